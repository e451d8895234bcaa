"""Outlines of cells: what is set in a mask, as polygons in columns and rows."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.world_files.parts import BoolArray

MAX_BOXES: Final = 250_000
"""More rectangles than these are not united: cells are taken together two by two first."""


def outlines(mask: BoolArray) -> tuple[list[Any], int]:
    """Polygons (with holes) round the cells that are set, and how many cells a side were taken together.

    The cell in column i and row j covers i to i + 1 and j to j + 1. A mask so ragged that its outlines would take
    minutes is made coarser first; a coarse cell is set if any of its cells is.

    Args:
        mask: (rows, columns).
    """
    import shapely

    factor, boxes = 1, _boxes(mask)
    while boxes.shape[1] > MAX_BOXES:
        factor, mask = 2 * factor, _halved(mask)
        boxes = _boxes(mask)
    if not boxes.shape[1]:
        return [], factor
    united = shapely.union_all(shapely.box(*(factor * boxes)))
    return [each for each in shapely.get_parts(united) if each.area > 0], factor


def _halved(mask: BoolArray) -> BoolArray:
    """Any of each two by two cells."""
    rows, columns = mask.shape
    even = np.zeros((rows + rows % 2, columns + columns % 2), dtype=np.bool_)
    even[:rows, :columns] = mask
    return np.logical_or(
        np.logical_or(even[::2, ::2], even[1::2, ::2]), np.logical_or(even[::2, 1::2], even[1::2, 1::2])
    )


def _boxes(mask: BoolArray) -> NDArray[np.float64]:
    """(4, n) xmin, ymin, xmax, ymax of rectangles that cover the cells: runs of a row, joined where rows agree."""
    edges = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, begin = np.nonzero(edges == 1)
    end = np.nonzero(edges == -1)[1]
    if not len(row):
        return np.zeros((4, 0))
    # Runs with the same columns in consecutive rows make one rectangle.
    order = np.lexsort((row, end, begin))
    row, begin, end = row[order], begin[order], end[order]
    new = np.ones(len(row), dtype=np.bool_)
    new[1:] = (begin[1:] != begin[:-1]) | (end[1:] != end[:-1]) | (row[1:] != row[:-1] + 1)
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(row)) - 1
    return np.array((begin[first], row[first], end[first], row[last] + 1), dtype=np.float64)
