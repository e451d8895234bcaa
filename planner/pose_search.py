"""Search over poses where turning is tight: the step model (1)-(3) under the minimum turn radius.

Every step is an arc of one of a few curvatures within the turn radius, so that whatever is found can be flown
as it is. It is used where no track through the free sectors leaves room for the turns that it needs.
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from planner.curves import Limits, Point, Pose, Segment, turns_onto
from planner.interface import Path
from planner.route_optimisation import Route, Terrain
from planner.step_model import distance_left_m, largest_course_change_rad, step

EXPANSIONS = 60
"""Poses looked at before the search gives up."""


def search_poses(
    start: Pose, start_curvature: float, goal: Point, limits: Limits, terrain: Terrain
) -> Route | None:
    """The cheapest flyable route by best-first search over (x, y, course), in steps S_0 of one turn radius.

    A left turn never follows a right one without a straight step between.

    Args:
        start: first pose.
        start_curvature: curvature (1/m) flown on arrival there.
        goal: the end.
        limits: smallest radius.
        terrain: where the route may lie.

    Returns:
        The route; None where the search ran out of poses or of its count.
    """
    step_m = limits.radius_m
    largest = largest_course_change_rad(step_m, limits.radius_m)
    course = math.atan2(start.tangent_north, start.tangent_east)
    queue: list[tuple[float, int, float, float, float, float, tuple[Segment, ...]]]
    queue = [(math.dist(start[:2], goal), 0, 0.0, start.east_m, start.north_m, course, ())]
    seen: set[tuple[int, int, int]] = set()
    count = 0
    for _ in range(EXPANSIONS):
        if not queue:
            return None
        _, _, cost, x, y, course, done = heapq.heappop(queue)
        key = (round(2 * x / step_m), round(2 * y / step_m), round(course % math.tau / (0.5 * largest)))
        if key in seen:
            continue
        seen.add(key)
        pose = Pose(x, y, math.cos(course), math.sin(course))
        turning = done[-1][4] if done else start_curvature
        for final in turns_onto(pose, goal, limits.radius_m):
            if final[0][4] * turning >= 0.0 and terrain.admits(Path(np.array(final))):
                path = Path(np.array([*done, *final]))
                return Route((*((s[0], s[1]) for s in path.segments[1:].tolist()), goal), path)
        nearby = terrain.near(x, y, step_m)
        away = math.dist((x, y), goal)
        for change in (0.0, 0.5 * largest, -0.5 * largest, largest, -largest):
            if change * turning < 0.0:
                continue
            # theta_k is the course of chords: half-way between the tangents at the ends of an arc.
            nx, ny, chord = step(x, y, course, 0.5 * change, step_m)
            curvature = 2.0 * math.sin(0.5 * change) / step_m
            arc: Segment = (*pose, curvature, change / curvature if change else step_m)
            if not nearby.admits(Path(np.array([arc]))):
                continue
            count += 1
            left = distance_left_m(away, step_m, chord - math.atan2(goal[1] - y, goal[0] - x))
            so_far = cost + arc[5]
            heapq.heappush(queue, (so_far + left, count, so_far, nx, ny, course + change, (*done, arc)))
    return None
