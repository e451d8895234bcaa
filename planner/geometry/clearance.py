"""Distances between paths and sensed edge points."""

from __future__ import annotations

import math

import numpy as np

from planner.compiled import COUNT, FLOAT, FLOATS, ROWS, compiled
from planner.geometry.curves import Point
from planner.geometry.fans import entered
from planner.interface import FloatArray, Path

EVERYWHERE = np.array([[0.0], [0.0], [math.inf]])
"""A circle that holds all: (3, 1), as `planner.geometry.blocks.blocks` has them."""


@compiled(ROWS, COUNT, FLOAT)
def _place(rows: FloatArray, which: int, along: float) -> tuple[float, float]:
    """East and north so far along a segment."""
    x, y, tx, ty = rows[which, 0], rows[which, 1], rows[which, 2], rows[which, 3]
    half = 0.5 * rows[which, 4] * along
    chord = along * (math.sin(half) / half if half else 1.0)
    cos, sin = math.cos(half), math.sin(half)
    return x + chord * (tx * cos - ty * sin), y + chord * (ty * cos + tx * sin)


@compiled(ROWS, COUNT, FLOAT, FLOAT)
def _to_segment(rows: FloatArray, which: int, east: float, north: float) -> tuple[float, float]:
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
def _distances(rows: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    nearest, stations = np.full(len(points), np.inf), np.zeros(len(points))
    begins = 0.0
    for which in range(len(rows)):
        for i in range(len(points)):
            distance, along = _to_segment(rows, which, points[i, 0], points[i, 1])
            if distance < nearest[i]:
                nearest[i], stations[i] = distance, begins + along
        begins += rows[which, 5]
    return nearest, stations


def distances(path: Path, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How near a path comes to each of some points, and where.

    Args:
        path: n segments.
        points_m: (m, 2) points.

    Returns:
        (m,) distances in metres and (m,) stations along the path of the nearest places.
    """
    return _distances(path.segments, points_m)


@compiled(ROWS, ROWS, FLOATS, FLOAT)
def _first_breach(rows: FloatArray, points: FloatArray, radius: FloatArray, from_m: float) -> float:
    first, begins, last = math.inf, 0.0, len(radius) - 1
    for which in range(len(rows)):
        half = 0.5 * rows[which, 5]
        east, north = _place(rows, which, half)
        for i in range(len(points)):
            keep = radius[min(i, last)]
            dx, dy, reach = points[i, 0] - east, points[i, 1] - north, half + keep
            if dx * dx + dy * dy >= reach * reach:
                continue  # most points are out of reach
            distance, along = _to_segment(rows, which, points[i, 0], points[i, 1])
            # Where a segment is nearest at its start, the path only leads away from there on.
            if distance < keep and (along > 0.0 or not which) and from_m <= begins + along < first:
                first = begins + along
        begins += rows[which, 5]
    return first


def first_breach(
    path: Path, points_m: FloatArray, radius_m: float | FloatArray, from_m: float = 0.0
) -> float:
    """Station at which a path first comes nearest to a point that it passes within `radius_m` of.

    Args:
        path: the path.
        points_m: (m, 2) points.
        radius_m: the distance to be kept, one for all or one for each point.
        from_m: what lies before this station does not count.

    Returns:
        The station in metres; infinite where the distance is kept.
    """
    radii_m = radius_m if isinstance(radius_m, np.ndarray) else np.array((radius_m,))
    return _first_breach(path.segments, points_m, radii_m, from_m)


@compiled(ROWS, FLOAT, FLOAT, FLOAT, FLOAT)
def _inside_bounds(rows: FloatArray, xmin: float, ymin: float, xmax: float, ymax: float) -> bool:
    for which in range(len(rows) + 1):
        end = which == len(rows)
        x, y = _place(rows, which - 1, rows[which - 1, 5]) if end else (rows[which, 0], rows[which, 1])
        if not (xmin <= x <= xmax and ymin <= y <= ymax):
            return False
    for which in range(len(rows)):
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
            if _to_segment(rows, which, x, y)[0] < 1e-6 * radius:
                return False
    return True


def inside_bounds(path: Path, bounds_m: tuple[float, float, float, float]) -> bool:
    """Whether a path stays inside a rectangle xmin, ymin, xmax, ymax."""
    return _inside_bounds(path.segments, *bounds_m)


@compiled(ROWS, FLOAT, FLOAT, FLOAT, FLOAT)
def to_nearer(points: FloatArray, ax: float, ay: float, bx: float, by: float) -> FloatArray:
    """(m,) distance of each point to the nearer of two places a and b, m."""
    away = np.empty(len(points))
    for i in range(len(points)):
        ux, uy, vx, vy = points[i, 0] - ax, points[i, 1] - ay, points[i, 0] - bx, points[i, 1] - by
        away[i] = math.sqrt(min(ux * ux + uy * uy, vx * vx + vy * vy))
    return away


def first_entry(a: Point, b: Point, points_m: FloatArray, radius_m: float | FloatArray) -> tuple[float, int]:
    """Where the line from a to b first enters one of the discs about some points.

    A disc that holds `a` counts only when the line leads deeper into it.

    Args:
        a: start.
        b: end.
        points_m: (m, 2) centres.
        radius_m: radius, one for all or one for each disc.

    Returns:
        Distance from a (m) and index of the disc; infinite and -1 where the line is clear.
    """
    discs, count = np.array((*points_m.T, _each(radius_m, points_m))), len(points_m)
    entry, which = entered(discs, np.array([0, count]), EVERYWHERE, *a, *b, count)
    if not len(which):
        return math.inf, -1
    first = int(entry.argmin())
    return max(float(entry[first]), 0.0), int(which[first])


def _each(radius_m: float | FloatArray, points_m: FloatArray) -> FloatArray:
    """(m,) the radius of each of (m, 2) points."""
    return radius_m if isinstance(radius_m, np.ndarray) else np.full(len(points_m), radius_m)
