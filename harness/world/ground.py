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

Position = tuple[float, float, float]  # east, north and up (m)

SAMPLE_M: Final = 0.5
"""A way is compared with the ground at places at most this far apart; ground thinner along it is no contact."""

SQUARES: Final = (64, 16, 4, 1)
"""Half widths, in cells of the grid, of the squares in which the highest ground is looked for."""


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
        """Tells whether the straight way between two positions goes through the ground."""
        east, north, up = np.linspace(begin, end, math.ceil(math.dist(begin, end) / SAMPLE_M) + 1).T
        return bool((up - self.field.at(east, north) <= 0.0).any())

    def reach_m(self, position: Position) -> float:
        """Returns a distance that can be flown from a position, in any direction, without touching the ground.

        Only the highest ground in squares about the position is known, so that the answer may be much too small, but
        never too large.
        """
        east, north, up = position
        column, row = (math.floor(each[0]) for each in self.field.cells(np.array([east]), np.array([north])))
        best = 0.0
        for cells in SQUARES:
            near = self._solid_m[
                max(row - cells, 0) : max(row + cells + 2, 0),
                max(column - cells, 0) : max(column + cells + 2, 0),
            ]
            best = max(best, min(cells * min(self.field.spacing_m), up - float(near.max(initial=-math.inf))))
        return best

    @cached_property
    def _solid_m(self) -> FloatArray:
        """Heights of the nodes, -inf where they are not known."""
        return np.where(np.isfinite(self.field.heights_m), self.field.heights_m, -math.inf)
