"""The course, the whole way to the goal of which a plan in effect is the beginning, and routes that may become it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.geometry.clearance import distances
from planner.geometry.curves import Point, between
from planner.interface import FloatArray, Path
from planner.kernels.fans import encircled


@dataclass(frozen=True)
class Route:
    """A candidate that can be flown: its track points, and the curve through them."""

    nodes: tuple[Point, ...]
    path: Path


@dataclass(frozen=True, eq=False)
class Course:
    """A path to the goal through what is known, unknown space taken as free."""

    path: Path  # from where the aircraft was when it was found
    nodes: tuple[Point, ...]  # track points, the goal last
    known: int  # how many of the remembered edge points, of what stands still, it was found with
    shortest: bool  # none shorter was known, nor will be while nothing cuts it: obstacles shorten no way
    to_goal: bool = True  # it leads to the goal, not only into a turn

    def ahead(self, arc_length_m: float) -> Course:
        """The rest of the course from an arc length on; the whole of it where no rest is left."""
        if not (segments := between(self.path, arc_length_m, self.path.length_m)):
            return self
        _, at_m = distances(self.path, np.array(self.nodes))
        left = [node for node, at in zip(self.nodes[:-1], at_m.tolist(), strict=False) if at > arc_length_m]
        return replace(self, path=Path(np.array(segments)), nodes=(*left, self.nodes[-1]))

    def same_side(self, nodes: Sequence[Point], points_m: FloatArray) -> bool:
        """Tells whether the closed loop of this course and another way to the goal encircles no point then known."""
        return not encircled(np.array([*nodes, *self.nodes[-2::-1]]), points_m[: self.known]).any()
