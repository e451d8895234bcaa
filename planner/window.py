"""The rolling window: what lies in it, the guide vector, and the fan-shaped sectors that obstacles cut.

Definition 1 of the paper is the sensing range U, Definition 2 the guide vector alpha; section 3.3 has the
planning window U_1 of radius r_1 <= r. Seen from a track point, an obstacle, grown by the distance to be kept
from it, fills a fan of bearings. M and N are where its fan ends on the left and on the right: directions
tangent to the obstacle. Between the fans lie the free sectors. Fans that overlap are merged, and an edge that
something nearer hides is none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.blocks import Blocks
from planner.curves import Point
from planner.interface import FloatArray
from planner.memory import IntArray

EDGE_OFF_RAD = 1e-7
"""Edges are turned this much into the free sector, clear of rounding errors."""

MOST_HIDING = 12
"""So many obstacles at most are looked at for the edges of one."""

BLOCK_CELLS = 4
"""Side of the blocks in which points near a line are looked for, in cells."""


def guide_vector(position: Point, goal: Point) -> tuple[float, float, float]:
    """Definition 2: unit vector from the position to the goal, and its length in metres."""
    dx, dy = goal[0] - position[0], goal[1] - position[1]
    length = math.hypot(dx, dy)
    return (dx / length, dy / length, length) if length else (1.0, 0.0, 0.0)


class SectorEdge(NamedTuple):
    """The edge of a free sector at a track point: M (the obstacle is on its right) or N (on its left).

    Attributes:
        ux, uy: unit vector along the edge, tangent to the obstacle.
        touch_m: distance at which it touches the obstacle.
        clear_m: distance up to which the direction is free; infinite where nothing is met.
        obstacle: label of the obstacle.
        side: 1 for M, -1 for N.
    """

    ux: float
    uy: float
    touch_m: float
    clear_m: float
    obstacle: int
    side: float


class _Cells(NamedTuple):
    """The points of one obstacle, cell by cell.

    Attributes:
        members: (k,) indices of the points, those of a cell next to each other.
        first: (c,) where each cell begins in `members`.
        counts: (c,) how many points it has.
        one, other: (p,) cells that touch each other.
        keep_m: (k,) distance to be kept from each point.
    """

    members: IntArray
    first: IntArray
    counts: IntArray
    one: IntArray
    other: IntArray
    keep_m: FloatArray


@dataclass(frozen=True, eq=False)
class Window:
    """The planning window U_1 and the obstacles that are known in it.

    Attributes:
        center_m: the present track point w_k.
        radius_m: r_1.
        points_m: (m, 2) sensed edge points.
        labels: (m,) the obstacle that each belongs to.
        cell_m: points within a square of this side are looked at as one piece of wall.
        keep_m: (m,) distance to be kept from each point.
    """

    center_m: Point
    radius_m: float
    points_m: FloatArray
    labels: IntArray
    cell_m: float
    keep_m: FloatArray
    _cells: dict[int, _Cells] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _most_kept_m(self) -> float:
        return float(self.keep_m.max())

    @cached_property
    def _blocks(self) -> Blocks:
        return Blocks.of(self.points_m, BLOCK_CELLS * self.cell_m)

    def _obstacle(self, label: int) -> _Cells:
        """The points of an obstacle, gathered once."""
        if label not in self._cells:
            members = np.flatnonzero(self.labels == label)
            cells = Blocks.of(self.points_m[members], self.cell_m)
            members, (one, other) = members[cells.members], cells.beside.T
            self._cells[label] = _Cells(members, cells.first, cells.counts, one, other, self.keep_m[members])
        return self._cells[label]

    def sector_edges(self, origin: Point, beside: Iterable[int]) -> list[SectorEdge]:
        """The edges M and N of the free sectors beside some obstacles, as seen from a track point.

        Where something hides an edge, or closes it right behind the place where it touches, the edges of that are
        taken as well.
        """
        edges: list[SectorEdge] = []
        pending = list(dict.fromkeys(beside))
        looked_at = set(pending)
        dx, dy = self.points_m[:, 0] - origin[0], self.points_m[:, 1] - origin[1]
        while pending:
            obstacle = pending.pop()
            ux, uy, touch, sides = self._tangents(dx, dy, obstacle)
            if not len(ux):
                continue
            clear, met = self._clear_past(origin, ux, uy, touch)
            rows = np.column_stack((ux, uy, touch, clear)).tolist()
            for (*row, clear_to), side, met_by in zip(rows, sides, met.tolist(), strict=True):
                if clear_to >= row[2]:
                    edges.append(SectorEdge(row[0], row[1], row[2], clear_to, obstacle, side))
                if clear_to < row[2] + self.keep_m[met_by]:
                    # Hidden, or closed right behind: the way goes round what hides it.
                    other = int(self.labels[met_by])
                    if other not in looked_at and len(looked_at) < MOST_HIDING:
                        looked_at.add(other)
                        pending.append(other)
        return edges

    def hugged_m(self, origin: Point, edge: SectorEdge, outer_m: float) -> float:
        """How far along an edge an outer distance from the obstacle that it touches is reached again."""
        _, point = self._blocks.near_lines(origin, np.array([edge.ux]), np.array([edge.uy]), outer_m)
        points = self.points_m[point[self.labels[point] == edge.obstacle]]
        dx, dy = points[:, 0] - origin[0], points[:, 1] - origin[1]
        ahead = dx * edge.ux + dy * edge.uy
        beside = dx * edge.uy - dy * edge.ux
        reach = outer_m * outer_m - beside * beside
        near = (reach > 0.0) & (ahead > -outer_m)
        ahead, reach = ahead[near], np.sqrt(reach[near])
        order = np.argsort(ahead - reach)
        begin, end = (ahead - reach)[order], np.maximum.accumulate((ahead + reach)[order])
        gap = np.flatnonzero((begin[1:] > end[:-1]) & (end[:-1] > edge.touch_m))
        return float(end[gap[0]] if len(gap) else end[-1])

    def _tangents(
        self, dx: FloatArray, dy: FloatArray, label: int
    ) -> tuple[FloatArray, FloatArray, FloatArray, list[float]]:
        """Unit vectors tangent to the ends of an obstacle's fan, where they touch it, and which ends they are."""
        cells = self._obstacle(label)
        x, y = dx[cells.members], dy[cells.members]
        square = x * x + y * y
        keep = cells.keep_m
        half = np.arcsin(np.minimum(keep / np.sqrt(np.maximum(square, 1e-12)), 1.0))
        middle = np.arctan2(y, x)
        angles, touches, sides = [], [], []
        for side in (1.0, -1.0):  # M, N
            # Angles towards the side, relative to the first point of their cell: none is cut at pi.
            edge = side * middle + half
            reference = edge[cells.first]
            relative = edge - np.repeat(reference, cells.counts)
            relative -= math.tau * np.rint(relative / math.tau)
            furthest = np.maximum.reduceat(relative, cells.first)
            outmost = reference + furthest
            # The fan ends in a cell whose outmost tangent lies further out than those of the cells around it.
            beyond = outmost[cells.other] - outmost[cells.one]
            beyond -= math.tau * np.rint(beyond / math.tau)
            ends = np.ones(len(outmost), dtype=np.bool_)
            ends[cells.one[beyond > 0.0]] = False
            ends[cells.other[beyond < 0.0]] = False
            for cell in ends.nonzero()[0].tolist():
                first = cells.first[cell]
                place = first + int(relative[first : first + cells.counts[cell]].argmax())
                touch2 = square[place] - keep[place] ** 2
                if touch2 > 0.0:
                    angles.append(side * (edge[place] + EDGE_OFF_RAD))
                    touches.append(math.sqrt(touch2))
                    sides.append(side)
        angle = np.array(angles)
        return np.cos(angle), np.sin(angle), np.array(touches), sides

    def _clear_past(
        self, origin: Point, ux: FloatArray, uy: FloatArray, touch_m: FloatArray
    ) -> tuple[FloatArray, IntArray]:
        """The same as `_clear_along`: most tangents are hidden before they touch, and need no longer look."""
        clear, met = self._clear_along(origin, ux, uy, touch_m)
        clear[clear >= touch_m] = math.inf
        seen = np.isinf(clear).nonzero()[0]
        if len(seen):
            clear[seen], met[seen] = self._clear_along(origin, ux[seen], uy[seen])
        return clear, met

    def _clear_along(
        self, origin: Point, ux: FloatArray, uy: FloatArray, to_m: FloatArray | float = math.inf
    ) -> tuple[FloatArray, IntArray]:
        """How far (k,) directions lead before they come too near to a point, and to which; infinite: never."""
        which, point = self._blocks.near_lines(origin, ux, uy, self._most_kept_m, to_m)
        points, keep = self.points_m[point], self.keep_m[point]
        dx, dy = points[:, 0] - origin[0], points[:, 1] - origin[1]
        ux_of, uy_of = ux[which], uy[which]
        beside = uy_of * dx - ux_of * dy
        ahead = ux_of * dx + uy_of * dy
        room = keep * keep - beside * beside
        met_by = ((room > 0.0) & (ahead > 0.0)).nonzero()[0]
        which, point = which[met_by], point[met_by]
        entry = ahead[met_by] - np.sqrt(room[met_by])
        clear, met = np.full(len(ux), math.inf), np.zeros(len(ux), dtype=np.intp)
        if len(which):
            # Pairs come direction by direction.
            first = np.concatenate(([0], (which[1:] != which[:-1]).nonzero()[0] + 1))
            nearest = np.minimum.reduceat(entry, first)
            counts = np.diff(np.append(first, len(which)))
            of_all = (entry == np.repeat(nearest, counts)).nonzero()[0]
            clear[which[first]] = nearest
            met[which[of_all[::-1]]] = point[of_all[::-1]]
        return np.maximum(clear, 0.0), met

    def free_sectors(self, origin: Point) -> FloatArray:
        """(k, 4) free sectors at a track point: unit vectors of the right and the left edge of each.

        Fans that overlap or hide each other are merged. With nothing in the window all is free and there is no
        row.
        """
        if not len(self.points_m):
            return np.zeros((0, 4))
        dx, dy = self.points_m[:, 0] - origin[0], self.points_m[:, 1] - origin[1]
        half = np.arcsin(np.minimum(self.keep_m / np.maximum(np.hypot(dx, dy), 1e-9), 1.0))
        low = np.arctan2(dy, dx) - half
        high = low + 2.0 * half
        start = low[0]
        begin = (low - start) % math.tau
        order = np.argsort(begin)
        begin, furthest = begin[order], np.maximum.accumulate((begin + high - low)[order])
        # What reaches beyond a full turn covers the beginning again.
        covered = np.maximum(np.append(0.0, furthest[:-1]), furthest[-1] - math.tau)
        gap = begin > covered
        right, left = start + covered[gap], start + begin[gap]
        if furthest[-1] < math.tau:
            right, left = np.append(right, start + furthest[-1]), np.append(left, start + math.tau)
        return np.column_stack((np.cos(right), np.sin(right), np.cos(left), np.sin(left)))
