"""Ways of a point: polylines of (n, 2) places, east and north in metres, measured by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.geometry.curves import Point
from planner.interface import FloatArray

NOWHERE: FloatArray = np.zeros((0, 2))  # way without a place


@dataclass(frozen=True)
class Mark:
    """A place on a boundary and the unit vector in which it was passed."""

    place: Point
    ux: float
    uy: float


class Tangent(NamedTuple):
    """Where a line from a place touches an obstacle: a corner of it."""

    place: Point
    side: float  # 1: the obstacle lies on the left of the line, -1: on the right, 0: none is touched
    seen: bool  # nothing lies before it
    dent: bool  # the line leads on to the same obstacle soon


def stations(way: FloatArray) -> FloatArray:
    """(n,) arc length of each corner."""
    return np.concatenate(((0.0,), np.cumsum(np.hypot(*np.diff(way, axis=0).T))))


def length_of(way: FloatArray) -> float:
    """Length, m; 0 of a way without a place."""
    return float(stations(way)[-1]) if len(way) else 0.0


def piece(way: FloatArray, from_m: float, to_m: float) -> FloatArray:
    """The part of a way between two arc lengths, both clamped to its ends."""
    if not len(way):
        return way
    at = stations(way)
    ends = np.clip((from_m, max(from_m, to_m)), 0.0, at[-1])
    first, last = (np.array([[np.interp(end, at, axis) for axis in way.T]]) for end in ends)
    return np.concatenate((first, way[(at > ends[0]) & (at < ends[1])], last))


def mark_at(way: FloatArray, arc_length_m: float) -> Mark:
    """The place of a way at an arc length, and its direction there."""
    at = stations(way)
    i = int(np.clip(np.searchsorted(at, arc_length_m, side="right") - 1, 0, max(len(way) - 2, 0)))
    edge = way[min(i + 1, len(way) - 1)] - way[i]
    whole = max(float(np.hypot(*edge)), 1e-9)
    east, north = (float(np.interp(arc_length_m, at, axis)) for axis in way.T)
    return Mark((east, north), float(edge[0]) / whole, float(edge[1]) / whole)


def beside(way: FloatArray, place: Point) -> tuple[FloatArray, FloatArray, FloatArray]:
    """For each edge of a way (n - 1,) its distance from a place, the arc length there, and (n - 1, 2) its direction."""
    edges = np.diff(way, axis=0)
    lengths = np.maximum(np.hypot(*edges.T), 1e-9)
    share = np.clip(((np.array(place) - way[:-1]) * edges).sum(axis=1) / lengths**2, 0.0, 1.0)
    away_m: FloatArray = np.hypot(*(way[:-1] + share[:, None] * edges - place).T)
    return away_m, stations(way)[:-1] + share * lengths, edges / lengths[:, None]
