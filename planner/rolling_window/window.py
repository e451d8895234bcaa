"""The rolling window: what lies in it, the guide vector, and the fan-shaped sectors that obstacles cut.

Seen from a track point, an obstacle, grown by the distance to be kept from it, fills a fan of bearings. M and N are
where its fan ends on the left and on the right: directions tangent to the obstacle. Between the fans lie the free
sectors. Fans that overlap are merged, and an edge that something nearer hides is none.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.geometry.curves import Point
from planner.geometry.terrain import HUG_WORK, POINT_WORK, TANGENT_WORK, WorkCount
from planner.interface import FloatArray, IntArray
from planner.kernels.buckets import Buckets, Cells, bucketed, cells_of, gathered
from planner.kernels.fans import entered, fan_edges

MOST_OBSTACLES = 12
"""Most obstacles whose edges are taken at one track point: the first ones, and those that hide their edges."""

SQUARE_SIDE_CELLS = 4  # side, in cells, of the squares that edge points are sorted into


def guide_vector(position: Point, goal: Point) -> tuple[float, float, float]:
    """Definition 2: unit vector from the position to the goal, and its length in metres."""
    dx, dy = goal[0] - position[0], goal[1] - position[1]
    length = math.hypot(dx, dy)
    return (dx / length, dy / length, length) if length else (1.0, 0.0, 0.0)


class SectorEdge(NamedTuple):
    """The edge of a free sector at a track point: M (the obstacle is on its right) or N (on its left)."""

    ux: float  # unit vector along the edge, tangent to the obstacle
    uy: float
    touch_m: float  # distance at which it touches the obstacle
    clear_m: float  # distance up to which the direction is free; infinite where nothing is met
    side: float  # 1 for M, -1 for N
    hugged_m: float  # distance at which an outer distance from the obstacle is reached again; 0: never
    obstacle: int  # label


_Obstacle = tuple[FloatArray, Cells]
"""(3, m) its points as `planner.kernels.buckets.gathered` has them, and their squares."""


@dataclass(frozen=True, eq=False)
class Window:
    """The (m, 2) edge points known about a track point, the obstacle of each and the distance to be kept from each.

    Points within a square of `cell_m` are looked at as one piece of wall.
    """

    center_m: Point
    points_m: FloatArray
    labels: IntArray
    cell_m: float
    keep_m: FloatArray
    work_count: WorkCount = field(default_factory=WorkCount)
    _obstacles: dict[int, _Obstacle] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _buckets(self) -> tuple[Buckets, IntArray]:
        """The points by squares, and the label of the obstacle of each."""
        order, squares = bucketed(self.points_m, self.keep_m, SQUARE_SIDE_CELLS * self.cell_m)
        return squares, self.labels[order]

    def _obstacle(self, label: int) -> _Obstacle:
        if label not in self._obstacles:
            members = np.flatnonzero(self.labels == label)
            self.work_count.add(4, TANGENT_WORK, len(members))
            members, squares = cells_of(self.points_m, members, self.cell_m)
            self._obstacles[label] = gathered(self.points_m, self.keep_m, members), squares
        return self._obstacles[label]

    def entered(self, origin: Point, goal: Point) -> tuple[FloatArray, IntArray]:
        """Where the line to the goal comes too near to edge points, m from the origin, and the obstacle of each."""
        blocked, labels = self._buckets
        self.work_count.add(1, POINT_WORK, len(labels))
        entry, which = entered(blocked, origin, goal, len(labels))
        return entry, labels[which]

    def nearest_obstacles(self, most: int) -> list[int]:
        """Labels of the obstacles nearest to the centre, at most `most`."""
        self.work_count.add(2, TANGENT_WORK, len(self.points_m))
        order = np.argsort(np.hypot(*(self.points_m - self.center_m).T))
        return list(itertools.islice(dict.fromkeys(self.labels[order].tolist()), most))

    def sector_edges(self, origin: Point, beside: Iterable[int], outer_m: float = 0.0) -> list[SectorEdge]:
        """The edges M and N of the free sectors beside some obstacles, as seen from a track point.

        Where something hides an edge, or closes it right behind the place where it touches, the edges of that are
        taken as well.
        """
        edges: list[SectorEdge] = []
        pending = list(dict.fromkeys(beside))
        looked_at = set(pending)
        blocked, labels = self._buckets
        if not self._obstacles:  # the squares were laid for this
            self.work_count.add(1, TANGENT_WORK, len(self.points_m))
        while pending:
            obstacle = pending.pop()
            own, squares = self._obstacle(obstacle)
            found, hiding, looked = fan_edges(blocked, labels, own, squares, self.cell_m, origin, outer_m)
            self.work_count.add(1, TANGENT_WORK, len(own[0]))
            self.work_count.add(0, POINT_WORK, looked * len(labels))
            self.work_count.add(0, HUG_WORK, len(found) * len(own[0]))
            edges += [SectorEdge._make((*edge, obstacle)) for edge in found.tolist()]
            # Hidden, or closed right behind: the way goes round what hides it.
            for other in hiding.tolist():
                if other not in looked_at and len(looked_at) < MOST_OBSTACLES:
                    looked_at.add(other)
                    pending.append(other)
        return edges
