"""Cells of a raster as polygons: what is set in a mask, in columns and rows, and in the local plane."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from harness.world_files.parts import BoolArray, Box, FloatArray, Raster
from harness.world_files.plane import Mapping

MAX_RUNS: Final = 100_000
"""Cells of a mask with more runs along its rows are taken together two by two first."""
LONGEST_EDGE_CELLS: Final = 64
"""Outlines of cells are bent into the plane with a point at least this often: to a hundredth of a cell."""


def outlines(mask: BoolArray) -> tuple[list[Any], int]:
    """Polygons (with holes) round the cells that are set, and how many cells a side were taken together.

    The cell in column i and row j covers i to i + 1 and j to j + 1. Of a mask so ragged that nobody could fly with its
    outlines, coarser cells are taken, each set if any of its cells is.

    Args:
        mask: (rows, columns).
    """
    import shapely

    factor = 1
    rows, begins, ends = _runs(mask)
    while len(rows) > MAX_RUNS:
        even = np.pad(mask, [(0, size % 2) for size in mask.shape])
        factor, mask = 2 * factor, even[::2, ::2] | even[1::2, ::2] | even[::2, 1::2] | even[1::2, 1::2]
        rows, begins, ends = _runs(mask)
    if not len(rows):
        return [], factor
    # Runs of the same columns in rows that follow each other are one box.
    order = np.lexsort((rows, ends, begins))
    rows, begins, ends = rows[order], begins[order], ends[order]
    goes_on = (np.diff(rows) == 1) & (np.diff(begins) == 0) & (np.diff(ends) == 0)
    first = np.flatnonzero(np.append(True, ~goes_on))
    last = np.append(first[1:], len(rows)) - 1
    boxes = shapely.box(begins[first], rows[first], ends[first], rows[last] + 1)
    whole = shapely.simplify(shapely.union_all(boxes), 0.0)
    return list(shapely.transform(shapely.get_parts(whole), lambda places: factor * places)), factor


def _runs(mask: BoolArray) -> tuple[Any, Any, Any]:
    """Row, first column and column behind the last of each run of set cells along a row."""
    change = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, begins = np.nonzero(change == 1)
    return rows, begins, np.nonzero(change == -1)[1]


def placed_cells(raster: Raster, solid: BoolArray, mapping: Mapping, box: Box) -> tuple[list[Any], int]:
    """Outlines in the plane of the cells of a raster that are solid; and how many a side were taken together.

    Args:
        raster: gives the places of the cells.
        solid: (rows, columns) which are solid.
        mapping: of the file's coordinates to the plane.
        box: cells that lie outside are left out.
    """
    import shapely

    rows, columns = window_of(raster, mapping, box)
    polygons, factor = outlines(solid[rows, columns])

    def place(points: FloatArray) -> FloatArray:
        x, y = raster.places(points[:, 0] + columns.start, points[:, 1] + rows.start)
        return np.column_stack(mapping.to_plane(x, y))

    shapes = np.array(polygons, dtype=object)
    dense = shapely.segmentize(shapes, LONGEST_EDGE_CELLS) if mapping.crs else shapes
    return list(shapely.transform(dense, place)), factor


def window_of(raster: Raster, mapping: Mapping, box: Box) -> tuple[slice, slice]:
    """Rows and columns that cover a box of the plane."""
    share = np.linspace(0.0, 1.0, 33)
    x, y = (low + share * (high - low) for low, high in ((box[0], box[2]), (box[1], box[3])))
    across, along = np.meshgrid(x, box[1::2]), np.meshgrid(box[::2], y)
    east, north = (np.concatenate((across[k].ravel(), along[k].ravel())) for k in (0, 1))
    column, row = raster.cells(*mapping.from_plane(east, north, raster.middle_x))
    spans = []
    for places, size in ((row, raster.values.shape[0]), (column, raster.values.shape[1])):
        known = np.clip(places[np.isfinite(places)], -1e9, 1e9)
        low, high = (known.min(), known.max()) if len(known) else (0.0, 0.0)
        begin = min(max(math.floor(low) - 2, 0), size)
        spans.append(slice(begin, max(min(math.ceil(high) + 2, size), begin)))
    return spans[0], spans[1]
