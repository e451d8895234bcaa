"""BendyRuler, ArduPilot's path planning around obstacles for Copter and Rover, steered at the turn radius.

Written from its description in ArduPilot's documentation (`common-oa-bendyruler`) and of its parameters:

1. Once a second, probe bearings every 5 degrees from the bearing of the goal outwards, left and right in turns: a
   line of the length OA_BR_LOOKAHEAD. The margin is the least distance of the line from an obstacle.
2. Where the margin is larger than OA_MARGIN_MAX, here the clearance and `margin_m`, a second line is probed from its
   end: towards the goal, and 45 degrees to the left and to the right of that. The first bearing of which one of these
   is clear too is taken.
3. A bearing that is more than OA_BR_CONT_ANGLE off the last one is taken only if the last one is not clear, or
   the margin along it is less than its margin over OA_BR_CONT_RATIO. The way to the goal, both lines, is always taken.
4. Where no bearing is clear, the one with the largest margin is taken. (ArduPilot's code first takes one with a clear
   first line, the nearest to its course.)

ArduPilot's vehicles turn on the spot or nearly so. Here the bearing is steered to by a turn at the turn radius.
"""

from __future__ import annotations

import math

import numpy as np

from planner.baselines.steering import Steerer, ahead, turn_rad
from planner.geometry.curves import Point, Pose
from planner.interface import FloatArray, Mission
from planner.keys import MarginConfig

BEARING_STEP_RAD = math.radians(5.0)  # angle between neighbouring bearings that are probed
SECOND_OFFSETS_RAD = (0.0, math.radians(45.0), -math.radians(45.0))
"""Bearings of the second lines, each from the end of a first one, relative to the bearing of the goal there."""
LOOKAHEAD_RADII = 8.0  # OA_BR_LOOKAHEAD, in turn radii: length of a probed line, at most the sensor range
CONT_RATIO, CONT_ANGLE_RAD = 1.5, math.radians(75.0)
"""OA_BR_CONT_RATIO and OA_BR_CONT_ANGLE, ArduPilot's defaults."""


class BendyRuler(Steerer):
    """The planner for one flight."""

    def __init__(self, config: MarginConfig, mission: Mission) -> None:
        lookahead_m = min(LOOKAHEAD_RADII * mission.turn_radius_m, mission.sensor_range_m)
        self._margin_m = mission.clearance_m + config.margin(mission)
        super().__init__(mission, lookahead_m, 2.0 * lookahead_m + self._margin_m, BEARING_STEP_RAD)

    def direction(self, pose: Pose, points_m: FloatArray) -> float:
        """The bearing that steps 1 to 4 of the method choose; without a clear one, that with the largest margin."""
        here, goal = pose[:2], self.mission.goal_m
        to_goal = math.atan2(goal[1] - here[1], goal[0] - here[0])
        first_m = min(self.look_m, math.dist(here, goal))
        widest, best = -math.inf, to_goal
        for number in range(round(math.tau / BEARING_STEP_RAD)):
            bearing = to_goal + (1.0 if number % 2 else -1.0) * BEARING_STEP_RAD * ((number + 1) // 2)
            end = ahead(here, bearing, first_m)
            if (margin := self._margin_along(here, end, points_m)) > widest:
                widest, best = margin, bearing
            if margin > self._margin_m and (offset := self._second_clear(end, points_m)) is not None:
                if number == 0 and offset == 0.0:
                    return bearing
                return self._resist_change(here, bearing, margin, first_m, points_m)
        return best

    def _second_clear(self, end: Point, points_m: FloatArray) -> float | None:
        """Step 2: the first of `SECOND_OFFSETS_RAD` that is clear from the end of the first line, None without."""
        goal = self.mission.goal_m
        left_m = math.dist(end, goal)
        to_goal = math.atan2(goal[1] - end[1], goal[0] - end[0])
        ends = ((each, ahead(end, to_goal + each, min(self.look_m, left_m))) for each in SECOND_OFFSETS_RAD)
        clear = (each for each, to in ends if self._margin_along(end, to, points_m) > self._margin_m)
        return next(clear, None)

    def _resist_change(
        self, here: Point, bearing: float, margin_m: float, first_m: float, points_m: FloatArray
    ) -> float:
        """Step 3: the last bearing where the new one is far off it and not that much better."""
        last = self.chosen
        if last is None or abs(turn_rad(bearing, last)) <= CONT_ANGLE_RAD:
            return bearing
        along_last = self._margin_along(here, ahead(here, last, first_m), points_m)
        return last if along_last > self._margin_m and margin_m < CONT_RATIO * along_last else bearing

    def _margin_along(self, a: Point, b: Point, points_m: FloatArray) -> float:
        """Least distance (m) from edge points of the line from a to b, infinite without any; negative: b is outside."""
        xmin, ymin, xmax, ymax = self.mission.bounds_m
        if (border := min(b[0] - xmin, xmax - b[0], b[1] - ymin, ymax - b[1])) < 0.0 or not len(points_m):
            # The border must not be crossed; no clearance is wanted from it.
            return border if border < 0.0 else math.inf
        way, to = np.subtract(b, a), points_m - a
        share = np.clip(to @ way / max(float(way @ way), 1e-9), 0.0, 1.0)
        return float(np.hypot(*(to - share[:, None] * way).T).min())
