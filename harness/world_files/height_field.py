"""The ground as heights on a grid of the local plane, and as a text that a scenario file can hold.

Frame: local ENU plane, x = east, y = north, metres; heights above mean sea level, metres.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from dataclasses import dataclass
from typing import Final

import numpy as np

from harness.world_files.parts import Box, FloatArray

NO_HEIGHT: Final = 65_535
"""Number that stands for a height that is not known."""
MAX_NODES: Final = 4_000_000
"""A field has at most this many heights."""


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights at the nodes of a regular grid, bilinear in between.

    Attributes:
        corner_m: east and north of the south-western node.
        spacing_m: east and north from a node to the next.
        heights_m: (rows, columns) from south to north and west to east; NaN where the height is not known.
    """

    corner_m: tuple[float, float]
    spacing_m: tuple[float, float]
    heights_m: FloatArray

    def at(self, east_m: FloatArray, north_m: FloatArray) -> FloatArray:
        """(k,) heights of the ground; NaN outside of the grid and where one of the four nodes round a place is NaN."""
        column = (np.asarray(east_m, dtype=np.float64) - self.corner_m[0]) / self.spacing_m[0]
        row = (np.asarray(north_m, dtype=np.float64) - self.corner_m[1]) / self.spacing_m[1]
        return bilinear(self.heights_m, column, row)

    @property
    def bounds_m(self) -> Box:
        """xmin, ymin, xmax, ymax of the nodes."""
        rows, columns = self.heights_m.shape
        (east, north), (right, up) = self.corner_m, self.spacing_m
        return east, north, east + (columns - 1) * right, north + (rows - 1) * up


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
    """Linear between two values; exactly the first at 0 even where the second is NaN, and the second at 1."""
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
    """What `packed` was given, to the step.

    Raises:
        ValueError: the text is not that of so many heights.
    """
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
