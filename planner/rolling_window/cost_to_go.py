"""Cost to go: the distance to the goal from every place, round everything known. It guides a wide search.

A wave that spreads from the goal through a grid (a navigation function, as in Barraquand, Langlois and Latombe, 1992).
A cell is closed only where no place in it keeps the distance wanted: every way that there is leads through open
cells that touch each other. Where the wave does not get to, there is no way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from planner.geometry.curves import Point
from planner.geometry.terrain import WorkCount
from planner.interface import FloatArray
from planner.kernels.wave import close_cells, spread_wave

KEEP_CELLS, LEAST_KEEP_M = 5.0, 1.0
"""Number of cells in the distance kept from edge points, which counts as at least `LEAST_KEEP_M`."""

MOST_CELLS = 250_000
"""Most cells of a grid; a larger one is made coarser. It then closes fewer cells, but no open one."""

PAIRS_AT_ONCE = 20_000
"""Pairs of an edge point and a cell, or cells that the wave comes to, in one step of work."""

CLOSED_WORK, REACHED_WORK = 0.002, 0.012
"""Counted work (about 1 us a unit) of a pair of an edge point and a cell near it, and of a cell of the wave."""


class CostToGo:
    """Distances to the goal on a grid."""

    def __init__(
        self,
        start: Point,
        goal: Point,
        bounds_m: tuple[float, float, float, float],
        points_m: FloatArray,
        keep_m: FloatArray,
        work_count: WorkCount,
    ) -> None:
        self._goal, self._points, self._keep, self._work_count = goal, points_m, keep_m, work_count
        # Beyond all that is known, and a way round it, nothing is nearer to anything.
        most = max(float(keep_m.max(initial=0.0)), LEAST_KEEP_M)
        places = np.vstack((points_m, start, goal))
        low = np.maximum(places.min(axis=0) - 2.0 * most, np.minimum(bounds_m[:2], places.min(axis=0)))
        high = np.minimum(places.max(axis=0) + 2.0 * most, np.maximum(bounds_m[2:], places.max(axis=0)))
        self._cell = max(most / KEEP_CELLS, math.sqrt(float(np.prod(high - low)) / MOST_CELLS))
        self._low = low
        self._columns, self._rows = (int(each) + 3 for each in (high - low) / self._cell)
        self._levels = np.full(self._columns * self._rows, math.inf)

    def __call__(self, place: Point) -> float:
        """Distance to the goal, m, at least the straight line; that outside of the grid; infinite: there is no way."""
        column = math.floor((place[0] - self._low[0]) / self._cell) + 1
        row = math.floor((place[1] - self._low[1]) / self._cell) + 1
        if not (0 < column < self._columns - 1 and 0 < row < self._rows - 1):
            return math.dist(place, self._goal)
        return max(self._cell * float(self._levels[column * self._rows + row]), math.dist(place, self._goal))

    def spread(self) -> Iterator[None]:
        """Finds the distances; None after each step of work."""
        grid = np.zeros((self._columns, self._rows), dtype=np.bool_)
        grid[1:-1, 1:-1] = True
        open_ = grid.ravel()
        width = 2 * int(float(self._keep.max(initial=0.0)) / self._cell) + 3
        some = max(PAIRS_AT_ONCE // width**2, 1)
        corner: Point = tuple(self._low.tolist())
        for i in range(0, len(self._points), some):
            points, keep = self._points[i : i + some], self._keep[i : i + some]
            close_cells(open_, points, keep, corner, self._cell, self._columns, self._rows)
            self._work_count.add(1, CLOSED_WORK, len(points) * width**2)
            yield
        column, row = (int(each) + 1 for each in (self._goal - self._low) / self._cell)
        goal = column * self._rows + row
        order = np.zeros(len(open_), dtype=np.intp)
        order[0], open_[goal], self._levels[goal] = goal, False, 0.0
        state = np.array((0, 0, 0, 1))
        while state[1] < state[3]:
            before = int(state[3])
            spread_wave(self._levels, open_, order, state, self._rows, PAIRS_AT_ONCE)
            self._work_count.add(1, REACHED_WORK, int(state[3]) - before)
            yield
