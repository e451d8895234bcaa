"""Edge points sorted into squares of the plane, for searches near a place; compiled, see `planner.kernels`."""

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

Buckets = tuple[FloatArray, IntArray, FloatArray]
"""(3, m) east and north of points by squares and the distance to be kept from each; (b + 1,) where each square begins
among them, and the end; (3, b) centre and radius of a circle about each that holds what is to be kept from them. m."""
BUCKETS = f"Tuple(({ROWS}, {INTS}, {ROWS}))"  # the type of those as an argument


@compiled(INTS, INTS, inner=True)
def _sorted_by(keys: IntArray, order: IntArray) -> IntArray:
    """The (m,) indices of an order, those of lesser keys first and else as they were: a counting sort."""
    least = most = keys[0] if len(keys) else 0
    for key in keys:
        least, most = min(least, key), max(most, key)
    begins, indices = np.zeros(most - least + 2, dtype=np.intp), np.empty(len(order), dtype=np.intp)
    for key in keys:
        begins[key - least + 1] += 1
    for k in range(1, len(begins)):
        begins[k] += begins[k - 1]
    for i in order:
        indices[begins[keys[i] - least]] = i
        begins[keys[i] - least] += 1
    return indices


@compiled(INTS, INTS, inner=True)
def _by_squares(columns: IntArray, rows: IntArray) -> tuple[IntArray, IntArray]:
    """(m,) indices of points, column by column and row by row; (c + 1,) where each square begins, and the end."""
    order = _sorted_by(columns, _sorted_by(rows, np.arange(len(rows))))
    first, count = np.empty(len(rows) + 1, dtype=np.intp), 0
    for k in range(len(order)):
        if not k or columns[order[k]] != columns[order[k - 1]] or rows[order[k]] != rows[order[k - 1]]:
            first[count] = k
            count += 1
    first[count] = len(order)
    return order, first[: count + 1]


@compiled(ROWS, INTS, FLOAT)
def cells_of(points: FloatArray, some: IntArray, side: float) -> tuple[IntArray, Cells]:
    """Sorts the points of some indices into squares of `side`; those in one square count as one piece of wall.

    Returns:
        (m,) the indices, square by square; the squares.
    """
    columns, rows = np.empty(len(some), dtype=np.intp), np.empty(len(some), dtype=np.intp)
    for k in range(len(some)):
        columns[k], rows[k] = math.floor(points[some[k], 0] / side), math.floor(points[some[k], 1] / side)
    order, first = _by_squares(columns, rows)
    count, touching, right = len(first) - 1, 0, 0
    one, other = np.empty(4 * count, dtype=np.intp), np.empty(4 * count, dtype=np.intp)
    column, row, counts = np.empty_like(first), np.empty_like(first), np.empty(count, dtype=np.intp)
    for square in range(count):
        column[square], row[square] = columns[order[first[square]]], rows[order[first[square]]]
        counts[square] = first[square + 1] - first[square]
    for square in range(count):
        east = column[square] + 1
        while right < count and (column[right], row[right]) < (east, row[square] - 1):
            right += 1
        for beside in (square + 1 if square + 1 < right else count, right, right + 1, right + 2):
            if beside < count and column[beside] <= east and abs(row[beside] - row[square]) <= 1:
                one[touching], other[touching] = square, beside
                touching += 1
    return some[order], (first[:count], counts, one[:touching], other[:touching])


@compiled(COUNT, INTS, INTS)
def joined(count: int, one: IntArray, other: IntArray) -> IntArray:
    """(count,) the first square of the group that each square is joined to by touching pairs: union-find."""
    first = np.arange(count)
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


@compiled(ROWS, FLOATS, FLOAT)
def bucketed(points: FloatArray, keep: FloatArray, side: float) -> tuple[IntArray, Buckets]:
    """Sorts points into squares at least `side` wide; `keep` is the (n,) distance to be kept from each.

    Returns:
        (n,) indices, square by square; the points in this order.
    """
    west, south, east, north = math.inf, math.inf, -math.inf, -math.inf
    for i in range(len(points)):
        west, east = min(west, points[i, 0]), max(east, points[i, 0])
        south, north = min(south, points[i, 1]), max(north, points[i, 1])
    east, north = east - west, north - south
    side = max(side, (east + north) / TARGET_BUCKETS, math.sqrt(east * north / TARGET_BUCKETS))
    columns, rows = np.empty(len(points), dtype=np.intp), np.empty(len(points), dtype=np.intp)
    for i in range(len(points)):
        columns[i], rows[i] = int((points[i, 0] - west) / side), int((points[i, 1] - south) / side)
    order, first = _by_squares(columns, rows)
    places, circles = np.empty((3, len(points))), np.empty((3, len(first) - 1))
    for square in range(len(first) - 1):
        xmin, xmax, ymin, ymax, most = math.inf, -math.inf, math.inf, -math.inf, 0.0
        for j in range(first[square], first[square + 1]):
            x, y, keeps = points[order[j], 0], points[order[j], 1], keep[order[j]]
            places[0, j], places[1, j], places[2, j] = x, y, keeps
            xmin, xmax, ymin, ymax = min(xmin, x), max(xmax, x), min(ymin, y), max(ymax, y)
            most = max(most, keeps)
        circles[0, square], circles[1, square] = 0.5 * (xmin + xmax), 0.5 * (ymin + ymax)
        circles[2, square] = most + 0.5 * math.hypot(xmax - xmin, ymax - ymin)
    return order, (places, first, circles)
