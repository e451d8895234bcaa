"""Pure pursuit: the circle through the aircraft, along its course, and through a point of the path ahead.

Source: R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01, 1992: the arc to a
goal point at the look-ahead distance L has the curvature 2 x / L^2, with x the goal's offset across the course. As a
lateral acceleration this is 2 V^2 / L sin(eta), that of S. Park, J. Deyst and J. P. How, AIAA 2004-4900. Right is
positive: roll, acceleration, curvature.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from aircraft.guidance.interface import GuidanceLimits
from aircraft.guidance.key import key
from aircraft.guidance.progress import PathPoint
from aircraft.guidance.route_law import RouteLaw
from aircraft.guidance.vector_field import LEAST_CRAB_COSINE, SLOW_MPS
from aircraft.interface import GRAVITY_MPS2, AircraftState

LOOK_AHEAD_FACTOR = 2.0 * math.sqrt(2.0)
"""Look-ahead time times the aircraft's guidance bandwidth. On a line the law is an oscillator of the natural frequency
sqrt(2) / time and the damping 0.7: with this it is half as fast as the bandwidth."""
GOAL_STEPS, GOAL_REACH_FACTOR = 16, 2.0
"""The goal point is sought in at most this many steps, up to this many look-ahead distances along the route."""


@dataclass(frozen=True)
class PurePursuitConfig:
    """Keys of `guidance.kind: pure_pursuit`."""

    look_ahead_s: float | None = key(
        None, "look-ahead in flying time; default: 2.8 over the aircraft's guidance bandwidth", "s", above=0.0
    )
    min_look_ahead_m: float = key(1.0, "least look-ahead distance", "m", above=0.0)

    def resolved(self, limits: GuidanceLimits) -> PurePursuitConfig:
        """The config with every default filled in."""
        ahead = LOOK_AHEAD_FACTOR / limits.bandwidth_radps if self.look_ahead_s is None else self.look_ahead_s
        return replace(self, look_ahead_s=ahead)


def look_ahead_distance(velocity_east_mps: float, velocity_north_mps: float, has: PurePursuitConfig) -> float:
    """Look-ahead distance at a ground velocity, m."""
    speed = math.sqrt(velocity_east_mps * velocity_east_mps + velocity_north_mps * velocity_north_mps)
    return max(speed * (has.look_ahead_s or 0.0), has.min_look_ahead_m)


def pure_pursuit(
    to_goal_east_m: float,
    to_goal_north_m: float,
    velocity_east_mps: float,
    velocity_north_mps: float,
    heading_rad: float,
    look_ahead_m: float,
) -> tuple[float, float]:
    """Curvature (1/m, right) of the arc to the goal point, and the bank (rad) of a coordinated turn on it, not limited.

    Of the goal only the direction counts beside the distance. To one more than a right angle off the course the turn is
    as hard as to one at a right angle.
    """
    east, north = velocity_east_mps, velocity_north_mps
    speed = max(math.sqrt(east * east + north * north), SLOW_MPS)
    away = math.sqrt(to_goal_east_m * to_goal_east_m + to_goal_north_m * to_goal_north_m)
    sine = 0.0
    if away > 0.0:
        sine = (north * to_goal_east_m - east * to_goal_north_m) / (speed * away)
        if east * to_goal_east_m + north * to_goal_north_m < 0.0:
            sine = -1.0 if sine < 0.0 else 1.0
    curvature = 2.0 * sine / look_ahead_m
    ahead = (east * math.sin(heading_rad) + north * math.cos(heading_rad)) / speed
    return curvature, math.atan(speed * speed * curvature / (GRAVITY_MPS2 * max(ahead, LEAST_CRAB_COSINE)))


class PurePursuitLaw(RouteLaw):
    """Flies a route by pure pursuit of the first point ahead that is the look-ahead distance away."""

    def __init__(self, config: PurePursuitConfig, limits: GuidanceLimits) -> None:
        super().__init__(limits)
        self._has = config

    def demand(self, state: AircraftState, place: PathPoint) -> tuple[float, float]:
        """Roll (rad) of pure pursuit; no airspeed."""
        velocity = state.velocity_east_mps, state.velocity_north_mps
        ahead_m = look_ahead_distance(*velocity, self._has)
        goal = self._to_goal(state.east_m, state.north_m, ahead_m)
        return pure_pursuit(*goal, *velocity, state.heading_rad, ahead_m)[1], math.nan

    def _to_goal(self, east_m: float, north_m: float, ahead_m: float) -> tuple[float, float]:
        """Vector (m) to the goal point. A step along the route by the distance still missing cannot overshoot it."""
        further_m, east, north = 0.0, *self.progress.ahead(0.0)
        for _ in range(GOAL_STEPS):
            missing = ahead_m - math.hypot(east - east_m, north - north_m)
            if missing <= 1e-3 * ahead_m or further_m > GOAL_REACH_FACTOR * ahead_m:
                break
            further_m += missing
            east, north = self.progress.ahead(further_m)
        return east - east_m, north - north_m
