"""Sorts edge points into squares of the plane, so that a search near a place does not go through all points.

Compiled: see `planner.kernels`.
"""

from __future__ import annotations

import math

import numpy as np

from planner.compiled import COUNT, FLOAT, FLOATS, INTS, ROWS, compiled
from planner.interface import FloatArray, IntArray

TARGET_BUCKETS = 4096
"""Squares are widened so that the extent of the points has at most about twice this number of them."""

Cells = tuple[IntArray, IntArray, IntArray, IntArray]
"""(c,) where each square begins among gathered points; (c,) how many it has; (p,) twice: squares that touch each other,
diagonally too, each pair once."""

SortedBefore = dict[int, tuple[IntArray, tuple[IntArray, Cells]]]
"""By label of an obstacle: (m,) the indices of its points, and what `cells_of` returned for them."""

Buckets = tuple[FloatArray, IntArray, FloatArray]
"""(3, m) east and north of points by squares and the distance to be kept from each; (b + 1,) where each square begins
among them, and the end; (3, b) centre and radius of a circle about each that holds what is to be kept from them. m."""


def cells_of(points: FloatArray, some: IntArray, side: float) -> tuple[IntArray, Cells]:
    """Sorts the points of some indices into squares of `side`; those in one square count as one piece of wall.

    Returns:
        (m,) the indices, square by square; the squares.
    """
    squares = np.floor(points.take(some, axis=0) / side).astype(np.int64)
    squares -= [squares[:, 0].min() - 1, squares[:, 1].min() - 1]
    width = int(squares[:, 1].max()) + 2
    keys = squares @ (width, 1)
    order = np.argsort(keys, kind="stable")
    return some[order], _touching(keys[order], width)


def _touching(keys: IntArray, width: int) -> Cells:
    """Returns the `Cells` of (m,) sorted keys; a key is column times `width` (rows + 1) plus row."""
    first = np.flatnonzero(np.concatenate(((True,), keys[1:] != keys[:-1])))
    squares, counts = keys[first], np.concatenate((first[1:], (len(keys),))) - first
    beside = squares + np.array(((1,), (width - 1,), (width,), (width + 1,)))
    there = np.searchsorted(squares, beside)
    touched = squares[np.minimum(there, len(squares) - 1)] == beside
    return first, counts, np.flatnonzero(touched) % len(squares), there[touched]


@compiled(COUNT, INTS, INTS)
def joined(count: int, one: IntArray, other: IntArray) -> IntArray:
    """(count,) the first square of the group that each square is joined to by touching pairs: union-find."""
    first = np.empty(count, dtype=np.intp)
    for square in range(count):
        first[square] = square
    for pair in range(len(one)):
        a, b = one[pair], other[pair]
        while first[a] != a:
            first[a] = first[first[a]]
            a = first[a]
        while first[b] != b:
            first[b] = first[first[b]]
            b = first[b]
        first[max(a, b)] = min(a, b)
    for square in range(count):
        first[square] = first[first[square]]
    return first


def gathered(points: FloatArray, keep: FloatArray, some: IntArray) -> FloatArray:
    """(3, k) east and north of k of (n, 2) points, and the distance to be kept from each, one row after the other."""
    rows = np.empty((3, len(some)))
    rows[:2], rows[2] = points.take(some, axis=0).T, keep.take(some)  # an index takes five times as long
    return rows


def bucketed(points: FloatArray, keep: FloatArray, side: float) -> tuple[IntArray, Buckets]:
    """Sorts points into squares at least `side` wide; `keep` is the (n,) distance to be kept from each.

    Returns:
        (n,) indices, square by square; the points in this order.
    """
    order, first, circles = _in_squares(points, keep, side)
    return order, (gathered(points, keep, order), first, circles)


@compiled(ROWS, FLOATS, FLOAT)
def _in_squares(points: FloatArray, keep: FloatArray, side: float) -> tuple[IntArray, IntArray, FloatArray]:
    """Returns the indices and the buckets of `bucketed`, without its points."""
    count, order = len(points), np.empty(len(points), dtype=np.intp)
    west, south, east, north = math.inf, math.inf, -math.inf, -math.inf
    for i in range(count):
        west, east = min(west, points[i, 0]), max(east, points[i, 0])
        south, north = min(south, points[i, 1]), max(north, points[i, 1])
    if not count:
        west = south = east = north = 0.0
    east, north = east - west, north - south
    side = max(side, (east + north) / TARGET_BUCKETS, math.sqrt(east * north / TARGET_BUCKETS))
    width = int(north / side) + 1
    begins = np.zeros((int(east / side) + 1) * width + 1, dtype=np.intp)
    key = np.empty(count, dtype=np.intp)
    for i in range(count):
        key[i] = int((points[i, 0] - west) / side) * width + int((points[i, 1] - south) / side)
        begins[key[i] + 1] += 1
    used = 0
    for square in range(1, len(begins)):
        used += begins[square] > 0
        begins[square] += begins[square - 1]
    first, circles = np.empty(used + 1, dtype=np.intp), np.empty((3, used))
    at = np.empty(len(begins), dtype=np.intp)
    for square in range(len(begins)):
        at[square] = begins[square]
    for i in range(count):
        order[at[key[i]]] = i
        at[key[i]] += 1
    used = 0
    for square in range(len(begins) - 1):
        if begins[square] == begins[square + 1]:
            continue
        x, y = points[order[begins[square]], 0], points[order[begins[square]], 1]
        xmin, xmax, ymin, ymax, kept = x, x, y, y, 0.0
        for j in range(begins[square], begins[square + 1]):
            i = order[j]
            xmin, xmax = min(xmin, points[i, 0]), max(xmax, points[i, 0])
            ymin, ymax = min(ymin, points[i, 1]), max(ymax, points[i, 1])
            kept = max(kept, keep[i])
        circles[0, used], circles[1, used] = 0.5 * (xmin + xmax), 0.5 * (ymin + ymax)
        circles[2, used] = kept + 0.5 * math.hypot(xmax - xmin, ymax - ymin)
        first[used] = begins[square]
        used += 1
    first[used] = count
    return order, first, circles
