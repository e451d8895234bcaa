"""How far it is to the goal from every place, round all that is known: guides a wide search and tells it when to end.

A wave that spreads from the goal through a grid (a navigation function, as in Barraquand, Langlois and Latombe, 1992).
A cell is closed only where no place in it keeps the distance wanted: every way that there is leads through open
cells that touch each other. Where the wave does not get to, there is no way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from planner.curves import Point
from planner.interface import FloatArray, IntArray
from planner.window import Tally

CELLS = 5.0
"""Cells along the distance that is kept."""

MOST_CELLS = 250_000
"""A grid of more is made coarser: it then closes less, but nothing that is open."""

LEAST_M = 1.0
"""Where less is kept, as where start or goal lie at an edge, the grid is made for this."""

EIGHT = (2, 4)
"""Of five levels of the wave these go on to all 8 neighbours of a cell, the others to 4: what is counted is between the
length of a way and 0.92 of it, so that what looks shortest on the grid seldom is not."""

AT_ONCE = 20_000
"""So many pairs of a point and a cell are looked at in one step of work."""

PAIR, LEVEL, CELL = 0.015, 8.0, 0.04
"""Work of a pair of a point and a cell near it, of a level of the wave, and of each cell in it."""


class CostToGo:
    """Distances to the goal on a grid.

    Args:
        start: where ways begin; it and the goal lie in cells that are open.
        goal: where they end.
        bounds_m: xmin, ymin, xmax, ymax of the area, which is never left.
        points_m: (m, 2) edge points.
        keep_m: (m,) distance to be kept from each.
        tally: work is counted here.
    """

    def __init__(
        self,
        start: Point,
        goal: Point,
        bounds_m: tuple[float, float, float, float],
        points_m: FloatArray,
        keep_m: FloatArray,
        tally: Tally,
    ) -> None:
        self._goal, self._points, self._keep, self._tally = goal, points_m, keep_m, tally
        # Beyond all that is known, and a way round it, nothing is nearer to anything.
        most = max(float(keep_m.max()), LEAST_M)
        places = np.vstack((points_m, start, goal))
        low = np.maximum(places.min(axis=0) - 2.0 * most, np.minimum(bounds_m[:2], places.min(axis=0)))
        high = np.minimum(places.max(axis=0) + 2.0 * most, np.maximum(bounds_m[2:], places.max(axis=0)))
        self._cell = max(most / CELLS, math.sqrt(float(np.prod(high - low)) / MOST_CELLS))
        self._low = low
        self._columns, self._rows = (int(each) + 3 for each in (high - low) / self._cell)
        self._levels = np.full(self._columns * self._rows, math.inf)

    def __call__(self, place: Point) -> float:
        """Distance to the goal, m; infinite where there is no way."""
        column = int((place[0] - self._low[0]) / self._cell) + 1
        row = int((place[1] - self._low[1]) / self._cell) + 1
        if not (0 < column < self._columns - 1 and 0 < row < self._rows - 1):
            return math.dist(place, self._goal)
        levels = float(self._levels[column * self._rows + row])
        return max(self._cell * levels, math.dist(place, self._goal))

    def spread(self) -> Iterator[None]:
        """Finds the distances; None after each step of work."""
        grid = np.zeros((self._columns, self._rows), dtype=np.bool_)
        grid[1:-1, 1:-1] = True
        open_ = grid.ravel()
        for some in self._portions():
            open_[self._closed_by(some)] = False
            yield
        rows = self._rows
        beside = np.array((rows, -rows, 1, -1))
        around = np.concatenate((beside, (rows + 1, rows - 1, 1 - rows, -rows - 1)))
        level, front, fronts = 0, np.array([self._index(self._goal)]), list[IntArray]()
        open_[front] = False
        self._levels[front] = 0.0
        order = np.zeros(len(open_), dtype=np.intp)
        while len(front) or fronts:
            level += 1
            if len(front):
                fronts.append(front)
            corners = level % 5 in EIGHT
            # What touches only at a corner is come to later, from all that was new since the last time.
            old = np.concatenate(fronts) if corners else front
            found = np.add.outer(old, around if corners else beside).ravel()
            found = found[open_[found]]
            order[found] = np.arange(len(found))
            front = found[order[found] == np.arange(len(found))]
            open_[front] = False
            self._levels[front] = level
            self._tally.add(0, LEVEL, 1)
            self._tally.add(0, CELL, len(old))
            if corners:
                fronts = []
            yield

    def _index(self, place: Point) -> int:
        column = int((place[0] - self._low[0]) / self._cell) + 1
        return column * self._rows + int((place[1] - self._low[1]) / self._cell) + 1

    def _portions(self) -> Iterator[slice]:
        reach = int(float(self._keep.max()) / self._cell) + 1
        some = max(AT_ONCE // (2 * reach + 1) ** 2, 1)
        return (slice(i, i + some) for i in range(0, len(self._points), some))

    def _closed_by(self, some: slice) -> IntArray:
        """Cells that lie as a whole within what is to be kept from one of some points."""
        points, keep = self._points[some], self._keep[some] - math.sqrt(0.5) * self._cell
        reach = int(float(self._keep.max()) / self._cell) + 1
        offsets = np.arange(-reach, reach + 1)
        self._tally.add(1, PAIR, len(points) * len(offsets) ** 2)
        at = np.floor((points - self._low) / self._cell).astype(np.intp)
        column, row = (at[:, axis, None] + offsets for axis in (0, 1))
        east, north = (
            (cells + 0.5) * self._cell + self._low[axis] - points[:, axis, None]
            for axis, cells in enumerate((column, row))
        )
        near = east[:, :, None] ** 2 + north[:, None, :] ** 2 < (np.maximum(keep, 0.0) ** 2)[:, None, None]
        which, i, j = near.nonzero()
        column, row = column[which, i] + 1, row[which, j] + 1
        inside = (column > 0) & (column < self._columns) & (row > 0) & (row < self._rows)
        closed: IntArray = column[inside] * self._rows + row[inside]
        return closed
