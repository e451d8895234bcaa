"""The law `bearing`: bank in proportion to the angle between course and the bearing to a point.

    bank = limit(gain (bearing to the point - course), bank limit)

Simple autopilots fly so; it knows neither a path nor the wind. With `guidance.follow: waypoints` the point is the next
waypoint. With `follow: path` it is the point of the path a look-ahead 2 Vg^2 / (gain g) on: the arc to a point so far
ahead has the lateral acceleration g gain eta at a small angle eta (pure pursuit, a = 2 V^2 sin(eta) / L), which is that
of the commanded bank.

Source: UASLab/OpenFlight at e3562a6, `guidance/waypoint_guidance_fast.c`, `control/waypoint_tracker.c`: gain 1.5, bank
limit 45 degrees, waypoints accepted within 10 m and never for being passed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from aircraft.guidance.interface import GuidanceLimits
from aircraft.guidance.key import key
from aircraft.guidance.progress import PathPoint
from aircraft.guidance.route_law import RouteLaw
from aircraft.interface import GRAVITY_MPS2, AircraftState, Route

SLOW_MPS = 1.0  # least ground speed in the look-ahead, so that the point stays ahead


@dataclass(frozen=True)
class BearingConfig:
    """Keys of `guidance.kind: bearing`."""

    gain: float = key(1.5, "bank for the angle between course and bearing", "1", above=0.0)
    switch_by_passing: bool = key(
        False, "with follow: waypoints, a waypoint counts as reached once the aircraft is past it, too"
    )

    def resolved(self, limits: GuidanceLimits) -> BearingConfig:
        """The config; no default depends on the aircraft."""
        return self


def bank_to_point(to_east_m: float, to_north_m: float, course_rad: float, gain: float) -> float:
    """Bank (rad, positive right wing down) towards a point, not limited."""
    return gain * math.remainder(math.atan2(to_east_m, to_north_m) - course_rad, math.tau)


class BearingLaw(RouteLaw):
    """Heads for points. Implements `GuidanceLaw` and `aircraft.guidance.waypoints.PointLaw`."""

    def __init__(self, config: BearingConfig, limits: GuidanceLimits) -> None:
        super().__init__(limits)
        self._gain = config.gain
        self._point: tuple[float, float] | None = None

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route; the roll command goes on from where it is."""
        super().follow(route, arc_length_m)
        self._point = None

    def fly_to(self, east_m: float, north_m: float) -> None:
        """Heads for one point until the next call."""
        self._point = east_m, north_m

    def demand(self, state: AircraftState, place: PathPoint) -> tuple[float, float]:
        """Roll (rad) towards the point; no airspeed."""
        speed = max(state.groundspeed_mps, SLOW_MPS)
        east, north = self._point or self.progress.ahead(2.0 * speed * speed / (self._gain * GRAVITY_MPS2))
        to_east, to_north = east - state.east_m, north - state.north_m
        return bank_to_point(to_east, to_north, state.course_rad, self._gain), math.nan
