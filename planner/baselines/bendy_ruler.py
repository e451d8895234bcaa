"""BendyRuler, ArduPilot's path planning around obstacles for Copter and Rover, steered at the turn radius.

Written from its description in ArduPilot's documentation (`common-oa-bendyruler`) and of its parameters:

1. Once a second, probe bearings every 5 degrees from the bearing of the goal outwards, left and right in turns: a
   line of the length `lookahead` (OA_BR_LOOKAHEAD). The margin is the least distance of the line from an obstacle.
2. Where the margin is larger than `margin_max` (OA_MARGIN_MAX), a second line is probed from its end: towards the
   goal, and 45 degrees to the left and to the right of that. The first bearing of which one of these is clear too is
   taken.
3. A bearing that is more than `cont_angle` (OA_BR_CONT_ANGLE) off the last one is taken only if the margin along the
   last bearing is less than its margin over `cont_ratio` (OA_BR_CONT_RATIO).
4. Where no bearing is clear, the one with the largest margin is taken.

ArduPilot's vehicles turn on the spot or nearly so. Here the bearing is steered to by a turn at the turn radius.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from planner.baselines.steering import off, steer
from planner.geometry.clearance import first_breach
from planner.geometry.curves import Point
from planner.geometry.joining import branch_off
from planner.geometry.margin import margin_of
from planner.interface import FloatArray, Mission, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.keys import key
from planner.memory import ObstacleMemory

BEARING_STEP = math.radians(5.0)
SECOND_BEARINGS = (0.0, math.radians(45.0), -math.radians(45.0))
"""Offsets from the bearing of the goal of the second line."""

UPDATE_S = 1.0
"""The bearing is chosen anew after so much time."""


@dataclass(frozen=True)
class BendyRulerConfig:
    """Keys of `planner.kind: bendy_ruler`, ArduPilot's parameters but for their scale."""

    lookahead_m: float | None = key(
        None,
        "OA_BR_LOOKAHEAD, length of a probed line; default: 8 turn radii, at most the sensor range",
        "m",
        above=0.0,
    )
    margin_max_m: float | None = key(
        None,
        "OA_MARGIN_MAX, distance that a line keeps from obstacles; default: the clearance and "
        "the margin that other planners keep",
        "m",
        minimum=0.0,
    )
    cont_ratio: float = key(
        1.5, "OA_BR_CONT_RATIO, how much larger the margin of a new bearing must be", minimum=1.0, maximum=2.0
    )
    cont_angle_deg: float = key(
        75.0, "OA_BR_CONT_ANGLE, largest change of bearing without that", "deg", minimum=0.0, maximum=180.0
    )

    def resolved(self, mission: Mission) -> BendyRulerConfig:
        """This config with every None replaced by its default for the mission.

        Raises:
            ValueError: the lines reach beyond the sensing range.
        """
        reach = mission.sensor_range_m
        lookahead = min(8.0 * mission.turn_radius_m, reach) if self.lookahead_m is None else self.lookahead_m
        if lookahead > reach:
            raise ValueError(f"lookahead_m is {lookahead:g}, more than sensor.range_m {reach:g}")
        margin = mission.clearance_m + margin_of(mission) if self.margin_max_m is None else self.margin_max_m
        return replace(self, lookahead_m=lookahead, margin_max_m=margin)


class BendyRuler:
    """The planner for one flight."""

    def __init__(self, config: BendyRulerConfig, mission: Mission) -> None:
        config = config.resolved(mission)
        assert config.lookahead_m is not None
        assert config.margin_max_m is not None
        self._config, self._mission = config, mission
        self._lookahead_m, self._margin_m = config.lookahead_m, config.margin_max_m
        self._memory = ObstacleMemory(mission.clearance_m)
        self._bearing: float | None = None
        self._chosen_s = -math.inf

    def plan(self, request: PlanRequest) -> Plan:
        """A new bearing every second, and where the path in effect is cut; a path where it is another one."""
        self._memory.take_in(request.seen)
        mission, path = self._mission, request.flown.path if request.flown else None
        points = self._memory.points_m
        cut = path is not None and math.isfinite(
            first_breach(path, points, mission.clearance_m, request.arc_length_m)
        )
        if path is not None and not cut and request.time_s < self._chosen_s + UPDATE_S:
            return Plan(PlanStatus.KEPT, "the bearing is less than a second old")
        self._chosen_s = request.time_s
        pose, prefix = branch_off(request, mission)
        near = points[np.hypot(*(points - pose[:2]).T) < 2.0 * self._lookahead_m + self._margin_m]
        last, self._bearing = self._bearing, self.bearing(pose[:2], near)
        left_m = 0.0 if path is None or path.loiter else path.length_m - request.arc_length_m
        same = last is not None and abs(off(self._bearing, last)) < 0.5 * BEARING_STEP
        if same and not cut and left_m > 0.5 * self._lookahead_m:
            self._bearing = last
            return Plan(PlanStatus.KEPT, "the bearing is the same")
        reach = min(self._lookahead_m, math.dist(pose[:2], mission.goal_m))
        target = _beyond(pose[:2], self._bearing, reach)
        picture = partial(PlanPicture, np.array([request.position_m, mission.goal_m]), self._lookahead_m)
        return steer(request, mission, (pose, prefix), target, points, picture)

    def bearing(self, here: Point, points_m: FloatArray) -> float:
        """Steps 1 to 4: the bearing to be flown, rad counter-clockwise from east, among (m, 2) edge points."""
        goal = self._mission.goal_m
        to_goal = math.atan2(goal[1] - here[1], goal[0] - here[0])
        first_m = min(self._lookahead_m, math.dist(here, goal))
        widest, best = -math.inf, to_goal
        for number in range(round(math.tau / BEARING_STEP)):
            side = 1.0 if number % 2 else -1.0
            bearing = to_goal + side * BEARING_STEP * ((number + 1) // 2)
            end = _beyond(here, bearing, first_m)
            margin = self._margin_along(here, end, points_m)
            if margin > widest:
                widest, best = margin, bearing
            if margin > self._margin_m and self._second_clear(end, points_m):
                return self._resisting(here, bearing, margin, first_m, points_m)
        return best

    def _second_clear(self, end: Point, points_m: FloatArray) -> bool:
        """Step 2: whether a line onwards from the end of the first one is clear."""
        goal = self._mission.goal_m
        left_m = math.dist(end, goal)
        if left_m < 1.0:
            return True
        to_goal = math.atan2(goal[1] - end[1], goal[0] - end[0])
        ends = (_beyond(end, to_goal + offset, min(self._lookahead_m, left_m)) for offset in SECOND_BEARINGS)
        return any(self._margin_along(end, onward, points_m) > self._margin_m for onward in ends)

    def _resisting(
        self, here: Point, bearing: float, margin_m: float, first_m: float, points_m: FloatArray
    ) -> float:
        """Step 3: the last bearing where the new one is far off it and not that much better."""
        last = self._bearing
        if last is None or abs(off(bearing, last)) <= math.radians(self._config.cont_angle_deg):
            return bearing
        along_last = self._margin_along(here, _beyond(here, last, first_m), points_m)
        keeps = along_last > self._margin_m and margin_m < self._config.cont_ratio * along_last
        return last if keeps else bearing

    def _margin_along(self, a: Point, b: Point, points_m: FloatArray) -> float:
        """Least distance of the line from a to b to an edge point, or of its end to the border of the area."""
        xmin, ymin, xmax, ymax = self._mission.bounds_m
        border = min(b[0] - xmin, xmax - b[0], b[1] - ymin, ymax - b[1])
        if border < 0.0 or not len(points_m):
            # The border must not be crossed; no clearance is wanted from it.
            return border if border < 0.0 else math.inf
        way, to = np.subtract(b, a), points_m - a
        share = np.clip(to @ way / max(float(way @ way), 1e-9), 0.0, 1.0)
        return float(np.hypot(*(to - share[:, None] * way).T).min())


def _beyond(a: Point, bearing: float, distance_m: float) -> Point:
    return a[0] + distance_m * math.cos(bearing), a[1] + distance_m * math.sin(bearing)
