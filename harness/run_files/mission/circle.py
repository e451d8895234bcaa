"""Ways onto a circle and off it, as lines and arcs: for loiters.

Frame: the plane as complex numbers, east + i north, metres; a direction is a number of size 1. A side is +1 for a turn
to the left (counter-clockwise) and -1 for one to the right. Segments are rows of `planner.interface.Path`.
"""

from __future__ import annotations

import cmath
import math

Row = tuple[float, float, float, float, float, float]
Pose = tuple[complex, complex]
"""A place and a direction."""

SHORTEST_M = 1e-6
NEAR = 1e-9

ON_CIRCLE_M = 0.01
"""A place no further from a circle lies on it."""

SAME_DIRECTION = 1e-5
"""Directions that differ by less, in radians, are no corner."""


def line(begin: complex, ahead: complex, length_m: float) -> list[Row]:
    """A straight segment; none where it is too short to be one."""
    if length_m <= SHORTEST_M:
        return []
    return [(begin.real, begin.imag, ahead.real, ahead.imag, 0.0, length_m)]


def arc(begin: complex, ahead: complex, side: int, radius_m: float, angle_rad: float) -> list[Row]:
    """An arc; none where it is too short to be one."""
    if angle_rad * radius_m <= SHORTEST_M:
        return []
    return [(begin.real, begin.imag, ahead.real, ahead.imag, side / radius_m, angle_rad * radius_m)]


def end_of(row: Row) -> Pose:
    """Where a segment ends."""
    begin, ahead, bend, length = complex(*row[:2]), complex(*row[2:4]), row[4], row[5]
    if bend == 0.0:
        return begin + length * ahead, ahead
    turned = ahead * cmath.exp(1j * bend * length)
    return begin + (turned - ahead) / (1j * bend), turned


def joins_at(place: complex, center: complex, radius_m: float, side: int) -> complex | None:
    """Where a straight line from a place touches a circle, so that it goes on round it; None from inside."""
    away = abs(place - center)
    if away <= radius_m * (1.0 + NEAR):
        return None
    # Seen from the centre, the place and the point of touch are this far apart.
    angle = math.acos(radius_m / away)
    return center + radius_m * (place - center) / away * cmath.exp(1j * side * angle)


def leaves_at(place: complex, center: complex, radius_m: float, side: int) -> complex | None:
    """Where a line to a place leaves a circle that was gone round; None to the inside."""
    return joins_at(place, center, radius_m, -side)


def direction_on(place: complex, center: complex, side: int) -> complex:
    """Direction of flight at a place of a circle."""
    out = (place - center) / abs(place - center)
    return out * 1j * side


def onto(pose: Pose, center: complex, radius_m: float, side: int, turn_m: float) -> list[Row]:
    """A way from a pose onto a circle: straight on as far as it takes, one turn, a line that touches the circle.

    Args:
        pose: where it begins.
        center: of the circle.
        radius_m: of the circle.
        side: which way it is gone round.
        turn_m: radius of the turn.
    """
    begin, ahead = pose
    best: list[Row] | None = None
    for turn in (1, -1):
        way = _onto(begin, ahead, center, radius_m, side, turn_m, turn)
        if way is not None and (best is None or sum(row[5] for row in way) < sum(row[5] for row in best)):
            best = way
    assert best is not None
    return best


def _onto(
    begin: complex, ahead: complex, center: complex, radius_m: float, side: int, turn_m: float, turn: int
) -> list[Row] | None:
    """`onto` with a turn to one side; the centres of turn and circle must be far enough apart for a common tangent."""
    # A common tangent of both, outer where they turn alike and inner where not, needs so much between the centres.
    needed = abs(radius_m - turn_m) if turn == side else radius_m + turn_m
    hub = begin + 1j * turn * turn_m * ahead - center
    along = hub.real * ahead.real + hub.imag * ahead.imag
    reach = needed * (1.0 + NEAR) + SHORTEST_M
    square = along * along - (abs(hub) ** 2 - reach * reach)
    on = 0.0 if abs(hub) >= reach else -along + math.sqrt(max(square, 0.0))
    start = begin + on * ahead
    pivot = start + 1j * turn * turn_m * ahead
    # Of the line: its direction d has the centre of turn at -1j turn turn_m, that of the circle likewise.
    apart = center - pivot
    offset = side * radius_m - turn * turn_m
    sine = offset / abs(apart)
    if abs(sine) > 1.0:
        return None
    straight = abs(apart) * math.sqrt(1.0 - sine * sine)
    out = apart / abs(apart) * cmath.exp(-1j * math.asin(sine))
    swept = (turn * cmath.phase(out / ahead)) % math.tau
    leave = pivot - 1j * turn * turn_m * out
    return [*line(begin, ahead, on), *arc(start, ahead, turn, turn_m, swept), *line(leave, out, straight)]


def towards(pose: Pose, place: complex, turn_m: float) -> list[Row]:
    """A turn from a pose after which a line leads to a place: the shorter of both sides that gets there."""
    begin, ahead = pose
    ways = []
    for turn in (1, -1):
        pivot = begin + 1j * turn * turn_m * ahead
        leave = leaves_at(place, pivot, turn_m, turn)
        if leave is not None:
            swept = (turn * cmath.phase((leave - pivot) / (begin - pivot))) % math.tau
            ways.append((swept * turn_m + abs(place - leave), turn, swept))
    if not ways:  # on the circles of both sides: at the pose itself
        return []
    _, turn, swept = min(ways)
    return arc(begin, ahead, turn, turn_m, swept)


def up_to(pose: Pose, target: complex | None, length_m: float, circle: tuple[complex, float, int]) -> float:
    """How much further round a circle it is to where the way to a place leaves it.

    Args:
        pose: on the circle.
        target: the place; None: it is left where it is.
        length_m: so far round from the pose.
        circle: centre, radius and side.
    """
    center, radius, side = circle
    leave = None if target is None else leaves_at(target, center, radius, side)
    if leave is None:
        return 0.0
    place = (pose[0] - center) * cmath.exp(1j * side * length_m / radius)
    return ((side * cmath.phase((leave - center) / place)) % math.tau) * radius


def turns_to(pose: Pose | None, place: complex) -> bool:
    """Whether a line from a pose, if there is one, leads to a place only after a turn."""
    if pose is None:
        return False
    way = place - pose[0]
    return abs(way) > SHORTEST_M and abs(way / abs(way) - pose[1]) > SAME_DIRECTION


def on_circle(pose: Pose, center: complex, radius: float, side: int) -> bool:
    """Whether a pose is on a circle, and goes round it."""
    if abs(abs(pose[0] - center) - radius) > ON_CIRCLE_M:
        return False
    return abs(direction_on(pose[0], center, side) - pose[1]) < 1e-3
