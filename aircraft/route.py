"""Points and directions along a route, its length, and a route to try laws on."""

from __future__ import annotations

import math

import numpy as np

from aircraft.interface import Route

SegmentRow = tuple[float, float, float, float, float, float]  # one row of `Route.segments`
SHORTEST_M = 1e-6  # a segment shorter than this is left out
WEAVE_DEG = (60.0, -30.0, 90.0, -60.0, -20.0, 20.0)  # angles of the arcs of `weave`, positive to the left


def arc_point(row: SegmentRow, along_m: float) -> tuple[float, float, float, float]:
    """East, north (m) and unit tangent on a segment of constant curvature, at a distance from its start."""
    east, north, tangent_east, tangent_north, curvature, _ = row
    half = 0.5 * curvature * along_m
    sine, cosine = math.sin(half), math.cos(half)
    chord = along_m * (sine / half if abs(half) > 1e-9 else 1.0)
    chord_east = tangent_east * cosine - tangent_north * sine
    chord_north = tangent_east * sine + tangent_north * cosine
    return (
        east + chord * chord_east,
        north + chord * chord_north,
        chord_east * cosine - chord_north * sine,
        chord_east * sine + chord_north * cosine,
    )


def corner_arcs(at: complex, ahead: complex, turn: float, radius_m: float, back: float) -> list[SegmentRow]:
    """The turn at a corner, from a place (east + i north, m): an arc, and where it goes too far another one back.

    The direction `ahead` turns by `turn` (rad, positive to the left), after a turn by `back` (rad) too far and back.
    """
    rows = []
    side = 1.0 if turn > 0.0 else -1.0
    for sign, angle in ((side, abs(turn) + back), (-side, back)):
        if (around := float(angle * radius_m)) <= SHORTEST_M:
            continue
        rows.append((at.real, at.imag, ahead.real, ahead.imag, sign / radius_m, around))
        turned = ahead * np.exp(1j * sign * angle)
        at, ahead = at + (turned - ahead) * radius_m / (1j * sign), turned
    return rows


def route_length(route: Route) -> float:
    """Length of a route (m), one turn of a closing loiter included."""
    return float(route.segments[:, 5].sum())


def weave(radius_m: float) -> Route:
    """A route from (0, 0) northwards: lines as long as the radius, each followed by an arc of `WEAVE_DEG`."""
    point, rows = (0.0, 0.0, 0.0, 1.0), []
    for turn_deg in WEAVE_DEG:
        for curvature, length in ((0.0, radius_m), (1.0 / radius_m, math.radians(turn_deg) * radius_m)):
            rows.append((*point, math.copysign(curvature, turn_deg), abs(length)))
            point = arc_point(rows[-1], abs(length))
    return Route(np.array(rows))
