"""Distances between paths and sensed edge points."""

from __future__ import annotations

import math

import numpy as np

from planner.curves import Point, end_of
from planner.interface import FloatArray, IntArray, Path


def _to_lines(rows: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(k,) distance of points to straight segments, one each, and how far along the nearest place is."""
    x, y, tx, ty, _, length = rows.T
    dx, dy = points[:, 0] - x, points[:, 1] - y
    s = np.minimum(np.maximum(dx * tx + dy * ty, 0.0), length)
    dx -= s * tx
    dy -= s * ty
    return np.sqrt(dx * dx + dy * dy), s


def _to_arcs(rows: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(k,) distance of points to arcs, one each, and how far along the nearest place is."""
    x, y, tx, ty, curvature, length = rows.T
    side, radius = np.sign(curvature), 1.0 / np.abs(curvature)
    # Radial unit vector at the start, seen from the centre, and the tangent in the sense of travel.
    rx, ry = side * ty, -side * tx
    dx = points[:, 0] - x + radius * rx
    dy = points[:, 1] - y + radius * ry
    sweep = length / radius
    turn = np.arctan2(dx * tx + dy * ty, dx * rx + dy * ry) % math.tau
    # Beyond the end the nearer end counts: the middle of the part not swept parts the two.
    turn = np.where(turn <= sweep, turn, np.where(turn > 0.5 * (sweep + math.tau), 0.0, sweep))
    px, py = (
        radius * (np.cos(turn) * rx + np.sin(turn) * tx),
        radius * (np.cos(turn) * ry + np.sin(turn) * ty),
    )
    return np.hypot(dx - px, dy - py), turn * radius


def _to_segments(rows: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(k,) distance of points, (k, 2), to segments, (k, 6), and how far along the nearest place is."""
    distance, along = np.empty((2, len(rows)))
    bent = np.abs(rows[:, 4]) > 1e-12
    for which, measure in ((~bent, _to_lines), (bent, _to_arcs)):
        if which.any():
            distance[which], along[which] = measure(rows[which], points[which])
    return distance, along


def _begins(path: Path) -> FloatArray:
    """(n,) station at which each segment begins."""
    begins: FloatArray = np.cumsum(path.segments[:, 5]) - path.segments[:, 5]
    return begins


def distances(path: Path, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How near a path comes to each of some points, and where.

    Args:
        path: n segments.
        points_m: (m, 2) points.

    Returns:
        (m,) distances in metres and (m,) stations along the path of the nearest places.
    """
    n, m = len(path.segments), len(points_m)
    each = _to_segments(np.repeat(path.segments, m, axis=0), np.tile(points_m, (n, 1)))
    distance, along = (values.reshape(n, m) for values in each)
    nearest = distance.argmin(axis=0)
    column = np.arange(m)
    return distance[nearest, column], along[nearest, column] + _begins(path)[nearest]


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
    rows = path.segments
    radius = np.asarray(radius_m, dtype=np.float64)
    # Most points are out of reach.
    east, north, half = path.middles
    dx, dy = points_m[:, 0] - east[:, None], points_m[:, 1] - north[:, None]
    which, point = (dx * dx + dy * dy < np.square(half[:, None] + radius)).nonzero()
    if not len(which):
        return math.inf
    distance, along = _to_segments(rows[which], points_m[point])
    station = along + _begins(path)[which]
    # Where a segment is nearest at its start, the path only leads away from there on.
    approached = (along > 0.0) | (which == 0)
    near = (distance < (radius[point] if radius.ndim else radius)) & approached & (station >= from_m)
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
            distance, _ = _to_arcs(np.tile(row, (4, 1)), extremes)
            passed = extremes[distance < 1e-6 * r]
            if not _all_within(passed[:, 0], passed[:, 1], bounds_m):
                return False
    end = end_of(path)
    return bool(xmin <= end.east_m <= xmax and ymin <= end.north_m <= ymax)


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
    entry, entered = _entries(a, b, points_m, radius_m)
    if not len(entered):
        return math.inf, -1
    first = int(entry.argmin())
    return max(float(entry[first]), 0.0), int(entered[first])


def all_entered(a: Point, b: Point, points_m: FloatArray, radius_m: float | FloatArray) -> IntArray:
    """Indices of all discs that the line from a to b enters, as `first_entry` has it."""
    return _entries(a, b, points_m, radius_m)[1]


def _entries(
    a: Point, b: Point, points_m: FloatArray, radius_m: float | FloatArray
) -> tuple[FloatArray, IntArray]:
    """Distances from a at which the line to b enters discs, and the indices of these discs."""
    ux, uy = b[0] - a[0], b[1] - a[1]
    length = math.hypot(ux, uy)
    if length < 1e-9 or not len(points_m):
        return np.zeros(0), np.zeros(0, dtype=np.intp)
    ux, uy = ux / length, uy / length
    dx, dy = points_m[:, 0] - a[0], points_m[:, 1] - a[1]
    ahead = dx * ux + dy * uy
    beside = dx * uy - dy * ux
    past = np.maximum(ahead - length, 0.0)
    room = np.square(radius_m) - beside * beside
    hit = np.flatnonzero((room > past * past) & (ahead > 0.0))
    return ahead[hit] - np.sqrt(room[hit]), hit
