"""The ground as heights (m) above mean sea level on a grid of the local ENU plane (m): of files, and as text."""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.polynomial.polynomial import polyvander2d

from harness.files.input_file import InputError
from harness.world_files.parts import Box, FloatArray, Raster

if TYPE_CHECKING:
    from harness.world_files.plane import Mapping

NO_HEIGHT: Final = 65_535  # this number stands for a height that is not known
MAX_NODES: Final = 4_000_000  # a text with more is refused; a larger field is thinned out, with a note
MAX_CELLS: Final = 60_000_000  # cells of all files together in an area; with more it is refused
LARGEST_DEGREE: Final = 8  # of the polynomials that say where the cells of a file lie
PLACE_ERROR_CELLS: Final = 1e-3  # polynomials of the least degree with at most this error are taken
SAMPLES: Final = 41  # number of samples a side of the box, for the polynomials
ALIGNED_CELLS: Final = 0.01  # cells of a file no further than this from those of another are the same
OTHER_CELLS: Final = "where a file has other cells than the finest, the ground is kept no lower than it"
NEWTON_STEPS: Final = 10  # number of Newton steps to the place of a node, with the slope in the middle


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights at the nodes of a grid, bilinear in between, (rows, columns) from south to north; NaN: not known.

    The corner is the south-western node, the spacing is east and north from a node to the next. With a `lattice` the
    nodes are the middles of a file's cells, which lie askew: it has (2, k, k) coefficients of column and row by powers
    of east and of north, both counted from the corner, now in the middle, and over `scale_m`; the spacing is then the
    least between two lines of nodes.
    """

    corner_m: tuple[float, float]
    spacing_m: tuple[float, float]
    heights_m: FloatArray
    lattice: FloatArray | None = None
    scale_m: float = 1.0

    def at(self, east_m: FloatArray, north_m: FloatArray) -> FloatArray:
        """(k,) heights of the ground; NaN outside of the grid and where one of the four nodes round a place is NaN."""
        return bilinear(self.heights_m, *self.cells(east_m, north_m))

    def cells(self, east_m: FloatArray, north_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns and rows of places, 0 at the first node."""
        right, up = np.subtract(east_m, self.corner_m[0]), np.subtract(north_m, self.corner_m[1])
        if self.lattice is None:
            return right / self.spacing_m[0], up / self.spacing_m[1]
        u, v = (np.power.outer(each / self.scale_m, np.arange(self.lattice.shape[1])) for each in (right, up))
        column, row = ((u @ each * v).sum(axis=-1) for each in self.lattice)
        return column, row

    def places(self, column: FloatArray, row: FloatArray) -> tuple[FloatArray, FloatArray]:
        """East and north (m) of columns and rows."""
        (x, y), (right, up) = self.corner_m, self.spacing_m
        if self.lattice is None:
            return x + right * column, y + up * row
        inverse = self.scale_m * np.linalg.inv(self.lattice[:, [1, 0], [0, 1]])
        place = np.full((2, *np.shape(column)), np.reshape(self.corner_m, (2, *(1,) * np.ndim(column))))
        for _ in range(NEWTON_STEPS):
            place += np.tensordot(inverse, np.subtract((column, row), self.cells(*place)), 1)
        return place[0], place[1]


def bilinear(values: FloatArray, column: FloatArray, row: FloatArray) -> FloatArray:
    """(k,) bilinear values at columns and rows; NaN outside, and where a node that counts there is NaN."""
    rows, columns = values.shape
    inside = (column >= 0) & (column <= columns - 1) & (row >= 0) & (row <= rows - 1)
    left = np.clip(np.where(inside, column, 0.0).astype(np.int64), 0, max(columns - 2, 0))
    low = np.clip(np.where(inside, row, 0.0).astype(np.int64), 0, max(rows - 2, 0))
    right, high = np.minimum(left + 1, columns - 1), np.minimum(low + 1, rows - 1)
    u, v = column - left, row - low
    lower = _interpolate(values[low, left], values[low, right], u)
    upper = _interpolate(values[high, left], values[high, right], u)
    return np.where(inside, _interpolate(lower, upper, v), np.nan)


def _interpolate(first: FloatArray, second: FloatArray, share: FloatArray) -> FloatArray:
    """Interpolates linearly; gives exactly the first value at 0 even where the second is NaN, and the second at 1."""
    return np.where(share <= 0.0, first, np.where(share >= 1.0, second, first + share * (second - first)))


def packed(heights_m: FloatArray, lowest_m: float, step_m: float) -> str:
    """Heights as base64 of zlib of little-endian uint16 steps eastwards; n: `lowest_m + n * step_m`; 65535: NaN."""
    numbers = np.round((heights_m - lowest_m) / step_m)
    whole = np.where(np.isfinite(numbers), numbers, NO_HEIGHT).astype(np.uint16)
    differences = np.diff(whole, axis=1, prepend=np.uint16(0)).astype("<u2")
    return base64.b64encode(zlib.compress(differences.tobytes(), 6)).decode("ascii")


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
    """Returns the ground in a box of the plane, with nodes in the middles of the files' cells, and notes on changes.

    A height is bilinear between the middles of a file's cells, and that of the next middle within a cell beyond them.
    Of several files the first that knows a place counts, and the nodes are those of the finest. Where nodes are not
    those of a file, they are no lower than it is within a node's cell about. None where no file reaches into the box.
    """
    if not (near := [(sides, at) for at in sources if (sides := _spacing(*at, box))]):
        return None, []
    finest, mapping = min(near, key=lambda each: min(each[0]))[1]
    field, low, high = _lattice(finest, mapping, box)
    reaches = np.array([_reach(field, *at, box) for _, at in near])
    low, high = np.maximum(low, reaches[:, 0].min(axis=0)), np.minimum(high, reaches[:, 1].max(axis=0))
    columns, rows = (np.arange(low[k], high[k] + 1) for k in (0, 1))
    if len(rows) * len(columns) > MAX_CELLS:
        raise InputError(f"has {len(rows)} x {len(columns)} cells in the area; make area.bounds_m smaller")
    heights, notes = _heights(near, columns, rows)
    if not np.isfinite(heights).any():
        return None, []
    if (step := math.ceil(math.sqrt(heights.size / (0.95 * MAX_NODES)))) > 1:
        whole = [(0, (1 - size) % step) for size in heights.shape]  # the last node is at the edge or beyond
        heights = np.pad(_highest(heights, step), whole, mode="edge")[::step, ::step]
        notes.append(f"the ground is kept every {step} cells, no lower than between: its area is large")
    assert field.lattice is not None
    lattice = field.lattice / step
    lattice[:, 0, 0] -= low / step
    if np.linalg.det(lattice[:, [1, 0], [0, 1]]) < 0.0:  # rows go from the north, as in most files
        heights, lattice[1] = heights[::-1], -lattice[1]
        lattice[1, 0, 0] += len(heights) - 1
    spacing = field.spacing_m[0] * step, field.spacing_m[1] * step
    return replace(field, heights_m=heights, lattice=lattice, spacing_m=spacing), notes


def _heights(
    near: Sequence[tuple[tuple[float, float], tuple[Raster, Mapping]]], columns: FloatArray, rows: FloatArray
) -> tuple[FloatArray, list[str]]:
    """Returns the heights at columns and rows of the finest of some files, given with their cells' sides, and notes."""
    sides_m, (finest, mapping) = min(near, key=lambda each: min(each[0]))
    heights, notes = np.full((len(rows), len(columns)), np.nan), []
    for beyond in (0, 1):
        for each_m, (raster, at) in near:
            missing = np.isnan(heights)
            if raster is finest:
                last = np.subtract(raster.values.shape, 1)
                i, j = np.clip(rows, 0, last[0]), np.clip(columns, 0, last[1])
                missing &= (np.abs(rows - i) <= beyond)[:, None] & (np.abs(columns - j) <= beyond)
                np.copyto(heights, raster.values[np.ix_(i, j)], where=missing)
            elif missing.any():
                row, column = (each[missing] for each in np.meshgrid(rows, columns, indexing="ij"))
                x, y = mapping.to_plane(*finest.places(column + 0.5, row + 0.5))
                x, y = at.from_plane(x, y, raster.middle_x)
                places = np.array(raster.cells(x, y)) - 0.5
                heights[missing], same = _take(raster, places, beyond, math.ceil(max(sides_m) / min(each_m)))
                notes += [] if same else [OTHER_CELLS]
    return heights, list(dict.fromkeys(notes))


def _lattice(raster: Raster, mapping: Mapping, box: Box) -> tuple[HeightField, FloatArray, FloatArray]:
    """Returns a field without heights whose nodes are the cells of a file, and its first and last node in a box."""
    (west, south, east, north), shape = box, (2, SAMPLES, SAMPLES)
    x, y = np.linspace(west, east, SAMPLES), np.linspace(south, north, SAMPLES)
    middle, scale_m = (0.5 * (west + east), 0.5 * (south + north)), 0.5 * max(east - west, north - south)
    places = np.array([each.ravel() for each in np.meshgrid(x, y)])
    wanted = np.array(raster.cells(*mapping.from_plane(places[0], places[1], raster.middle_x))) - 0.5
    known = np.isfinite(wanted).all(axis=0)
    u, v = (places - np.reshape(middle, (2, 1))) / scale_m
    for degree in range(1, LARGEST_DEGREE + 1):
        powers = polyvander2d(u, v, (degree, degree))
        powers *= np.add.outer(np.arange(degree + 1), np.arange(degree + 1)).ravel() <= degree
        solved = np.linalg.lstsq(powers[known][::2], wanted[:, known][:, ::2].T, rcond=None)[0]
        lattice = np.asarray(solved.T, dtype=np.float64)
        found = lattice @ powers.T
        if np.abs(found - wanted)[:, known].max() <= PLACE_ERROR_CELLS:
            break
    slopes = np.hypot(*np.gradient(found.reshape(shape), y, x, axis=(1, 2))).max(axis=(1, 2))
    spacing = 0.999 / float(slopes[0]), 0.999 / float(slopes[1])
    shaped = lattice.reshape(2, degree + 1, degree + 1)
    field = HeightField(middle, spacing, np.zeros((0, 0)), shaped, scale_m)
    return field, np.floor(found.min(axis=1)).astype(int) - 1, np.ceil(found.max(axis=1)).astype(int) + 1


def _reach(field: HeightField, raster: Raster, mapping: Mapping, box: Box) -> tuple[FloatArray, FloatArray]:
    """Returns the first and the last node, a cell beyond the outer middles, that a file gives a field near a box."""
    rows, columns = window_of(raster, mapping, box)
    column, row = np.meshgrid(*(np.linspace(each.start, each.stop, 9) for each in (columns, rows)))
    found = field.cells(*mapping.to_plane(*raster.places(column, row)))
    low, high = ([f(each) for each in found] for f in (np.nanmin, np.nanmax))
    return np.floor(np.array(low) + 0.01).astype(int), np.ceil(np.array(high) - 0.01).astype(int)


def _take(raster: Raster, places: FloatArray, beyond: int, cells: int) -> tuple[FloatArray, bool]:
    """(k,) heights at columns and rows (2, k) from middles, and whether those are cells; else the highest near by."""
    clipped = np.clip(places, 0.0, np.array(raster.values.shape[::-1])[:, None] - 1.0)
    inside = (np.abs(places - clipped) <= beyond + ALIGNED_CELLS).all(axis=0)
    same = not inside.any() or bool(np.abs(places - np.rint(places))[:, inside].max() <= ALIGNED_CELLS)
    values, clipped = (raster.values, np.rint(clipped)) if same else (_highest(raster.values, cells), clipped)
    if not (same or beyond):  # in a hole another file may know the height
        inside &= np.isfinite(bilinear(raster.values, *clipped))
    return np.where(inside, bilinear(values, *clipped), np.nan), same


def _highest(values: FloatArray, cells: int) -> FloatArray:
    """Returns the highest value within so many columns and rows of each; NaN where none is known."""
    from scipy import ndimage

    known = np.where(np.isnan(values), -np.inf, values)
    found: FloatArray = ndimage.maximum_filter(known, 2 * cells + 1, mode="nearest")
    found[np.isneginf(found)] = np.nan
    return found


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
