"""Distances between paths and sensed edge points."""

from __future__ import annotations

import math

import numpy as np

from planner.geometry.curves import Point
from planner.interface import BoolArray, FloatArray, Path
from planner.kernels import segments

EXIT_M = 1e-3  # where a path leaves an area is found this much before it, or less


def distances(path: Path, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(m,) distance of each of (m, 2) points to a path, and (m,) arc length of the place nearest to it, m."""
    return segments.distances(path.segments, points_m)


def first_breach(path: Path, points_m: FloatArray, keep_m: float | FloatArray, from_m: float = 0.0) -> float:
    """Arc length (m) at which a path is nearest to the first of (m, 2) points that it passes too near to.

    Infinite where there is none. `keep_m` is the distance to be kept, one for all or (m,) m. What lies before
    `from_m` does not count.
    """
    keeps_m = keep_m if isinstance(keep_m, np.ndarray) else np.array((keep_m,))
    return segments.first_breach(path.segments, points_m, keeps_m, from_m)


def inside_bounds(path: Path, bounds_m: tuple[float, float, float, float]) -> bool:
    """Whether a path stays inside a rectangle xmin, ymin, xmax, ymax."""
    return segments.rows_inside(path.segments, *bounds_m) == len(path.segments)


def first_exit_m(path: Path, bounds_m: tuple[float, float, float, float]) -> float:
    """Arc length (m) up to which a path stays inside a rectangle, to `EXIT_M` below; infinite if it never leaves."""
    if (count := segments.rows_inside(path.segments, *bounds_m)) == len(path.segments):
        return math.inf
    piece = path.segments[count : count + 1].copy()
    inside_m, outside_m = 0.0, float(piece[0, 5])
    while outside_m - inside_m > EXIT_M:
        piece[0, 5] = 0.5 * (inside_m + outside_m)
        if segments.rows_inside(piece, *bounds_m):
            inside_m = float(piece[0, 5])
        else:
            outside_m = float(piece[0, 5])
    return float(path.segments[:count, 5].sum()) + inside_m


def behind(places_m: FloatArray, eye_m: Point, edges_m: FloatArray, beside_m: float) -> BoolArray:
    """(k,) whether each of (k, 2) places lies in the shadow of one of (n, 2) edge points that are seen from a place.

    At its edge point a shadow is `beside_m` wide to each side.
    """
    off, edges_m = places_m - eye_m, edges_m - eye_m
    edges_m = edges_m[np.hypot(*edges_m.T) < np.hypot(*off.T).max(initial=0.0)]
    away_m = np.hypot(*edges_m.T)
    along_m = off @ edges_m.T / away_m
    aside_m = np.abs(off[:, 1:] * edges_m[:, 0] - off[:, :1] * edges_m[:, 1]) / away_m
    # The shadow is a fan: at twice the distance it is twice as wide.
    return np.asarray(((along_m > away_m) & (aside_m < beside_m * along_m / away_m)).any(axis=1))
