"""Which obstacle each edge point belongs to: connected components on a grid, made when they are asked for."""

from __future__ import annotations

import math

import numpy as np

from planner.interface import FloatArray, IntArray


class ObstacleLabels:
    """Labels of edge points that come in by batches: one label for all that are joined by neighbouring cells.

    A batch is gathered when labels are next asked for, so that points that are cleared before cost nothing. The labels
    are those that each batch had been given as it came in.

    Args:
        cell_m: side of the cells. Cells that touch, diagonally too, hold one obstacle.
    """

    def __init__(self, cell_m: float) -> None:
        self._cell_m = cell_m
        self._labels = np.zeros(0, dtype=np.intp)
        self._gathered = 0
        self._of_cell: dict[tuple[int, int], int] = {}
        self._next = 0
        self._ends: list[int] = []

    def add(self, total: int) -> None:
        """Notes a batch that brings the number of points to a total."""
        self._ends.append(total)

    def of(self, points_m: FloatArray) -> IntArray:
        """(m,) the obstacle that each of (m, 2) points belongs to; all points noted so far, in order."""
        if len(self._labels) < len(points_m):
            labels = np.zeros(len(points_m) if not self._gathered else 2 * len(points_m), dtype=np.intp)
            labels[: self._gathered] = self._labels[: self._gathered]
            self._labels = labels
        for end in self._ends:
            self._gather(points_m, end)
        self._ends.clear()
        return self._labels[: len(points_m)]

    def _gather(self, points_m: FloatArray, end: int) -> None:
        """Gathers the points up to one into obstacles, with those before it."""
        begin, self._gathered = self._gathered, end
        fresh = points_m[begin:end]
        if begin == 0:
            cells, which = _cells_of(fresh, self._cell_m)
            labels = _components(cells)
            self._of_cell = dict(zip(map(tuple, cells.tolist()), labels.tolist(), strict=True))
            self._next = len(cells)
            self._labels[:end] = labels[which]
            return
        side = self._cell_m
        cells_of = [(math.floor(east / side), math.floor(north / side)) for east, north in fresh.tolist()]
        joined: list[tuple[int, int]] = []
        for cell in dict.fromkeys(cells_of):
            if cell not in self._of_cell:
                self._join(cell, joined, points_m[:begin])
                joined.append(cell)
        self._labels[begin:end] = [self._of_cell[cell] for cell in cells_of]

    def _join(self, cell: tuple[int, int], joined: list[tuple[int, int]], before_m: FloatArray) -> None:
        """Gives a new cell the label of its neighbours, which become one obstacle if they were several."""
        x, y = cell
        around = ((x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j)
        found = {self._of_cell[near] for near in around if near in self._of_cell}
        label = min(found) if found else self._next
        self._next += not found
        self._of_cell[cell] = label
        for other in found - {label}:
            mine = self._labels[: len(before_m)] == other
            cells, _ = _cells_of(before_m[mine], self._cell_m)
            of_new = (each for each in joined if self._of_cell[each] == other)
            self._of_cell |= dict.fromkeys([*map(tuple, cells.tolist()), *of_new], label)
            self._labels[: len(before_m)][mine] = label


def _cells_of(points_m: FloatArray, cell_m: float) -> tuple[IntArray, IntArray]:
    """(k, 2) cells of (m, 2) points, each once, in order of columns and rows; (m,) which of them each point lies in."""
    at = np.floor(points_m / cell_m).astype(np.int64)
    if not len(at):
        return at, np.zeros(0, dtype=np.intp)
    low = at.min(axis=0)
    rows = int(np.ptp(at[:, 1])) + 1
    keys, which = np.unique((at - low) @ (rows, 1), return_inverse=True)
    return np.column_stack(np.divmod(keys, rows)) + low, which


def _components(cells: IntArray) -> IntArray:
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
