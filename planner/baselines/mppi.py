"""MPPI: model-predictive path integral control, the sampling planner that mobile robots fly today (Nav2 has one).

G. Williams, P. Drews, B. Goldfain, J. M. Rehg and E. A. Theodorou, "Information-theoretic model predictive control:
theory and applications to autonomous driving", IEEE Transactions on Robotics 34(6), 2018.

1. The nominal controls are a curvature for each step of the horizon, from the plan before, moved on by the time flown.
2. K sequences are drawn about them, the noise correlated from step to step, and rolled out from the start by the
   paper's model: an arc of one curvature a step, none tighter than the turn radius.
3. A rollout costs its way and what is left to the goal, a little for turns, and much for each place that is too near
   to an edge or outside.
4. The new nominal controls are the mean of the sequences with the weights exp(-cost / lambda), several times over.

The path is the rollout of the nominal controls. It is deterministic: the samples follow from the seed and their count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from planner.baselines.steering import Replanner, Start
from planner.geometry.clearance import first_breach, inside_bounds
from planner.geometry.curves import Pose, Segment, along
from planner.interface import FloatArray, Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.kernels.segments import to_nearest
from planner.keys import MarginConfig, key

STEP_RADII = 0.5  # length of a step in turn radii
NOISE_SHARE, CORRELATION = 0.6, 0.8
"""Sigma of the sampled curvature over the largest one, and its correlation from step to step."""
TOO_NEAR_COST, BLOCKED_COST = 3.0, 50.0
"""Cost, in steps, of a place within the margin and of one within the clearance or outside the area."""
TURN_COST = 0.05  # cost, in steps, of one at the turn radius; it falls with the square of the curvature
LAMBDA_STEPS = 0.3
"""Temperature lambda of the weights exp(-cost / lambda), in the unit of costs, which is a step."""
ROUNDS = 3
"""Each plan takes this many rounds of sampling and weighted mean, each with less noise than the one before."""
ROLLOUTS_DRAWN = 24  # most rollouts in the picture of a plan


@dataclass(frozen=True)
class MppiConfig(MarginConfig):
    """Keys of `planner.kind: mppi`."""

    samples: int = key(256, "K, sequences drawn in a round", minimum=8, maximum=10_000)
    steps: int = key(24, "steps of the horizon, half a turn radius each", minimum=4, maximum=200)
    seed: int = key(1, "the samples follow from it", minimum=0, maximum=2**31)


class Mppi(Replanner):
    """The planner for one flight."""

    def __init__(self, config: MppiConfig, mission: Mission) -> None:
        super().__init__(mission)
        self._config, self._keep_m = config, mission.clearance_m + config.margin(mission)
        self._step_m = STEP_RADII * mission.turn_radius_m
        self._most_1pm = 1.0 / mission.turn_radius_m
        self._random = np.random.default_rng(self._config.seed)
        self._nominal = np.zeros(self._config.steps)
        self._begins_m = 0.0

    def replanned(self, request: PlanRequest, start: Start) -> Plan:
        """A path by the mean of the sampled controls, optimised anew; a turn to hold in where it is blocked."""
        mission, pose = self.mission, start.pose
        lead_m = sum(row[5] for row in start.before)
        # Step 1: the nominal controls from a place on their rollout on; beyond it, straight.
        flown_m = request.arc_length_m + lead_m - self._begins_m if start.before else math.inf
        steps = np.arange(self._config.steps)
        at = steps + min(flown_m / self._step_m, self._config.steps)
        self._nominal, self._begins_m = np.interp(at, steps, self._nominal, right=0.0), lead_m
        rollouts = self._optimise(pose, self._nearby(pose))
        rows: list[Segment] = []
        for curvature in self._nominal.tolist():
            rows.append((*pose, curvature, self._step_m))
            pose = along(rows[-1], self._step_m)
        found = Path(np.array([*start.before, *rows]))
        breach_m = first_breach(Path(np.array(rows)), self.memory.points_m, 0.5 * mission.clearance_m)
        if math.isfinite(breach_m) or not inside_bounds(found, mission.bounds_m):
            self._nominal[:] = 0.0
            return self.holding_plan("the best rollout is blocked", request)
        here = request.position_m
        waypoints = np.array([here, *(row[:2] for row in rows), pose[:2]])
        drawn = tuple(np.array([here, *each]) for each in rollouts[:ROLLOUTS_DRAWN])
        picture = partial(PlanPicture, np.array([here, mission.goal_m]), candidates=drawn)
        return Plan(PlanStatus.FOUND, f"mean of {self._config.samples} rollouts", waypoints, found, picture)

    def _nearby(self, pose: Pose) -> FloatArray:
        """(m, 2) edge points that a rollout may meet, one for each square of half the clearance."""
        points = self.memory.points_m
        reach = self._step_m * self._config.steps + 2.0 * self.mission.clearance_m
        near = points[np.hypot(*(points - pose[:2]).T) < reach]
        squares = np.floor(near / (0.5 * max(self.mission.clearance_m, 1.0)))
        _, first = np.unique(squares, axis=0, return_index=True)
        return np.ascontiguousarray(near[np.sort(first)])

    def _optimise(self, pose: Pose, points_m: FloatArray) -> FloatArray:
        """Steps 2 to 4: moves the nominal controls; returns the rollouts of the last round, (K, steps, 2)."""
        count, steps = self._config.samples, self._config.steps
        for round_number in range(ROUNDS):
            drawn = self._random.normal(size=(count, steps))
            noise = drawn * NOISE_SHARE * self._most_1pm / (1 + round_number)
            for i in range(1, steps):
                noise[:, i] = CORRELATION * noise[:, i - 1] + math.sqrt(1.0 - CORRELATION**2) * noise[:, i]
            noise[0] = 0.0
            controls = np.clip(self._nominal + noise, -self._most_1pm, self._most_1pm)
            places = self.rollout(pose, controls)
            cost = self.costs(places, points_m) + TURN_COST * np.square(controls / self._most_1pm).sum(axis=1)
            weights = np.exp((cost.min() - cost) / LAMBDA_STEPS)
            self._nominal = weights @ controls / weights.sum()
        return places

    def rollout(self, pose: Pose, controls: FloatArray) -> FloatArray:
        """(K, steps, 2) places at the ends of the steps of (K, steps) curvatures; a step is an arc."""
        turn = controls * self._step_m
        course = math.atan2(pose.tangent_north, pose.tangent_east) + np.cumsum(turn, axis=1)
        chord = self._step_m * np.sinc(0.5 * turn / np.pi)
        middle = course - 0.5 * turn
        steps = np.stack((chord * np.cos(middle), chord * np.sin(middle)), axis=2)
        return np.asarray(np.cumsum(steps, axis=1) + pose[:2])

    def costs(self, places: FloatArray, points_m: FloatArray) -> FloatArray:
        """(K,) costs in steps: the least sum of way and distance left, and what is too near or outside before that."""
        mission, keep = self.mission, self._keep_m
        left = np.hypot(*np.moveaxis(places - mission.goal_m, 2, 0)) / self._step_m
        way = left + np.arange(1, places.shape[1] + 1)
        last = np.argmin(np.where(left < mission.goal_radius_m / self._step_m, way - 1e6, way), axis=1)
        last = np.where(left.min(axis=1) > 1.0, places.shape[1] - 1, last)
        room = to_nearest(np.ascontiguousarray(places.reshape(-1, 2)), points_m).reshape(places.shape[:2])
        outside = ((places < mission.bounds_m[:2]) | (places > mission.bounds_m[2:])).any(axis=2)
        # Between the ends of a step, half a step apart from them, the way comes nearer by no more than this.
        sagitta = keep - math.sqrt(max(keep * keep - 0.25 * self._step_m**2, 0.25 * keep * keep))
        penalty = np.where(room < keep + sagitta, TOO_NEAR_COST, 0.0)
        penalty[(room < mission.clearance_m) | outside] = BLOCKED_COST
        whole = np.take_along_axis(way, last[:, None], axis=1)[:, 0]
        return np.asarray(whole + (penalty * (np.arange(places.shape[1]) <= last[:, None])).sum(axis=1))
