"""Outlines of cells: what is set in a mask, as polygons in columns and rows."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from harness.world_files.parts import BoolArray

MAX_RUNS: Final = 100_000
"""Cells of a mask with more runs along its rows are taken together two by two first."""


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
        factor, mask = 2 * factor, _halved(mask)
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
    scaled = shapely.transform(shapely.get_parts(whole), lambda places: factor * places)
    return list(scaled), factor


def _runs(mask: BoolArray) -> tuple[Any, Any, Any]:
    """Row, first column and column behind the last of each run of set cells along a row."""
    change = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, begins = np.nonzero(change == 1)
    return rows, begins, np.nonzero(change == -1)[1]


def _halved(mask: BoolArray) -> BoolArray:
    """Any of each two by two cells."""
    rows, columns = mask.shape
    even = np.pad(mask, ((0, rows % 2), (0, columns % 2)))
    halved: BoolArray = even[::2, ::2] | even[1::2, ::2] | even[::2, 1::2] | even[1::2, 1::2]
    return halved
