"""Proof that no way exists: a closed chain of seen edges between start and goal.

Two edge points nearer to each other than twice the clearance let nothing through between them: no point of the
line that joins them is as far as the clearance from both. Nor is there a way between an edge point and the border of
the area that is nearer to it than the clearance. A closed chain of such lines, where the border closes chains
outside of the area, that crosses the straight line from start to goal an odd number of times parts the two (Jordan
curve theorem, modulo 2). Chains are kept as a forest with the parity of their crossings, so that the first link
that closes an odd one is noticed: union-find with parity.
"""

from __future__ import annotations

import math

import numpy as np

from planner.curves import Point
from planner.interface import FloatArray, Mission
from planner.memory import ObstacleMemory

OUTSIDE = 0
"""Node of the world outside of the area."""

PROVED_AT_ONCE = 100
"""So many edge points at most are taken into a proof in one call."""

THIN = 0.1
"""Points nearer to one that was taken in than this share of the clearance are left out. Fewer points prove less,
but nothing that is not so."""


class Barrier:
    """Watches for a closed chain of edge points between two places.

    Args:
        start: a place that keeps the clearance from all points.
        goal: another.
        bounds_m: xmin, ymin, xmax, ymax of the area, which is never left.
        clearance_m: distance that a way keeps from every point.
    """

    def __init__(
        self, start: Point, goal: Point, bounds_m: tuple[float, float, float, float], clearance_m: float
    ) -> None:
        self._start, self._goal = start, goal
        self._bounds = bounds_m
        self._clearance = clearance_m
        self._parent = [OUTSIDE]
        self._parity = [False]  # crossings on the way to the parent
        self._cells: dict[tuple[int, int], list[tuple[float, float, int]]] = {}
        self._thinned: set[tuple[int, int]] = set()
        self.closed = False

    def add(self, points_m: FloatArray) -> None:
        """Takes in edge points, (k, 2)."""
        places = np.floor(points_m / (THIN * self._clearance)).astype(np.int64).tolist()
        for (x, y), (column, row) in zip(points_m.tolist(), places, strict=True):
            if (column, row) not in self._thinned:
                self._thinned.add((column, row))
                self._add(x, y)

    def _add(self, x: float, y: float) -> None:
        node = len(self._parent)
        self._parent.append(node)
        self._parity.append(False)
        xmin, ymin, xmax, ymax = self._bounds
        for border in ((xmin, y), (xmax, y), (x, ymin), (x, ymax)):
            if math.dist(border, (x, y)) < self._clearance:
                self._link(node, OUTSIDE, self._crosses((x, y), border))
        reach = 2.0 * self._clearance
        column, row = math.floor(x / reach), math.floor(y / reach)
        for i in (column - 1, column, column + 1):
            for j in (row - 1, row, row + 1):
                for other_x, other_y, other in self._cells.get((i, j), ()):
                    if (other_x - x) ** 2 + (other_y - y) ** 2 < reach * reach:
                        self._link(node, other, self._crosses((x, y), (other_x, other_y)))
        self._cells.setdefault((column, row), []).append((x, y, node))

    def _link(self, a: int, b: int, crosses: bool) -> None:
        root_a, parity_a = self._root(a)
        root_b, parity_b = self._root(b)
        odd = parity_a ^ parity_b ^ crosses
        if root_a != root_b:
            self._parent[root_a], self._parity[root_a] = root_b, odd
        elif odd:
            self.closed = True

    def _root(self, node: int) -> tuple[int, bool]:
        """The root of a node's tree and the parity of crossings on the way there; shortens the way."""
        way = []
        while self._parent[node] != node:
            way.append(node)
            node = self._parent[node]
        parity = False
        for each in reversed(way):
            parity ^= self._parity[each]
            self._parent[each], self._parity[each] = node, parity
        return node, parity

    def _crosses(self, a: Point, b: Point) -> bool:
        """Whether the line from a to b crosses that from start to goal."""
        (sx, sy), (gx, gy) = self._start, self._goal
        dx, dy = gx - sx, gy - sy
        side_a = dx * (a[1] - sy) - dy * (a[0] - sx)
        side_b = dx * (b[1] - sy) - dy * (b[0] - sx)
        if (side_a > 0.0) == (side_b > 0.0):
            return False
        share = side_a / (side_a - side_b)
        x, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
        return 0.0 <= (x - sx) * dx + (y - sy) * dy < dx * dx + dy * dy


class Proof:
    """Asks what a planner remembers, again and again, whether it leaves no way to the goal.

    Args:
        mission: goal and bounds.
        memory: the edge points.
        keeps_m: what a way has to keep from every point, but for those that are nearer than this to the goal or to
            where the aircraft is at first: they prove nothing.
        with_refused: count what was refused: asks whether it leaves no way but through that. Else it proves
            nothing either.
    """

    def __init__(
        self, mission: Mission, memory: ObstacleMemory, keeps_m: float, with_refused: bool = False
    ) -> None:
        self._mission, self._memory, self._keeps_m = mission, memory, keeps_m
        self._with_refused = with_refused
        self._ends: tuple[Point, Point] | None = None
        self._begin()

    def _begin(self) -> None:
        self._barrier: Barrier | None = None
        self._taken = 0
        self._begun_at = self._gone = self._memory.gone

    def closed(self, position: Point) -> bool:
        """Takes in some more of the points and says whether they close all ways from the first position given."""
        # Where the aircraft was first: by a way that it found it can go back, be it narrower than this.
        self._ends = self._ends or (position, self._mission.goal_m)
        if self._taken_in(self._ends, PROVED_AT_ONCE) and self._begun_at != self._memory.gone:
            # Some of what closes it may have been let go of since: what is left has to close it as well.
            self._begin()
            return self._taken_in(self._ends, self._memory.known)
        return self._barrier is not None and self._barrier.closed

    def _taken_in(self, ends: tuple[Point, Point], most: int) -> bool:
        """Whether the ways are closed with so many more points."""
        memory, keeps_m = self._memory, self._keeps_m
        if self._barrier is None:
            self._barrier = Barrier(*ends, self._mission.bounds_m, keeps_m)
        self._taken = max(self._taken - (memory.gone - self._gone), 0)
        self._gone = memory.gone
        more = memory.genuine_m[self._taken :][:most]
        self._taken += len(more)
        if self._with_refused:
            more = np.concatenate((memory.refused_m, more))
        for east, north in ends:
            more = more[np.hypot(more[:, 0] - east, more[:, 1] - north) >= keeps_m]
        self._barrier.add(more)
        return self._barrier.closed
