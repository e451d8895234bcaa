"""Straight-line motion and presence of many obstacles or faces at once, and distances from their boxes to a place.

Frame: local ENU plane, x = east, y = north, metres; times are simulated seconds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from harness.world.obstacle import Obstacle
from planner.interface import BoolArray, FloatArray


class LinearMotions:
    """Straight-line motion and presence of n obstacles or faces, one column each.

    Args:
        rows: (5, n): velocity east, velocity north, epoch, first and last time of presence.
    """

    def __init__(self, rows: FloatArray) -> None:
        self._rows = rows
        self.speeds_mps: FloatArray = np.hypot(rows[0], rows[1])
        self.matter = bool(self.speeds_mps.any() or np.isfinite(rows[3:]).any())

    @classmethod
    def of(cls, obstacles: Iterable[Obstacle]) -> LinearMotions:
        """Collects the motions of obstacles."""
        rows = [(*o.velocity_mps, o.epoch_s, *o.interval_s) for o in obstacles]
        return cls(np.array(rows, dtype=np.float64).reshape(-1, 5).T.copy())

    def shifts(self, time_s: float) -> FloatArray:
        """(2, n) displacement since the epoch."""
        return np.asarray(self._rows[:2] * (time_s - self._rows[2]))

    def present(self, start_s: float, stop_s: float) -> BoolArray:
        """(n,) whether each is there at some time of an interval."""
        return np.asarray((self._rows[3] <= stop_s) & (start_s <= self._rows[4]))

    def gaps(self, boxes: FloatArray, east: float, north: float, time_s: float) -> FloatArray:
        """(n,) lower bounds of the distances to each, there or not, by their rounded boxes (5, n) at the epoch."""
        if self.matter:
            boxes = np.vstack((boxes[:2] + self.shifts(time_s), boxes[2:]))
        return gaps_to(boxes, east, north)

    def next_start(self, time_s: float) -> float:
        """First time after `time_s` at which something appears, else +inf."""
        starts = self._rows[3]
        return float(starts[starts > time_s].min(initial=math.inf))

    def changes(self, start_s: float, stop_s: float) -> list[float]:
        """Times within an interval at which something appears or goes, in order."""
        times = self._rows[3:]
        within: list[float] = np.unique(times[(start_s < times) & (times < stop_s)]).tolist()
        return within


def gaps_to(boxes: FloatArray, east: float | FloatArray, north: float | FloatArray) -> FloatArray:
    """(n,) signed distances from a point to rounded boxes (5, n); (n, k) from k points to (5, n, 1).

    A shape inside a box is never nearer than the box (formula: Quilez, "2D distance functions").
    """
    beside = np.abs(boxes[0] - east) - boxes[2]
    above = np.abs(boxes[1] - north) - boxes[3]
    outside = np.sqrt(np.maximum(beside, 0.0) ** 2 + np.maximum(above, 0.0) ** 2)
    return np.asarray(outside + np.minimum(np.maximum(beside, above), 0.0) - boxes[4])
