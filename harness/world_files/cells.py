"""Outlines of cells: what is set in a mask, as polygons in columns and rows.

The border between set and other cells is followed from corner to corner with the set cells on its left. Where two set
cells touch at a corner only, it stays with the one it came along, so that each polygon is a piece that hangs together
by sides; a ring that comes back to such a corner is two.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.world_files.parts import BoolArray

MAX_CORNERS: Final = 400_000
"""Of a mask with more, cells are taken together two by two first."""

IntArray = NDArray[np.int64]


def outlines(mask: BoolArray) -> tuple[list[Any], int]:
    """Polygons (with holes) round the cells that are set, and how many cells a side were taken together.

    The cell in column i and row j covers i to i + 1 and j to j + 1. A mask so ragged that nobody could fly with its
    outlines is made coarser first; a coarse cell is set if any of its cells is.

    Args:
        mask: (rows, columns).
    """
    factor = 1
    corner, touching = _corners(mask)
    while np.count_nonzero(corner) > MAX_CORNERS:
        factor, mask = 2 * factor, _halved(mask)
        corner, touching = _corners(mask)
    return _polygons(_border(mask, corner, touching), mask, factor) if corner.any() else [], factor


def _halved(mask: BoolArray) -> BoolArray:
    """Any of each two by two cells."""
    rows, columns = mask.shape
    even = np.zeros((rows + rows % 2, columns + columns % 2), dtype=np.bool_)
    even[:rows, :columns] = mask
    return np.logical_or(
        np.logical_or(even[::2, ::2], even[1::2, ::2]), np.logical_or(even[::2, 1::2], even[1::2, 1::2])
    )


class _Border(NamedTuple):
    """Corners of the border, row by row, and the straight runs between them.

    Attributes:
        x: (n,) column of each corner.
        y: (n,) its row.
        touching: (n,) whether two set cells touch there at a corner only.
        begins: (m,) corner at which each run begins, as the border is followed.
        after: (m,) the run that follows it.
    """

    x: IntArray
    y: IntArray
    touching: BoolArray
    begins: IntArray
    after: IntArray


def _corners(mask: BoolArray) -> tuple[BoolArray, BoolArray]:
    """(rows + 1, columns + 1) which places of the grid are corners, and at which two set cells touch there only."""
    low_left, low_right, high_left, high_right = _about(np.pad(mask, 1))
    odd = low_left ^ low_right ^ high_left ^ high_right
    touching = (low_left == high_right) & (low_right == high_left) & (low_left != low_right)
    return odd | touching, touching


def _about(padded: BoolArray) -> tuple[BoolArray, BoolArray, BoolArray, BoolArray]:
    """Cells about each place of the grid: of the row before left and right, of the row after left and right."""
    return padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]


def _border(mask: BoolArray, corner: BoolArray, touching: BoolArray) -> _Border:
    y, x = np.nonzero(corner)
    _, low_right, high_left, high_right = (each[y, x] for each in _about(np.pad(mask, 1)))
    right, up = low_right != high_right, high_left != high_right
    columns = np.lexsort((y, x))
    # Runs along rows, then along columns, each from one corner to the next.
    first = np.concatenate((np.flatnonzero(right), columns[np.flatnonzero(up[columns])]))
    last = np.concatenate((np.flatnonzero(right) + 1, columns[np.flatnonzero(up[columns]) + 1]))
    along = int(right.sum())
    forward = np.concatenate((high_right[first[:along]], high_left[first[along:]]))
    begins, ends = np.where(forward, first, last), np.where(forward, last, first)
    # The run that goes on from a corner: along the other axis; where cells touch, the one to the left.
    out: IntArray = np.full((4, len(x)), -1)
    kind = np.where(np.arange(len(first)) < along, 0, 2) + ~forward
    out[kind, begins] = np.arange(len(first))
    on_left = np.array((2, 3, 1, 0))[kind]
    on_right = on_left ^ 1
    after = np.where(out[on_left, ends] >= 0, out[on_left, ends], out[on_right, ends])
    return _Border(x, y, touching[y, x], begins, after)


def _rings(border: _Border) -> list[list[int]]:
    """Corners of each ring; none has one twice."""
    begins, after = border.begins.tolist(), border.after.tolist()
    touching = border.touching.tolist()
    found: list[list[int]] = []
    done = bytearray(len(begins))
    for run in range(len(begins)):
        ring: list[int] = []
        at: dict[int, int] = {}
        while not done[run]:
            done[run] = 1
            corner = begins[run]
            if touching[corner]:
                if corner in at:
                    place = at[corner]
                    found.append(ring[place:])
                    for each in ring[place + 1 :]:
                        at.pop(each, None)
                    del ring[place:]
                at[corner] = len(ring)
            ring.append(corner)
            run = after[run]
        if ring:
            found.append(ring)
    return found


def _polygons(border: _Border, mask: BoolArray, factor: int) -> list[Any]:
    """Outlines with their holes: rings of one piece of set cells belong together."""
    import shapely
    from scipy import ndimage

    rings = _rings(border)
    counts = np.array([len(ring) for ring in rings])
    corners = np.concatenate([np.array(ring) for ring in rings])
    x, y = border.x[corners], border.y[corners]
    ends = np.cumsum(counts)
    begins = ends - counts
    after = np.arange(1, len(x) + 1)
    after[ends - 1] = begins
    areas = np.add.reduceat(x * y[after] - x[after] * y, begins)
    # The set cell on the left of each ring's first run.
    east, north = np.sign(x[after] - x)[begins], np.sign(y[after] - y)[begins]
    column = x[begins] - ((east < 0) | (north > 0))
    row = y[begins] - ((east < 0) | (north < 0))
    pieces, _ = ndimage.label(mask)
    piece = pieces[row, column]
    order = np.lexsort((areas < 0, piece))
    lines = shapely.linearrings(
        factor * np.column_stack((x, y)).astype(np.float64), indices=np.repeat(np.arange(len(rings)), counts)
    )
    return list(shapely.polygons(lines[order], indices=piece[order] - 1))
