"""Edge points by squares of the plane, so that a question about a few of them does not go through all.

Compiled: see `planner.compiled`.
"""

from __future__ import annotations

import math

import numpy as np

from planner.compiled import COUNTS, FLOAT, FLOATS, ROWS, compiled
from planner.interface import FloatArray, IntArray

MOST_BLOCKS = 4096
"""Where the squares would be more, over all of the ground, they are made larger."""


Cells = tuple[IntArray, IntArray, IntArray, IntArray]
"""(c,) where each square begins among gathered points; (c,) how many it has; (p,) twice: squares that touch each other,
diagonally too, each pair once."""

Blocks = tuple[FloatArray, IntArray, FloatArray]
"""(3, m) east and north of points by squares and the distance to be kept from each; (b + 1,) where each square begins
among them, and the end; (3, b) centre and radius of a circle about each that holds what is to be kept from them. m."""


@compiled(ROWS, COUNTS, FLOAT)
def cells(points: FloatArray, some: IntArray, side: float) -> tuple[IntArray, Cells]:
    """Some points by squares: what lies in one of them is looked at as one piece of wall.

    Args:
        points: (n, 2) all points, m.
        some: (m,) indices of those that are gathered, at least one.
        side: of the squares, m.

    Returns:
        (m,) the indices, those of a square next to each other; where the squares begin, and which touch.
    """
    column, row = np.empty(len(some), dtype=np.int64), np.empty(len(some), dtype=np.int64)
    for j, i in enumerate(some):
        column[j], row[j] = math.floor(points[i, 0] / side), math.floor(points[i, 1] / side)
    column -= column.min() - 1
    row -= row.min() - 1
    width = row.max() + 2
    keys = column * width + row
    order = np.argsort(keys, kind="mergesort")
    first, counts = np.empty(len(some), dtype=np.intp), np.zeros(len(some), dtype=np.intp)
    squares = np.empty(len(some), dtype=np.int64)
    count = 0
    for j, k in enumerate(order):
        if not j or keys[k] != squares[count - 1]:
            squares[count], first[count] = keys[k], j
            count += 1
        counts[count - 1] += 1
    squares = squares[:count]
    one, other = np.empty(4 * count, dtype=np.intp), np.empty(4 * count, dtype=np.intp)
    pairs = 0
    for step in (1, width - 1, width, width + 1):
        # As one goes on from square to square so does what lies a step further.
        k = 0
        for j in range(count):
            while k < count and squares[k] < squares[j] + step:
                k += 1
            if k < count and squares[k] == squares[j] + step:
                one[pairs], other[pairs] = j, k
                pairs += 1
    squares_of = first[:count].copy(), counts[:count].copy(), one[:pairs].copy(), other[:pairs].copy()
    return some[order], squares_of


@compiled(ROWS, FLOATS, COUNTS)
def places(points: FloatArray, keep: FloatArray, some: IntArray) -> FloatArray:
    """(3, k) east and north of k of (n, 2) points, and the distance to be kept from each, one row after the other."""
    rows = np.empty((3, len(some)))
    for j, i in enumerate(some):
        rows[0, j], rows[1, j], rows[2, j] = points[i, 0], points[i, 1], keep[i]
    return rows


@compiled(ROWS, FLOATS, FLOAT)
def blocks(points: FloatArray, keep: FloatArray, side: float) -> tuple[IntArray, Blocks]:
    """All points by squares.

    Args:
        points: (m, 2) points, m.
        keep: (m,) distance to be kept from each, m.
        side: of the squares, m.

    Returns:
        (m,) indices, those of a square next to each other; the points in this order.
    """
    if not len(points):
        return np.empty(0, dtype=np.intp), (np.empty((3, 0)), np.zeros(1, dtype=np.intp), np.empty((3, 0)))
    west, south = points[:, 0].min(), points[:, 1].min()
    east, north = points[:, 0].max() - west, points[:, 1].max() - south
    side = max(side, (east + north) / MOST_BLOCKS, math.sqrt(east * north / MOST_BLOCKS))
    width = int(north / side) + 1
    begins = np.zeros((int(east / side) + 1) * width + 1, dtype=np.intp)
    key = np.empty(len(points), dtype=np.intp)
    for i in range(len(points)):
        key[i] = int((points[i, 0] - west) / side) * width + int((points[i, 1] - south) / side)
        begins[key[i] + 1] += 1
    begins = np.cumsum(begins)
    order, at = np.empty(len(points), dtype=np.intp), begins.copy()
    for i in range(len(points)):
        order[at[key[i]]] = i
        at[key[i]] += 1
    first, circles = np.empty(len(begins), dtype=np.intp), np.empty((3, len(begins)))
    count = 0
    for square in range(len(begins) - 1):
        within = order[begins[square] : begins[square + 1]]
        if not len(within):
            continue
        x, y = points[within[0]]
        xmin, xmax, ymin, ymax, kept = x, x, y, y, 0.0
        for i in within:
            x, y = points[i]
            xmin, xmax, ymin, ymax = min(xmin, x), max(xmax, x), min(ymin, y), max(ymax, y)
            kept = max(kept, keep[i])
        circles[0, count], circles[1, count] = 0.5 * (xmin + xmax), 0.5 * (ymin + ymax)
        circles[2, count] = kept + 0.5 * math.hypot(xmax - xmin, ymax - ymin)
        first[count] = begins[square]
        count += 1
    first[count] = len(points)
    return order, (places(points, keep, order), first[: count + 1].copy(), circles[:, :count].copy())
