"""Where an aircraft has room in a world: distances from what is solid on a grid, and two places far apart in it.

Frame: local ENU plane, metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from harness.world_files.parts import BoolArray, FloatArray
from harness.world_files.slicing import Box

CELLS_A_SIDE: Final = 320
ACROSS: Final = 0.5
"""A world is large enough where start and goal lie so far apart, as a share of what a point could have."""
TURNS: Final = (2.5, 2.0, 1.5, 1.2)
"""Room round start and goal beyond the clearance, in turn radii, as much as there is: 2 hold a circle to a side."""
CORRIDORS: Final = (1.0, 0.5, 0.0)
"""Room on the way from start to goal beyond the clearance, in turn radii, the widest that there is: 1 holds a circle,
so that an aircraft can turn round anywhere on it."""
LEAST_WAY: Final = 8.0
"""Start and goal are at least so many turn radii apart."""
DIRECTIONS: Final = 24
BLOCKED_SHARE: Final = 0.6
"""Start and goal whose straight line is blocked are preferred down to this share of the largest distance."""


@dataclass(frozen=True, eq=False)
class FreeRoom:
    """Distance from the middle of each cell of a grid to what is solid and to the border, at least.

    Attributes:
        corner_m: south-western corner of the grid.
        cell_m: side of a cell.
        room_m: (rows, columns) from south to north.
        allowed: (rows, columns) where start and goal may lie.
    """

    corner_m: tuple[float, float]
    cell_m: float
    room_m: FloatArray
    allowed: BoolArray

    @property
    def widest_m(self) -> float:
        """Radius of the largest free disc."""
        return float(np.where(self.allowed, self.room_m, 0.0).max(initial=0.0))

    @property
    def free_share(self) -> float:
        """Share of the cells that are free."""
        return float((self.room_m > 0).mean())

    def place(self, row: int, column: int) -> tuple[float, float]:
        """East and north of the middle of a cell."""
        return (self.corner_m[0] + (column + 0.5) * self.cell_m, self.corner_m[1] + (row + 0.5) * self.cell_m)


def free_room(polygons: Sequence[Any], bounds_m: Box, forbidden: Sequence[Any] = ()) -> FreeRoom:
    """Distances in an area from polygons and from its border.

    Args:
        polygons: what is solid.
        bounds_m: of the area.
        forbidden: polygons in which neither start nor goal may lie.
    """
    from scipy import ndimage

    xmin, ymin, xmax, ymax = bounds_m
    cell = max(xmax - xmin, ymax - ymin) / CELLS_A_SIDE
    columns, rows = max(int((xmax - xmin) / cell), 1), max(int((ymax - ymin) / cell), 1)
    solid = _covered(polygons, (xmin, ymin), cell, rows, columns, edges=True)
    padded = np.pad(solid, 1, constant_values=True)
    distance = ndimage.distance_transform_edt(~padded)[1:-1, 1:-1]
    room: FloatArray = np.where(solid, 0.0, (distance - 1.0) * cell)
    allowed = ~_covered(forbidden, (xmin, ymin), cell, rows, columns, edges=False)
    return FreeRoom((xmin, ymin), cell, np.maximum(room, 0.0), allowed)


def _covered(
    polygons: Sequence[Any], corner: tuple[float, float], cell: float, rows: int, columns: int, edges: bool
) -> BoolArray:
    """(rows, columns) cells whose middle lies in a polygon, or through which an edge goes."""
    import shapely

    covered = np.zeros((rows, columns), dtype=np.bool_)
    if not len(polygons):
        return covered
    shapes = np.array(polygons, dtype=object)
    cells = (shapely.bounds(shapes) - np.tile(corner, 2)) / cell
    for index in np.flatnonzero((cells[:, 2:] - cells[:, :2]).min(axis=1) > 1.0).tolist():
        left, right = _span(cells[index, 0], cells[index, 2], columns)
        low, high = _span(cells[index, 1], cells[index, 3], rows)
        if left < right and low < high:
            shapely.prepare(shapes[index])
            x, y = np.meshgrid(np.arange(left, right) + 0.5, np.arange(low, high) + 0.5)
            inside = shapely.contains_xy(shapes[index], corner[0] + cell * x, corner[1] + cell * y)
            covered[low:high, left:right] |= inside
    if edges:
        points = shapely.get_coordinates(shapely.segmentize(shapely.boundary(shapes), cell / 2))
        column, row = np.floor((points - corner) / cell).astype(np.int64).T
        kept = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        covered[row[kept], column[kept]] = True
    return covered


def _span(low: float, high: float, size: int) -> tuple[int, int]:
    return max(math.floor(low), 0), min(math.ceil(high) + 1, size)


def ends(
    room: FreeRoom, turn_radius_m: float, clearance_m: float, corridor_turns: float = CORRIDORS[0]
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Start and goal: two places far apart with room to turn, joined by a corridor.

    Args:
        room: of the area.
        turn_radius_m: of the aircraft.
        clearance_m: that its planner keeps.
        corridor_turns: room to both sides of the middle of the corridor beyond the clearance, in turn radii.

    Returns:
        East and north of each; None where there are no two such places.
    """
    from scipy import ndimage

    corridors, _ = ndimage.label(room.room_m >= clearance_m + corridor_turns * turn_radius_m)
    for turns in TURNS:
        fits = (room.room_m >= clearance_m + turns * turn_radius_m) & (corridors > 0) & room.allowed
        best: tuple[float, tuple[int, int], tuple[int, int]] | None = None
        for number in np.unique(corridors[fits]).tolist():
            found = _farthest(np.argwhere(fits & (corridors == number)), room)
            if best is None or found[0] > best[0]:
                best = found
        if best is not None and best[0] * room.cell_m >= LEAST_WAY * turn_radius_m:
            return room.place(*best[1]), room.place(*best[2])
    return None


def _farthest(
    cells: np.ndarray[Any, np.dtype[np.int64]], room: FreeRoom
) -> tuple[float, tuple[int, int], tuple[int, int]]:
    """Two cells far apart, and their distance: the best of the extremes in some directions.

    Those whose straight line is blocked go before those that see each other, unless they are much nearer.
    """
    angle = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    along = cells @ np.array((np.cos(angle), np.sin(angle)))
    extremes = cells[np.unique(np.concatenate((along.argmin(axis=0), along.argmax(axis=0))))]
    gaps = np.hypot(*(extremes[:, None] - extremes[None]).transpose(2, 0, 1))
    worth = gaps.copy()
    for i, j in np.argwhere(np.triu(gaps > BLOCKED_SHARE * gaps.max())).tolist():
        share = np.linspace(0.0, 1.0, 2 * int(gaps[i, j]) + 2)[:, None]
        between = np.round(extremes[i] + share * (extremes[j] - extremes[i])).astype(np.int64)
        if not room.room_m[between[:, 0], between[:, 1]].all():
            worth[i, j] /= BLOCKED_SHARE
    first, second = np.unravel_index(int(worth.argmax()), gaps.shape)
    west, east = sorted(
        (extremes[first].tolist(), extremes[second].tolist()), key=lambda cell: (cell[1], cell[0])
    )
    return float(gaps[first, second]), (west[0], west[1]), (east[0], east[1])


def scale_that_fits(
    room: FreeRoom, turn_radius_m: float, clearance_m: float, most: float = 1e5
) -> float | None:
    """By how much a world must be made larger for `ends` to find two places across it; None where nothing helps."""
    widest = ends(room, turn_radius_m / most, clearance_m / most)
    scale = 1.0
    while widest is not None and scale < most:
        found = ends(room, turn_radius_m / scale, clearance_m / scale)
        if found is not None and math.dist(*found) >= ACROSS * math.dist(*widest):
            return scale
        scale *= 1.1
    return None
