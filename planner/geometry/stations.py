"""Places, directions and turns at many stations along a path at once. Compiled: see `planner.compiled`."""

from __future__ import annotations

import math

import numpy as np

from planner.compiled import COUNT, FLOAT, FLOATS, ROWS, compiled
from planner.interface import FloatArray, Path


def poses_at(path: Path, arc_lengths_m: FloatArray) -> FloatArray:
    """(k, 4) poses at (k,) stations along a path, clamped to its ends."""
    return _poses_at(path.segments, np.ascontiguousarray(arc_lengths_m))


def places_along(path: Path, end_m: float, pieces: int) -> FloatArray:
    """(pieces + 1, 2) places along a path, clamped to its ends, from its start to a station and evenly spaced."""
    return _places_along(path.segments, end_m, pieces)


def turn_centres(path: Path, arc_lengths_m: FloatArray, radius_m: float, roll_m: float) -> FloatArray:
    """(k, 2, 2) centres of the turns off a path at (k,) stations: to the left, and to the right.

    Where the path turns the other way, the turn begins after a straight of `roll_m`.
    """
    return _turn_centres(path.segments, np.ascontiguousarray(arc_lengths_m), radius_m, roll_m)


@compiled(ROWS, FLOAT)
def _pose(rows: FloatArray, station: float) -> tuple[float, float, float, float, float]:
    """Place and tangent at a station, clamped to the ends, and the curvature there."""
    which, along = 0, max(station, 0.0)
    while along > rows[which, 5] and which < len(rows) - 1:
        along -= rows[which, 5]
        which += 1
    along = min(along, rows[which, 5])
    tx, ty, half = rows[which, 2], rows[which, 3], 0.5 * rows[which, 4] * along
    chord = along * (math.sin(half) / half if half else 1.0)
    cos, sin = math.cos(half), math.sin(half)
    cx, cy = tx * cos - ty * sin, ty * cos + tx * sin  # direction of the chord
    east, north = rows[which, 0] + chord * cx, rows[which, 1] + chord * cy
    return east, north, cx * cos - cy * sin, cy * cos + cx * sin, rows[which, 4]


@compiled(ROWS, FLOATS)
def _poses_at(rows: FloatArray, stations: FloatArray) -> FloatArray:
    poses = np.empty((len(stations), 4))
    for i in range(len(stations)):
        poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3], _ = _pose(rows, stations[i])
    return poses


@compiled(ROWS, FLOAT, COUNT)
def _places_along(rows: FloatArray, end: float, pieces: int) -> FloatArray:
    places = np.empty((pieces + 1, 2))
    for i in range(pieces + 1):
        station = i * (end / pieces) if i < pieces else end
        places[i, 0], places[i, 1], _, _, _ = _pose(rows, station)
    return places


@compiled(ROWS, FLOATS, FLOAT, FLOAT)
def _turn_centres(rows: FloatArray, stations: FloatArray, radius: float, roll: float) -> FloatArray:
    centres = np.empty((len(stations), 2, 2))
    for i in range(len(stations)):
        x, y, tx, ty, curvature = _pose(rows, stations[i])
        for k in range(2):
            aside = radius if k == 0 else -radius
            ahead = roll if aside * curvature < 0.0 else 0.0
            centres[i, k, 0] = x + ahead * tx - aside * ty
            centres[i, k, 1] = y + ahead * ty + aside * tx
    return centres
