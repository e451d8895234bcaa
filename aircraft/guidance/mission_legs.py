"""A mission flown leg by leg as its file has it: straight legs to its waypoints and no others, and its loiters.

The law follows one leg after the other. A waypoint counts as reached within its own acceptance radius, else within that
of the law's autopilot, or when the aircraft is past it, as `aircraft.guidance.waypoints` has it. A loiter is left when
the aircraft has gone round far enough. Autopilots that head for the centre of a loiter and then join its circle are
flown so: PX4 (`navigateLoiter`: far from the circle the bearing is that to its nearest point, which is towards the
centre) and ArduPilot (ArduPlane's mission mode: the line to the centre is followed until three radii from it, then
`update_loiter` captures the circle).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from aircraft.guidance.interface import GuidanceOutput
from aircraft.guidance.progress import RouteProgress
from aircraft.guidance.waypoints import PointLaw, WaypointLaw
from aircraft.interface import AircraftState, Route
from aircraft.route import arc_point

HEADING_FOR_CENTRES: Final = ("l1", "npfg")
"""Laws whose autopilots head for the centre of a loiter; all others join its circle along a tangent."""

L1_CAPTURE_RADII: Final = 3.0
"""ArduPlane follows the line to the centre of a loiter down to so many radii from it."""


class Along(NamedTuple):
    """Where the aircraft is along and beside a route; as in `PathPoint`."""

    cross_track_m: float
    arc_length_m: float
    past_end: bool


@dataclass(frozen=True, eq=False)
class MissionLeg:
    """One leg: to a waypoint, along a way, or round a circle.

    Attributes:
        route: what the law follows.
        stations_m: arc lengths at its ends on the route that the mission was made into.
        end_m: the waypoint that it leads to; None: it is flown to its end.
        acceptance_m: from where the waypoint counts as reached; None: by the rule of the law; 0: only when passed.
        captured_radius_m: radius of the circle about the waypoint that is joined from far; 0: there is none.
        centre_m: of a circle that the leg goes round.
        swept_rad: how far round, from where the route begins.
    """

    route: Route
    stations_m: tuple[float, float]
    end_m: tuple[float, float] | None = None
    acceptance_m: float | None = 0.0
    captured_radius_m: float = 0.0
    centre_m: tuple[float, float] | None = None
    swept_rad: float = 0.0

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
    """A leg from one place to another, east + i north."""
    start, end = ends
    goal = end if centre is None else centre
    length_m = abs(goal - start)
    ahead = (goal - start) / length_m
    row = (start.real, start.imag, ahead.real, ahead.imag, 0.0, length_m)
    return MissionLeg(
        Route(np.array([row])), stations_m, (goal.real, goal.imag), acceptance_m, abs(goal - end)
    )


class MissionLaw:
    """Flies the legs of a mission with another law. Implements `GuidanceLaw`.

    Cross-track error and arc length are those on the route that is followed, not on the leg.
    """

    def __init__(self, flies: WaypointLaw, kind: str, legs: tuple[MissionLeg, ...]) -> None:
        self._law, self._acceptance_m, self._by_passing = flies.law, flies.acceptance_m, flies.by_passing
        self._kind, self._legs = kind, legs
        self._progress: RouteProgress | None = None

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes the route that the legs belong to, from its start."""
        self._progress, self._leg = RouteProgress(route, arc_length_m), -1
        self._begin_next()

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Decides the roll command for the next update interval."""
        if self._progress is None:
            raise RuntimeError("follow() a route before update()")
        while self._is_over(state) and self._leg < len(self._legs) - 1:
            self._begin_next()
        roll_rad, _, _, saturated, _, airspeed_mps = self._law.update(state)
        place = self.along(state)
        return GuidanceOutput(
            roll_rad, place.cross_track_m, place.arc_length_m, saturated, place.past_end, airspeed_mps
        )

    def along(self, state: AircraftState) -> Along:
        """Where an aircraft on the present leg is along the route, and how far beside it; at its start before one.

        A route with arcs would be lost by an aircraft that turns to the other side; the leg is known.
        """
        if self._progress is None:
            return Along(0.0, 0.0, False)
        leg = self._legs[self._leg]
        first, last = leg.stations_m
        past_end = False
        if leg.centre_m is not None:
            share = self._round_rad / leg.swept_rad if self._bearing_rad is not None else 0.0
            past_end = share >= 1.0
        else:
            place = self._on_leg.nearest(state.east_m, state.north_m)
            share = place.arc_length_m / (float(leg.route.segments[:, 5].sum()) - leg.captured_radius_m)
            past_end = place.past_end
        station_m = first + min(max(share, 0.0), 1.0) * (last - first)
        self._progress.restart(station_m)
        beside = self._progress.nearest(state.east_m, state.north_m)
        return Along(beside.cross_track_m, station_m, past_end and self._leg == len(self._legs) - 1)

    def _begin_next(self) -> None:
        self._leg += 1
        leg = self._legs[self._leg]
        self._law.follow(leg.route)
        if isinstance(self._law, PointLaw) and leg.end_m is not None:
            self._law.fly_to(*leg.end_m)
        self._on_leg = RouteProgress(leg.route)
        self._turn_rad = self._turn_after(leg)
        self._bearing_rad: float | None = None

    def _is_over(self, state: AircraftState) -> bool:
        leg = self._legs[self._leg]
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
        """How far from the centre of a circle it begins to be joined."""
        if self._kind == "l1":
            return L1_CAPTURE_RADII * radius_m
        return radius_m + self._acceptance_m(ground_speed_mps, 0.5 * math.pi)

    def _gone_round_rad(self, leg: MissionLeg, state: AircraftState) -> float:
        """How far round a circle the aircraft is from where its route begins."""
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
        """By how much the next leg is turned from the end of this one, at least 0; 0 where there is none."""
        if self._leg + 1 >= len(self._legs):
            return 0.0
        (east, north), after = leg.direction, self._legs[self._leg + 1].route.segments[0, 2:4]
        return abs(math.atan2(east * after[1] - north * after[0], east * after[0] + north * after[1]))
