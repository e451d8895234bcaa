"""What a world file holds, whatever its format: solid parts with a height band, terrain, occupied cells.

Heights are metres; places x, y in the file's coordinate reference system (longitude first), or metres of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Affine = tuple[float, float, float, float, float, float]
Box = tuple[float, float, float, float]  # xmin, ymin, xmax, ymax

WGS84: Final = "EPSG:4326"  # latitude and longitude
FOOT_M: Final = 0.3048
LEVEL_M: Final = 3.0  # height of a storey (m), for a building whose file gives only the number of storeys


class Datum(Enum):
    """The reference that a height is counted from."""

    SEA = "above mean sea level"
    GROUND = "above ground"


@dataclass(frozen=True, slots=True)
class Limit:
    """The bottom or the top of a part: a height above its datum, infinite where there is no limit."""

    height_m: float
    datum: Datum = Datum.SEA


NO_BOTTOM: Final = Limit(-math.inf)  # a part without a bottom begins at the ground, or below
NO_TOP: Final = Limit(math.inf)  # a part without a top has no end upwards


@dataclass(frozen=True, slots=True)
class Part:
    """A solid: a shapely Polygon or MultiPolygon in the coordinates of the file, between two heights.

    Where `keep_in`, the footprint is free, and all outside is solid (an inclusion fence). What is `rigid` stands level
    on the ground below it, as a building; limits above ground of others follow the ground. The name is for messages.
    """

    footprint: Any
    bottom: Limit = NO_BOTTOM
    top: Limit = NO_TOP
    name: str = ""
    keep_in: bool = False
    rigid: bool = False

    @property
    def is_limited(self) -> bool:
        """Whether it has a bottom or a top."""
        return (self.bottom, self.top) != (NO_BOTTOM, NO_TOP)


@dataclass(frozen=True, eq=False)
class Raster:
    """Numbers in rows and columns, the first row on top: heights above mean sea level (m), NaN where there is none.

    Of an `occupancy` map they are 1 where a cell is occupied, 0 where it is free, NaN where it is not known. The affine
    a, b, c, d, e, f puts the corner of column i and row j at x = a i + b j + c, y = d i + e j + f; the value belongs to
    the middle of a cell.
    """

    values: FloatArray
    affine: Affine
    occupancy: bool = False

    @property
    def middle_x(self) -> float:
        """X of the raster's middle, in the coordinates of the file."""
        return float(self.places(*np.multiply(0.5, self.values.shape[::-1]))[0])

    def window(self, rows: slice, columns: slice) -> Raster:
        """Returns some of the rows and columns."""
        (x,), (y,) = self.places(np.array([columns.start]), np.array([rows.start]))
        a, b, _, d, e, _ = self.affine
        return replace(self, values=self.values[rows, columns], affine=(a, b, float(x), d, e, float(y)))

    def places(self, column: FloatArray, row: FloatArray) -> tuple[FloatArray, FloatArray]:
        """X and y of places given in columns and rows from the upper left corner."""
        a, b, c, d, e, f = self.affine
        return a * column + b * row + c, d * column + e * row + f

    def cells(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns and rows from the upper left corner of places given as x and y."""
        a, b, c, d, e, f = self.affine
        determinant = a * e - b * d
        return (e * (x - c) - b * (y - f)) / determinant, (a * (y - f) - d * (x - c)) / determinant


@dataclass(frozen=True, eq=False)
class Contents:
    """Parts or raster of a file, its crs as pyproj takes it (None for metres of its own), and notes on assumptions."""

    crs: str | None
    parts: tuple[Part, ...] = ()
    raster: Raster | None = None
    notes: tuple[str, ...] = ()
    kind: str = ""
    sha256: str = ""

    @property
    def terrain(self) -> Raster | None:
        """The raster if it holds heights of the ground, else None."""
        return None if self.raster is None or self.raster.occupancy else self.raster

    @property
    def corners(self) -> tuple[FloatArray, FloatArray]:
        """X and y, in the file, of the corners of its raster and of each part's box; empty where it has neither."""
        found = [np.zeros((0, 2))]
        if self.raster is not None:
            rows, columns = self.raster.values.shape
            across, down = np.array([0.0, columns, columns, 0.0]), np.array([0.0, 0.0, rows, rows])
            found.append(np.column_stack(self.raster.places(across, down)))
        bounds = shapely.bounds(np.array([part.footprint for part in self.parts], dtype=object))
        found += [bounds[:, [i, j]] for i in (0, 2) for j in (1, 3)]
        x, y = np.concatenate(found).T
        return x, y


@dataclass(frozen=True)
class FileSpec:
    """One file of a scenario, as its key `file` has it."""

    path: Path
    kind: str | None = None
    vertical_clearance_m: float = 10.0
    metres_per_cell: float | None = None
    shift_m: tuple[float, float] = (0.0, 0.0)
    crs: str | None = None
    tolerance_m: float | None = None
    nodata: str = "solid"
    unknown: str = "free"
    default_height_m: float = 6.0
    ground_m: float | None = None
    active_s: tuple[float, float] | None = None  # of its obstacle
