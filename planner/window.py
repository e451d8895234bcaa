"""The rolling window: what lies in it, the guide vector, and the fan-shaped sectors that obstacles cut.

Definition 1 of the paper is the sensing range U, Definition 2 the guide vector alpha; section 3.3 has the
planning window U_1 of radius r_1 <= r. Seen from a track point, an obstacle, grown by the distance to be kept
from it, fills a fan of bearings. M and N are where its fan ends on the left and on the right: directions
tangent to the obstacle. Between the fans lie the free sectors. Fans that overlap are merged, and an edge that
something nearer hides is none.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.blocks import Blocks
from planner.curves import Point
from planner.interface import ComplexArray, FloatArray, IntArray

EDGE_OFF_RAD = 1e-7
"""Edges are turned this much into the free sector, clear of rounding errors."""

MOST_HIDING = 12
"""So many obstacles at most are looked at for the edges of one."""

BLOCK_CELLS = 4
"""Side of the blocks in which points near a line are looked for, in cells."""

AT_ONCE = 12_000
"""So many pairs of a direction and a point are looked at in one go; of more only those near each other."""

SIDES = np.array((1.0, -1.0))
"""M and N."""

CALL, TANGENT, PAIR, PLACE = 15.0, 0.06, 0.04, 0.008
"""Work of a question, and more of it for each point that tangents are laid at, for each pair that is looked up and
for each that is only compared."""


class Tally:
    """Work done, counted by what was looked at and never timed: one is about a microsecond on an ordinary core."""

    def __init__(self) -> None:
        self.done = 0.0

    def add(self, calls: float, each: float = 0.0, count: int = 0) -> None:
        """Counts questions, and what each of so many points or pairs adds to them."""
        self.done += CALL * calls + each * count


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
        tally: work is counted here.
    """

    center_m: Point
    radius_m: float
    points_m: FloatArray
    labels: IntArray
    cell_m: float
    keep_m: FloatArray
    tally: Tally = field(default_factory=Tally)
    _cells: dict[int, _Cells] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _most_kept_m(self) -> float:
        return float(self.keep_m.max())

    @cached_property
    def _places(self) -> ComplexArray:
        """(m,) the points as east + i north: one number each."""
        return self.points_m[:, 0] + 1j * self.points_m[:, 1]

    @cached_property
    def _square(self) -> FloatArray:
        return self.keep_m * self.keep_m

    @cached_property
    def _blocks(self) -> Blocks:
        return Blocks.of(self.points_m, BLOCK_CELLS * self.cell_m)

    def _obstacle(self, label: int) -> _Cells:
        """The points of an obstacle, gathered once."""
        if label not in self._cells:
            members = np.flatnonzero(self.labels == label)
            self.tally.add(4, TANGENT, len(members))
            cells = Blocks.of(self.points_m[members], self.cell_m)
            members, (one, other) = members[cells.members], cells.beside.T
            self._cells[label] = _Cells(members, cells.first, cells.counts, one, other, self.keep_m[members])
        return self._cells[label]

    def nearest_obstacles(self, most: int) -> list[int]:
        """The obstacles nearest to the centre, so many at most."""
        self.tally.add(2, PLACE, len(self.points_m))
        order = np.argsort(np.abs(self._places - complex(*self.center_m)))
        return list(itertools.islice(dict.fromkeys(self.labels[order].tolist()), most))

    def sector_edges(self, origin: Point, beside: Iterable[int]) -> list[SectorEdge]:
        """The edges M and N of the free sectors beside some obstacles, as seen from a track point.

        Where something hides an edge, or closes it right behind the place where it touches, the edges of that are
        taken as well.
        """
        edges: list[SectorEdge] = []
        pending = list(dict.fromkeys(beside))
        looked_at = set(pending)
        away = self._places - complex(*origin)
        while pending:
            obstacle = pending.pop()
            towards, touch, sides = self._tangents(away, obstacle)
            if not len(towards):
                continue
            clear, met = self._clear_past(origin, away, towards, touch)
            hidden = clear < touch + self.keep_m[met]
            for u, touch_m, clear_m, side in zip(
                towards.tolist(), touch.tolist(), clear.tolist(), sides, strict=True
            ):
                if clear_m >= touch_m:
                    edges.append(SectorEdge(u.real, u.imag, touch_m, clear_m, obstacle, side))
            # Hidden, or closed right behind: the way goes round what hides it.
            for other in self.labels[met[hidden]].tolist():
                if other not in looked_at and len(looked_at) < MOST_HIDING:
                    looked_at.add(other)
                    pending.append(other)
        return edges

    def hugged_m(self, origin: Point, edge: SectorEdge, outer_m: float) -> float:
        """How far along an edge an outer distance from the obstacle that it touches is reached again."""
        members = self._obstacle(edge.obstacle).members
        self.tally.add(1, PAIR, len(members))
        seen = (self._places[members] - complex(*origin)) * complex(edge.ux, -edge.uy)
        reach = outer_m * outer_m - seen.imag * seen.imag
        near = ((reach > 0.0) & (seen.real > -outer_m)).nonzero()[0]
        ahead, reach = seen.real[near], np.sqrt(reach[near])
        order = np.argsort(ahead - reach)
        begin, end = (ahead - reach)[order], np.maximum.accumulate((ahead + reach)[order])
        gap = np.flatnonzero((begin[1:] > end[:-1]) & (end[:-1] > edge.touch_m))
        return float(end[gap[0]] if len(gap) else end[-1])

    def _tangents(self, away: ComplexArray, label: int) -> tuple[ComplexArray, FloatArray, FloatArray]:
        """Directions tangent to the ends of an obstacle's fan, where they touch it, and which ends they are."""
        cells = self._obstacle(label)
        self.tally.add(2, TANGENT, len(cells.members))
        seen = away[cells.members]
        distance = np.maximum(np.abs(seen), 1e-6)
        half = np.arcsin(np.minimum(cells.keep_m / distance, 1.0))
        # Angles towards M and N, relative to the first point of their cell: none is cut at pi.
        edge = np.multiply.outer(SIDES, np.angle(seen)) + half
        reference = edge[:, cells.first]
        relative = edge - np.repeat(reference, cells.counts, axis=1)
        relative -= math.tau * np.rint(relative / math.tau)
        outmost = reference + np.maximum.reduceat(relative, cells.first, axis=1)
        # The fan ends in a cell whose outmost tangent lies further out than those of the cells around it.
        beyond = outmost[:, cells.other] - outmost[:, cells.one]
        beyond -= math.tau * np.rint(beyond / math.tau)
        ends = np.ones(outmost.shape, dtype=np.bool_)
        for inner, cell in ((beyond > 0.0, cells.one), (beyond < 0.0, cells.other)):
            row, pair = inner.nonzero()
            ends[row, cell[pair]] = False
        row, cell = ends.nonzero()
        place = np.array(
            [
                first + int(relative[i, first : first + count].argmax())
                for i, first, count in zip(
                    row.tolist(), cells.first[cell].tolist(), cells.counts[cell].tolist(), strict=True
                )
            ],
            dtype=np.intp,
        )
        touch2 = distance[place] ** 2 - cells.keep_m[place] ** 2
        outside = touch2 > 0.0
        row, place = row[outside], place[outside]
        side = SIDES[row]
        angle = side * (edge[row, place] + EDGE_OFF_RAD)
        return np.cos(angle) + 1j * np.sin(angle), np.sqrt(touch2[outside]), side

    def _clear_past(
        self, origin: Point, away: ComplexArray, towards: ComplexArray, touch_m: FloatArray
    ) -> tuple[FloatArray, IntArray]:
        """How far (k,) directions lead before they come too near to a point, and to which; infinite: never."""
        if len(away) * len(towards) <= AT_ONCE:
            return self._clear_of_all(away, towards)
        # Most tangents are hidden before they touch, and need not be looked along any further.
        clear, met = self._clear_along(origin, away, towards, touch_m)
        clear[clear >= touch_m] = math.inf
        seen = np.isinf(clear).nonzero()[0]
        if len(seen):
            clear[seen], met[seen] = self._clear_along(origin, away, towards[seen])
        return clear, met

    def _clear_of_all(self, away: ComplexArray, towards: ComplexArray) -> tuple[FloatArray, IntArray]:
        """`_clear_past` of a few directions and points."""
        seen = np.multiply.outer(towards.conj(), away)
        self.tally.add(1, PLACE, seen.size)
        ahead, beside = seen.real, seen.imag
        which, point = ((beside * beside < self._square) & (ahead > 0.0)).nonzero()
        return self._nearest(len(towards), which, point, ahead[which, point], beside[which, point])

    def _clear_along(
        self,
        origin: Point,
        away: ComplexArray,
        towards: ComplexArray,
        to_m: FloatArray | float = math.inf,
    ) -> tuple[FloatArray, IntArray]:
        """`_clear_past` of many: only the points near each direction are looked at, and only so far along it."""
        which, point = self._blocks.near_lines(origin, towards, self._most_kept_m, to_m)
        self.tally.add(2, PAIR, len(which))
        seen = away[point] * towards.conj()[which]
        ahead, beside = seen.real, seen.imag
        met_by = ((beside * beside < self._square[point]) & (ahead > 0.0)).nonzero()[0]
        return self._nearest(len(towards), which[met_by], point[met_by], ahead[met_by], beside[met_by])

    def _nearest(
        self, count: int, which: IntArray, point: IntArray, ahead_m: FloatArray, beside_m: FloatArray
    ) -> tuple[FloatArray, IntArray]:
        """Where each of so many directions first comes too near to a point, and to which.

        Args:
            count: number of directions.
            which: (p,) a direction, in order, of each pair of one and a point that it comes too near to.
            point: (p,) that point.
            ahead_m: (p,) how far along the direction it lies.
            beside_m: (p,) how far beside it.
        """
        clear, met = np.full(count, math.inf), np.zeros(count, dtype=np.intp)
        if len(which):
            entry = ahead_m - np.sqrt(self._square[point] - beside_m * beside_m)
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
