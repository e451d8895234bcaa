"""Flies a given path from its start to its end: the closed loop with a planner that has one answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from aircraft.guidance.altitude import AltitudeGuidance
from aircraft.guidance.mission_legs import MissionLaw
from aircraft.guidance.progress import Along, RouteProgress
from aircraft.guidance.waypoints import WaypointLaw
from aircraft.interface import AircraftState, Route
from aircraft.route import route_length
from harness.flight.closed_loop import Loop, fly
from harness.flight.observer import Observer, Progress
from harness.flight.record import Flight, Outcome
from harness.flight.termination import Ending
from harness.run.path_plan import PathPlan
from planner.interface import FloatArray, Path, Plan, PlanRequest, PlanStatus


def fly_along(
    plan: PathPlan,
    kind: str,
    loop: Loop,
    observers: Sequence[Observer] = (),
    progress: Progress | None = None,
) -> Flight:
    """Flies a path to its end.

    Args:
        plan: the path, with its altitudes and airspeeds.
        kind: the guidance law's.
        loop: the parts of the flight; its sensor and planner are not asked, its mission does not end the flight. Used
            up.
        observers: look on.
        progress: told of the flight every few simulated seconds.
    """
    path = Path(plan.way.segments)
    limit_s = 2.0 * path.length_m / max(_slowest_mps(loop.model.state(), plan), 1.0) + 60.0
    guidance, route = loop.guidance, Route(path.segments)
    progress_of = RouteProgress(route)

    def where(state: AircraftState) -> Along:
        return progress_of.along(state.east_m, state.north_m)

    if isinstance(guidance, WaypointLaw):
        guidance = MissionLaw(guidance, kind, plan.legs)
        where = guidance.along
    along = replace(
        loop,
        guidance=guidance,
        sensor=None,
        planner=GivenPath(plan.way.waypoints_m, path),
        vertical=AltitudeGuidance(plan.profile, plan.climb_gain_1ps, plan.climb_mps),
        termination=PathEnd(where, route_length(route), loop.mission.goal_radius_m, limit_s),
    )
    return replace(fly(along, observers, progress), compute_ms=())  # nothing was searched for


class GivenPath:
    """A planner whose first answer is a path, and which keeps to it. Implements `Planner`."""

    def __init__(self, waypoints_m: FloatArray, path: Path) -> None:
        self._found = Plan(PlanStatus.FOUND, "the path as given", waypoints_m, path)
        self._kept = Plan(PlanStatus.KEPT, "the path as given")

    def plan(self, request: PlanRequest) -> Plan:
        """The path, or that it is kept."""
        return self._kept if request.flown else self._found


class PathEnd:
    """A flight along a path: over at its end, or when it takes too long. Implements `Termination`.

    Args:
        where: the place of an aircraft on the path.
        length_m: of the path.
        near_m: so near to the path where it ends, the end is reached.
        limit_s: time limit.
    """

    contact_m = math.inf

    def __init__(
        self, where: Callable[[AircraftState], Along], length_m: float, near_m: float, limit_s: float
    ) -> None:
        self._where, self._length_m = where, length_m
        self._near_m, self._limit_s = near_m, limit_s

    def to_go_m(self, state: AircraftState) -> float:
        """Length of the path that is left."""
        return self._length_m - self._where(state).arc_length_m

    def verdict(self, state: AircraftState, fault: str | None) -> Ending | None:
        """How the flight ends now; None while it goes on."""
        if fault is not None:
            return Ending(Outcome.LOST_CONTROL, fault)
        time_s, nearest = state.time_s, self._where(state)
        off_m = abs(nearest.cross_track_m)
        if nearest.past_end and off_m > self._near_m:
            return Ending(
                Outcome.TIMEOUT, f"passed the end of the path {off_m:,.0f} m beside it after {time_s:.0f} s"
            )
        if nearest.past_end:
            return Ending(Outcome.REACHED, f"at the end of the path after {time_s:.0f} s")
        if time_s >= self._limit_s:
            return Ending(
                Outcome.TIMEOUT,
                f"not at the end of the path after {time_s:.0f} s, twice what it should take",
            )
        return None


def _slowest_mps(state: AircraftState, plan: PathPlan) -> float:
    """Slowest speed over the ground, against the wind that the aircraft starts in."""
    wind = math.hypot(
        state.velocity_east_mps - state.airspeed_mps * math.sin(state.heading_rad),
        state.velocity_north_mps - state.airspeed_mps * math.cos(state.heading_rad),
    )
    return float(plan.profile.airspeed_mps.min()) - wind
