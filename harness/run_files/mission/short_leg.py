"""A waypoint so near to a circle that the turn at it ends on the circle: rounded onto that, not on the leg between."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from harness.run_files.given_path import FLATTEST, LIMIT_SHARE, FloatArray
from harness.run_files.mission.circle import Pose, Row, end_of, onto
from harness.run_files.mission.flying import Flying, corner_limit_m

PAST_RADII: Final = 3.0
"""A turn of more than a right angle goes past the next leg and is back on it after no more than so many radii."""

STEP_RAD: Final = math.radians(2.0)
SHARE: Final = 0.5
"""Part of the leg before a waypoint that a turn at it may take: the corner before needs the other."""


class ShortLeg(NamedTuple):
    """The way from the leg before a waypoint onto a circle.

    Attributes:
        rows: lines and arcs.
        given_m: (k, 3) the path as given in their place: the waypoint, where the circle is touched, the circle.
        arc_length_m: where along the route the waypoint is passed.
        cut_m: how far off.
        half_m: the way is no longer than this before and after that.
    """

    rows: list[Row]
    given_m: FloatArray
    arc_length_m: float
    cut_m: float
    half_m: float


def corner_radius_m(flying: Flying, airspeed_mps: float, acceptance_m: float, angle_rad: float) -> float:
    """Radius of the arc at a corner: with bank in hand, or less where that would pass too far off."""
    wide = flying.turn_radius_m(airspeed_mps)
    least = wide if flying.least_radius_m is None else flying.least_radius_m(airspeed_mps)
    off = 1.0 / math.cos(0.5 * min(abs(angle_rad), 0.5 * math.pi)) - 1.0
    most = LIMIT_SHARE * corner_limit_m(acceptance_m, flying.corner_m) / max(off, FLATTEST)
    return max(min(wide, most), least)


def begins_before_m(leg_m: float, ahead_m: float, angle_rad: float, radius_m: float) -> float:
    """How far before a waypoint the turn begins that ends on a circle; 0 where the leg to the circle has room for it.

    Args:
        leg_m: length of the leg to the waypoint.
        ahead_m: from there to where the circle is touched.
        angle_rad: of the corner.
        radius_m: of the arc there.
    """
    sharp = abs(angle_rad) > 0.5 * math.pi
    trim = radius_m * math.tan(0.5 * min(abs(angle_rad), 0.5 * math.pi))
    return min(trim, SHARE * leg_m) if ahead_m < (PAST_RADII * radius_m if sharp else trim) else 0.0


def short_leg(
    pose: Pose,
    places: tuple[complex, complex],
    circle: tuple[complex, float, int],
    turn_m: float,
    begins_m: float,
) -> ShortLeg:
    """Makes it.

    Args:
        pose: where the turn begins.
        places: the waypoint, and where a line from there touches the circle.
        circle: centre, radius, and side of the turn.
        turn_m: radius of the turn.
        begins_m: arc length of the route there.
    """
    (waypoint, touch), (center, radius, side) = places, circle
    rows = onto(pose, center, radius, side, turn_m)
    length = sum(row[5] for row in rows)
    where, along = _sampled(rows)
    nearest = int(np.abs(where - waypoint).argmin())
    passes_m = begins_m + float(along[nearest])
    angle = side * cmath.phase((end_of(rows[-1])[0] - center) / (touch - center))
    turned = np.linspace(0.0, max(angle, 0.0), 2 + int(max(angle, 0.0) / STEP_RAD))
    round_it = center + (touch - center) * np.exp(1j * side * turned)
    ends_m = begins_m + length
    stations = np.maximum(ends_m - radius * (turned[-1] - turned), passes_m)
    line = np.concatenate(([pose[0], waypoint], round_it))
    given = np.column_stack((line.real, line.imag, np.concatenate(([begins_m, passes_m], stations))))
    half_m = max(passes_m - begins_m, ends_m - passes_m)
    return ShortLeg(rows, given, passes_m, float(abs(where[nearest] - waypoint)), half_m)


def _sampled(rows: Sequence[Row]) -> tuple[np.ndarray, FloatArray]:
    """Places along lines and arcs, east + i north, and how far along each is."""
    places, along, begins = [], [], 0.0
    for row in rows:
        for share in np.linspace(0.0, 1.0, 50).tolist():
            places.append(end_of((*row[:5], share * row[5]))[0])
            along.append(begins + share * row[5])
        begins += row[5]
    return np.array(places), np.array(along)
