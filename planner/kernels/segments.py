"""Segments of constant curvature: places along them, and distances to points.

A path is (n, 6) rows, as in `planner.interface.Path`; arc lengths are counted from its start. All in metres.
Compiled: see `planner.kernels`.
"""

from __future__ import annotations

import math

import numpy as np

from planner.compiled import COUNT, FLOAT, FLOATS, ROWS, compiled
from planner.interface import FloatArray
from planner.kernels.buckets import BUCKETS, Buckets


@compiled(ROWS, COUNT, FLOAT, inner=True)
def pose(rows: FloatArray, which: int, along: float) -> tuple[float, float, float, float]:
    """Place (m) and tangent at a distance `along` a segment."""
    tx, ty, half = rows[which, 2], rows[which, 3], 0.5 * rows[which, 4] * along
    chord = along * (math.sin(half) / half if half else 1.0)
    cos, sin = math.cos(half), math.sin(half)
    cx, cy = tx * cos - ty * sin, ty * cos + tx * sin  # direction of the chord
    east, north = rows[which, 0] + chord * cx, rows[which, 1] + chord * cy
    return east, north, cx * cos - cy * sin, cy * cos + cx * sin


@compiled(ROWS, COUNT, FLOAT, FLOAT, inner=True)
def to_segment(rows: FloatArray, which: int, east: float, north: float) -> tuple[float, float]:
    """Distance of a place to a segment, and how far along it the nearest place is."""
    tx, ty, curvature, length = rows[which, 2], rows[which, 3], rows[which, 4], rows[which, 5]
    dx, dy = east - rows[which, 0], north - rows[which, 1]
    if abs(curvature) <= 1e-12:
        along = min(max(dx * tx + dy * ty, 0.0), length)
        return math.hypot(dx - along * tx, dy - along * ty), along
    side, radius = math.copysign(1.0, curvature), 1.0 / abs(curvature)
    # Radial unit vector at the start, seen from the centre, and the tangent in the sense of travel.
    rx, ry = side * ty, -side * tx
    dx, dy = dx + radius * rx, dy + radius * ry
    sweep = length / radius
    turn = math.atan2(dx * tx + dy * ty, dx * rx + dy * ry) % math.tau
    if turn > sweep:
        # Beyond the end the nearer end counts: the middle of the part not swept parts the two.
        turn = 0.0 if turn > 0.5 * (sweep + math.tau) else sweep
    cos, sin = radius * math.cos(turn), radius * math.sin(turn)
    return math.hypot(dx - (cos * rx + sin * tx), dy - (cos * ry + sin * ty)), turn * radius


@compiled(ROWS, ROWS)
def distances(rows: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(m,) distance of each of (m, 2) points to a path, and (m,) arc length of the nearest place."""
    nearest, arc_lengths, begins = np.full(len(points), math.inf), np.zeros(len(points)), 0.0
    for which in range(len(rows)):
        for i in range(len(points)):
            distance, along = to_segment(rows, which, points[i, 0], points[i, 1])
            if distance < nearest[i]:
                nearest[i], arc_lengths[i] = distance, begins + along
        begins += rows[which, 5]
    return nearest, arc_lengths


@compiled(ROWS, ROWS, FLOATS, FLOAT)
def first_breach(rows: FloatArray, points: FloatArray, radius: FloatArray, from_m: float) -> float:
    """Arc length at which a path is nearest to the first point that it passes within a radius of; infinite: none.

    The radii are one for all points, (1,), or one for each, (m,). What lies before `from_m` does not count.
    """
    first, begins, last = math.inf, 0.0, len(radius) - 1
    for which in range(len(rows)):
        half = 0.5 * rows[which, 5]
        east, north, _, _ = pose(rows, which, half)
        for i in range(len(points)):
            keep = radius[min(i, last)]
            dx, dy, reach = points[i, 0] - east, points[i, 1] - north, half + keep
            if dx * dx + dy * dy >= reach * reach:
                continue  # most points are out of reach
            distance, along = to_segment(rows, which, points[i, 0], points[i, 1])
            # Where a segment is nearest at its start, the path only leads away from there on.
            if distance < keep and (along > 0.0 or not which) and from_m <= begins + along < first:
                first = begins + along
        begins += rows[which, 5]
    return first


@compiled(ROWS, BUCKETS)
def comes_too_near(rows: FloatArray, buckets: Buckets) -> bool:
    """Whether a path passes a point within the distance to be kept from it."""
    places, first, circles = buckets
    for which in range(len(rows)):
        half = 0.5 * rows[which, 5]
        east, north, _, _ = pose(rows, which, half)
        for block in range(len(first) - 1):
            dx, dy, reach = circles[0, block] - east, circles[1, block] - north, half + circles[2, block]
            if dx * dx + dy * dy >= reach * reach:
                continue
            for i in range(first[block], first[block + 1]):
                distance, along = to_segment(rows, which, places[0, i], places[1, i])
                if distance < places[2, i] and (along > 0.0 or not which):  # as in `first_breach`
                    return True
    return False


@compiled(ROWS, FLOAT, FLOAT, FLOAT, FLOAT)
def rows_inside(rows: FloatArray, xmin: float, ymin: float, xmax: float, ymax: float) -> int:
    """How many segments of a path stay inside a rectangle before one that does not."""
    for which in range(len(rows)):
        for end in (0.0, rows[which, 5]):
            x, y, _, _ = pose(rows, which, end)
            if not (xmin <= x <= xmax and ymin <= y <= ymax):
                return which
        curvature = rows[which, 4]
        if abs(curvature) <= 1e-12:
            continue
        # Between its ends an arc leaves a rectangle only at one of its four outermost points.
        radius = 1.0 / abs(curvature)
        center_x = rows[which, 0] - rows[which, 3] / curvature
        center_y = rows[which, 1] + rows[which, 2] / curvature
        for sx, sy in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
            x, y = center_x + sx * radius, center_y + sy * radius
            if xmin <= x <= xmax and ymin <= y <= ymax:
                continue
            if to_segment(rows, which, x, y)[0] < 1e-6 * radius:
                return which
    return len(rows)


@compiled(ROWS, ROWS)
def to_nearest(places: FloatArray, points: FloatArray) -> FloatArray:
    """(k,) distance of each of (k, 2) places to the nearest of (m, 2) points, m; infinite where there is none."""
    away = np.empty(len(places))
    for i in range(len(places)):
        least = math.inf
        for j in range(len(points)):
            dx, dy = places[i, 0] - points[j, 0], places[i, 1] - points[j, 1]
            least = min(least, dx * dx + dy * dy)
        away[i] = math.sqrt(least)
    return away


@compiled(ROWS, FLOATS)
def poses_at(rows: FloatArray, arc_lengths: FloatArray) -> FloatArray:
    """(k, 5) places, tangents and curvatures at (k,) arc lengths of a path, clamped to its ends."""
    poses = np.empty((len(arc_lengths), 5))
    for i in range(len(arc_lengths)):
        which, along = 0, max(arc_lengths[i], 0.0)
        while along > rows[which, 5] and which < len(rows) - 1:
            along -= rows[which, 5]
            which += 1
        poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3] = pose(rows, which, min(along, rows[which, 5]))
        poses[i, 4] = rows[which, 4]
    return poses


@compiled(ROWS, FLOAT, FLOAT)
def turn_centres(poses: FloatArray, radius: float, roll: float) -> FloatArray:
    """(k, 2, 2) centres of the turns off (k, 5) poses of a path, as `poses_at` gives: to the left, and to the right.

    Where the path turns the other way, the turn begins after a straight of length `roll`.
    """
    centres = np.empty((len(poses), 2, 2))
    for i in range(len(poses)):
        for k in range(2):
            aside = radius if k == 0 else -radius
            ahead = roll if aside * poses[i, 4] < 0.0 else 0.0
            centres[i, k, 0] = poses[i, 0] + ahead * poses[i, 2] - aside * poses[i, 3]
            centres[i, k, 1] = poses[i, 1] + ahead * poses[i, 3] + aside * poses[i, 2]
    return centres
