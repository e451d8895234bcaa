"""Where an aircraft has room in the local plane (m): distances from what is solid, and two places far apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import shapely
from numpy.typing import NDArray

from harness.world_files.parts import Box, FloatArray

CELLS_A_SIDE: Final = 320  # the longer side of an area is divided into this many cells
ROOM_RADII: Final = (2.5, 1.5, 1.2)  # room beyond the clearance, in turn radii; 2 hold a circle to one side
WAY_RADII: Final = 8.0  # start and goal are at least this many turn radii apart
DIRECTIONS: Final = 24  # places far apart are sought in this many directions


@dataclass(frozen=True, eq=False)
class FreeRoom:
    """Least distance from the middle of each cell to what is solid and to the border, from the south-western corner."""

    corner_m: tuple[float, float]
    cell_m: float
    room_m: FloatArray


def free_room(polygons: Sequence[Any], bounds_m: Box) -> FreeRoom:
    """Returns each cell's distance to solid polygons and to the border of an area."""
    from scipy import ndimage

    xmin, ymin, xmax, ymax = bounds_m
    cell = max(xmax - xmin, ymax - ymin) / CELLS_A_SIDE
    shape = max(int((ymax - ymin) / cell), 1), max(int((xmax - xmin) / cell), 1)
    x, y = (low + cell * (np.arange(count) + 0.5) for low, count in ((xmin, shape[1]), (ymin, shape[0])))
    solid = shapely.disjoint_subset_union_all([*polygons])
    shapely.prepare(solid)
    covered = shapely.contains_xy(solid, *np.meshgrid(x, y))
    edges = shapely.get_coordinates(shapely.segmentize(solid.boundary, cell / 2))
    column, row = np.floor((edges - (xmin, ymin)) / cell).astype(np.int64).T
    inside = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    covered[row[inside], column[inside]] = True
    distance = ndimage.distance_transform_edt(~np.pad(covered, 1, constant_values=True))[1:-1, 1:-1]
    return FreeRoom((xmin, ymin), cell, np.where(covered, 0.0, np.maximum((distance - 1.0) * cell, 0.0)))


def ends(room: FreeRoom, turn_radius_m: float, clearance_m: float, turning: bool) -> FloatArray | None:
    """(2, 2) start and goal with room to turn, in a corridor with the clearance (`turning`: a turn) aside; or None."""
    from scipy import ndimage

    corridors, _ = ndimage.label(room.room_m >= clearance_m + turning * turn_radius_m)
    for turns in ROOM_RADII:
        fits = (room.room_m >= clearance_m + turns * turn_radius_m) & (corridors > 0)
        numbers = np.unique(corridors[fits]).tolist()
        pairs = [_farthest(np.argwhere(fits & (corridors == number))) for number in numbers]
        pair = max(pairs, key=lambda pair: float(np.hypot(*(pair[1] - pair[0]))), default=np.zeros((2, 2)))
        places: FloatArray = np.array(room.corner_m) + (pair[:, ::-1] + 0.5) * room.cell_m
        if np.hypot(*(places[1] - places[0])) >= WAY_RADII * turn_radius_m:
            return places
    return None


def _farthest(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Picks the two cells that are furthest apart along one of several directions, the western one first."""
    angle = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    along = cells @ np.array((np.cos(angle), np.sin(angle)))
    best = along[:, np.ptp(along, axis=0).argmax()]
    pair: NDArray[np.int64] = cells[[best.argmin(), best.argmax()]]
    return pair[np.lexsort((pair[:, 0], pair[:, 1]))]


def covered(solid: Sequence[Any], bounds: Box) -> float:
    """Returns the share of an area that polygons cover."""
    area = shapely.box(*bounds)
    return float(shapely.intersection(shapely.union_all(solid), area).area / area.area)
