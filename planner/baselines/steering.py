"""A direction steered to: the turn onto it at the turn radius and straight on, as far as the area goes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from planner.geometry.clearance import inside_bounds
from planner.geometry.curves import SHORTEST_M, Point, Pose, Segment, turn_onto
from planner.geometry.joining import stuck
from planner.interface import FloatArray, Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus


def steer(
    request: PlanRequest,
    mission: Mission,
    start: tuple[Pose, list[Segment]],
    target: Point,
    points_m: FloatArray,
    picture: Callable[[], PlanPicture],
) -> Plan:
    """The path of a planner that answers with a direction: BendyRuler and VFH+ have none of their own.

    `start` is where the path leaves the one in effect, and the stretch up to there; the direction leads to `target`.
    The (m, 2) edge points are for a turn to hold in.
    """
    pose, prefix = start
    turn = turn_onto(pose, target, mission.turn_radius_m)
    if turn is None:
        return Plan(PlanStatus.NO_PATH, "the goal is nearer than a turn")
    arcs, last = [row for row in turn if row[4]], turn[-1]
    room_m = last[5] if last[4] else _to_border_m(last, mission.bounds_m)
    if room_m < SHORTEST_M or (arcs and not inside_bounds(Path(np.array(arcs)), mission.bounds_m)):
        return stuck("no turn stays inside the area", request, mission, points_m)
    turn[-1] = (*last[:5], min(last[5], room_m))
    bearing = math.atan2(target[1] - pose.north_m, target[0] - pose.east_m)
    return Plan(
        PlanStatus.FOUND,
        f"steering {math.degrees(math.pi / 2 - bearing) % 360:.0f} degrees",
        np.array([request.position_m, *(row[:2] for row in turn[1:]), target]),
        Path(np.array([*prefix, *turn])),
        picture,
    )


def off(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """The turn from direction b to direction a, in [-pi, pi)."""
    return np.asarray((np.subtract(a, b) + math.pi) % math.tau - math.pi, dtype=np.float64)


def _to_border_m(straight: Segment, bounds_m: tuple[float, float, float, float]) -> float:
    """How far a straight line stays inside the area; negative where it begins outside."""
    x, y, ux, uy, _, _ = straight
    xmin, ymin, xmax, ymax = bounds_m
    room = [math.inf]
    for low, high, place, pace in ((xmin, xmax, x, ux), (ymin, ymax, y, uy)):
        if not low <= place <= high:
            return -math.inf
        if pace:
            room.append(((high if pace > 0.0 else low) - place) / pace)
    return min(room)
