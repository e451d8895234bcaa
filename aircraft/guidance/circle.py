"""Lines and arcs onto the circle of a loiter and off it: rows of `Route.segments`.

The plane is one of complex numbers, east + i north, metres; a direction is a number of size 1.
"""

from __future__ import annotations

import cmath
import math
from typing import Final, NamedTuple

import numpy as np

from aircraft.interface import FloatArray
from aircraft.route import SHORTEST_M, SegmentRow, arc_point

Pose = tuple[complex, complex]  # a place and a direction

SHARE_ROUNDING: Final = 1e-9  # rounding, as a share of a radius
JUST_PASSED_RAD: Final = 0.01  # a place passed by no more costs no further turn: files have places to 1 cm
ON_CIRCLE_M: Final = 0.01  # a place no further than this from a circle lies on it


class Circle(NamedTuple):
    """A circle that is flown, `side` +1 to the left (counter-clockwise), -1 to the right."""

    center: complex
    radius_m: float
    side: int

    def joined_from(self, place: complex) -> complex | None:
        """Returns the point where a straight line from a place touches it in flight direction; None from inside."""
        if (away := abs(place - self.center)) <= self.radius_m * (1.0 + SHARE_ROUNDING):
            return None
        # Seen from the centre, the place and the point of touch are this far apart.
        angle = math.acos(self.radius_m / away)
        return self.center + (self.edge(place) - self.center) * cmath.exp(1j * self.side * angle)

    def left_to(self, place: complex) -> complex | None:
        """Returns the point where a straight line to a place leaves it; None to the inside."""
        return self._replace(side=-self.side).joined_from(place)

    def edge(self, place: complex) -> complex:
        """Returns its point nearest to a place."""
        return self.center + self.radius_m * (place - self.center) / abs(place - self.center)

    def direction(self, place: complex) -> complex:
        """Returns the direction of flight at a place on it."""
        return (place - self.center) / abs(place - self.center) * 1j * self.side

    def contains(self, pose: Pose) -> bool:
        """Tells whether a pose is on it, and flies round it."""
        if abs(abs(pose[0] - self.center) - self.radius_m) > ON_CIRCLE_M:
            return False
        return abs(self.direction(pose[0]) - pose[1]) < 1e-3

    def further_m(self, place: complex, target: complex | None, length_m: float) -> float:
        """Returns the way (m) round it from `length_m` after a place to where it is left outwards; < 0: just passed."""
        leave = None if target is None else self.left_to(target)
        if leave is None:
            return 0.0
        here = (place - self.center) * cmath.exp(1j * self.side * length_m / self.radius_m)
        left_rad = self.side * cmath.phase((leave - self.center) / here) + JUST_PASSED_RAD
        return (left_rad % math.tau - JUST_PASSED_RAD) * self.radius_m


def segment(pose: Pose, bend_1pm: float, length_m: float) -> list[SegmentRow]:
    """Returns a line, or an arc with a bend, positive to the left; nothing where it is too short."""
    begin, ahead = pose
    row = (begin.real, begin.imag, ahead.real, ahead.imag, bend_1pm, length_m)
    return [row] if length_m > SHORTEST_M else []


def end_of(row: SegmentRow) -> Pose:
    """Returns the pose at the end of a segment."""
    east, north, ahead_east, ahead_north = arc_point(row, row[5])
    return complex(east, north), complex(ahead_east, ahead_north)


def sampled(row: SegmentRow, pieces: int) -> FloatArray:
    """(pieces + 1, 3) east, north and distance along a segment, both ends among them."""
    along = np.linspace(0.0, row[5], pieces + 1)
    return np.array([(*arc_point(row, part)[:2], part) for part in along.tolist()])


def shortest_way(pose: Pose, circle: Circle, turn_m: float) -> list[SegmentRow]:
    """Returns the shorter way from a pose onto a circle: straight on as needed, one turn, a line that touches it."""
    ways = (_way_by_turn(pose, circle, turn_m, turn) for turn in (1, -1))
    return min((way for way in ways if way is not None), key=lambda way: sum(row[5] for row in way))


def _way_by_turn(pose: Pose, circle: Circle, turn_m: float, turn: int) -> list[SegmentRow] | None:
    """Returns the way with a turn to one side; None if turn and circle have no common tangent."""
    begin, ahead = pose
    # A common tangent of both, outer where they turn alike and inner where not, needs so much between the centres.
    needed = abs(circle.radius_m - turn_m) if turn == circle.side else circle.radius_m + turn_m
    hub = begin + 1j * turn * turn_m * ahead - circle.center
    along = hub.real * ahead.real + hub.imag * ahead.imag
    reach = needed * (1.0 + SHARE_ROUNDING) + SHORTEST_M
    on = 0.0 if abs(hub) >= reach else -along + math.sqrt(along * along - (abs(hub) ** 2 - reach * reach))
    start = begin + on * ahead
    pivot = start + 1j * turn * turn_m * ahead
    # The line's direction d has the centre of the turn at -1j turn turn_m, and that of the circle likewise.
    apart = circle.center - pivot
    if abs(sine := (circle.side * circle.radius_m - turn * turn_m) / abs(apart)) > 1.0:
        return None
    straight = abs(apart) * math.sqrt(1.0 - sine * sine)
    out = apart / abs(apart) * cmath.exp(-1j * math.asin(sine))
    return [
        *segment(pose, 0.0, on),
        *segment((start, ahead), turn / turn_m, (turn * cmath.phase(out / ahead)) % math.tau * turn_m),
        *segment((pivot - 1j * turn * turn_m * out, out), 0.0, straight),
    ]
