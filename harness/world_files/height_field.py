"""The ground as heights (m) above mean sea level on a grid of the local ENU plane (m): of files, and as text."""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from harness.world_files.parts import Box, FloatArray, Raster

if TYPE_CHECKING:
    from harness.world_files.plane import Mapping

NO_HEIGHT: Final = 65_535  # this number stands for a height that is not known
MAX_NODES: Final = 4_000_000  # a field with more heights than this is refused
COARSER_NODES: Final = 1_000_000
"""A field that would have more heights than this is made coarser than its file, and a note says so."""


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights at the nodes of a regular grid, bilinear in between, (rows, columns) from south to north; NaN: not known.

    The corner is the south-western node, the spacing is east and north from a node to the next.
    """

    corner_m: tuple[float, float]
    spacing_m: tuple[float, float]
    heights_m: FloatArray

    def at(self, east_m: FloatArray, north_m: FloatArray) -> FloatArray:
        """(k,) heights of the ground; NaN outside of the grid and where one of the four nodes round a place is NaN."""
        column = (np.asarray(east_m, dtype=np.float64) - self.corner_m[0]) / self.spacing_m[0]
        row = (np.asarray(north_m, dtype=np.float64) - self.corner_m[1]) / self.spacing_m[1]
        return bilinear(self.heights_m, column, row)


def bilinear(values: FloatArray, column: FloatArray, row: FloatArray) -> FloatArray:
    """(k,) values between the four nodes round places in columns and rows; NaN outside, and next to a NaN.

    On a node, and on the line between two, the others do not count.
    """
    rows, columns = values.shape
    inside = (column >= 0) & (column <= columns - 1) & (row >= 0) & (row <= rows - 1)
    left = np.clip(np.where(inside, column, 0.0).astype(np.int64), 0, max(columns - 2, 0))
    low = np.clip(np.where(inside, row, 0.0).astype(np.int64), 0, max(rows - 2, 0))
    right, high = np.minimum(left + 1, columns - 1), np.minimum(low + 1, rows - 1)
    u, v = column - left, row - low
    lower = _between(values[low, left], values[low, right], u)
    upper = _between(values[high, left], values[high, right], u)
    return np.where(inside, _between(lower, upper, v), np.nan)


def _between(first: FloatArray, second: FloatArray, share: FloatArray) -> FloatArray:
    """Interpolates linearly; gives exactly the first value at 0 even where the second is NaN, and the second at 1."""
    mixed = first + share * (second - first)
    return np.where(share <= 0.0, first, np.where(share >= 1.0, second, mixed))


def packed(heights_m: FloatArray, lowest_m: float, step_m: float) -> str:
    """Heights as text: base64 of zlib of little-endian 16-bit numbers, each row the differences from west to east.

    A number n stands for `lowest_m + n * step_m`, 65535 for a height that is not known.
    """
    numbers = np.round((heights_m - lowest_m) / step_m)
    whole = np.where(np.isfinite(numbers), numbers, NO_HEIGHT).astype(np.uint16)
    differences = np.diff(whole, axis=1, prepend=np.uint16(0)).astype("<u2")
    return base64.b64encode(zlib.compress(differences.tobytes(), 9)).decode("ascii")


def unpacked(text: str, rows: int, columns: int, lowest_m: float, step_m: float) -> FloatArray:
    """Decodes the text of `packed` into heights (m); raises ValueError unless it holds rows x columns of them."""
    size = 2 * rows * columns
    if rows * columns > MAX_NODES:
        raise ValueError(f"has {rows} x {columns} heights; must be at most {MAX_NODES:,}")
    try:
        data = zlib.decompressobj().decompress(base64.b64decode(text, validate=True), size + 1)
    except (binascii.Error, zlib.error, ValueError) as error:
        raise ValueError("is not base64 of zlib; must be as wayproof wrote it") from error
    if len(data) != size:
        raise ValueError(f"does not hold {rows} x {columns} heights; must be as wayproof wrote it")
    whole = np.cumsum(np.frombuffer(data, dtype="<u2").reshape(rows, columns), axis=1, dtype=np.uint16)
    heights: FloatArray = lowest_m + step_m * whole.astype(np.float64)
    heights[whole == NO_HEIGHT] = np.nan
    return heights


def height_field(sources: Sequence[tuple[Raster, Mapping]], box: Box) -> tuple[HeightField | None, list[str]]:
    """Returns the ground in a box of the plane, at about the files' own spacing, and notes on what was changed.

    A height is bilinear between the middles of a file's cells, and that of the next middle within half a cell of the
    edge. Of several files the first that knows a place counts. None where no file reaches into the box.
    """
    known = [each for each in (_spacing(raster, mapping, box) for raster, mapping in sources) if each]
    if not known:
        return None, []
    xmin, ymin, xmax, ymax = box
    right, up = (_rounded(min(each[k] for each in known)) for k in (0, 1))
    notes = []
    nodes = ((xmax - xmin) / right + 1) * ((ymax - ymin) / up + 1)
    if nodes > COARSER_NODES:
        factor = math.ceil(math.sqrt(nodes / COARSER_NODES))
        right, up = factor * right, factor * up
        notes.append(f"the ground is kept every {right:g} m, coarser than the file: its area is large")
    columns, rows = int((xmax - xmin) / right) + 2, int((ymax - ymin) / up) + 2
    east, north = np.meshgrid(xmin + right * np.arange(columns), ymin + up * np.arange(rows))
    heights = np.full(rows * columns, np.nan)
    for raster, mapping in sources:
        missing = np.flatnonzero(np.isnan(heights))
        x, y = mapping.from_plane(east.ravel()[missing], north.ravel()[missing], raster.middle_x)
        places, sizes = np.array(raster.cells(x, y)), np.array(raster.values.shape[::-1])[:, None]
        inside = ((places >= 0) & (places <= sizes)).all(axis=0)
        column, row = np.clip(places - 0.5, 0.0, sizes - 1.0)
        heights[missing[inside]] = bilinear(raster.values, column[inside], row[inside])
    if not np.isfinite(heights).any():
        return None, []
    return HeightField((xmin, ymin), (right, up), heights.reshape(rows, columns)), notes


def window_of(raster: Raster, mapping: Mapping, box: Box) -> tuple[slice, slice]:
    """Returns the rows and the columns of a raster that cover a box of the plane."""
    x, y = np.linspace(box[:2], box[2:], 33).T
    across, along = np.meshgrid(x, box[1::2]), np.meshgrid(box[::2], y)
    east, north = (np.concatenate((across[k].ravel(), along[k].ravel())) for k in (0, 1))
    column, row = raster.cells(*mapping.from_plane(east, north, raster.middle_x))
    spans = []
    for places, size in ((row, raster.values.shape[0]), (column, raster.values.shape[1])):
        known = places[np.isfinite(places)] if np.isfinite(places).any() else np.zeros(1)
        ends = np.floor(known.min()) - 2.0, np.ceil(known.max()) + 2.0
        spans.append(slice(*np.clip(ends, 0, size).astype(int).tolist()))
    return spans[0], spans[1]


def _spacing(raster: Raster, mapping: Mapping, box: Box) -> tuple[float, float] | None:
    """Sides of a cell in metres, in the middle of what lies in the box; None where nothing does."""
    rows, columns = window_of(raster, mapping, box)
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return None
    return cell_sides(raster, mapping, 0.5 * (columns.start + columns.stop), 0.5 * (rows.start + rows.stop))


def cell_sides(raster: Raster, mapping: Mapping, column: float, row: float) -> tuple[float, float] | None:
    """Returns the lengths (m) in the plane of the two sides of a cell; None where the cell has no place there."""
    x, y = raster.places(column + np.array([0.0, 1.0, 0.0]), row + np.array([0.0, 0.0, 1.0]))
    east, north = mapping.to_plane(x, y)
    sides = np.hypot(east[1:] - east[0], north[1:] - north[0]).tolist()
    return (sides[0], sides[1]) if np.isfinite(sides).all() else None


def _rounded(spacing_m: float) -> float:
    """Rounds a spacing down to two significant digits."""
    digits = 1 - math.floor(math.log10(spacing_m))
    return math.floor(spacing_m * 10.0**digits) / 10.0**digits
