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
from dataclasses import replace

import numpy as np

from planner.baselines.steering import Steerer, turn_rad
from planner.geometry.curves import Pose
from planner.interface import BoolArray, FloatArray, Mission, PlanPicture, PlanRequest
from planner.keys import MarginConfig

SECTORS = 72  # number of sectors of the polar histogram
WIDTH_RAD = math.tau / SECTORS  # width of a sector of the polar histogram

WINDOW_RADII, WINDOW_CLEARANCES = 12.0, 6.0
"""Numbers of turn radii and of clearances that add up to the radius of the active window, at most the sensor range."""

FREE_BELOW, BLOCKED_ABOVE = 0.05, 0.10
"""Thresholds of the magnitude of a sector: 1 is an edge at the aircraft, 0 one at the window's rim."""

WIDE_RAD = math.radians(80.0)
"""An opening as wide as this has two sides to choose from; of a narrower one the middle is taken."""

GOAL_WEIGHT, COURSE_WEIGHT, CHOICE_WEIGHT = 5.0, 2.0, 2.0
"""Weights mu 1 to 3 of the cost of a direction, as in the paper: mu 1 > mu 2 + mu 3 leads to the goal."""


class VfhPlus(Steerer):
    """The planner for one flight."""

    every_s = 0.0

    def __init__(self, config: MarginConfig, mission: Mission) -> None:
        reach_m = WINDOW_RADII * mission.turn_radius_m + WINDOW_CLEARANCES * mission.clearance_m
        window_m = min(reach_m, mission.sensor_range_m)
        super().__init__(mission, window_m, window_m, WIDTH_RAD)
        self._keep_m = mission.clearance_m + config.margin(mission)
        self._bearings = WIDTH_RAD * np.arange(SECTORS)
        self._blocked: BoolArray = np.zeros(SECTORS, dtype=np.bool_)
        self._masked = self._blocked

    def direction(self, pose: Pose, points_m: FloatArray) -> float | None:
        """The candidate direction with the least cost, steps 1 to 4 of the method; None if all are blocked."""
        self._masked = self._mask(pose, points_m, self._binary(pose, points_m))
        return self._best_direction(pose, self._masked)

    def picture(self, request: PlanRequest) -> PlanPicture:
        """The line to the goal, the look distance, and the sectors that are not masked."""
        edges = self._bearings[~self._masked, None] + 0.5 * WIDTH_RAD * np.array((-1.0, 1.0))
        sectors = np.stack((np.cos(edges), np.sin(edges)), axis=2).reshape(-1, 4)
        return replace(super().picture(request), sectors=sectors)

    def _binary(self, pose: Pose, near: FloatArray) -> BoolArray:
        """Which sectors are blocked: by the primary histogram, between two thresholds as before, or leading outside."""
        dx, dy = near[:, 0] - pose.east_m, near[:, 1] - pose.north_m
        distance = np.hypot(dx, dy)
        half = np.arcsin(np.minimum(self._keep_m / np.maximum(distance, 1e-9), 1.0))
        # The paper's a - b d^2 with unit certainty, 1 here and 0 at the rim.
        magnitude = 1.0 - np.square(distance / self.look_m)
        aside = np.abs(turn_rad(self._bearings[:, None], np.arctan2(dy, dx)))
        # What is narrower than a sector fills the one that it lies in.
        primary = (magnitude * (aside <= np.maximum(half, 0.5 * WIDTH_RAD))).sum(axis=1)
        between = np.where(primary < FREE_BELOW, False, self._blocked)
        self._blocked = np.where(primary > BLOCKED_ABOVE, True, between)
        return self._blocked | self._outside(pose)

    def _outside(self, pose: Pose) -> BoolArray:
        """Which directions leave the area within two turn radii."""
        reach, bounds_m = 2.0 * self.mission.turn_radius_m, self.mission.bounds_m
        ends = pose[:2] + reach * np.column_stack((np.cos(self._bearings), np.sin(self._bearings)))
        return np.asarray(((ends < bounds_m[:2]) | (ends > bounds_m[2:])).any(axis=1))

    def _mask(self, pose: Pose, near: FloatArray, blocked: BoolArray) -> BoolArray:
        """Which sectors are blocked or lie behind an obstacle that a turn there would touch."""
        course = math.atan2(pose.tangent_north, pose.tangent_east)
        relative = turn_rad(self._bearings, course)
        masked = blocked.copy()
        for side in (1.0, -1.0):  # left, right
            radius = self.mission.turn_radius_m
            x = pose.east_m - side * radius * pose.tangent_north
            y = pose.north_m + side * radius * pose.tangent_east
            touching = np.hypot(near[:, 0] - x, near[:, 1] - y) < radius + self._keep_m
            bearing = side * turn_rad(np.arctan2(near[:, 1] - pose.north_m, near[:, 0] - pose.east_m), course)
            masked |= side * relative > bearing[touching & (bearing >= 0.0)].min(initial=math.pi)
        return masked

    def _best_direction(self, pose: Pose, masked: BoolArray) -> float | None:
        """The candidate direction with the least cost; None where all is blocked."""
        dx, dy = self.mission.goal_m[0] - pose.east_m, self.mission.goal_m[1] - pose.north_m
        goal, course = math.atan2(dy, dx), math.atan2(pose.tangent_north, pose.tangent_east)
        last = course if self.chosen is None else self.chosen

        def cost(bearing: float) -> float:
            terms = ((GOAL_WEIGHT, goal), (COURSE_WEIGHT, course), (CHOICE_WEIGHT, last))
            return float(sum(weight * abs(turn_rad(bearing, other)) for weight, other in terms))

        return min(self._candidates(masked, goal), key=cost, default=None)

    def _candidates(self, masked: BoolArray, goal: float) -> list[float]:
        """Step 4: the candidate directions (rad): middles of narrow openings, two in wide ones, and the goal's."""
        if not masked.any():
            return [goal]
        count, width = len(masked), WIDTH_RAD
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
