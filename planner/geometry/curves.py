"""Paths of bounded curvature: building them from poses and nodes, measuring, cutting, sampling.

A segment is one row of `planner.interface.Path.segments`: start east, start north, unit tangent east, unit
tangent north, curvature (1/m, positive = left turn), length (m).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from planner.interface import FloatArray, Mission, Path
from planner.kernels import segments as kernel

Point = tuple[float, float]
Segment = tuple[float, float, float, float, float, float]

SHORTEST_M = 1e-6  # segments shorter than this are left out of a path

ON_TURN_SHARE = 1e-6  # a place counts as on a turn if it is at most this share of the radius off the circle


class Pose(NamedTuple):
    """A place (metres, ENU) and the unit vector of the direction of travel."""

    east_m: float
    north_m: float
    tangent_east: float
    tangent_north: float


def along(segment: Sequence[float], distance_m: float) -> Pose:
    """The pose `distance_m` after the start of a segment."""
    x, y, tx, ty, curvature, _ = segment
    if abs(curvature) < 1e-12:
        return Pose(x + tx * distance_m, y + ty * distance_m, tx, ty)
    turn = curvature * distance_m
    sine, versine = math.sin(turn) / curvature, (1.0 - math.cos(turn)) / curvature
    c, s = math.cos(turn), math.sin(turn)
    return Pose(x + tx * sine - ty * versine, y + ty * sine + tx * versine, tx * c - ty * s, ty * c + tx * s)


def end_of(path: Path) -> Pose:
    """The pose at the end of a path."""
    last = path.segments[-1]
    return along(last, float(last[5]))


def place_on(path: Path, arc_length_m: float) -> tuple[Pose, float]:
    """The pose `arc_length_m` along a path, clamped to its ends, and the curvature (1/m) there."""
    left = max(arc_length_m, 0.0)
    last = path.rows[-1]
    for row in path.rows[:-1]:
        if left <= row[5]:
            return along(row, left), row[4]
        left -= row[5]
    return along(last, min(left, last[5])), last[4]


def pose_at(path: Path, arc_length_m: float) -> Pose:
    """The pose `arc_length_m` along a path, clamped to its ends."""
    return place_on(path, arc_length_m)[0]


def on_loiter(path: Path, arc_length_m: float) -> float:
    """An arc length with whole turns of a closing loiter circle taken off."""
    if not path.loiter or arc_length_m <= path.length_m:
        return arc_length_m
    turn = float(path.segments[-1, 5])
    return path.length_m - turn + (arc_length_m - path.length_m) % turn


def between(path: Path, start_m: float, stop_m: float) -> list[Segment]:
    """The segments of the stretch of a path from one arc length to another."""
    out: list[Segment] = []
    begin = 0.0
    for row in path.segments.tolist():
        lower, upper = max(start_m - begin, 0.0), min(stop_m - begin, row[5])
        if upper - lower > SHORTEST_M:
            out.append((*along(row, lower), row[4], upper - lower))
        begin += row[5]
    return out


def sample(path: Path, spacing_m: float, deviation_m: float = math.inf) -> FloatArray:
    """(k, 2) points along a path, both ends included, no further apart than `spacing_m` along the path.

    Nowhere is an arc further than `deviation_m` from the chord between neighbours.
    """
    pieces = [path.segments[:1, :2]]
    for x, y, tx, ty, curvature, length in path.segments.tolist():
        step = spacing_m
        if curvature:
            step = min(step, math.sqrt(8.0 * deviation_m / abs(curvature)))
        elif math.isfinite(deviation_m) and math.isinf(spacing_m):
            step = length
        s = np.linspace(0.0, length, max(2, math.ceil(length / step) + 1))[1:]
        if abs(curvature) < 1e-12:
            pieces.append(np.column_stack((x + tx * s, y + ty * s)))
            continue
        sine, versine = np.sin(curvature * s) / curvature, (1.0 - np.cos(curvature * s)) / curvature
        pieces.append(np.column_stack((x + tx * sine - ty * versine, y + ty * sine + tx * versine)))
    return np.concatenate(pieces)


def poses_at(path: Path, arc_lengths_m: FloatArray) -> FloatArray:
    """(k, 4) poses at (k,) arc lengths along a path, clamped to its ends."""
    return kernel.poses_at(path.segments, np.ascontiguousarray(arc_lengths_m))[:, :4]


def places_along(path: Path, end_m: float, pieces: int) -> FloatArray:
    """(pieces + 1, 2) places along a path, clamped to its ends, from its start to an arc length and evenly spaced."""
    return poses_at(path, np.linspace(0.0, end_m, pieces + 1))[:, :2]


def turn_centres(path: Path, arc_lengths_m: FloatArray, radius_m: float, roll_m: float) -> FloatArray:
    """(k, 2, 2) centres of the turns off a path at (k,) arc lengths: to the left, and to the right.

    Where the path turns the other way, the turn begins after a straight of `roll_m`.
    """
    poses = kernel.poses_at(path.segments, np.ascontiguousarray(arc_lengths_m))
    return kernel.turn_centres(poses, radius_m, roll_m)


def turns_onto(pose: Pose, target: Point, radius_m: float) -> Iterator[list[Segment]]:
    """Yields turns from a pose onto a straight line that ends at a point, each with that line, the shorter first.

    There is one to the left and one to the right, except where the point lies inside the turning circle.
    """
    ways: list[tuple[float, Segment, float]] = []
    for side in (1.0, -1.0):  # left, right
        cx = pose.east_m - side * radius_m * pose.tangent_north
        cy = pose.north_m + side * radius_m * pose.tangent_east
        dx, dy = target[0] - cx, target[1] - cy
        if (distance := math.hypot(dx, dy)) <= radius_m:
            continue
        straight = math.sqrt(distance * distance - radius_m * radius_m)
        # Direction of the tangent line that leaves the circle towards the target.
        heading = math.atan2(dy, dx) + side * math.asin(radius_m / distance)
        turn = side * (heading - math.atan2(pose.tangent_north, pose.tangent_east)) % math.tau
        if math.tau - turn < 1e-9:
            turn = 0.0
        arc: Segment = (*pose, side / radius_m, turn * radius_m)
        ways.append((turn * radius_m + straight, arc, straight))
    for _, arc, straight in sorted(ways, key=lambda each: each[0]):
        way = [arc] if arc[5] > SHORTEST_M else []
        if straight > SHORTEST_M:
            way.append((*along(arc, arc[5]), 0.0, straight))
        if way:
            yield way


def turn_onto(pose: Pose, target: Point, radius_m: float) -> list[Segment] | None:
    """The shorter turn from a pose onto a straight line that ends at a point, and that line; None if there is none."""
    return next(turns_onto(pose, target, radius_m), None)


class Limits(NamedTuple):
    """Limits of the bend of a curve."""

    radius_m: float  # smallest radius
    roll_m: float  # flown, downwind, while rolling into a turn; straight between a left and a right turn

    @classmethod
    def of(cls, mission: Mission) -> Limits:
        """The limits of a mission."""
        return cls(mission.turn_radius_m, mission.ground_speed_mps * mission.roll_in_s)


def fillet(
    start: Pose,
    nodes: Sequence[Point],
    limits: Limits,
    cut_m: float,
    start_curvature: float = 0.0,
    longer_turn: bool = False,
    first_radius_m: float | None = None,
) -> Path | None:
    """A path from a pose through the corners of a polyline, each corner rounded by one arc.

    The first turn has the smallest radius, if none is given. Every corner gets the largest arc that its legs have
    room for and that passes the corner within a given distance, so that curvature is no larger than it has to be.

    Args:
        start: where the path begins.
        nodes: corners and, last, the end; all ahead of `start` in the order of flight.
        limits: smallest radius and room to roll.
        cut_m: how far from a corner its arc may pass, where the smallest radius leaves the choice.
        start_curvature: curvature (1/m) flown on arrival at the start.
        longer_turn: begin with the longer of the two turns towards the first corner.
        first_radius_m: radius of that turn.
    """
    first_radius_m = first_radius_m or limits.radius_m
    segments = _first_turn(start, nodes[0], limits, start_curvature, longer_turn, first_radius_m)
    if segments is None:
        return None
    corner, last_turn = start, start_curvature
    if segments:
        corner, last_turn = along(segments[-1], segments[-1][5]), segments[-1][4]
    used = 0.0  # how much of the present leg the corner before it has taken
    for i, node in enumerate(nodes):
        leg = math.dist(corner[:2], node)
        out = math.dist(node, nodes[i + 1]) if i + 1 < len(nodes) else math.inf
        if min(leg, out) <= SHORTEST_M:
            return None
        ux, uy = (node[0] - corner[0]) / leg, (node[1] - corner[1]) / leg
        trim, turn, radius = 0.0, 0.0, math.inf
        if i + 1 < len(nodes):
            vx, vy = (nodes[i + 1][0] - node[0]) / out, (nodes[i + 1][1] - node[1]) / out
            turn = math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)
            free = leg - used - (limits.roll_m if turn * last_turn < 0.0 else 0.0)
            most = min(0.5 * leg, out if i + 2 == len(nodes) else 0.5 * out)
            if (rounded := _round_corner(turn, limits.radius_m, min(free, out), free, most, cut_m)) is None:
                return None
            trim, radius = rounded
        if (straight := leg - used - trim) > SHORTEST_M:
            segments.append((corner[0] + ux * used, corner[1] + uy * used, ux, uy, 0.0, straight))
        if math.isfinite(radius) and radius * abs(turn) > SHORTEST_M:
            last_turn = turn
            at = (node[0] - ux * trim, node[1] - uy * trim)
            segments.append((*at, ux, uy, math.copysign(1.0 / radius, turn), radius * abs(turn)))
        corner, used = Pose(node[0], node[1], ux, uy), trim
    return Path(np.array(segments)) if segments else None


def _round_corner(
    turn: float, least_radius_m: float, room_m: float, free_m: float, most_m: float, cut_m: float
) -> tuple[float, float] | None:
    """Length of each leg that the arc of a corner takes, and its radius; None where the least radius has no room."""
    if (tangent := math.tan(0.5 * abs(turn))) <= 1e-9:
        return 0.0, math.inf
    if (need := least_radius_m * tangent) > room_m:
        return None
    # An arc of radius r passes the corner at r (1 / cos(turn / 2) - 1).
    trim = min(max(need, min(cut_m * tangent / max(1.0 / math.cos(0.5 * turn) - 1.0, 1e-12), most_m)), free_m)
    return trim, trim / tangent


def _first_turn(
    start: Pose, node: Point, limits: Limits, start_curvature: float, longer_turn: bool, radius_m: float
) -> list[Segment] | None:
    """The turn towards the first corner, after a straight to roll where the other way is turned before."""
    segments: list[Segment] = []
    way = next(islice(turns_onto(start, node, radius_m), longer_turn, None), None)
    if way and way[0][4] * start_curvature < 0.0 and limits.roll_m > SHORTEST_M:
        segments.append((*start, 0.0, limits.roll_m))
        start = along(segments[0], limits.roll_m)
        way = next(islice(turns_onto(start, node, radius_m), longer_turn, None), None)
    return [*segments, *(segment for segment in way if segment[4])] if way else None


def onward(path: Path, arc_length_m: float, length_m: float) -> list[Segment]:
    """The segments of `length_m` of a path from an arc length on; a closing loiter repeats as often as needed."""
    stretch = between(path, arc_length_m, arc_length_m + length_m)
    left = arc_length_m + length_m - max(path.length_m, arc_length_m)
    turn = path.segments[-1].tolist()
    while path.loiter and left > SHORTEST_M:
        stretch.append((*turn[:5], min(left, turn[5])))
        left -= turn[5]
    return stretch


def full_turn(pose: Pose, radius_m: float, side: float) -> Segment:
    """A full circle from a pose, to the left (`side` = 1) or to the right (-1)."""
    return (*pose, side / radius_m, math.tau * radius_m)


def turn_off(pose: Pose, curvature: float, side: float, limits: Limits) -> list[Segment]:
    """A full turn from a pose to one side, after a straight to roll where the other way is turned before (1/m)."""
    if side * curvature >= 0.0:
        return [full_turn(pose, limits.radius_m, side)]
    roll: Segment = (*pose, 0.0, limits.roll_m)
    return [roll, full_turn(along(roll, limits.roll_m), limits.radius_m, side)]


def moved(segments: Sequence[Segment], to: Pose) -> list[Segment]:
    """Moves and turns segments as a whole, so that they begin at another pose."""
    x, y, tx, ty = segments[0][:4]
    turn = complex(to.tangent_east, to.tangent_north) * complex(tx, -ty)
    turn /= abs(turn)  # else what is moved again and again shrinks or grows: the error doubles each time
    out: list[Segment] = []
    for east, north, tangent_east, tangent_north, curvature, length in segments:
        place = complex(to.east_m, to.north_m) + turn * complex(east - x, north - y)
        tangent = turn * complex(tangent_east, tangent_north)
        out.append((place.real, place.imag, tangent.real, tangent.imag, curvature, length))
    return out


def onward_in_turn(pose: Pose, curvature: float, to: Pose) -> list[Segment] | None:
    """The arc of a turn of a curvature (1/m) from one pose on it to another; None where the other is not on it."""
    if not curvature:
        return None
    turned = math.atan2(
        pose.tangent_east * to.tangent_north - pose.tangent_north * to.tangent_east,
        pose.tangent_east * to.tangent_east + pose.tangent_north * to.tangent_north,
    )
    arc: Segment = (*pose, curvature, math.copysign(1.0, curvature) * turned % math.tau / abs(curvature))
    if math.dist(along(arc, arc[5])[:2], to[:2]) > ON_TURN_SHARE / abs(curvature):
        return None
    return [arc] if SHORTEST_M < arc[5] < math.tau / abs(curvature) - SHORTEST_M else []
