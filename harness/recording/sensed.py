"""What the sensor has shown of the true obstacles so far, for the recording: which are in view, which parts of them.

A drawing aid with the truth at hand; nothing here reaches the planner. Frame: local ENU plane, metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from harness.flight.record import FloatArray, IntArray
    from harness.mapping.scan import RangeScan
    from harness.world.obstacle import Obstacle

NEAR_CELLS = 2.0
"""A return further than this many cells from every edge shows no obstacle: it is a false one."""


@dataclass(frozen=True, eq=False)
class NewEdges:
    """What some scans have shown for the first time.

    Attributes:
        points_m: (k, 2) places on the edges of standing obstacles, no two in one cell.
        scans: (k,) index of the scan that showed each, ascending.
        first: index of an obstacle -> index of the scan that showed it first, and how far away.
    """

    points_m: FloatArray
    scans: np.ndarray[tuple[int], np.dtype[np.intp]]
    first: dict[int, tuple[int, float]]


class Sensed:
    """Gathers what has been sensed, in cells of a square grid.

    Args:
        obstacles: the true ones.
        cell_m: side of a cell.
    """

    def __init__(self, obstacles: Sequence[Obstacle], cell_m: float) -> None:
        self._obstacles, self._cell_m = obstacles, cell_m
        self._stands = np.array([each.stands_for_ever for each in obstacles], dtype=bool)
        self._boxes = np.array([each.shape.rounded_box for each in obstacles]).reshape(-1, 5).T.copy()
        self._known = np.zeros(0, dtype=np.int64)
        self._seen: set[int] = set()

    def take(self, scans: Sequence[RangeScan], points: Sequence[FloatArray]) -> NewEdges:
        """Takes consecutive scans and what they returned (`returns_m`); tells what none before them had shown."""
        scan = np.repeat(np.arange(len(points)), [len(each) for each in points])
        where = np.concatenate([np.zeros((0, 2)), *points])
        cells = np.round(where / self._cell_m).astype(np.int64) @ (1 << 32, 1)
        new = np.sort(np.unique(cells, return_index=True)[1])
        new = new[~np.isin(cells[new], self._known)]
        if not len(self._obstacles) or not len(new):
            return NewEdges(np.zeros((0, 2)), np.zeros(0, dtype=np.intp), {})
        times = np.array([each.time_s for each in scans])[scan[new]]
        nearest, off_m = self._nearest(where[new], times)
        near = off_m <= NEAR_CELLS * self._cell_m
        kept = new[near & self._stands[nearest]]
        self._known = np.append(self._known, cells[kept])
        first: dict[int, tuple[int, float]] = {}
        for row, index in zip(new[near], nearest[near].tolist(), strict=True):
            if index not in self._seen:
                self._seen.add(index)
                seen_by = scans[scan[row]]
                away_m = np.hypot(*(where[row] - (seen_by.east_m, seen_by.north_m)))
                first[index] = int(scan[row]), float(away_m)
        return NewEdges(where[kept], scan[kept], first)

    def _nearest(self, places: FloatArray, times_s: FloatArray) -> tuple[IntArray, FloatArray]:
        """(k,) obstacles whose edges are nearest to places, and how far; only of those near the box of all places."""
        low, high = places.min(axis=0), places.max(axis=0)
        beside, above = np.abs(self._boxes[:2] - ((low + high) / 2)[:, None]) - self._boxes[2:4]
        width, height = (high - low) / 2 + NEAR_CELLS * self._cell_m
        inside = (beside - self._boxes[4] <= width) & (above - self._boxes[4] <= height)
        nearest, off_m = np.zeros(len(places), dtype=np.intp), np.full(len(places), math.inf)
        for index in np.flatnonzero(inside | ~self._stands).tolist():
            off = np.abs(self._obstacles[index].distance(places, times_s))
            nearer = off < off_m
            nearest[nearer], off_m[nearer] = index, off[nearer]
        return nearest, off_m


def returns_m(scan: RangeScan) -> FloatArray:
    """(k, 2) places from which something came back."""
    if scan.nearest_m == math.inf:
        return np.zeros((0, 2))
    return scan.returned()[1].view(np.float64).reshape(-1, 2)
