"""Distances between paths and sensed edge points."""

from __future__ import annotations

import math

import numpy as np

from planner.curves import Point, end_of
from planner.interface import FloatArray, Path


def _to_lines(rows: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance of points to straight segments, (n, m), and how far along each the nearest place is."""
    dx, dy = points[:, 0] - rows[:, :1], points[:, 1] - rows[:, 1:2]
    tx, ty = rows[:, 2:3], rows[:, 3:4]
    s = np.minimum(np.maximum(dx * tx + dy * ty, 0.0), rows[:, 5:6])
    dx -= s * tx
    dy -= s * ty
    return np.sqrt(dx * dx + dy * dy), s


def _to_arcs(rows: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance of points to arcs, (n, m), and how far along each the nearest place is."""
    curvature, length = rows[:, 4:5], rows[:, 5:6]
    side, radius = np.sign(curvature), 1.0 / np.abs(curvature)
    # Radial unit vector at the start, seen from the centre, and the tangent in the sense of travel.
    rx, ry = side * rows[:, 3:4], -side * rows[:, 2:3]
    dx = points[:, 0] - rows[:, :1] + radius * rx
    dy = points[:, 1] - rows[:, 1:2] + radius * ry
    tx, ty = rows[:, 2:3], rows[:, 3:4]
    sweep = length / radius
    turn = np.arctan2(dx * tx + dy * ty, dx * rx + dy * ry) % math.tau
    # Beyond the end the nearer end counts: the middle of the part not swept parts the two.
    turn = np.where(turn <= sweep, turn, np.where(turn > 0.5 * (sweep + math.tau), 0.0, sweep))
    px, py = (
        radius * (np.cos(turn) * rx + np.sin(turn) * tx),
        radius * (np.cos(turn) * ry + np.sin(turn) * ty),
    )
    return np.hypot(dx - px, dy - py), turn * radius


def _nearest(path: Path, points_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n, m) distance of points to each segment, how far along it and along the path the nearest place is."""
    rows = path.segments
    begin = np.cumsum(rows[:, 5]) - rows[:, 5]
    bent = np.abs(rows[:, 4]) > 1e-12
    distance, along = np.empty((2, len(rows), len(points_m)))
    for which, measure in ((~bent, _to_lines), (bent, _to_arcs)):
        if which.any():
            distance[which], along[which] = measure(rows[which], points_m)
    return distance, along, along + begin[:, None]


def distances(path: Path, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How near a path comes to each of some points, and where.

    Args:
        path: n segments.
        points_m: (m, 2) points.

    Returns:
        (m,) distances in metres and (m,) stations along the path of the nearest places.
    """
    distance, _, station = _nearest(path, points_m)
    nearest = distance.argmin(axis=0)
    column = np.arange(len(points_m))
    return distance[nearest, column], station[nearest, column]


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
    if not len(points_m):
        return math.inf
    distance, along, station = _nearest(path, points_m)
    # Where a segment is nearest at its start, the path only leads away from there on.
    approached = along > 0.0
    approached[0] = True
    near = (distance < radius_m) & approached & (station >= from_m)
    return float(station[near].min()) if near.any() else math.inf


def inside_bounds(path: Path, bounds_m: tuple[float, float, float, float]) -> bool:
    """Whether a path stays inside a rectangle xmin, ymin, xmax, ymax."""
    xmin, ymin, xmax, ymax = bounds_m
    rows = path.segments
    if not _all_within(rows[:, 0], rows[:, 1], bounds_m):
        return False
    bent = rows[np.abs(rows[:, 4]) > 1e-12]
    if len(bent):
        # An arc leaves a rectangle only at one of its four outermost points, or at its ends.
        centre_x, centre_y = bent[:, 0] - bent[:, 3] / bent[:, 4], bent[:, 1] + bent[:, 2] / bent[:, 4]
        radius = 1.0 / np.abs(bent[:, 4])
        out = (
            (centre_x - radius < xmin)
            | (centre_x + radius > xmax)
            | (centre_y - radius < ymin)
            | (centre_y + radius > ymax)
        )
        for x, y, r, row in zip(centre_x[out], centre_y[out], radius[out], bent[out], strict=True):
            extremes = np.array([[x - r, y], [x + r, y], [x, y - r], [x, y + r]])
            distance, _ = _to_arcs(row[None], extremes)
            passed = extremes[distance[0] < 1e-6 * r]
            if not _all_within(passed[:, 0], passed[:, 1], bounds_m):
                return False
    end = end_of(path)
    return xmin <= end.east_m <= xmax and ymin <= end.north_m <= ymax


def _all_within(x: FloatArray, y: FloatArray, bounds_m: tuple[float, float, float, float]) -> bool:
    xmin, ymin, xmax, ymax = bounds_m
    return bool(((x >= xmin) & (x <= xmax) & (y >= ymin) & (y <= ymax)).all())


def line_is_clear(a: Point, b: Point, points_m: FloatArray, radius_m: float | FloatArray) -> bool:
    """Whether the line from a to b keeps a distance from all points."""
    if not len(points_m):
        return True
    return math.isinf(first_entry(a, b, points_m, radius_m)[0])


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
    ux, uy = b[0] - a[0], b[1] - a[1]
    length = math.hypot(ux, uy)
    if length < 1e-9 or not len(points_m):
        return math.inf, -1
    ux, uy = ux / length, uy / length
    dx, dy = points_m[:, 0] - a[0], points_m[:, 1] - a[1]
    ahead = dx * ux + dy * uy
    beside = dx * uy - dy * ux
    past = np.maximum(ahead - length, 0.0)
    room = np.square(radius_m) - beside * beside
    hit = np.flatnonzero((room > past * past) & (ahead > 0.0))
    if not len(hit):
        return math.inf, -1
    entry = ahead[hit] - np.sqrt(room[hit])
    first = int(entry.argmin())
    return max(float(entry[first]), 0.0), int(hit[first])
