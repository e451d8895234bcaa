"""The true ground below an aircraft, and how far it can fly before it could touch it.

Frame: local ENU plane, x = east, y = north, metres; heights above mean sea level, metres. Between the nodes of its grid
the ground is bilinear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from planner.interface import FloatArray

if TYPE_CHECKING:
    from harness.world_files.height_field import HeightField

Position = tuple[float, float, float]
"""East, north and up (m)."""

SAMPLE_M: Final = 0.5
"""A way is held against the ground at least this often; what is thinner along it is no contact."""


@dataclass(frozen=True, eq=False)
class Ground:
    """Heights of the ground where they are known; where they are not, nothing is ever touched.

    Attributes:
        field: the heights.
    """

    field: HeightField

    def height_m(self, east_m: float, north_m: float) -> float:
        """Height of the ground at a place; NaN where it is not known."""
        return float(self.field.at(np.array([east_m]), np.array([north_m]))[0])

    def above_m(self, position: Position) -> float:
        """Height of a position above the ground; NaN where that is not known."""
        return position[2] - self.height_m(position[0], position[1])

    def contact_between(self, begin: Position, end: Position) -> bool:
        """Whether the straight way between two positions goes through the ground."""
        count = math.ceil(math.dist(begin, end) / SAMPLE_M) + 1
        east, north, up = np.linspace(begin, end, count).T
        return bool((up - self.field.at(east, north) <= 0.0).any())

    def reach_m(self, position: Position) -> float:
        """So far can one fly from a position, in whatever direction, without touching the ground; at least.

        Around the position tiles of the grid are taken, as large as their highest ground allows. Nothing else is
        known of the ground, so that the answer may be much too small, but never too large.
        """
        east, north, up = position
        column = (east - self.field.corner_m[0]) / self.field.spacing_m[0]
        row = (north - self.field.corner_m[1]) / self.field.spacing_m[1]
        best = 0.0
        for level, tiles in enumerate(self._highest):
            side = 2**level
            reach = side * min(self.field.spacing_m)
            i, j = math.floor(row / side), math.floor(column / side)
            near = tiles[max(i - 1, 0) : max(i + 2, 0), max(j - 1, 0) : max(j + 2, 0)]
            free = up - float(near.max(initial=-math.inf))
            if free <= 0.0:
                break
            best = min(reach, free)
            if free < reach:
                break
        return best

    @cached_property
    def _highest(self) -> list[FloatArray]:
        """Highest ground in tiles of 1, 2, 4 ... cells a side; the last is one tile. -inf where it is not known."""
        heights = np.where(np.isfinite(self.field.heights_m), self.field.heights_m, -math.inf)
        # A cell reaches from its node to the next ones in the east and north.
        wide = np.pad(heights, ((0, 1), (0, 1)), constant_values=-math.inf)
        pairs = np.maximum(wide[:, :-1], wide[:, 1:])
        tiles: FloatArray = np.maximum(pairs[:-1], pairs[1:])
        levels = [tiles]
        while max(levels[-1].shape) > 1:
            rows, columns = levels[-1].shape
            even = np.pad(levels[-1], ((0, rows % 2), (0, columns % 2)), constant_values=-math.inf)
            levels.append(np.maximum.reduce([even[i::2, j::2] for i in (0, 1) for j in (0, 1)]))
        return levels
