"""A path as somebody gives it, made into what guidance can follow: lines, and an arc at every corner.

Every corner of a polyline is flown by: an arc touches both legs and passes the corner inside. Where the points
sample a curve, the arcs are as wide as the points leave room for and give the curve back; where legs are long,
an arc has the turn radius of the aircraft. What is left is the corner that had to be cut.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GIVEN = "path as given"
"""Stands for the planner's name where there was none."""

SAME_PLACE_M = 0.01
"""Points that are not further apart are one."""

SAME_LINE_M = 0.01
"""A point nearer than this to the line of those about it is taken to lie on it."""

AT_ONCE = 10_000
"""Points that are simplified together: GEOS calls itself once more for each that it keeps."""

SHORTEST_M = 1e-6
"""A shorter segment is left out."""

SHARPEST_RAD = np.pi - 1e-3
"""A sharper corner leads back: it has no arc that touches both legs."""

FLATTEST = 1e-12
"""Distance of the flattest corner from its arc, in radii."""


@dataclass(frozen=True)
class CutCorner:
    """A corner that the turn radius does not let an aircraft fly through.

    Attributes:
        waypoint: its number in the path as given, the first being 0.
        east_m: where it is.
        north_m: where it is.
        turn_deg: the turn asked for, positive to the left.
        radius_m: of the arc that is flown instead; 0 where the path leads back and there is none.
        cut_m: how far from the corner that arc passes; 0 where there is none.
        arc_length_m: distance along the flown path to the middle of the arc.
    """

    waypoint: int
    east_m: float
    north_m: float
    turn_deg: float
    radius_m: float
    cut_m: float
    arc_length_m: float

    @property
    def half_m(self) -> float:
        """Half the length of its arc."""
        return 0.5 * self.radius_m * abs(float(np.radians(self.turn_deg)))


@dataclass(frozen=True, eq=False)
class FlyBy:
    """A polyline with an arc at every corner.

    Attributes:
        waypoints_m: (k, 2) those of the points given that are needed.
        segments: (n, 6) as in `planner.interface.Path`.
        corners: those that are cut by more than was left free, or have no arc, in order.
        given_m: (m, 3) the polyline once more, with the points where arcs touch it: east, north, and the arc length of
            `segments` that belongs there. Along a leg both grow alike; an arc is shared out over what it cuts off.
    """

    waypoints_m: FloatArray
    segments: FloatArray
    corners: tuple[CutCorner, ...]
    given_m: FloatArray


def fly_by(points_m: FloatArray, radius_m: float, free_cut_m: float) -> FlyBy:
    """Rounds the corners of a polyline.

    The arc at a corner of angle `a` that touches the legs `t` before and after it has the radius
    `t / tan(a / 2)` and passes the corner at `radius (1 / cos(a / 2) - 1)`. It is as wide as it can be without
    passing further off than `free_cut_m`, but not tighter than `radius_m` where there is room for that.
    Neighbouring corners share the leg between them in proportion to what they need.

    Args:
        points_m: (m, 2) points, not all in one place.
        radius_m: smallest radius that the aircraft should fly, > 0.
        free_cut_m: a corner may be passed at this distance wherever that makes its arc wider, > 0.
    """
    kept = _needed(points_m)
    points = points_m[kept]
    place = points[:, 0] + 1j * points[:, 1]
    length = np.abs(np.diff(place))
    ahead = np.diff(place) / length
    turn = np.angle(ahead[1:] / ahead[:-1])
    back = np.abs(turn) > SHARPEST_RAD
    half = 0.5 * np.where(back, 0.0, np.abs(turn))
    tangent, beyond = np.tan(half), np.maximum(1.0 / np.cos(half) - 1.0, FLATTEST)
    room = _room(length, radius_m * tangent)
    fits = np.divide(room, tangent, out=np.zeros_like(room), where=tangent > 0.0)
    radius = np.minimum(fits, np.maximum(radius_m, free_cut_m / beyond))
    trim = radius * tangent
    cut = np.where(back, 0.0, radius * beyond)

    ends = np.concatenate(([0.0], trim, [0.0]))
    rows: list[tuple[float, float, float, float, float, float]] = []
    middles: list[float] = []
    station = 0.0
    for leg in range(len(length)):
        begin = place[leg] + ends[leg] * ahead[leg]
        straight = length[leg] - ends[leg] - ends[leg + 1]
        if straight > SHORTEST_M:
            rows.append((begin.real, begin.imag, ahead[leg].real, ahead[leg].imag, 0.0, straight))
            station += float(straight)
        if leg == len(turn):
            break
        around = float(abs(turn[leg]) * radius[leg])
        middles.append(station + 0.5 * around)
        if around > SHORTEST_M:
            touch = place[leg + 1] - trim[leg] * ahead[leg]
            bend = np.sign(turn[leg]) / radius[leg]
            rows.append((touch.real, touch.imag, ahead[leg].real, ahead[leg].imag, bend, around))
            station += around
    corners = tuple(
        CutCorner(
            waypoint=int(kept[i + 1]),
            east_m=float(place[i + 1].real),
            north_m=float(place[i + 1].imag),
            turn_deg=float(np.degrees(turn[i])),
            radius_m=float(radius[i]),
            cut_m=float(cut[i]),
            arc_length_m=middles[i],
        )
        for i in np.flatnonzero(back | (cut > free_cut_m * (1.0 + 1e-9))).tolist()
    )
    return FlyBy(
        points, np.array(rows), corners, _as_given(points, ahead, trim, middles, turn * radius, station)
    )


def _as_given(
    points_m: FloatArray,
    ahead: NDArray[Any],
    trim_m: FloatArray,
    middles_m: list[float],
    around_m: FloatArray,
    length_m: float,
) -> FloatArray:
    """`FlyBy.given_m` of (k + 2, 2) points with arcs at the k between its ends.

    Args:
        points_m: the polyline.
        ahead: (k + 1,) unit vectors along its legs.
        trim_m: (k,) how far from its corner each arc begins and ends.
        middles_m: of the arcs, along the rounded path.
        around_m: (k,) lengths of the arcs, with a sign.
        length_m: of the rounded path.
    """
    corners = points_m[1:-1, 0] + 1j * points_m[1:-1, 1]
    middle, half = np.array(middles_m), 0.5 * np.abs(around_m)
    places = np.stack((corners - trim_m * ahead[:-1], corners, corners + trim_m * ahead[1:]), axis=1).ravel()
    along = np.stack((middle - half, middle, middle + half), axis=1).ravel()
    inner = np.column_stack((places.real, places.imag, along))
    ends = np.column_stack((points_m[[0, -1]], (0.0, length_m)))
    return np.concatenate((ends[:1], inner, ends[1:]))


def _needed(points_m: FloatArray) -> NDArray[np.int64]:
    """Indices of the points without which the polyline would be another (Douglas and Peucker, 1973)."""
    import shapely

    # Heights are not looked at: each point carries its number there.
    numbered = shapely.LineString(np.column_stack((points_m, np.arange(len(points_m)))))
    apart = shapely.get_coordinates(shapely.remove_repeated_points(numbered, SAME_PLACE_M), include_z=True)
    pieces = [shapely.LineString(apart[i : i + AT_ONCE + 1]) for i in range(0, len(apart) - 1, AT_ONCE)]
    simple = [shapely.simplify(piece, SAME_LINE_M, preserve_topology=False) for piece in pieces]
    kept = [shapely.get_coordinates(piece, include_z=True)[1:, 2] for piece in simple]
    return np.concatenate(([0], *kept)).astype(np.int64)


def _room(length_m: FloatArray, need_m: FloatArray) -> FloatArray:
    """(k,) how far from each corner its arc may begin: its share of the shorter of the two legs.

    Args:
        length_m: (k + 1,) of the legs.
        need_m: (k,) how far from its corner an arc of the smallest radius begins.
    """
    need = np.concatenate(([0.0], need_m, [0.0]))
    asked = np.maximum(need[:-1] + need[1:], SHORTEST_M * SHORTEST_M)
    before, after = length_m * need[1:] / asked, length_m * need[:-1] / asked
    room: FloatArray = np.minimum(before[:-1], after[1:])
    return room
