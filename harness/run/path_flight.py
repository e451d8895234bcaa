"""Plans a given path as lines and arcs with altitude and airspeed along them, and flies it to its end."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from aircraft.airframe import Airframe
from aircraft.airframes import kept_radii
from aircraft.climb import climb_rates
from aircraft.guidance.altitude import AltitudeGuidance, VerticalProfile, flat
from aircraft.guidance.progress import PathPoint, RouteProgress
from aircraft.guidance.waypoints import HEADING_FOR_CENTRES, Along, MissionLeg, WaypointLaw, straight
from aircraft.interface import AircraftState, FloatArray, Route
from aircraft.route import route_length
from harness.files.input_file import InputError
from harness.flight.closed_loop import Loop, fly
from harness.flight.observer import Observer, Progress
from harness.flight.polylines import needed
from harness.flight.record import Flight, Outcome
from harness.flight.termination import Ending
from harness.run_files.given_path import FlyBy, Tightest, fly_by
from harness.run_files.mission.route import CLIMB_SHARE, mission_route
from harness.run_files.mission.vertices import Flying, Ground, corner_limit_m, without_steps
from harness.run_files.path_files import PathAsGiven
from harness.scenario.parts import airframe_of
from harness.scenario.performance import air_of, performance_of, wind_mps_of
from harness.scenario.scenario import Scenario
from harness.scenario.sections import ALTITUDES_M
from harness.scenario.validation import KeyFault
from planner.interface import Path, Plan, PlanRequest, PlanStatus

if TYPE_CHECKING:
    from harness.world_files.parts import FileSpec

BEND_SHARE = 0.25
"""Altitudes of a drawn line that are straight within this share of the altitude threshold are one slope."""
LEVEL_SHARE = 0.1  # a path whose altitudes differ by no more of the limit is flown at that of its first point
FREE_SHARE = 0.25  # a corner may be passed off by this share of what is allowed only to make its arc wider


@dataclass(frozen=True, eq=False)
class PathPlan:
    """A path as it is flown: lines and arcs, with the altitude and airspeed that are commanded along them."""

    way: FlyBy
    profile: VerticalProfile
    commanded_mps: FloatArray
    """Airspeeds that the path asks for, at the profile's places; the aircraft may not hold them."""
    frame: Airframe
    marks: tuple[tuple[int, float], ...] = ()
    """Number and arc length of every item of a mission; none for a drawn line."""
    bends: tuple[tuple[int, float], ...] = ()
    """Number and arc length of the points of a drawn line at which its slope changes."""
    notes: tuple[str, ...] = ()  # notes on assumptions, a line each
    legs: tuple[MissionLeg, ...] = ()  # legs of the path, for a law that flies to its waypoints

    @cached_property
    def climb_mps(self) -> Callable[[float], tuple[float, float]]:
        """Returns the fastest climb and descent at an airspeed; measured in flight when first called."""
        return lru_cache(maxsize=1000)(lambda airspeed_mps: climb_rates(self.frame).at(airspeed_mps))

    @cached_property
    def climb_limit_mps(self) -> float | None:
        """Climb rate that the altitude loop may command; None for a level path, which has that of every flight."""
        if self.profile.level:
            return None
        return max(max(self.climb_mps(speed)) for speed in set(self.profile.airspeed_mps.tolist()))


@dataclass(frozen=True, eq=False)
class PathCheck:
    """A path, and what it is to be flown and judged with."""

    given: PathAsGiven
    scenario: Scenario
    plan: PathPlan
    again: Callable[..., PathCheck]  # prepares the same check with another `corner_m`
    bounded: bool = False  # the bounds of the area were named, and must not be crossed
    corner_m: float | None = None  # how far off a corner may be passed; None: what `allowed_cut_m` says
    files: tuple[FileSpec, ...] = ()  # files among the obstacles of a path that is not flown at one altitude

    def allowed_cut_m(self, waypoint: int) -> float:
        """Returns how far off a corner may be passed (m); nothing of the aircraft or its guidance enters.

        It is `corner_m` where that is given. Else a drawn path is to be flown as drawn: it is the cross-track limit. At
        a waypoint of a mission it is the acceptance radius of the file, else `CORNER_M`.
        """
        if self.corner_m is not None:
            return self.corner_m
        if self.given.mission is None:
            return self.scenario.trackability.cross_track_m
        accepted_m = {step.item: step.acceptance_m for step in self.given.mission.steps}
        return corner_limit_m(accepted_m.get(waypoint, 0.0), None)


def plan_path(
    given: PathAsGiven,
    scenario: Scenario,
    altitude_m: float | None,
    ground: Ground | None,
    corner_m: float | None = None,
) -> PathPlan:
    """Plans a path as it is flown.

    An InputError says why it cannot be: altitudes above a ground that is not known, a wind too strong for an airspeed.
    """
    if given.mission is None:
        return _planned_line(given, scenario, altitude_m, ground, corner_m)
    frame, kind = airframe_of(scenario.aircraft), scenario.guidance.kind
    by_waypoints = scenario.guidance.follow == "waypoints"
    flying = Flying(
        airspeed_mps=scenario.aircraft.airspeed_mps,
        airspeed_range_mps=(frame.slowest_turning_mps, frame.airspeed_range_mps[1]),
        turn_radius_m=_turn_radius_of(given, scenario),
        climb_mps=lru_cache(maxsize=1000)(lambda airspeed_mps: climb_rates(frame).at(airspeed_mps)),
        free_cut_m=FREE_SHARE * scenario.trackability.cross_track_m,
        ground=ground,
        least_radius_m=frame.least_radius_m,
        heads_for_centres=by_waypoints and kind in HEADING_FOR_CENTRES,
        corner_m=corner_m,
        kept_radii=partial(kept_radii, frame, scenario.mission.altitude_m),
        winds=partial(_winds, scenario, ground, altitude_m),
    )
    route = mission_route(given.mission, flying, given.source)
    profile, notes = route.profile, list(route.notes)
    if altitude_m is not None:
        profile = replace(profile, altitude_m=np.full_like(profile.altitude_m, altitude_m))
    else:
        profile = _flyable_altitudes(profile, given.source, scenario.trackability.altitude_m, notes)
    if altitude_m is None and (items := route.over_unknown):
        listed = ", ".join(map(str, items[:6])) + (" and others" if len(items) > 6 else "")
        listed = f"{'items' if len(items) > 1 else 'item'} {listed}"
        notes.append(f"{listed}: above ground, taken to be as high as home where it is not known")
    if by_waypoints and any(step.loiter is not None for step in given.mission.steps):
        heads, joins = "heads for its centre and then joins it", "joins it along a tangent"
        how = heads if flying.heads_for_centres else joins
        notes.append(f"to a loiter's circle the aircraft {how}, with the law {kind}")
    return PathPlan(route.way, profile, route.commanded_mps, frame, route.marks, notes=tuple(notes), legs=route.legs)


def _flyable_altitudes(profile: VerticalProfile, source: str, tolerance_m: float, notes: list[str]) -> VerticalProfile:
    """Returns altitudes that can be flown, with a note; an InputError where they differ by more than the tolerance."""
    lowest, highest = ALTITUDES_M
    held_m = np.clip(profile.altitude_m, lowest, highest)
    worst = int(np.abs(held_m - profile.altitude_m).argmax())
    if abs(held_m[worst] - profile.altitude_m[worst]) > tolerance_m:
        text = f"goes to {profile.altitude_m[worst]:g} m above the sea; must be {lowest:g} to {highest:g} m"
        raise InputError(f"{source}: {text}, or give --altitude-m")
    if (held_m != profile.altitude_m).any():
        notes.append(f"altitudes below {lowest:g} m or above {highest:g} m above the sea: flown at these")
        return replace(profile, altitude_m=held_m)
    return profile


def _planned_line(
    given: PathAsGiven,
    scenario: Scenario,
    altitude_m: float | None,
    ground: Ground | None,
    corner_m: float | None,
) -> PathPlan:
    frame, speed = airframe_of(scenario.aircraft), scenario.aircraft.airspeed_mps
    across_m = scenario.trackability.cross_track_m
    limit_m = across_m if corner_m is None else corner_m
    if altitude_m is not None or not len(given.altitudes_m):
        level_m = np.full(len(given.points_m), scenario.mission.altitude_m)
        given = replace(given, altitudes_m=level_m, above_ground=False)
    below = None if given.above_ground else ground
    wind = _winds(scenario, below, None, given.points_m, given.altitudes_m) @ np.array((1.0, 1j)) / speed
    kept = kept_radii(frame, scenario.mission.altitude_m, speed)
    tightest = Tightest(frame.least_radius_m(speed), limit_m, wind, kept)
    free_m = FREE_SHARE * min(across_m, limit_m)
    way = fly_by(given.points_m, performance_of(scenario).turn_radius_m, free_m, tightest)
    high_m = scenario.trackability.altitude_m
    profile = _drawn_profile(given, way, frame, speed, ground, LEVEL_SHARE * high_m)
    bends = _bends(profile, BEND_SHARE * high_m)
    places = way.waypoints_m[:, 0] + 1j * way.waypoints_m[:, 1]
    ends = zip(pairwise(places.tolist()), pairwise(way.stations_m.tolist()), strict=True)
    legs = tuple(straight(*each, None) for each in ends)
    return PathPlan(way, profile, profile.airspeed_mps, frame, bends=bends, legs=legs)


def _drawn_profile(
    given: PathAsGiven, way: FlyBy, frame: Airframe, speed_mps: float, ground: Ground | None, same_m: float
) -> VerticalProfile:
    """Returns the altitudes along a drawn line, the ground added to those above it; level if they hardly differ."""
    altitudes = given.altitudes_m
    if given.above_ground:
        remedy = "give --altitude-m"
        if ground is None:
            text = "has altitudes above ground, and the ground is not known"
            raise InputError(f"{given.source}: {text}; {remedy}")
        altitudes = altitudes + ground(*given.points_m.T)
        if len(unknown := np.flatnonzero(~np.isfinite(altitudes))):
            raise InputError(f"{given.source}: point {unknown[0]} is where the ground is not known; {remedy}")
    if np.ptp(altitudes) <= same_m:
        return flat(float(altitudes[0]), speed_mps)
    steps = list(zip(way.stations_of(given.points_m).tolist(), altitudes.tolist(), strict=True))
    along, high = np.array(
        without_steps(steps, lambda: CLIMB_SHARE * min(climb_rates(frame).at(speed_mps)) / speed_mps)
    ).T
    return VerticalProfile(along, high, np.zeros(1), np.full(1, speed_mps))


def _bends(profile: VerticalProfile, tolerance_m: float) -> tuple[tuple[int, float], ...]:
    """Returns the points between which altitudes are straight to a tolerance, both ends left out."""
    if profile.level:
        return ()
    indices = needed(np.column_stack((profile.arc_length_m, profile.altitude_m)), tolerance_m)[1:-1]
    return tuple(zip(indices.tolist(), profile.arc_length_m[indices].tolist(), strict=True))


def _winds(
    scenario: Scenario, ground: Ground | None, level_m: float | None, points_m: FloatArray, up_m: FloatArray
) -> FloatArray:
    """(m, 2) winds, east and north, at time 0, points (m, 2) and altitudes, m/s; unknown ground is at sea level."""
    up_m = up_m if level_m is None else np.full_like(up_m, level_m)
    air, known_m = air_of(scenario), 0.0 if ground is None else np.nan_to_num(ground(*points_m.T))
    return np.array([air.start_wind(height_m) for height_m in (up_m - known_m).tolist()])


def _turn_radius_of(given: PathAsGiven, scenario: Scenario) -> Callable[[float], float]:
    def turn_radius_m(airspeed_mps: float) -> float:
        spec = scenario.aircraft.model_copy(update={"airspeed_mps": airspeed_mps})
        try:
            return performance_of(scenario.model_copy(update={"aircraft": spec})).turn_radius_m
        except KeyFault as fault:
            key = ".".join(map(str, fault.loc))
            raise InputError(f"{given.source}: at {airspeed_mps:g} m/s, {key} {fault}") from fault

    return lru_cache(maxsize=1000)(turn_radius_m)


def fly_along(
    check: PathCheck, loop: Loop, observers: Sequence[Observer] = (), progress: Progress | None = None
) -> Flight:
    """Flies a path to its end, or until twice the time that it takes against its strongest wind, and a minute."""
    plan, path = check.plan, Path(check.plan.way.segments)
    wind_mps = wind_mps_of(check.scenario, float(plan.profile.altitude_m.max()))
    limit_s = 2.0 * path.length_m / max(float(plan.profile.airspeed_mps.min()) - wind_mps, 1.0) + 60.0
    guidance, route = loop.guidance, Route(path.segments)
    place = RouteProgress(route).nearest

    def where(state: AircraftState) -> Along | PathPoint:
        return place(state.east_m, state.north_m)

    if isinstance(guidance, WaypointLaw):
        guidance = guidance.flying(plan.legs)
        where = guidance.along
    along = replace(
        loop,
        guidance=guidance,
        sensor=None,
        planner=GivenPath(plan.way.waypoints_m, path),
        # A given path begins where it does, however far from there the aircraft believes to be.
        mission=replace(loop.mission, tracking_error_m=math.inf),
        vertical=AltitudeGuidance(plan.profile, plan.frame.gains.altitude, plan.climb_mps).command,
        termination=PathEnd(where, route_length(route), loop.mission.goal_radius_m, limit_s),
    )
    return replace(fly(along, observers, progress), compute_ms=())  # nothing was searched for


class GivenPath:
    """A planner that answers first with a path, and then keeps to it. Implements `Planner`."""

    def __init__(self, waypoints_m: FloatArray, path: Path) -> None:
        self._plan = Plan(PlanStatus.FOUND, "the path as given", waypoints_m, path)
        self._same = Plan(PlanStatus.KEPT, "the path as given")

    def plan(self, request: PlanRequest) -> Plan:
        """Returns the path, or that it is kept."""
        return self._same if request.flown else self._plan


@dataclass
class PathEnd:
    """Ends a flight along a path at the end of the path, or when it takes too long. Implements `Termination`."""

    where: Callable[[AircraftState], Along | PathPoint]
    length_m: float
    near_m: float
    limit_s: float
    contact_m: float = math.inf

    def to_go_m(self, state: AircraftState) -> float:
        """Returns the length of the path that is left."""
        return self.length_m - self.where(state).arc_length_m

    def verdict(self, state: AircraftState, fault: str | None) -> Ending | None:
        """Returns how the flight ends now: control lost, at or far beside the path's end, or time up; else None."""
        if fault is not None:
            return Ending(Outcome.LOST_CONTROL, fault)
        after, nearest = f"after {state.time_s:.0f} s", self.where(state)
        if nearest.past_end and (off_m := abs(nearest.cross_track_m)) > self.near_m:
            return Ending(Outcome.TIMEOUT, f"passed the end of the path {off_m:,.0f} m beside it {after}")
        if nearest.past_end:
            return Ending(Outcome.REACHED, f"at the end of the path {after}")
        if state.time_s >= self.limit_s:
            return Ending(Outcome.TIMEOUT, f"not at the end of the path {after}, twice what it should take")
        return None
