"""A plan flown as a mission of waypoints: the law follows the straight leg to the next waypoint, then the leg after it.

This is how the aircraft of ArduPilot and PX4 fly: they know nothing of the arcs of a plan. The waypoints are where the
lines of the plan meet: the corners that its arcs round. A closing loiter is flown as a circle. A waypoint counts as
reached within an acceptance radius, or when the aircraft is past it (ArduPilot, "Mission planning", WP_RADIUS; PX4,
"Fixed-wing mission mode"; Beard and McLain, algorithm 5).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np

from aircraft.guidance.interface import GuidanceLaw, GuidanceLimits, GuidanceOutput
from aircraft.guidance.progress import RouteProgress
from aircraft.interface import GRAVITY_MPS2, AircraftState, FloatArray, Route
from aircraft.route import arc_point

WP_RADIUS_M = 90.0
"""ArduPilot's WP_RADIUS: the most that `l1` accepts a waypoint from."""

MAX_SWITCH_M = 500.0
"""PX4 asks npfg for its switch distance with this as the most."""

CORNER_RAD = math.radians(90.0)
"""An arc that turns by more is rounded by several corners."""

LEAST_TURN_RAD = math.radians(0.5)
LEAST_LEG_M = 1.0
"""Waypoints are no closer to each other, and legs bend by no less at one that is no end."""

BANK_KEPT_RAD = math.radians(15.0)
"""Bank kept back where a law has no rule of its own: it turns at each waypoint as the fillet of a plan would."""

FAR_M = 1e5
"""Beyond the last waypoint a law that flies to points heads for one so far on."""


@runtime_checkable
class PointLaw(Protocol):
    """A law that flies to waypoints and not along the legs between them."""

    def fly_to(self, east_m: float, north_m: float) -> None:
        """Heads for one point (m) until the next call of this or of `follow`."""
        ...


Acceptance = Callable[[float, float], float]
"""(ground speed m/s, turn at the waypoint rad, at least 0) -> distance from which a waypoint counts as reached, m."""


def mission_waypoints(route: Route) -> FloatArray:
    """(k, 2) the waypoints of a route: its start, its corners and those that its arcs round, its end; k is at least 2.

    Of a route that closes with a loiter the end is where the circle begins.
    """
    rows = [tuple(row) for row in (route.segments[:-1] if route.loiter else route.segments).tolist()]
    if not rows:
        start = route.segments[0]
        return np.array([start[:2] - LEAST_LEG_M * start[2:4], start[:2]])
    points = [rows[0][:2]]
    along = rows[0][2:4]
    for row in rows:
        if along[0] * row[2] + along[1] * row[3] < math.cos(LEAST_TURN_RAD):
            points.append(row[:2])
        along = arc_point(row, row[5])[2:]
        turn = abs(row[4] * row[5])
        parts = max(1, math.ceil(turn / CORNER_RAD - 1e-9))
        for part in range(parts if turn >= LEAST_TURN_RAD else 0):
            east, north, along_east, along_north = arc_point(row, part * row[5] / parts)
            ahead = math.tan(0.5 * turn / parts) / abs(row[4])
            points.append((east + ahead * along_east, north + ahead * along_north))
    last = arc_point(rows[-1], rows[-1][5])[:2]
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(point, kept[-1]) >= LEAST_LEG_M:
            kept.append(point)
    while len(kept) > 1 and math.dist(kept[-1], last) < LEAST_LEG_M:
        kept.pop()
    if math.dist(last, kept[-1]) < LEAST_LEG_M and len(kept) == 1:
        _, _, along_east, along_north = arc_point(rows[-1], rows[-1][5])
        kept[0] = (last[0] - LEAST_LEG_M * along_east, last[1] - LEAST_LEG_M * along_north)
    return np.array([*kept, last])


class WaypointLaw:
    """Flies a route's waypoints with another law. Implements `GuidanceLaw`.

    Cross-track error and arc length are those on the route, not on the leg.
    """

    def __init__(self, law: GuidanceLaw, acceptance_m: Acceptance, by_passing: bool = True) -> None:
        self.law, self.acceptance_m, self.by_passing = law, acceptance_m, by_passing
        self._progress: RouteProgress | None = None
        self._leg = -1

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route; the first leg is the first that ends ahead of the place on it."""
        self._progress = RouteProgress(route, arc_length_m)
        self._points: list[tuple[float, float]] = [tuple(p) for p in mission_waypoints(route).tolist()]
        self._circle = Route(route.segments[-1:], loiter=True) if route.loiter else None
        self._leg = -1
        self._next_leg()

    @property
    def leg(self) -> int:
        """Number of the leg that is flown, from 0; -1 before the first route."""
        return self._leg

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Decides the roll command for the next update interval."""
        if self._progress is None:
            raise RuntimeError("follow() a route before update()")
        while self._leg < len(self._points) - 1 and self._reached(state):
            self._next_leg()
        roll_rad, _, _, saturated, _, airspeed_mps = self.law.update(state)
        place = self._progress.nearest(state.east_m, state.north_m)
        return GuidanceOutput(
            roll_rad, place.cross_track_m, place.arc_length_m, saturated, place.past_end, airspeed_mps
        )

    def _next_leg(self) -> None:
        """Goes on to the next leg; beyond the last one to the loiter, or straight on."""
        self._leg += 1
        if self._leg < len(self._points) - 1:
            start, end = self._points[self._leg], self._points[self._leg + 1]
            self._along = end[0] - start[0], end[1] - start[1]
            self._turn_rad = self._turn_at_end_rad()
            self.law.follow(_line(start, end))
            if isinstance(self.law, PointLaw):
                self.law.fly_to(*end)
        elif self._circle is not None:
            self.law.follow(self._circle)
        elif isinstance(self.law, PointLaw):
            end, share = self._points[-1], FAR_M / math.hypot(*self._along)
            self.law.fly_to(end[0] + share * self._along[0], end[1] + share * self._along[1])

    def _reached(self, state: AircraftState) -> bool:
        """Whether the leg's end counts as reached: near enough, or passed."""
        end_east, end_north = self._points[self._leg + 1]
        east, north = end_east - state.east_m, end_north - state.north_m
        if self.by_passing and east * self._along[0] + north * self._along[1] <= 0.0:
            return True
        turn = self._turn_rad
        if turn == 0.0 and self.by_passing:
            return False
        return math.hypot(east, north) <= self.acceptance_m(state.groundspeed_mps, turn)

    def _turn_at_end_rad(self) -> float:
        """By how much the leg after this one is turned from it, at least 0; 0 where there is none."""
        if self._leg + 2 >= len(self._points):
            return 0.0
        (end_east, end_north), (next_east, next_north) = self._points[self._leg + 1 : self._leg + 3]
        after_east, after_north = next_east - end_east, next_north - end_north
        along_east, along_north = self._along
        return abs(
            math.atan2(
                along_east * after_north - along_north * after_east,
                along_east * after_east + along_north * after_north,
            )
        )


def waypoint_law(
    law: GuidanceLaw, kind: str, config: Any, limits: GuidanceLimits, radius_m: float | None = None
) -> WaypointLaw:
    """A law of its kind that flies the waypoints of routes; arguments as of `acceptance`."""
    return WaypointLaw(law, acceptance(kind, config, limits, radius_m), by_passing(config))


def by_passing(config: Any) -> bool:
    """Whether a waypoint counts as reached when the aircraft is past it; so it does where a law has no such key."""
    return bool(getattr(config, "switch_by_passing", True))


def _line(start: tuple[float, float], end: tuple[float, float]) -> Route:
    length = math.dist(start, end)
    return Route(
        np.array([[*start, (end[0] - start[0]) / length, (end[1] - start[1]) / length, 0.0, length]])
    )


def acceptance(kind: str, config: Any, limits: GuidanceLimits, radius_m: float | None = None) -> Acceptance:
    """From where a law's autopilot counts a waypoint as reached.

    `l1`: its look-ahead distance, no more than `WP_RADIUS_M`, less for a turn of less than 90 degrees in proportion
    (ArduPilot). `npfg`: its switch distance (PX4), a share of the track error bound. Any other: where a fillet of the
    turn would begin, R tan(turn / 2), at the bank limit less `BANK_KEPT_RAD`. A law that does not switch by passing
    would circle a point inside its turn for ever: the turn radius at the bank limit.
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
    per_speed2 = 1.0 / (GRAVITY_MPS2 * math.tan(max(limits.bank_limit_rad - BANK_KEPT_RAD, 0.1)))
    return lambda ground_speed_mps, turn_rad: (
        ground_speed_mps * ground_speed_mps * per_speed2 * math.tan(0.5 * min(turn_rad, CORNER_RAD))
    )
