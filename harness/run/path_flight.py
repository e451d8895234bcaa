"""Flies a given path from its start to its end: the loop without world, sensor and planner."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from aircraft.guidance import UPDATE_RATE_HZ
from aircraft.interface import Route
from harness.analysis.metrics import metrics
from harness.analysis.smoothness import polyline_profile, smoothness
from harness.analysis.trackability import FlightLimits
from harness.flight.closed_loop import Loop, Observer, Progress
from harness.flight.record import AcceptedPlan, Flight, Outcome, TrackLog
from harness.flight.signals import held_back
from harness.run.scenario_flight import fly_to_folder
from harness.run_files.given_path import GIVEN, SAME_PLACE_M, CutCorner, FloatArray, FlyBy, fly_by
from harness.scenario.scenario import Scenario, performance_of, scenario_of
from planner.interface import Path, Plan, PlanStatus

FREE_SHARE = 0.25
"""Share of the cross-track threshold by which a corner may be passed off only to make its arc wider."""

MARGIN_M, MARGIN_SHARE = 1000.0, 0.25
"""The area of a checked path reaches this far beyond it: so much, and so much of its span."""

PROGRESS_EVERY_S = 5.0


def scenario_for(
    name: str,
    points_m: FloatArray,
    sections: Mapping[str, Mapping[str, Any]],
    overrides: Sequence[tuple[str, str]] = (),
) -> Scenario:
    """The mission of a path as a scenario without obstacles: from its start to its end.

    A path that ends about where it begins has its furthest point as the goal. What the aircraft may be off is by
    default what it may be in calm air: the room about a path does not grow with the wind.

    Args:
        name: of the scenario.
        points_m: (n, 2) the path.
        sections: `aircraft`, `environment`, ... as in a file; what is left out has its default.
        overrides: keys to replace.

    Raises:
        InputError: the sections contradict each other; the fault names the key.
    """
    start = points_m[0]
    far = np.hypot(*(points_m - start).T)
    goal_radius = min(100.0, float(0.25 * far.max()))
    goal = points_m[-1] if far[-1] > 2.0 * goal_radius else points_m[int(far.argmax())]
    lowest, highest = points_m.min(axis=0), points_m.max(axis=0)
    margin = MARGIN_M + MARGIN_SHARE * float((highest - lowest).max())
    out = points_m[int(np.argmax(far > SAME_PLACE_M))] - start
    mission = {
        "start_m": start.tolist(),
        "course_deg": math.degrees(math.atan2(out[0], out[1])) % 360.0,
        "goal_m": goal.tolist(),
        "goal_radius_m": goal_radius,
    }
    keys: dict[str, Any] = {
        "schema": "wayproof/scenario/1",
        "name": name,
        **{key: dict(section) for key, section in sections.items()},
        "area": {
            "bounds_m": [*(lowest - margin).tolist(), *(highest + margin).tolist()],
            **sections.get("area", {}),
        },
        "mission": {**mission, **sections.get("mission", {})},
    }
    calm = scenario_of(
        {**keys, "environment": {}}, [each for each in overrides if not each[0].startswith("environment")]
    )
    limits = {"cross_track_m": calm.trackability.cross_track_m, **sections.get("trackability", {})}
    return scenario_of({**keys, "trackability": limits}, overrides)


def check_path(
    scenario: Scenario,
    points_m: FloatArray,
    out: FilePath,
    recording: bool,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Flies a path into a run folder and returns the content of its `metrics.json`.

    On top of what a flight has, `check` says what was given: its smoothness (`given`), and the `corners` that
    had to be cut, with the distance at which the aircraft passed them and what is allowed.

    Args:
        scenario: aircraft, air, altitude and thresholds; see `scenario_for`.
        points_m: (n, 2) the path.
        out: the run folder.
        recording: whether to write `flight.rrd`.
        progress: told of the flight as it goes on.

    Raises:
        AircraftError: the aircraft cannot be loaded or trimmed; nothing is written.
        RunFolderError: the folder holds something else or cannot be written.
    """
    threshold = scenario.trackability.cross_track_m
    way = fly_by(points_m, performance_of(scenario).turn_radius_m, FREE_SHARE * threshold)
    return fly_to_folder(
        scenario,
        out,
        recording,
        progress,
        pilot=GIVEN,
        flown_by=partial(fly_along, way),
        measured_by=partial(_measured, points_m, way),
    )


def fly_along(
    way: FlyBy, loop: Loop, observers: Sequence[Observer] = (), progress: Progress | None = None
) -> Flight:
    """Flies a path to its end.

    Args:
        way: the path.
        loop: the parts of the flight; world, sensor, map and planner are not asked. Used up.
        observers: look on.
        progress: told of the flight every few simulated seconds.
    """
    with held_back() as interrupt:
        return _flown(way, loop, observers, progress, interrupt)


def _flown(
    way: FlyBy,
    loop: Loop,
    observers: Sequence[Observer],
    progress: Progress | None,
    interrupt: Callable[[], None],
) -> Flight:
    begun = time.perf_counter()
    model, follower = loop.model, loop.follower
    path = Path(way.segments)
    plan = Plan(PlanStatus.FOUND, "the path as given", way.waypoints_m, path)
    accepted = AcceptedPlan(0, 0.0, 0.0, plan)
    log = TrackLog(loop.world.clearance, [observer.on_block for observer in observers])
    limit_s = 2.0 * path.length_m / max(_slowest_mps(loop), 1.0) + 60.0
    follower.follow(Route(path.segments))
    for observer in observers:
        observer.on_plan(accepted, model.state())
    steps = model.step_rate_hz // UPDATE_RATE_HZ
    updates = 0
    while True:
        interrupt()
        state = model.state()
        guided = follower.update(state)
        model.command(guided.roll_command_rad, loop.altitude_m, loop.mission.speed_mps)
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


def _slowest_mps(loop: Loop) -> float:
    """Speed over the ground against the wind that the aircraft starts in."""
    state = loop.model.state()
    wind = math.hypot(
        state.velocity_east_mps - state.airspeed_mps * math.sin(state.heading_rad),
        state.velocity_north_mps - state.airspeed_mps * math.cos(state.heading_rad),
    )
    return state.airspeed_mps - wind


def _measured(points_m: FloatArray, way: FlyBy, flight: Flight, limits: FlightLimits) -> dict[str, Any]:
    figures = metrics(flight, limits, way.corners)
    given = polyline_profile(way.waypoints_m, float(flight.track.groundspeed_mps.mean()))
    reached = flight.outcome is Outcome.REACHED
    return {
        **figures,
        "trackable": figures["trackable"] and reached,
        "check": {
            "points": len(points_m),
            "given": dataclasses.asdict(
                smoothness(given, max(float(flight.track.groundspeed_mps.mean()), 1e-3))
            ),
            "corners": [_passed(corner, flight, limits) for corner in way.corners],
        },
    }


def _passed(corner: CutCorner, flight: Flight, limits: FlightLimits) -> dict[str, Any]:
    """What is told of a corner; `flown_cut_m` is None where the aircraft did not get there."""
    track, room_m = flight.track, limits.clearance_m
    arc_m = corner.radius_m * math.radians(abs(corner.turn_deg))
    about = np.abs(track.arc_length_m - corner.arc_length_m) <= 0.5 * arc_m + room_m
    away_m = np.hypot(track.east_m - corner.east_m, track.north_m - corner.north_m)[about]
    return {
        **dataclasses.asdict(corner),
        "flown_cut_m": float(away_m.min()) if len(away_m) else None,
        "allowed_cut_m": room_m,
    }
