"""What obstacles look like from a track point: where their fans end, and how far lines lead past their edge points.

Points are (m, 2), metres, ENU; `keep` is the distance to be kept from each of them. Compiled: see `planner.compiled`.
"""

from __future__ import annotations

import math

import numpy as np

from planner.compiled import COUNTS, FLOAT, FLOATS, ROWS, compiled
from planner.interface import BoolArray, FloatArray, IntArray

EDGE_OFF_RAD = 1e-7
"""Edges are turned this much into the free sector, clear of rounding errors."""


@compiled(ROWS, FLOATS, COUNTS, COUNTS, ROWS, FLOAT, FLOAT, FLOAT, FLOAT)
def first_met(
    points: FloatArray,
    keep: FloatArray,
    order: IntArray,
    first: IntArray,
    circles: FloatArray,
    east: float,
    north: float,
    ux: float,
    uy: float,
) -> tuple[float, int]:
    """How far a ray leads before it comes too near to a point, and to which; infinite and 0: it never does.

    Args:
        points: all edge points.
        keep: distance to be kept from each.
        order: the points, as `planner.blocks.blocks` has them,
        first: where each square begins among them,
        circles: and the circle about it.
        east: where the ray begins.
        north: where the ray begins.
        ux: along the ray.
        uy: along the ray.
    """
    nearest, met = math.inf, 0
    for block in range(len(circles)):
        dx, dy, reach = circles[block, 0] - east, circles[block, 1] - north, circles[block, 2]
        ahead = dx * ux + dy * uy
        if abs(dx * uy - dy * ux) >= reach or ahead <= -reach or ahead - reach >= nearest:
            continue
        for k in range(first[block], first[block + 1]):
            i = order[k]
            dx, dy = points[i, 0] - east, points[i, 1] - north
            ahead, beside = dx * ux + dy * uy, dx * uy - dy * ux
            room = keep[i] * keep[i] - beside * beside
            if room > 0.0 and ahead > 0.0:
                entry = ahead - math.sqrt(room)
                if entry < nearest:
                    nearest, met = entry, i
    return max(nearest, 0.0), met


@compiled(ROWS, FLOATS, COUNTS, COUNTS, ROWS, COUNTS, COUNTS, COUNTS, COUNTS, COUNTS, FLOAT, FLOAT)
def fan_edges(
    points: FloatArray,
    keep: FloatArray,
    order: IntArray,
    block: IntArray,
    circles: FloatArray,
    members: IntArray,
    first: IntArray,
    counts: IntArray,
    one: IntArray,
    other: IntArray,
    east: float,
    north: float,
) -> tuple[FloatArray, IntArray]:
    """The tangents to the ends of an obstacle's fan, and how far each is free.

    Args:
        points: all edge points.
        keep: distance to be kept from each.
        order: all points by squares, see `first_met`,
        block: where each square begins,
        circles: and the circle about it.
        members: indices of the obstacle's points, those of a cell next to each other.
        first: where each cell begins in `members`.
        counts: how many points it has.
        one: a cell,
        other: and one that touches it; each pair once.
        east: of the track point.
        north: of the track point.

    Returns:
        (k, 5) unit vector, distance at which it touches, distance up to which it is free, side (1 for M, -1 for N);
        (k,) index of the point that it comes too near to first.
    """
    cells, count = len(first), 0
    left, right = np.empty((len(members), 2)), np.empty((len(members), 2))
    for j, i in enumerate(members):
        # The direction towards a point, turned to its tangents; from too near they lead square past it.
        dx, dy, kept2 = points[i, 0] - east, points[i, 1] - north, keep[i] * keep[i]
        away2 = max(dx * dx + dy * dy, 1e-12)
        inside = away2 <= kept2
        cos = 0.0 if inside else math.sqrt(away2 - kept2) / away2
        sin = 1.0 / math.sqrt(away2) if inside else keep[i] / away2
        left[j, 0], left[j, 1] = dx * cos - dy * sin, dy * cos + dx * sin
        right[j, 0], right[j, 1] = dx * cos + dy * sin, dy * cos - dx * sin
    outmost, ends = np.empty(cells, dtype=np.intp), np.empty(cells, dtype=np.bool_)
    edges, met = np.empty((2 * cells, 5)), np.empty(2 * cells, dtype=np.intp)
    for side, u in ((1.0, left), (-1.0, right)):
        for cell in range(cells):
            begin = outmost[cell] = first[cell]
            most = 0.0
            for j in range(begin + 1, begin + counts[cell]):
                beyond = side * (u[begin, 0] * u[j, 1] - u[begin, 1] * u[j, 0])
                if beyond > 0.0 and u[begin, 0] * u[j, 0] + u[begin, 1] * u[j, 1] < 0.0:
                    beyond = 2.0 - beyond  # grows with the angle between the two, up to pi
                if beyond > most:
                    outmost[cell], most = j, beyond
            ends[cell] = True
        # The fan ends in a cell whose outmost tangent lies further out than those of the cells around it.
        for pair in range(len(one)):
            j, k = outmost[one[pair]], outmost[other[pair]]
            beyond = side * (u[j, 0] * u[k, 1] - u[j, 1] * u[k, 0])
            if beyond > 0.0:
                ends[one[pair]] = False
            elif beyond < 0.0:
                ends[other[pair]] = False
        for cell in range(cells):
            j = outmost[cell]
            i = members[j]
            dx, dy = points[i, 0] - east, points[i, 1] - north
            touch2 = dx * dx + dy * dy - keep[i] * keep[i]
            if not ends[cell] or touch2 <= 0.0:
                continue
            off = side * EDGE_OFF_RAD
            towards, aside = u[j, 0] - off * u[j, 1], u[j, 1] + off * u[j, 0]
            clear, met[count] = first_met(points, keep, order, block, circles, east, north, towards, aside)
            edges[count] = (towards, aside, math.sqrt(touch2), clear, side)
            count += 1
    return edges[:count], met[:count]


@compiled(ROWS, COUNTS, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT)
def hugged(
    points: FloatArray,
    members: IntArray,
    east: float,
    north: float,
    ux: float,
    uy: float,
    outer: float,
    touch: float,
) -> float:
    """How far along a ray an outer distance from an obstacle, which it touches, is reached again; 0: it never is.

    Args:
        points: all edge points.
        members: indices of the obstacle's.
        east: where the ray begins.
        north: where the ray begins.
        ux: along the ray.
        uy: along the ray.
        outer: that distance.
        touch: distance along the ray at which it touches.
    """
    begin, end, count = np.empty(len(members)), np.empty(len(members)), 0
    for i in members:
        dx, dy = points[i, 0] - east, points[i, 1] - north
        ahead, beside = dx * ux + dy * uy, dx * uy - dy * ux
        reach = outer * outer - beside * beside
        if reach > 0.0 and ahead > -outer:
            half = math.sqrt(reach)
            begin[count], end[count] = ahead - half, ahead + half
            count += 1
    furthest = 0.0
    for i, k in enumerate(np.argsort(begin[:count])):
        if i and begin[k] > furthest > touch:
            return furthest
        furthest = max(furthest, end[k]) if i else end[k]
    return furthest


@compiled(ROWS, FLOATS, FLOAT, FLOAT, FLOAT, FLOAT)
def entered(
    points: FloatArray, keep: FloatArray, ax: float, ay: float, bx: float, by: float
) -> tuple[FloatArray, IntArray]:
    """The discs about points that the line from a to b enters: distances from a, and their indices.

    A disc that holds `a` counts only when the line leads deeper into it.
    """
    entry, which, count = np.empty(len(points)), np.empty(len(points), dtype=np.intp), 0
    length = math.hypot(bx - ax, by - ay)
    if length < 1e-9:
        return entry[:0], which[:0]
    ux, uy = (bx - ax) / length, (by - ay) / length
    for i in range(len(points)):
        dx, dy = points[i, 0] - ax, points[i, 1] - ay
        ahead, beside = dx * ux + dy * uy, dx * uy - dy * ux
        past = max(ahead - length, 0.0)
        room = keep[i] * keep[i] - beside * beside
        if room > past * past and ahead > 0.0:
            entry[count], which[count] = ahead - math.sqrt(room), i
            count += 1
    return entry[:count], which[:count]


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
