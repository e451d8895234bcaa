"""Flies a given path from its start to its end: the loop without world, sensor and planner."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

from aircraft.guidance.altitude import AltitudeGuidance
from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.interface import Route
from harness.flight.closed_loop import Loop, Observer, Progress
from harness.flight.record import AcceptedPlan, Flight, Outcome, TrackLog
from harness.flight.signals import held_back
from harness.run.path_plan import PathPlan
from planner.interface import Path, Plan, PlanStatus

PROGRESS_EVERY_S = 5.0


def fly_along(
    plan: PathPlan, loop: Loop, observers: Sequence[Observer] = (), progress: Progress | None = None
) -> Flight:
    """Flies a path to its end.

    Args:
        plan: the path, with its altitudes and airspeeds.
        loop: the parts of the flight; world, sensor, map and planner are not asked. Used up.
        observers: look on.
        progress: told of the flight every few simulated seconds.
    """
    with held_back() as interrupt:
        return _flown(plan, loop, observers, progress, interrupt)


def _flown(
    plan: PathPlan,
    loop: Loop,
    observers: Sequence[Observer],
    progress: Progress | None,
    interrupt: Callable[[], None],
) -> Flight:
    begun = time.perf_counter()
    model, guidance = loop.model, loop.guidance
    path = Path(plan.way.segments)
    found = Plan(PlanStatus.FOUND, "the path as given", plan.way.waypoints_m, path)
    accepted = AcceptedPlan(0, 0.0, 0.0, found)
    vertical = AltitudeGuidance(plan.profile, plan.climb_gain_1ps, plan.climb_mps)
    log = TrackLog(
        loop.world.clearance, [observer.on_block for observer in observers], ground=loop.world.ground_heights
    )
    limit_s = 2.0 * path.length_m / max(_slowest_mps(loop, plan), 1.0) + 60.0
    guidance.follow(Route(path.segments))
    for observer in observers:
        observer.on_plan(accepted, model.state())
    steps = model.step_rate_hz // UPDATE_RATE_HZ
    updates = 0
    while True:
        interrupt()
        state = model.state()
        guided = guidance.update(state)
        altitude_m, airspeed_mps = vertical.command(state, guided.arc_length_m)
        model.command(guided.roll_command_rad, altitude_m, guided.airspeed_or(airspeed_mps))
        off_m = abs(guided.cross_track_m) if guided.past_end else None
        outcome = _outcome(model.fault(), off_m, loop.mission.goal_radius_m, state.time_s, limit_s)
        log.add(state, guided.roll_command_rad, guided.cross_track_m, guided.arc_length_m, 0)
        if progress is not None and updates % round(PROGRESS_EVERY_S * UPDATE_RATE_HZ) == 0:
            progress(state.time_s, path.length_m - guided.arc_length_m, "following")
        if outcome is not None:
            break
        model.advance(steps)
        updates += 1
    for observer in observers:
        observer.on_event(state.time_s, f"{outcome[0].value}: {outcome[1]}")
    wall_s = time.perf_counter() - begun
    return Flight(log.close(), (accepted,), *outcome, compute_ms=(), sim_s=state.time_s, wall_s=wall_s)


def _outcome(
    fault: str | None, off_m: float | None, near_m: float, time_s: float, limit_s: float
) -> tuple[Outcome, str] | None:
    """How a flight ends now; None while it goes on.

    Args:
        fault: how control was lost.
        off_m: how far beside the path the aircraft passed its end; None before that.
        near_m: so near to it the end is reached.
        time_s: now.
        limit_s: time limit.
    """
    if fault is not None:
        return Outcome.LOST_CONTROL, fault
    if off_m is not None and off_m > near_m:
        return Outcome.TIMEOUT, f"passed the end of the path {off_m:,.0f} m beside it after {time_s:.0f} s"
    if off_m is not None:
        return Outcome.REACHED, f"at the end of the path after {time_s:.0f} s"
    if time_s >= limit_s:
        return Outcome.TIMEOUT, f"not at the end of the path after {time_s:.0f} s, twice what it should take"
    return None


def _slowest_mps(loop: Loop, plan: PathPlan) -> float:
    """Slowest speed over the ground, against the wind that the aircraft starts in."""
    state = loop.model.state()
    wind = math.hypot(
        state.velocity_east_mps - state.airspeed_mps * math.sin(state.heading_rad),
        state.velocity_north_mps - state.airspeed_mps * math.cos(state.heading_rad),
    )
    return float(plan.profile.airspeed_mps.min()) - wind
