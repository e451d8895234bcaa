"""Obstacles as seen from a track point: where their fans end, and how far lines lead past their edge points.

Metres, ENU. `buckets` are all edge points by squares. `own` are those of one obstacle, (3, m): east, north and the
distance to be kept from each. Its `cells`, of a `side`, are `planner.kernels.buckets.Cells`. A ray begins at (east,
north), along (ux, uy). Compiled: see `planner.kernels`.
"""

from __future__ import annotations

import math

import numpy as np

from planner.compiled import BOOLS_OUT, COUNT, COUNTS_OUT, FLOAT, FLOATS_OUT, INTS, POINT, ROWS, compiled
from planner.interface import BoolArray, FloatArray, IntArray
from planner.kernels.buckets import BUCKETS, Buckets, Cells

CELLS = f"UniTuple({INTS}, 4)"
RAY = "UniTuple(float64, 4)"  # numba type of a ray: east, north, unit vector
Point = tuple[float, float]
Ray = tuple[float, float, float, float]

EDGE_OFF_RAD = 1e-7  # edges are turned this much into the free sector, clear of rounding errors


@compiled(BUCKETS, RAY)
def first_met(buckets: Buckets, ray: Ray) -> tuple[float, int]:
    """Distance along a ray at which it comes too near to a point, and the point's index; infinite and 0: never."""
    (places, first, circles), (east, north, ux, uy) = buckets, ray
    nearest, met = math.inf, 0
    for block in range(len(first) - 1):
        dx, dy, reach = circles[0, block] - east, circles[1, block] - north, circles[2, block]
        ahead = dx * ux + dy * uy
        if abs(dx * uy - dy * ux) >= reach or not -reach < ahead < nearest + reach:
            continue
        for k in range(first[block], first[block + 1]):
            dx, dy = places[0, k] - east, places[1, k] - north
            ahead, beside = dx * ux + dy * uy, dx * uy - dy * ux
            room = places[2, k] * places[2, k] - beside * beside
            if room > 0.0 and ahead > 0.0 and ahead - math.sqrt(room) < nearest:
                nearest, met = ahead - math.sqrt(room), k
    return max(nearest, 0.0), met


@compiled(FLOATS_OUT, FLOATS_OUT, COUNT, COUNT, inner=True)
def _sift_down(key: FloatArray, value: FloatArray, place: int, count: int) -> None:
    """Restores a binary heap of `count` pairs, least key first, in which the key at `place` may be too great."""
    while 2 * place + 1 < count:
        child = 2 * place + 1
        if child + 1 < count and key[child + 1] < key[child]:
            child += 1
        if key[place] <= key[child]:
            return
        key[place], key[child] = key[child], key[place]
        value[place], value[child] = value[child], value[place]
        place = child


@compiled(ROWS, CELLS, FLOAT, RAY, FLOAT, FLOAT, inner=True)
def hugged(own: FloatArray, cells: Cells, side: float, ray: Ray, outer: float, touch: float) -> float:
    """Distance along a ray that touches an obstacle at which it is `outer` away from the obstacle again; 0: never."""
    first, counts, _, _ = cells
    east, north, ux, uy = ray
    # Stretches of the ray near to a point that end beyond the touch.
    begin, end, count = np.empty(own.shape[1]), np.empty(own.shape[1]), 0
    within = outer + 1.5 * side  # points of one cell lie no further apart than its diagonal
    for cell in range(len(first)):
        dx, dy = own[0, first[cell]] - east, own[1, first[cell]] - north
        if abs(dx * uy - dy * ux) >= within or dx * ux + dy * uy <= -within:
            continue
        for j in range(first[cell], first[cell] + counts[cell]):
            dx, dy = own[0, j] - east, own[1, j] - north
            ahead, beside = dx * ux + dy * uy, dx * uy - dy * ux
            half = math.sqrt(max(outer * outer - beside * beside, 0.0))
            if half > 0.0 and ahead + half > touch:
                begin[count], end[count] = ahead - half, ahead + half
                count += 1
    # From the first on, which a heap gives: those that overlap are one.
    for k in range(count // 2 - 1, -1, -1):
        _sift_down(begin, end, k, count)
    furthest = 0.0
    while count and not begin[0] > furthest > touch:
        furthest, count = max(furthest, end[0]), count - 1
        begin[0], end[0] = begin[count], end[count]
        _sift_down(begin, end, 0, count)
    return furthest


@compiled(ROWS, COUNT, CELLS, COUNTS_OUT, BOOLS_OUT, inner=True)
def _find_ends(tangents: FloatArray, row: int, cells: Cells, outmost: IntArray, ends: BoolArray) -> None:
    """Writes the outmost point of each cell, and whether the fan ends there, on the left (row 0) or the right (2).

    `tangents` are (4, m) unit vectors: those on the left of the points, then those on the right.
    """
    side, (first, counts, one, other) = 1.0 - row, cells
    east, north = np.empty(len(first)), np.empty(len(first))
    # Written without branches, which depend on numbers that no processor foresees.
    for cell in range(len(first)):
        begin = furthest = first[cell]
        ux, uy, most = tangents[row, begin], tangents[row + 1, begin], 0.0
        for j in range(begin + 1, begin + counts[cell]):
            u, v = tangents[row, j], tangents[row + 1, j]
            beyond = side * (ux * v - uy * u)
            # It grows with the angle between the two, up to pi.
            beyond = 2.0 - beyond if (beyond > 0.0) & (ux * u + uy * v < 0.0) else beyond
            furthest = j if beyond > most else furthest
            most = max(most, beyond)
        outmost[cell], ends[cell] = furthest, True
        east[cell], north[cell] = tangents[row, furthest], tangents[row + 1, furthest]
    # The fan ends in a cell whose outmost tangent lies further out than those of the cells around it.
    for pair in range(len(one)):
        a, b = one[pair], other[pair]
        beyond = side * (east[a] * north[b] - north[a] * east[b])
        ends[a] &= not beyond > 0.0
        ends[b] &= not beyond < 0.0


@compiled(BUCKETS, INTS, ROWS, CELLS, FLOAT, POINT, FLOAT)
def fan_edges(
    buckets: Buckets,
    labels: IntArray,
    own: FloatArray,
    cells: Cells,
    side: float,
    origin: Point,
    outer: float,
) -> tuple[FloatArray, IntArray, int]:
    """Finds the tangents to the ends of an obstacle's fan that are free up to the touch, and what hides the others.

    Returns:
        (k, 6) unit vector, distance at which it touches, distance up to which it is free, side (1 for M, -1 for N),
        distance at which the outer distance is reached again (`hugged`);
        (h,) the obstacles that hide a tangent, or close it right behind the place where it touches;
        how many tangents were looked along.
    """
    (places, _, _), (east, north) = buckets, origin
    many, count = len(cells[0]), 0
    tangents = np.empty((4, own.shape[1]))
    for j in range(own.shape[1]):
        # The direction towards a point, turned to its tangents; from too near they lead square past it.
        dx, dy, keep = own[0, j] - east, own[1, j] - north, own[2, j]
        away2 = max(dx * dx + dy * dy, 1e-12)
        cos = math.sqrt(max(away2 - keep * keep, 0.0)) / away2
        sin = 1.0 / math.sqrt(away2) if away2 <= keep * keep else keep / away2
        tangents[0, j], tangents[1, j] = dx * cos - dy * sin, dy * cos + dx * sin
        tangents[2, j], tangents[3, j] = dx * cos + dy * sin, dy * cos - dx * sin
    outmost, ends = np.empty(many, dtype=np.intp), np.empty(many, dtype=np.bool_)
    edges, hiding, hides, looked = np.empty((2 * many, 6)), np.empty(2 * many, dtype=np.intp), 0, 0
    for row in range(0, 4, 2):
        hand = 1.0 - row
        _find_ends(tangents, row, cells, outmost, ends)
        for cell in range(many):
            if not ends[cell]:
                continue
            j = outmost[cell]
            dx, dy, keep = own[0, j] - east, own[1, j] - north, own[2, j]
            touch2 = dx * dx + dy * dy - keep * keep
            if touch2 <= 0.0:
                continue
            off, x, y = hand * EDGE_OFF_RAD, tangents[row, j], tangents[row + 1, j]
            towards, aside = x - off * y, y + off * x
            touch = math.sqrt(touch2)
            ray = (east, north, towards, aside)
            clear, met = first_met(buckets, ray)
            looked += 1
            if clear >= touch:
                edges[count, 0], edges[count, 1], edges[count, 2] = towards, aside, touch
                edges[count, 3], edges[count, 4] = clear, hand
                edges[count, 5] = hugged(own, cells, side, ray, outer, touch)
                count += 1
            if clear < touch + places[2, met] and not (hides and hiding[hides - 1] == labels[met]):
                hiding[hides] = labels[met]
                hides += 1
    return edges[:count], hiding[:hides], looked


@compiled(BUCKETS, POINT, POINT, COUNT)
def entered(buckets: Buckets, a: Point, b: Point, most: int) -> tuple[FloatArray, IntArray]:
    """The discs about points by squares that the line from a to b enters: distances from a, and their indices.

    A disc that holds `a` counts only when the line leads deeper into it. At most `most` discs are returned.
    """
    (places, first, circles), (ax, ay), (bx, by) = buckets, a, b
    most = min(most, len(places[0]))
    entry, which, count = np.empty(most), np.empty(most, dtype=np.intp), 0
    length = math.hypot(bx - ax, by - ay)
    if length < 1e-9:
        return entry[:0], which[:0]
    ux, uy = (bx - ax) / length, (by - ay) / length
    for block in range(len(first) - 1):
        dx, dy, reach = circles[0, block] - ax, circles[1, block] - ay, circles[2, block]
        ahead = dx * ux + dy * uy
        if abs(dx * uy - dy * ux) >= reach or ahead <= -reach or ahead - reach >= length:
            continue
        for k in range(first[block], first[block + 1]):
            dx, dy = places[0, k] - ax, places[1, k] - ay
            ahead, beside = dx * ux + dy * uy, dx * uy - dy * ux
            past = max(ahead - length, 0.0)
            room = places[2, k] * places[2, k] - beside * beside
            if room > past * past and ahead > 0.0:
                entry[count], which[count] = ahead - math.sqrt(room), k
                count += 1
                if count == most:
                    return entry, which
    return entry[:count], which[:count]


@compiled(BUCKETS, ROWS)
def shortcuts(buckets: Buckets, nodes: FloatArray) -> tuple[IntArray, int]:
    """Drops those of (n, 2) track points that lie between one and the furthest that it sees.

    Returns:
        (k,) indices of the points left, the first and the last among them; number of lines tested.
    """
    indices, count, here, lines = np.zeros(len(nodes), dtype=np.intp), 1, 0, 0
    while here < len(nodes) - 1:
        there = len(nodes) - 1
        while there > here + 1:
            a, b = nodes[here], nodes[there]
            lines += 1
            if not len(entered(buckets, (a[0], a[1]), (b[0], b[1]), 1)[1]):
                break
            there -= 1
        here = there
        indices[count] = here
        count += 1
    return indices[:count], lines


@compiled(ROWS, ROWS)
def encircled(loop: FloatArray, points: FloatArray) -> BoolArray:
    """(m,) whether a closed polyline (k, 2) goes round each point an odd number of times."""
    odd = np.zeros(len(points), dtype=np.bool_)
    before = len(loop) - 1
    for corner in range(len(loop)):
        x0, y0, x1, y1 = loop[before, 0], loop[before, 1], loop[corner, 0], loop[corner, 1]
        for i in range(len(points)):
            y = points[i, 1]
            if (y0 <= y) != (y1 <= y) and points[i, 0] < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
                odd[i] = not odd[i]
        before = corner
    return odd
