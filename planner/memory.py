"""What a planner remembers of the flight so far: edge points, gathered into obstacles."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from planner.interface import FloatArray, IntArray, MapView

FIRST_MOVING = -1000
"""Label of the first obstacle that moves; the next ones have the numbers below it."""
MOVED = 0.3
"""An outline that has moved less than this share of a cell is left where it was."""
NOTHING = np.zeros((0, 2))


class ObstacleMemory:
    """Every edge point seen so far and the obstacle that it belongs to.

    Points nearer to each other than twice the clearance leave no way between them: they are one obstacle. They are
    gathered on a grid whose neighbouring cells (diagonals too) are always that near, as they come in. Each attribute is
    a column of the points, which grow by doubling, or an index of the cells: hence so many.

    Args:
        clearance_m: distance to be kept from every point.
    """

    def __init__(self, clearance_m: float) -> None:
        self.cell_m = clearance_m / math.sqrt(2.0)
        self.cleared = 0
        """How many edge points have been cleared so far; the others have moved up in their order by no more."""
        self.ever_cleared = False
        """Whether an edge point that had been seen was cleared again: the sensor errs, or something has gone."""
        self._outlines: Sequence[FloatArray] = ()
        self._revision = -1
        self._forget()

    def _forget(self) -> None:
        self._points = np.zeros((256, 2))
        self._labels = np.zeros(256, dtype=np.intp)
        self._genuine = np.zeros(256, dtype=np.bool_)
        self._count = 0
        self._with_moving: tuple[FloatArray, IntArray] | None = None
        self._of_cell: dict[tuple[int, int], int] = {}
        self._next = 0

    @property
    def known(self) -> int:
        """How many of the points stand still: the first ones, in the order in which they came in."""
        return self._count

    @property
    def points_m(self) -> FloatArray:
        """(m, 2) edge points, those of what moves last; what comes in later does not change what was given."""
        return self._all()[0]

    @property
    def labels(self) -> IntArray:
        """(m,) the obstacle that each point belongs to."""
        return self._all()[1]

    @property
    def standing_m(self) -> FloatArray:
        """(`known`, 2) the points of what stands still."""
        return self.points_m[: self.known]

    @property
    def met_m(self) -> FloatArray:
        """(k, 2) the others: what moves, where it is met."""
        return self.points_m[self.known :]

    @property
    def genuine_m(self) -> FloatArray:
        """(k, 2) those points that were seen to stand still, not refused."""
        return self._points[: self._count][self._genuine[: self._count]]

    @property
    def refused_m(self) -> FloatArray:
        """(k, 2) those points that were refused."""
        return self._points[: self._count][~self._genuine[: self._count]]

    def refuse(self, place: tuple[float, float]) -> None:
        """Remembers a place as if there were an edge: it is not to be gone to again."""
        self._add(np.array([place]), genuine=False)

    def forgive(self) -> None:
        """Forgets what was refused."""
        if not self._genuine[: self._count].all():
            self._keep_only(self.genuine_m, NOTHING)

    def take_in(self, seen: MapView, met: Sequence[FloatArray] | None = None) -> FloatArray:
        """Remembers what has come in since the last call, and returns it: (k, 2). Lets go of what was taken back.

        Args:
            seen: what has been seen so far.
            met: for each obstacle that moves, (k, 2) where its edge is to be thought of; default: where it is.
        """
        fresh = NOTHING if seen.revision == self._revision else self._take_in(seen)
        outlines = [each.points_m for each in seen.moving] if met is None else met
        if not (outlines or self._outlines) or self._alike(outlines):
            return fresh
        self._outlines, self._with_moving = tuple(outlines), None
        return np.concatenate((fresh, *outlines))

    def _alike(self, outlines: Sequence[FloatArray]) -> bool:
        """Whether what moves is where it was, but for a little."""
        if len(outlines) != len(self._outlines):
            return False
        corners = [
            np.abs(edge(new, axis=0) - edge(old, axis=0)).max()
            for new, old in zip(outlines, self._outlines, strict=True)
            for edge in (np.min, np.max)
        ]
        return bool(max(corners) < MOVED * self.cell_m)

    def _all(self) -> tuple[FloatArray, IntArray]:
        """Points and labels, those of what moves after all others: an obstacle each."""
        points, labels = self._points[: self._count], self._labels[: self._count]
        if not self._outlines:
            return points, labels
        if self._with_moving is None:
            numbers = [np.full(len(outline), FIRST_MOVING - i) for i, outline in enumerate(self._outlines)]
            self._with_moving = (
                np.concatenate((points, *self._outlines)),
                np.concatenate((labels, *numbers)),
            )
        return self._with_moving

    def _take_in(self, seen: MapView) -> FloatArray:
        fresh = seen.edges_since(self._revision)
        if seen.last_removal_revision > self._revision >= 0:
            self.ever_cleared, known = True, seen.edges_since(-1)
            self._keep_only(known[: len(known) - len(fresh)], self.refused_m)
        self._revision = seen.revision
        if len(fresh):
            self._add(fresh, genuine=True)
        return fresh

    def _keep_only(self, genuine_m: FloatArray, refused_m: FloatArray) -> None:
        """Gathers what is left into obstacles anew; what was refused comes first, so that nothing else moves up."""
        self.cleared += self._count - len(genuine_m) - len(refused_m)
        self._forget()
        for points, genuine in ((refused_m, False), (genuine_m, True)):
            if len(points):
                self._add(points, genuine)

    def _add(self, fresh: FloatArray, genuine: bool) -> None:
        total = self._count + len(fresh)
        self._with_moving = None
        self._grow(total)
        new = slice(self._count, total)
        self._points[new] = fresh
        self._genuine[new] = genuine
        self._count = total
        if new.start == 0:
            cells, which = _cells_of(fresh, self.cell_m)
            labels = _gathered(cells)
            self._of_cell = dict(zip(map(tuple, cells.tolist()), labels.tolist(), strict=True))
            self._next = len(cells)
            self._labels[new] = labels[which]
            return
        side = self.cell_m
        cells_of = [(math.floor(east / side), math.floor(north / side)) for east, north in fresh.tolist()]
        joined: list[tuple[int, int]] = []
        for cell in dict.fromkeys(cells_of):
            if cell not in self._of_cell:
                self._join(cell, joined, new.start)
                joined.append(cell)
        self._labels[new] = [self._of_cell[cell] for cell in cells_of]

    def _grow(self, total: int) -> None:
        if total > len(self._points):
            size = max(2 * len(self._points), total)
            self._points = np.resize(self._points, (size, 2))
            self._labels = np.resize(self._labels, size)
            self._genuine = np.resize(self._genuine, size)

    def _join(self, cell: tuple[int, int], joined: list[tuple[int, int]], count: int) -> None:
        """Gives a new cell the label of its neighbours, which become one obstacle if they were several.

        Args:
            cell: the cell.
            joined: the other new cells that have a label already.
            count: so many points have a label already.
        """
        x, y = cell
        around = ((x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j)
        found = {self._of_cell[near] for near in around if near in self._of_cell}
        label = min(found) if found else self._next
        self._next += not found
        self._of_cell[cell] = label
        for other in found - {label}:
            mine = self._labels[:count] == other
            cells, _ = _cells_of(self._points[:count][mine], self.cell_m)
            of_new = (each for each in joined if self._of_cell[each] == other)
            self._of_cell |= dict.fromkeys([*map(tuple, cells.tolist()), *of_new], label)
            self._labels[:count][mine] = label


def _cells_of(points_m: FloatArray, cell_m: float) -> tuple[IntArray, IntArray]:
    """(k, 2) cells of (m, 2) points, each once, in order of columns and rows; (m,) which of them each point lies in."""
    at = np.floor(points_m / cell_m).astype(np.int64)
    if not len(at):
        return at, np.zeros(0, dtype=np.intp)
    low = at.min(axis=0)
    rows = int(np.ptp(at[:, 1])) + 1
    keys, which = np.unique((at - low) @ (rows, 1), return_inverse=True)
    return np.column_stack(np.divmod(keys, rows)) + low, which


def _gathered(cells: IntArray) -> IntArray:
    """(k,) labels of (k, 2) cells, in order of columns and rows: one for all that are joined by neighbours."""
    labels = np.arange(len(cells))
    base = cells.min(axis=0) - 1
    width = int(np.ptp(cells[:, 1])) + 3
    keys = (cells - base) @ (width, 1)
    pairs: list[tuple[IntArray, IntArray]] = []
    for step in (1, width - 1, width, width + 1):
        beside = np.searchsorted(keys, keys + step)
        found = (beside < len(keys)) & (keys.take(beside, mode="clip") == keys + step)
        pairs.append((found.nonzero()[0], beside[found]))
    a, b = (np.concatenate(each) for each in zip(*pairs, strict=True))
    while True:
        least = np.minimum(labels[a], labels[b])
        if (least == labels[a]).all() and (least == labels[b]).all():
            return labels
        np.minimum.at(labels, labels[a], least)
        np.minimum.at(labels, labels[b], least)
        labels = labels[labels]
