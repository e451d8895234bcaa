"""VFH+: a polar histogram of what is near, and the best direction that the vehicle can still turn to.

I. Ulrich and J. Borenstein, "VFH+: reliable obstacle avoidance for fast mobile robots", IEEE International
Conference on Robotics and Automation, 1998.

1. Primary polar histogram: every edge point of the active window adds its magnitude to all sectors that it fills,
   grown by the distance to be kept.
2. Binary polar histogram: a sector is blocked above one threshold, free below a lower one, and between them as
   it was before.
3. Masked polar histogram: sectors that could only be reached by a turn through an obstacle are blocked too.
4. Candidate directions: the sides of wide openings, the middle of narrow ones, the goal where it is in one; the
   one with the least cost (off the goal, off the present direction, off the last choice) is taken.

It looks no further than its window and remembers no way: it is caught in dead ends, as its authors say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from planner.baselines.steering import off, steer
from planner.geometry.clearance import first_breach
from planner.geometry.curves import Limits, Point, Pose, Segment
from planner.geometry.joining import branch_off, stuck
from planner.geometry.margin import margin_of
from planner.interface import BoolArray, FloatArray, Mission, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.keys import key, margin_key
from planner.memory import ObstacleMemory

WIDE_RAD = math.radians(80.0)
"""An opening as wide as this has two sides to choose from; of a narrower one the middle is taken."""

GOAL_WEIGHT, COURSE_WEIGHT, CHOICE_WEIGHT = 5.0, 2.0, 2.0
"""Weights mu 1 to 3 of the cost of a direction, as in the paper: mu 1 > mu 2 + mu 3 leads to the goal."""


@dataclass(frozen=True)
class VfhPlusConfig:
    """Keys of `planner.kind: vfh_plus`."""

    window_m: float | None = key(
        None,
        "radius of the active window, at most the sensor range; default: 12 turn radii and 6 "
        "clearances, at most the sensor range",
        "m",
        above=0.0,
    )
    sectors: int = key(72, "sectors of the polar histogram", minimum=8, maximum=720)
    free_below: float = key(
        0.05,
        "a sector is free below this magnitude; 1 is an edge at the aircraft, 0 one at the window's rim",
        minimum=0.0,
    )
    blocked_above: float = key(0.10, "a sector is blocked above this magnitude", minimum=0.0)
    margin_m: float | None = margin_key()

    def resolved(self, mission: Mission) -> VfhPlusConfig:
        """This config with every None replaced by its default for the mission.

        Raises:
            ValueError: the window is larger than the sensing range, or the thresholds are the wrong way round.
        """
        reach = 12.0 * mission.turn_radius_m + 6.0 * mission.clearance_m
        window = min(reach, mission.sensor_range_m) if self.window_m is None else self.window_m
        if window > mission.sensor_range_m:
            raise ValueError(f"window_m is {window:g}, more than sensor.range_m {mission.sensor_range_m:g}")
        if self.free_below > self.blocked_above:
            raise ValueError(
                f"free_below is {self.free_below:g}, more than blocked_above {self.blocked_above:g}"
            )
        margin = margin_of(mission) if self.margin_m is None else self.margin_m
        return replace(self, window_m=window, margin_m=margin)


class VfhPlus:
    """The planner for one flight."""

    def __init__(self, config: VfhPlusConfig, mission: Mission) -> None:
        config = config.resolved(mission)
        assert config.window_m is not None
        assert config.margin_m is not None
        self._config, self._mission, self._window_m = config, mission, config.window_m
        self._keep_m = mission.clearance_m + config.margin_m
        self._limits = Limits.of(mission)
        self._memory = ObstacleMemory(mission.clearance_m)
        self._width_rad = math.tau / config.sectors
        self._bearings = self._width_rad * np.arange(config.sectors)
        self._blocked: BoolArray = np.zeros(config.sectors, dtype=np.bool_)
        self._choice: float | None = None

    def plan(self, request: PlanRequest) -> Plan:
        """One histogram, one direction; a path only where the direction is a new one."""
        self._memory.take_in(request.seen)
        mission, path = self._mission, request.flown.path if request.flown else None
        pose, prefix = branch_off(request, mission)
        near = self._near(pose)
        masked = self._masked(pose, near, self._binary(pose, near))
        choice = self._direction(pose, masked)
        if choice is None:
            self._choice = None
            return stuck("no direction is free", request, mission, self._memory.points_m)
        last, self._choice = self._choice, choice
        left = 0.0 if path is None or path.loiter else path.length_m - request.arc_length_m
        if (
            last is not None
            and path is not None
            and abs(off(choice, last)) < 0.5 * self._width_rad
            and left > 0.5 * self._look_m(pose[:2])
            and math.isinf(first_breach(path, near, mission.clearance_m, request.arc_length_m))
        ):
            self._choice = last
            return Plan(PlanStatus.KEPT, "the direction is still the best one")
        return self._found(request, pose, prefix, choice, masked)

    def _near(self, pose: Pose) -> FloatArray:
        """(m, 2) edge points of the active window."""
        points = self._memory.points_m
        distance = np.hypot(points[:, 0] - pose.east_m, points[:, 1] - pose.north_m)
        return points[distance < self._window_m]

    def _binary(self, pose: Pose, near: FloatArray) -> BoolArray:
        """Which sectors are blocked: the primary histogram between two thresholds."""
        dx, dy = near[:, 0] - pose.east_m, near[:, 1] - pose.north_m
        distance = np.hypot(dx, dy)
        half = np.arcsin(np.minimum(self._keep_m / np.maximum(distance, 1e-9), 1.0))
        # The paper's a - b d^2 with unit certainty, 1 here and 0 at the rim.
        magnitude = 1.0 - np.square(distance / self._window_m)
        aside = np.abs(off(self._bearings[:, None], np.arctan2(dy, dx)))
        primary = (magnitude * (aside <= half)).sum(axis=1)
        low, high = self._config.free_below, self._config.blocked_above
        self._blocked = np.where(primary > high, True, np.where(primary < low, False, self._blocked))
        return self._blocked | self._outside(pose)

    def _outside(self, pose: Pose) -> BoolArray:
        """Which directions leave the area within two turn radii."""
        xmin, ymin, xmax, ymax = self._mission.bounds_m
        reach = 2.0 * self._mission.turn_radius_m
        x = pose.east_m + reach * np.cos(self._bearings)
        y = pose.north_m + reach * np.sin(self._bearings)
        return np.asarray((x < xmin) | (x > xmax) | (y < ymin) | (y > ymax))

    def _masked(self, pose: Pose, near: FloatArray, blocked: BoolArray) -> BoolArray:
        """Which sectors are blocked or lie behind an obstacle that a turn there would touch."""
        course = math.atan2(pose.tangent_north, pose.tangent_east)
        relative = off(self._bearings, course)
        masked = blocked.copy()
        for side in (1.0, -1.0):  # left, right
            radius = self._limits.radius_m
            x, y = (
                pose.east_m - side * radius * pose.tangent_north,
                pose.north_m + side * radius * pose.tangent_east,
            )
            touching = np.hypot(near[:, 0] - x, near[:, 1] - y) < radius + self._keep_m
            bearing = side * off(np.arctan2(near[:, 1] - pose.north_m, near[:, 0] - pose.east_m), course)
            ahead = bearing[touching & (bearing >= 0.0)]
            limit = float(ahead.min()) if len(ahead) else math.pi
            masked |= side * relative > limit
        return masked

    def _direction(self, pose: Pose, masked: BoolArray) -> float | None:
        """The candidate direction with the least cost; None where all is blocked."""
        dx, dy = self._mission.goal_m[0] - pose.east_m, self._mission.goal_m[1] - pose.north_m
        goal, course = math.atan2(dy, dx), math.atan2(pose.tangent_north, pose.tangent_east)
        last = course if self._choice is None else self._choice

        def cost(bearing: float) -> float:
            terms = ((GOAL_WEIGHT, goal), (COURSE_WEIGHT, course), (CHOICE_WEIGHT, last))
            return float(sum(weight * abs(off(bearing, other)) for weight, other in terms))

        return min(self._candidates(masked, goal), key=cost, default=None)

    def _candidates(self, masked: BoolArray, goal: float) -> list[float]:
        """The directions worth choosing from."""
        if not masked.any():
            return [goal]
        count, width = len(masked), self._width_rad
        candidates: list[float] = []
        for first in np.flatnonzero(~masked & np.roll(masked, 1)).tolist():  # openings, counter-clockwise
            size = int(np.argmax(np.roll(masked, -first)))
            right, left = first * width, (first + size - 1) * width
            if (size - 1) * width < WIDE_RAD:
                candidates.append(0.5 * (right + left))
            else:
                candidates += [right + 0.5 * WIDE_RAD, left - 0.5 * WIDE_RAD]
            if not masked[round(goal / width) % count] and (goal - right) % math.tau <= left - right:
                candidates.append(goal)
        return candidates

    def _look_m(self, place: Point) -> float:
        """How far a path reaches."""
        return min(self._window_m, math.dist(place, self._mission.goal_m))

    def _found(
        self, request: PlanRequest, pose: Pose, prefix: list[Segment], choice: float, masked: BoolArray
    ) -> Plan:
        """The turn to a direction, and straight on along it."""
        look = self._look_m(pose[:2])
        target = pose.east_m + look * math.cos(choice), pose.north_m + look * math.sin(choice)
        free = self._bearings[~masked]
        half = 0.5 * self._width_rad
        picture = partial(
            PlanPicture,
            np.array([request.position_m, self._mission.goal_m]),
            self._window_m,
            np.column_stack(
                (np.cos(free - half), np.sin(free - half), np.cos(free + half), np.sin(free + half))
            ),
        )
        return steer(request, self._mission, (pose, prefix), target, self._memory.points_m, picture)
