"""A plan or a mission flown leg by leg: the law follows the straight leg to the next waypoint, then the leg after it.

So ArduPilot and PX4 fly, which know nothing of the arcs of a plan. Its waypoints are the corners that its arcs round; a
closing loiter is flown as a circle. A waypoint counts as reached within an acceptance radius, its own or that of the
law's autopilot, or when the aircraft is past it (ArduPilot, "Mission planning", WP_RADIUS; PX4, "Fixed-wing mission
mode"; Beard and McLain, algorithm 5).

A mission's loiter is left when the aircraft has gone round far enough. Autopilots that head for its centre and then
join its circle are flown so: PX4 (`navigateLoiter`) and ArduPilot (`update_loiter` from three radii on).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final, NamedTuple, Protocol, runtime_checkable

import numpy as np

from aircraft.guidance.interface import GuidanceLaw, GuidanceLimits, GuidanceOutput
from aircraft.guidance.progress import RouteProgress
from aircraft.interface import GRAVITY_MPS2, AircraftState, FloatArray, Route
from aircraft.route import SegmentRow, arc_point, route_length

WP_RADIUS_M = 90.0  # ArduPilot's WP_RADIUS: `l1` accepts a waypoint from at most this distance
MAX_SWITCH_M = 500.0  # `npfg` switches to the next leg at most this far from a waypoint, as PX4 limits it
MAX_CORNER_RAD = math.radians(90.0)  # an arc that turns by more than this is replaced by several corners
LEAST_TURN_RAD, LEAST_LEG_M = math.radians(0.5), 1.0
"""Legs turn by at least this angle at a waypoint between them, and waypoints are at least this far apart."""
ACCEPTANCE_BANK_MARGIN_RAD = math.radians(15.0)
"""A law without a rule of its own accepts a waypoint where a fillet at the bank limit less this would begin."""
L1_CAPTURE_RADII = 3.0
"""ArduPlane follows the line to the centre of a loiter until it is this many radii from it."""
FAR_M = 1e5  # after the last waypoint a law that flies to points heads for one this far straight on
HEADING_FOR_CENTRES: Final = ("l1", "npfg")
"""Laws whose autopilots head for the centre of a loiter; all others join its circle along a tangent."""


@dataclass(frozen=True, eq=False)
class MissionLeg:
    """One leg: to a waypoint, along a way, or round a circle."""

    route: Route  # what the law follows
    stations_m: tuple[float, float]  # arc lengths at its ends on the route that the mission was made into
    end_m: tuple[float, float] | None = None  # waypoint that the leg leads to; None: it is flown to its end
    acceptance_m: float | None = 0.0  # distance that is near enough; None: by the law's rule; 0: when passed
    captured_radius_m: float = 0.0  # radius of the circle about the waypoint that is joined from far; 0: none
    centre_m: tuple[float, float] | None = None  # centre of a circle that the leg goes round
    swept_rad: float = 0.0  # angle swept round it, from where the route begins

    @property
    def direction(self) -> tuple[float, float]:
        """Unit vector at its end."""
        row = self.route.segments[-1]
        return arc_point(tuple(row.tolist()), float(row[5]))[2:]


def straight(
    ends: tuple[complex, complex],
    stations_m: tuple[float, float],
    acceptance_m: float | None,
    centre: complex | None = None,
) -> MissionLeg:
    """A leg from one place to another (east + i north, m), or, with a `centre`, towards that of a circle to join."""
    start, end = ends
    goal = end if centre is None else centre
    length_m = abs(goal - start)
    ahead = (goal - start) / length_m
    route = Route(np.array([(start.real, start.imag, ahead.real, ahead.imag, 0.0, length_m)]))
    return MissionLeg(route, stations_m, (goal.real, goal.imag), acceptance_m, abs(goal - end))


@runtime_checkable
class PointLaw(Protocol):
    """A law that flies to waypoints and not along the legs between them."""

    def fly_to(self, east_m: float, north_m: float) -> None:
        """Heads for one point (m) until the next call of this or of `follow`."""


Acceptance = Callable[[float, float], float]
"""(ground speed m/s, turn at the waypoint rad, at least 0) -> distance from which a waypoint counts as reached, m."""


def mission_waypoints(route: Route) -> FloatArray:
    """The (k, 2) waypoints of a route, k at least 2: its start, its corners and those that its arcs round, its end.

    Of a route that closes with a loiter the end is where the circle begins.
    """
    rows = [tuple(row) for row in (route.segments[:-1] if route.loiter else route.segments).tolist()]
    if not rows:
        start = route.segments[0]
        return np.array([start[:2] - LEAST_LEG_M * start[2:4], start[:2]])
    points = [rows[0][:2]]
    along = rows[0][2:4]
    for row in rows:
        points += [row[:2]] if along[0] * row[2] + along[1] * row[3] < math.cos(LEAST_TURN_RAD) else []
        points += _corners(row)
        along = arc_point(row, row[5])[2:]
    last_east, last_north, along_east, along_north = arc_point(rows[-1], rows[-1][5])
    spaced, last = [points[0]], (last_east, last_north)
    for point in points[1:]:
        if math.dist(point, spaced[-1]) >= LEAST_LEG_M:
            spaced.append(point)
    while spaced and math.dist(spaced[-1], last) < LEAST_LEG_M:
        spaced.pop()
    before_last = (last_east - LEAST_LEG_M * along_east, last_north - LEAST_LEG_M * along_north)
    return np.array([*(spaced or [before_last]), last])


def _corners(row: SegmentRow) -> list[tuple[float, float]]:
    """The corners that an arc rounds, each of at most 90 degrees; a line has none."""
    turn, found = abs(row[4] * row[5]), []
    parts = max(1, math.ceil(turn / MAX_CORNER_RAD - 1e-9)) if turn >= LEAST_TURN_RAD else 0
    for part in range(parts):
        east, north, along_east, along_north = arc_point(row, part * row[5] / parts)
        ahead = math.tan(0.5 * turn / parts) / abs(row[4])
        found.append((east + ahead * along_east, north + ahead * along_north))
    return found


class Along(NamedTuple):
    """Where the aircraft is along and beside a route; as in `PathPoint`."""

    cross_track_m: float
    arc_length_m: float
    past_end: bool


class WaypointLaw:
    """Flies a route leg by leg with another law. Implements `GuidanceLaw`.

    The legs are those of a mission as its file has them, or else those between the waypoints of the route. Cross-track
    error and arc length are those on the route, not on the leg.
    """

    def __init__(
        self,
        law: GuidanceLaw,
        kind: str,
        acceptance_m: Acceptance,
        by_passing: bool = True,
        legs: Sequence[MissionLeg] = (),
    ) -> None:
        self.law, self._kind, self._acceptance_m, self._by_passing = law, kind, acceptance_m, by_passing
        self.hold_airspeed = getattr(law, "hold_airspeed", lambda airspeed_mps: None)
        self._mission = legs
        self._progress: RouteProgress | None = None
        self.leg = -1  # number of the leg that is flown, from 0; -1 before the first route

    def flying(self, legs: Sequence[MissionLeg]) -> WaypointLaw:
        """Returns the same law for the legs of a mission."""
        return WaypointLaw(self.law, self._kind, self._acceptance_m, self._by_passing, legs)

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route; the first leg is the first that ends ahead of the place on it."""
        self._progress, self.leg = RouteProgress(route, arc_length_m), -1
        self._legs = self._mission or legs_between_waypoints(route)
        self._last = len(self._legs) - (1 if self._mission else 2)
        self._begin_next_leg()

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Begins the next leg where one is over, and decides the roll command for the next update interval."""
        if self._progress is None:
            raise RuntimeError("follow() a route before update()")
        while self._is_over(state) and self.leg < len(self._legs) - 1:  # a last circle is counted too
            self._begin_next_leg()
        return self.law.update(state)._replace(**self.along(state)._asdict())

    def along(self, state: AircraftState) -> Along:
        """Where an aircraft is along the route, and how far beside it; at its start before there is one.

        A route with arcs would be lost by an aircraft that turns to the other side; the leg of a mission is known.
        """
        if self._progress is None:
            return Along(0.0, 0.0, False)
        if not self._mission:
            place = self._progress.nearest(state.east_m, state.north_m)
            return Along(place.off_m, place.arc_length_m, place.past_end)
        leg = self._legs[self.leg]
        first, last = leg.stations_m
        if leg.centre_m is not None:
            share = self._round_rad / leg.swept_rad if self._bearing_rad is not None else 0.0
            past_end = share >= 1.0
            if (before := self._legs[self.leg - 1]).captured_radius_m > 0.0:  # joined from far
                outside_m = math.dist(leg.centre_m, (state.east_m, state.north_m)) - before.captured_radius_m
                first -= min(max(outside_m, 0.0), first - before.stations_m[0])
        else:
            # The judge of the flight asks with the true state, which does not move the law's place.
            on_leg = copy(self._on_leg).nearest(state.east_m, state.north_m)
            share = on_leg.arc_length_m / (route_length(leg.route) - leg.captured_radius_m)
            past_end = on_leg.past_end
        station_m = first + min(max(share, 0.0), 1.0) * (last - leg.stations_m[0])
        self._progress.restart(station_m)
        beside = self._progress.nearest(state.east_m, state.north_m)
        return Along(beside.off_m, station_m, past_end and self.leg == len(self._legs) - 1)

    def _begin_next_leg(self) -> None:
        self.leg += 1
        leg = self._legs[self.leg]
        self.law.follow(leg.route, 0.0)
        if isinstance(self.law, PointLaw) and leg.end_m is not None:
            self.law.fly_to(*leg.end_m)
        self._on_leg = RouteProgress(leg.route)
        self._turn_rad = self._turn_after(leg)
        self._bearing_rad: float | None = None

    def _is_over(self, state: AircraftState) -> bool:
        """Tells whether the leg is over: its waypoint is accepted or passed, or its circle flown round."""
        leg = self._legs[self.leg]
        if leg.centre_m is not None:
            return self._gone_round_rad(leg, state) >= leg.swept_rad
        if leg.end_m is None:
            return self._on_leg.nearest(state.east_m, state.north_m).past_end
        east, north = leg.end_m[0] - state.east_m, leg.end_m[1] - state.north_m
        away_m = math.hypot(east, north)
        if leg.captured_radius_m > 0.0:
            return away_m <= self._capture_m(leg.captured_radius_m, state.groundspeed_mps)
        ahead, by_passing = leg.direction, self._by_passing or leg.acceptance_m == 0.0
        if by_passing and east * ahead[0] + north * ahead[1] <= 0.0:
            return True
        if by_passing and self._turn_rad == 0.0:
            return False
        if leg.acceptance_m is not None:
            return away_m <= leg.acceptance_m
        return away_m <= self._acceptance_m(state.groundspeed_mps, self._turn_rad)

    def _capture_m(self, radius_m: float, ground_speed_mps: float) -> float:
        """Distance from the centre of a circle at which the aircraft begins to join it."""
        if self._kind == "l1":
            return L1_CAPTURE_RADII * radius_m
        return radius_m + self._acceptance_m(ground_speed_mps, 0.5 * math.pi)

    def _gone_round_rad(self, leg: MissionLeg, state: AircraftState) -> float:
        """Returns the angle round a circle that the aircraft is from where its route begins."""
        assert leg.centre_m is not None
        east, north = leg.centre_m
        bearing = math.atan2(state.north_m - north, state.east_m - east)
        row = leg.route.segments[0]
        side = math.copysign(1.0, row[4])
        if self._bearing_rad is None:
            begin = math.atan2(row[1] - north, row[0] - east)
            self._round_rad = math.remainder(side * (bearing - begin), math.tau)
        else:
            self._round_rad += math.remainder(side * (bearing - self._bearing_rad), math.tau)
        self._bearing_rad = bearing
        return self._round_rad

    def _turn_after(self, leg: MissionLeg) -> float:
        """Angle by which the next leg is turned from the end of this one, at least 0; 0 at the last waypoint."""
        if self.leg >= self._last:
            return 0.0
        (east, north), after = leg.direction, self._legs[self.leg + 1].route.segments[0, 2:4]
        return abs(math.atan2(east * after[1] - north * after[0], east * after[0] + north * after[1]))


def legs_between_waypoints(route: Route) -> list[MissionLeg]:
    """The legs between the waypoints of a route, and what is flown after the last: the loiter, or straight on."""
    places = [complex(*point) for point in mission_waypoints(route).tolist()]
    legs = [straight(ends, (0.0, 0.0), None) for ends in pairwise(places)]
    if route.loiter:
        return [*legs, MissionLeg(Route(route.segments[-1:], loiter=True), (0.0, 0.0))]
    beyond = places[-1] + FAR_M * complex(*legs[-1].direction)
    return [*legs, straight((places[-1], beyond), (0.0, 0.0), None)]


def waypoint_law(
    law: GuidanceLaw, kind: str, config: Any, limits: GuidanceLimits, radius_m: float | None = None
) -> WaypointLaw:
    """A law of its kind that flies the waypoints of routes; arguments as of `acceptance`."""
    return WaypointLaw(law, kind, acceptance(kind, config, limits, radius_m), by_passing(config))


def by_passing(config: Any) -> bool:
    """Whether a waypoint counts as reached when the aircraft is past it; so it does where a law has no such key."""
    return bool(getattr(config, "switch_by_passing", True))


def acceptance(kind: str, config: Any, limits: GuidanceLimits, radius_m: float | None = None) -> Acceptance:
    """The rule for the distance from which a law's autopilot counts a waypoint as reached.

    `l1`: its look-ahead distance, no more than `WP_RADIUS_M`, less for a turn of less than 90 degrees in proportion
    (ArduPilot). `npfg`: its switch distance (PX4), a share of the track error bound. Any other: where a fillet of the
    turn would begin, R tan(turn / 2), at the bank limit less `ACCEPTANCE_BANK_MARGIN_RAD`. A law that does not switch
    by passing would circle a point inside its turn for ever: the turn radius at the bank limit.
    """
    if radius_m is not None:
        return lambda ground_speed_mps, turn_rad: radius_m
    if kind == "l1":
        share = config.damping * config.period_s / math.pi
        return lambda ground_speed_mps, turn_rad: (
            min(WP_RADIUS_M, share * ground_speed_mps) * min(turn_rad / (0.5 * math.pi), 1.0)
        )
    if kind == "npfg":
        share = config.switch_distance_multiplier * config.period_s * config.damping
        return lambda ground_speed_mps, turn_rad: min(MAX_SWITCH_M, share * ground_speed_mps)
    if not by_passing(config):
        least_per_speed2 = 1.0 / (GRAVITY_MPS2 * math.tan(limits.bank_limit_rad))
        return lambda ground_speed_mps, turn_rad: ground_speed_mps * ground_speed_mps * least_per_speed2
    per_speed2 = 1.0 / (GRAVITY_MPS2 * math.tan(max(limits.bank_limit_rad - ACCEPTANCE_BANK_MARGIN_RAD, 0.1)))
    return lambda ground_speed_mps, turn_rad: (
        ground_speed_mps * ground_speed_mps * per_speed2 * math.tan(0.5 * min(turn_rad, MAX_CORNER_RAD))
    )
