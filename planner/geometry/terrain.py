"""Where a curve may lie, and the work of asking that, which is counted."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

from planner.geometry.clearance import first_breach, inside_bounds
from planner.interface import FloatArray, Path
from planner.kernels.buckets import Buckets, bucketed

SQUARE = 3.0
"""Side of the squares in which edge points near a line are looked for, as a multiple of the distance kept."""

CALL_WORK, TANGENT_WORK, POINT_WORK, HUG_WORK = 14.0, 0.04, 0.0016, 0.006
"""Counted work, some microseconds, of a call, and in it of each point at which tangents are laid, that is compared with
a line, or along which a step may lead."""


class WorkCount:
    """Work done so far, some microseconds, counted and never timed: a search cut short ends alike in every run."""

    def __init__(self) -> None:
        self.done = 0.0

    def add(self, calls: float, each: float = 0.0, count: int = 0) -> None:
        """Counts questions, and what each of so many points or pairs adds to them."""
        self.done += CALL_WORK * calls + each * count


@dataclass(frozen=True, eq=False)
class Terrain:
    """Where a curve may lie: (m, 2) edge points, (m,) the distance to be kept from each, and the area.

    The work of asking is counted.
    """

    points_m: FloatArray
    keep_m: FloatArray
    bounds_m: tuple[float, float, float, float]
    work_count: WorkCount = field(default_factory=WorkCount)

    def admits(self, path: Path) -> bool:
        """Whether a path keeps its distance and stays inside."""
        if not inside_bounds(path, self.bounds_m):
            return False
        self.work_count.add(1, POINT_WORK, len(self.points_m) * len(path.segments))
        return math.isinf(first_breach(path, self.points_m, self.keep_m))

    @cached_property
    def squares(self) -> Buckets:
        """The edge points by squares."""
        side_m = SQUARE * max(float(self.keep_m.max(initial=0.0)), 1.0)
        return bucketed(self.points_m, self.keep_m, side_m)[1]
