"""The edge points of one obstacle by squares of the plane: what lies in one is looked at as one piece of wall."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.interface import FloatArray, IntArray


class Cells(NamedTuple):
    """Points, those of one square next to each other.

    Attributes:
        members: (m,) indices of the points.
        first: (c,) where each square begins in `members`.
        counts: (c,) how many points it has.
        one, other: (p,) squares that touch each other, diagonally too; each pair once.
    """

    members: IntArray
    first: IntArray
    counts: IntArray
    one: IntArray
    other: IntArray

    @staticmethod
    def of(points_m: FloatArray, members: IntArray, side_m: float) -> Cells:
        """The squares, of a side in metres, of some, (m,), of all (n, 2) points; at least of one."""
        grid = np.floor(points_m[members] / side_m).astype(np.int64)
        grid -= grid.min(axis=0) - 1
        width = int(grid[:, 1].max()) + 2
        keys = grid[:, 0] * width + grid[:, 1]
        order = np.argsort(keys, kind="stable")
        squares, first, counts = np.unique(keys[order], return_index=True, return_counts=True)
        wanted = squares[:, None] + np.array((1, width - 1, width, width + 1))
        place = np.minimum(np.searchsorted(squares, wanted), len(squares) - 1)
        one, which = map(np.ascontiguousarray, (squares[place] == wanted).nonzero())
        return Cells(members[order], first, counts, one, place[one, which])
