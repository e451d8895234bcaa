"""Search over poses where turning is tight: the step model (1)-(3) under the minimum turn radius.

It is used where no track through the free sectors leaves room for the turns that it needs: every step is an arc within
the turn radius. The distances to go lead it (hybrid A*: Dolgov, Thrun, Montemerlo and Diebel, 2008).
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Generator, Iterator

import numpy as np

from planner.geometry.course import Route
from planner.geometry.curves import Limits, Point, Pose, Segment, turns_onto
from planner.geometry.terrain import Terrain
from planner.interface import Path
from planner.paper.model import step

MOST_TURN_RAD = 2.0 * math.asin(0.5)  # of a step: its chord is the turn radius
MOST_POSES = 1000  # most poses that a search expands before it gives up

ENOUGH_RADII = 12.0
"""A route ends this many turn radii nearer to the goal: from there on the free sectors are searched again."""


def search_poses(
    start: Pose,
    start_curvature: float,
    goal: Point,
    limits: Limits,
    terrain: Terrain,
    to_go: Callable[[Point], float],
) -> Generator[None, None, Route | None]:
    """The cheapest flyable route over (x, y, course) in steps of a turn radius, a straight between turns; else None."""
    step_m = limits.radius_m
    course = math.atan2(start.tangent_north, start.tangent_east)
    enough_m = to_go(start[:2]) - ENOUGH_RADII * limits.radius_m
    queue: list[tuple[float, int, float, float, float, float, tuple[Segment, ...]]]
    queue = [(to_go(start[:2]), 0, 0.0, start.east_m, start.north_m, course, ())]
    seen: set[tuple[int, int, int]] = set()
    count = 0
    while queue and len(seen) < MOST_POSES:
        cost, _, flown, x, y, course, arcs = heapq.heappop(queue)
        key = (round(2 * x / step_m), round(2 * y / step_m), round(course % math.tau / (0.5 * MOST_TURN_RAD)))
        if key in seen:
            continue
        seen.add(key)
        yield
        if arcs and cost - flown < enough_m:
            return _route(arcs, (x, y))
        pose = Pose(x, y, math.cos(course), math.sin(course))
        turning = arcs[-1][4] if arcs else start_curvature
        for final in turns_onto(pose, goal, limits.radius_m):
            if final[0][4] * turning >= 0.0 and terrain.admits(Path(np.array(final))):
                return _route((*arcs, *final), goal)
        for arc, end, change in _steps(pose, course, turning, step_m):
            if (left := to_go(end)) < math.inf and terrain.admits(Path(np.array([arc]))):
                count += 1
                so_far = flown + arc[5]
                heapq.heappush(queue, (so_far + left, count, so_far, *end, course + change, (*arcs, arc)))
    return None


def _steps(pose: Pose, course: float, turning: float, step_m: float) -> Iterator[tuple[Segment, Point, float]]:
    """The steps from a pose that do not turn against the curvature flown: arc, end, and change of the course (rad)."""
    for change in (0.0, 0.5 * MOST_TURN_RAD, -0.5 * MOST_TURN_RAD, MOST_TURN_RAD, -MOST_TURN_RAD):
        if change * turning >= 0.0:
            # theta_k is the course of a chord: half-way between the tangents at the ends of an arc.
            x, y, _ = step(*pose[:2], course, 0.5 * change, 1.0, step_m)
            curvature = 2.0 * math.sin(0.5 * change) / step_m
            yield (*pose, curvature, change / curvature if change else step_m), (x, y), change


def _route(segments: tuple[Segment, ...], end: Point) -> Route:
    """The route along segments; its track points are their ends."""
    return Route((*(segment[:2] for segment in segments[1:]), end), Path(np.array(segments)))
