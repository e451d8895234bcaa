"""Edge points by squares of the plane, so that a question about a few of them does not go through all."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner.curves import Point
from planner.interface import ComplexArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Blocks:
    """Points, those of one square next to each other.

    Attributes:
        members: (m,) indices of the points.
        first: (c,) where each square begins in `members`.
        counts: (c,) how many points it has.
        beside: (p, 2) squares that touch each other, diagonally too; each pair once.
        center_m: (c,) middle of the box about the points of each square, east + i north.
        reach_m: (c,) half the diagonal of that box.
    """

    members: IntArray
    first: IntArray
    counts: IntArray
    beside: IntArray
    center_m: ComplexArray
    reach_m: FloatArray

    @staticmethod
    def of(points_m: FloatArray, side_m: float) -> Blocks:
        """The squares, of a side in metres, of (m, 2) points, at least one."""
        grid = np.floor(points_m / side_m).astype(np.int64)
        grid -= grid.min(axis=0) - 1
        width = int(grid[:, 1].max()) + 2
        keys = grid[:, 0] * width + grid[:, 1]
        members = np.argsort(keys, kind="stable")
        squares, first, counts = np.unique(keys[members], return_index=True, return_counts=True)
        wanted = squares[:, None] + np.array((1, width - 1, width, width + 1))
        place = np.minimum(np.searchsorted(squares, wanted), len(squares) - 1)
        one, which = (squares[place] == wanted).nonzero()
        ordered = points_m[members]
        low = np.minimum.reduceat(ordered, first, axis=0)
        high = np.maximum.reduceat(ordered, first, axis=0)
        return Blocks(
            members,
            first,
            counts,
            np.column_stack((one, place[one, which])),
            0.5 * (low[:, 0] + high[:, 0]) + 0.5j * (low[:, 1] + high[:, 1]),
            0.5 * np.hypot(*(high - low).T),
        )

    def near_lines(
        self,
        origin: Point,
        towards: ComplexArray,
        within_m: float,
        to_m: FloatArray | float = math.inf,
    ) -> tuple[IntArray, IntArray]:
        """Which points may lie near straight lines that begin at one place.

        Args:
            origin: where they begin.
            towards: (k,) unit vectors along them, east + i north.
            within_m: how near.
            to_m: points that a line comes near to only after so much of it do not count; one for all or (k,).

        Returns:
            Lines and points, (n,) each: all pairs that are as near, and some that are not.
        """
        away = self.center_m - complex(*origin)
        near = self.reach_m + within_m
        seen = np.multiply.outer(towards.conj(), away)
        ahead = seen.real
        wanted = (np.abs(seen.imag) < near) & (ahead > -near)
        if np.min(to_m, initial=math.inf) < math.inf:
            wanted &= ahead < np.reshape(to_m, (-1, 1)) + near
        line, square = wanted.nonzero()
        counts = self.counts[square]
        begins = np.cumsum(counts) - counts
        place = np.repeat(self.first[square] - begins, counts) + np.arange(int(counts.sum()))
        return np.repeat(line, counts), self.members[place]
