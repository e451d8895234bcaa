"""The square grid that edge points lie on, one a cell."""

from __future__ import annotations

import math
from dataclasses import dataclass

MOST_CELLS = 16_000_000


@dataclass(frozen=True)
class EdgeGrid:
    """A grid over the area of operations and a border.

    Attributes:
        cell_m: width of a cell.
        corner: its lower left corner, east + i north, m.
        columns: cells from west to east.
        rows: cells from south to north.
    """

    cell_m: float
    corner: complex
    columns: int
    rows: int

    @staticmethod
    def over(bounds_m: tuple[float, float, float, float], clearance_m: float) -> EdgeGrid:
        """The grid for an area: cells a quarter of the clearance wide, or wider where they would be too many."""
        xmin, ymin, xmax, ymax = bounds_m
        span = max(xmax - xmin, ymax - ymin) + 4.0 * clearance_m
        cell = max(clearance_m / 4.0, span / math.sqrt(MOST_CELLS))
        border = 2.0 * clearance_m + cell
        columns, rows = (
            math.ceil((high - low + 2.0 * border) / cell) for low, high in ((xmin, xmax), (ymin, ymax))
        )
        return EdgeGrid(cell, complex(xmin - border, ymin - border), columns, rows)
