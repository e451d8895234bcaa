"""Distances between paths and sensed edge points."""

from __future__ import annotations

import math

import numpy as np

from planner.geometry.curves import Point
from planner.interface import BoolArray, FloatArray, Path
from planner.kernels import segments
from planner.kernels.fans import entered

EVERYWHERE = np.array([[0.0], [0.0], [math.inf]])
"""A circle that holds all: (3, 1), as `planner.kernels.buckets.Buckets` has them."""


def distances(path: Path, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How near a path comes to each of some points, and where.

    Args:
        path: n segments.
        points_m: (m, 2) points.

    Returns:
        (m,) distances in metres and (m,) arc lengths along the path of the nearest places.
    """
    return segments.distances(path.segments, points_m)


def first_breach(
    path: Path, points_m: FloatArray, radius_m: float | FloatArray, from_m: float = 0.0
) -> float:
    """Arc length at which a path first comes nearest to a point that it passes within `radius_m` of.

    Args:
        path: the path.
        points_m: (m, 2) points.
        radius_m: the distance to be kept, one for all or one for each point.
        from_m: what lies before this arc length does not count.

    Returns:
        The arc length in metres; infinite where the distance is kept.
    """
    radii_m = radius_m if isinstance(radius_m, np.ndarray) else np.array((radius_m,))
    return segments.first_breach(path.segments, points_m, radii_m, from_m)


def inside_bounds(path: Path, bounds_m: tuple[float, float, float, float]) -> bool:
    """Whether a path stays inside a rectangle xmin, ymin, xmax, ymax."""
    return segments.inside_bounds(path.segments, *bounds_m)


def admits(
    path: Path, points_m: FloatArray, keep_m: float, bounds_m: tuple[float, float, float, float]
) -> bool:
    """Whether a path keeps its distance from (m, 2) points, and stays inside a rectangle."""
    return inside_bounds(path, bounds_m) and math.isinf(first_breach(path, points_m, keep_m))


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


def behind(places_m: FloatArray, eye_m: Point, edges_m: FloatArray, beside_m: float) -> BoolArray:
    """(k,) whether each of (k, 2) places lies in the shadow of one of (n, 2) edge points, or within reach of it.

    Args:
        places_m: the places.
        eye_m: from where the edge points are seen.
        edges_m: the edge points.
        beside_m: a shadow is so much wider to each side than its edge point.
    """
    hidden = np.zeros(len(places_m), dtype=np.bool_)
    off = places_m - eye_m
    for east, north in (edges_m - eye_m).tolist():
        away_m = math.hypot(east, north)
        along_m = (off[:, 0] * east + off[:, 1] * north) / away_m
        aside_m = np.abs(off[:, 1] * east - off[:, 0] * north) / away_m
        # The shadow is a fan: at twice the distance it is twice as wide.
        hidden |= (along_m > away_m) & (aside_m < beside_m * along_m / away_m)
    return hidden
