"""Terrain of files as one height field in the local plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from harness.world_files.height_field import HeightField
from harness.world_files.parts import FloatArray, Raster
from harness.world_files.plane import Mapping
from harness.world_files.slicing import Box, window_of

MOST_NODES: Final = 1_000_000
"""More than these make the field coarser than the file, which is told."""


def height_field(sources: Sequence[tuple[Raster, Mapping]], box: Box) -> tuple[HeightField | None, list[str]]:
    """The ground in a box of the plane, at about the file's own spacing; and what there is to say of it.

    A height is bilinear between the middles of the file's cells, and that of the next middle within half a cell of the
    edge. Of several files the first that knows a place counts.

    Args:
        sources: rasters of heights, each with the mapping of its coordinates to the plane.
        box: of the plane.

    Returns:
        None where no file reaches into the box.
    """
    spacings = [_spacing(raster, mapping, box) for raster, mapping in sources]
    known = [spacing for spacing in spacings if spacing is not None]
    if not known:
        return None, []
    xmin, ymin, xmax, ymax = box
    right, up = (_rounded(min(each[k] for each in known)) for k in (0, 1))
    notes = []
    nodes = ((xmax - xmin) / right + 1) * ((ymax - ymin) / up + 1)
    if nodes > MOST_NODES:
        factor = math.ceil(math.sqrt(nodes / MOST_NODES))
        notes.append(
            f"the ground is kept every {factor * right:g} m, coarser than the file: its area is large"
        )
        right, up = factor * right, factor * up
    columns, rows = int((xmax - xmin) / right) + 2, int((ymax - ymin) / up) + 2
    east, north = np.meshgrid(xmin + right * np.arange(columns), ymin + up * np.arange(rows))
    heights = np.full(rows * columns, np.nan)
    for raster, mapping in sources:
        missing = np.flatnonzero(np.isnan(heights))
        if len(missing):
            heights[missing] = sampled(
                raster, *mapping.from_plane(east.ravel()[missing], north.ravel()[missing], raster.middle_x)
            )
    if not np.isfinite(heights).any():
        return None, []
    return HeightField((xmin, ymin), (right, up), heights.reshape(rows, columns)), notes


def sampled(raster: Raster, x: FloatArray, y: FloatArray) -> FloatArray:
    """(k,) heights at places in a file; NaN outside, and next to a cell without a height."""
    column, row = raster.cells(x, y)
    rows, columns = raster.values.shape
    inside = (column >= 0) & (column <= columns) & (row >= 0) & (row <= rows)
    column = np.clip(np.where(inside, column, 0.0) - 0.5, 0.0, columns - 1.0)
    row = np.clip(np.where(inside, row, 0.0) - 0.5, 0.0, rows - 1.0)
    left, low = (
        np.minimum(column.astype(np.int64), max(columns - 2, 0)),
        np.minimum(row.astype(np.int64), max(rows - 2, 0)),
    )
    right, high = np.minimum(left + 1, columns - 1), np.minimum(low + 1, rows - 1)
    u, v, values = column - left, row - low, raster.values
    lower = (1 - u) * values[low, left] + u * values[low, right]
    upper = (1 - u) * values[high, left] + u * values[high, right]
    heights: FloatArray = np.where(inside, (1 - v) * lower + v * upper, np.nan)
    return heights


def _spacing(raster: Raster, mapping: Mapping, box: Box) -> tuple[float, float] | None:
    """Sides of a cell in metres, in the middle of what lies in the box; None where nothing does."""
    rows, columns = window_of(raster, mapping, box)
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return None
    row, column = 0.5 * (rows.start + rows.stop), 0.5 * (columns.start + columns.stop)
    x, y = raster.places(np.array([column, column + 1.0, column]), np.array([row, row, row + 1.0]))
    east, north = mapping.to_plane(x, y)
    if not (np.isfinite(east).all() and np.isfinite(north).all()):
        return None
    across = math.hypot(float(east[1] - east[0]), float(north[1] - north[0]))
    down = math.hypot(float(east[2] - east[0]), float(north[2] - north[0]))
    return across, down


def _rounded(spacing_m: float) -> float:
    """Down to two digits."""
    digits = 1 - math.floor(math.log10(spacing_m))
    return math.floor(spacing_m * 10.0**digits) / 10.0**digits
