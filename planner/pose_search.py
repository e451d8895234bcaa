"""Search over poses where turning is tight: the step model (1)-(3) under the minimum turn radius.

Every step is an arc of one of a few curvatures within the turn radius, so that whatever is found can be flown
as it is. It is used where no track through the free sectors leaves room for the turns that it needs.
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from planner.clearance import first_breach, inside_bounds
from planner.curves import Point, Pose, Segment, turn_onto
from planner.interface import FloatArray, Path
from planner.step_model import distance_left_m, largest_course_change_rad, step

EXPANSIONS = 150
"""Poses looked at before the search gives up."""


def search_poses(
    start: Pose,
    goal: Point,
    radius_m: float,
    points_m: FloatArray,
    keep_m: FloatArray,
    bounds_m: tuple[float, float, float, float],
    step_m: float | None = None,
) -> tuple[list[Point], Path] | None:
    """The cheapest flyable path by best-first search over (x, y, course).

    Args:
        start: first pose.
        goal: the end.
        radius_m: minimum turn radius R.
        points_m: (m, 2) edge points.
        keep_m: (m,) distance to be kept from each.
        bounds_m: area that must not be left.
        step_m: S_0; default: R.

    Returns:
        Track points after the start and the path; None where the search ran out of poses or of its count.
    """
    step_m = radius_m if step_m is None else step_m
    largest = largest_course_change_rad(step_m, radius_m)
    changes = (0.0, 0.5 * largest, -0.5 * largest, largest, -largest)
    course = math.atan2(start.tangent_north, start.tangent_east)
    guide = math.dist(start[:2], goal)
    # Entries: estimate, tie-break, cost, x, y, course at the track point (tangent), segments so far
    queue: list[tuple[float, int, float, float, float, float, tuple[Segment, ...]]]
    queue = [(guide, 0, 0.0, start.east_m, start.north_m, course, ())]
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
        near = np.hypot(points_m[:, 0] - x, points_m[:, 1] - y) < keep_m + 2.0 * step_m
        final = turn_onto(pose, goal, radius_m)
        if final is not None and _clear(final, points_m, keep_m, bounds_m):
            segments = [*done, *final]
            nodes = [(s[0], s[1]) for s in segments[1:]]
            return [*nodes, goal], Path(np.array(segments))
        away = math.dist((x, y), goal)
        for change in changes:
            # The chord of an arc points half-way between the tangents at its ends: theta_k is the course of chords.
            nx, ny, chord = step(x, y, course, 0.5 * change, step_m)
            curvature = 2.0 * math.sin(0.5 * change) / step_m
            length = step_m if change == 0.0 else change / curvature
            arc: Segment = (x, y, pose.tangent_east, pose.tangent_north, curvature, length)
            if not _clear([arc], points_m[near], keep_m[near], bounds_m):
                continue
            count += 1
            off = chord - math.atan2(goal[1] - y, goal[0] - x)
            left = distance_left_m(away, step_m, off)
            queue_entry = (cost + length + left, count, cost + length, nx, ny, course + change, (*done, arc))
            heapq.heappush(queue, queue_entry)
    return None


def _clear(
    segments: list[Segment],
    points_m: FloatArray,
    keep_m: FloatArray,
    bounds_m: tuple[float, float, float, float],
) -> bool:
    path = Path(np.array(segments))
    return inside_bounds(path, bounds_m) and math.isinf(first_breach(path, points_m, keep_m))
