"""The terrain in which curves may lie; tests of curves against it are counted as work."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

from planner.geometry.clearance import first_breach, inside_bounds
from planner.interface import FloatArray, Path
from planner.kernels.buckets import Buckets, bucketed
from planner.kernels.segments import comes_too_near

SQUARE_SIDE_KEEPS = 3.0
"""Side of the squares that edge points are sorted into, over the largest distance kept from one."""

CALL_WORK, TANGENT_WORK, POINT_WORK, HUG_WORK = 14.0, 0.04, 0.0016, 0.006
"""Counted work, about 1 us a unit: of a call, and in it of each point that tangents are drawn to, that is compared with
a line, or that a step may hug."""


class WorkCount:
    """Work done so far, some microseconds, counted and never timed: a search cut short ends alike in every run."""

    def __init__(self) -> None:
        self.total = 0.0

    def add(self, calls: float, each: float = 0.0, count: int = 0) -> None:
        """Counts `calls`, and `each` more for each of `count` points or pairs."""
        self.total += CALL_WORK * calls + each * count


@dataclass(frozen=True, eq=False)
class Terrain:
    """The space for curves: (m, 2) edge points, (m,) distance to be kept from each, area; tests count as work."""

    points_m: FloatArray
    keep_m: FloatArray
    bounds_m: tuple[float, float, float, float]
    work_count: WorkCount = field(default_factory=WorkCount)

    def admits(self, path: Path) -> bool:
        """Tells whether a path keeps its distance from every edge point and stays inside the area."""
        if not inside_bounds(path, self.bounds_m):
            return False
        self.work_count.add(1, POINT_WORK, len(self.points_m) * len(path.segments))
        if "squares" in self.__dict__:  # laid for shortcuts: faster than all points
            return not comes_too_near(path.segments, self.squares)
        return math.isinf(first_breach(path, self.points_m, self.keep_m))

    @cached_property
    def squares(self) -> Buckets:
        """The edge points by squares."""
        side_m = SQUARE_SIDE_KEEPS * max(float(self.keep_m.max(initial=0.0)), 1.0)
        return bucketed(self.points_m, self.keep_m, side_m)[1]
