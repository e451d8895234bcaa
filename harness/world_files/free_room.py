"""Where an aircraft has room in a world: distances from what is solid on a grid, and two places far apart in it.

Frame: local ENU plane, metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from harness.world_files.parts import BoolArray, Box, FloatArray

CELLS_A_SIDE: Final = 320
"""The longer side of an area is divided into this many cells."""
TURNS: Final = (2.5, 1.5, 1.2)
"""Room round start and goal beyond the clearance, in turn radii, as much as there is: 2 hold a circle to a side."""
CORRIDORS: Final = (1.0, 0.0)
"""Room on the way from start to goal beyond the clearance, in turn radii: 1 holds a circle, so that an aircraft can
turn round anywhere on it."""
LEAST_WAY: Final = 8.0
"""Start and goal are at least this many turn radii apart."""
DIRECTIONS: Final = 24
"""Places far apart are sought in this many directions."""
BLOCKED_SHARE: Final = 0.6
"""Start and goal whose straight line is blocked are preferred down to this share of the largest distance."""
LARGEST_SCALE: Final = 1e5
"""A world is enlarged by at most this factor."""

Ends = tuple[tuple[float, float], tuple[float, float]]
"""Start and goal, east and north."""


@dataclass(frozen=True, eq=False)
class FreeRoom:
    """Distance from the middle of each cell of a grid to what is solid and to the border, at least.

    The corner is the south-western one; room and where start and goal may lie are (rows, columns) from south to north.
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


def free_room(polygons: Sequence[Any], bounds_m: Box, forbidden: Sequence[Any] = ()) -> FreeRoom:
    """Distances in an area from solid polygons and from its border; neither start nor goal may lie in `forbidden`."""
    from scipy import ndimage

    xmin, ymin, xmax, ymax = bounds_m
    cell = max(xmax - xmin, ymax - ymin) / CELLS_A_SIDE
    shape = max(int((ymax - ymin) / cell), 1), max(int((xmax - xmin) / cell), 1)
    solid = _covered(polygons, (xmin, ymin), cell, shape, edges=True)
    distance = ndimage.distance_transform_edt(~np.pad(solid, 1, constant_values=True))[1:-1, 1:-1]
    room: FloatArray = np.where(solid, 0.0, np.maximum((distance - 1.0) * cell, 0.0))
    return FreeRoom((xmin, ymin), cell, room, ~_covered(forbidden, (xmin, ymin), cell, shape, edges=False))


def _covered(
    polygons: Sequence[Any], corner: tuple[float, float], cell: float, shape: tuple[int, int], edges: bool
) -> BoolArray:
    """(rows, columns) cells whose middle lies in a polygon, or through which an edge goes."""
    import shapely

    covered = np.zeros(shape, dtype=np.bool_)
    shapes = np.array(polygons, dtype=object)
    spans = (shapely.bounds(shapes) - np.tile(corner, 2)) / cell if len(shapes) else np.zeros((0, 4))
    for index in np.flatnonzero((spans[:, 2:] - spans[:, :2]).min(axis=1, initial=np.inf) > 1.0).tolist():
        left, low = (max(math.floor(each), 0) for each in spans[index, :2])
        columns = np.arange(left, min(math.ceil(spans[index, 2]) + 1, shape[1]))
        rows = np.arange(low, min(math.ceil(spans[index, 3]) + 1, shape[0]))
        shapely.prepare(shapes[index])
        x, y = np.meshgrid(corner[0] + cell * (columns + 0.5), corner[1] + cell * (rows + 0.5))
        covered[np.ix_(rows, columns)] |= shapely.contains_xy(shapes[index], x, y)
    if edges and len(shapes):
        points = shapely.get_coordinates(shapely.segmentize(shapely.boundary(shapes), cell / 2))
        column, row = np.floor((points - corner) / cell).astype(np.int64).T
        kept = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
        covered[row[kept], column[kept]] = True
    return covered


def ends(room: FreeRoom, turn_radius_m: float, clearance_m: float, corridor_turns: float) -> Ends | None:
    """Start and goal: two places far apart with room to turn, joined by a corridor; None where there are none.

    The corridor has room to both sides of its middle beyond the clearance, in turn radii of the aircraft.
    """
    from scipy import ndimage

    corridors, _ = ndimage.label(room.room_m >= clearance_m + corridor_turns * turn_radius_m)
    for turns in TURNS:
        fits = (room.room_m >= clearance_m + turns * turn_radius_m) & (corridors > 0) & room.allowed
        numbers = np.unique(corridors[fits]).tolist()
        found = [_farthest(np.argwhere(fits & (corridors == number)), room) for number in numbers]
        gap, pair = max(found, key=lambda each: each[0], default=(0.0, np.zeros((2, 2))))
        if gap > 0.0 and gap * room.cell_m >= LEAST_WAY * turn_radius_m:
            start, goal = (np.array(room.corner_m) + (pair[:, ::-1] + 0.5) * room.cell_m).tolist()
            return (start[0], start[1]), (goal[0], goal[1])
    return None


def _farthest(cells: np.ndarray[Any, np.dtype[np.int64]], room: FreeRoom) -> tuple[float, Any]:
    """The distance of two cells far apart, and the two, the western first: the best of the extremes in directions.

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
    pair = extremes[list(np.unravel_index(int(worth.argmax()), gaps.shape))]
    pair = pair[np.lexsort((pair[:, 0], pair[:, 1]))]
    return float(np.hypot(*(pair[1] - pair[0]))), pair


def scale_that_fits(room: FreeRoom, turn_radius_m: float, clearance_m: float) -> float | None:
    """By how much a world must be made larger for `ends` to find two places across it; None where nothing helps."""
    widest = ends(room, turn_radius_m / LARGEST_SCALE, clearance_m / LARGEST_SCALE, CORRIDORS[0])
    scale = 1.0
    while widest is not None and scale < LARGEST_SCALE:
        found = ends(room, turn_radius_m / scale, clearance_m / scale, CORRIDORS[0])
        if found is not None and math.dist(*found) >= 0.5 * math.dist(*widest):
            return scale
        scale *= 1.1
    return None
