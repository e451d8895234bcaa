"""What the keys of a scenario must be to each other: start and goal, obstacles and bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from harness.scenario.obstacles import Obstacle
from harness.scenario.sections import Area, MissionSpec, Point
from harness.scenario.validation import KeyFault

PLANE_REACH_M: Final = 400_000.0
"""Up to this distance from any origin within 85 degrees of the equator the local plane is right to 0.9 m (`pyproj`)."""
COURSE_STEP_DEG: Final = 5
"""Step in which places on an arc, and courses, are tested."""
ROUNDING_M: Final = 1e-3
"""A place outside of the area by at most this counts as inside."""


def check_local_plane(area: Area) -> None:
    """Raises a KeyFault unless the plane about the area's origin is right to a metre wherever the area reaches."""
    xmin, ymin, xmax, ymax = area.bounds_m
    reach_m = math.hypot(max(abs(xmin), abs(xmax)), max(abs(ymin), abs(ymax)))
    if reach_m > PLANE_REACH_M:
        raise KeyFault(
            ("area", "bounds_m"),
            f"reaches {reach_m / 1e3:.0f} km from area.origin; the plane is right to a metre up to "
            f"{PLANE_REACH_M / 1e3:.0f} km: lay the origin nearer to the area's middle, or take a smaller area",
        )


def check_start_and_goal(
    area: Area, obstacles: Sequence[Obstacle], mission: MissionSpec, clearance_m: float, names: Sequence[str]
) -> None:
    """Raises a KeyFault unless start and goal lie in the area and, as far as it can be told, clear of obstacles.

    The start must be clear of what is there at time 0, the goal of what is there for ever; a moving or timed
    obstacle may lie on the goal. `names` are what messages call each obstacle.
    """
    xmin, ymin, xmax, ymax = area.bounds_m
    ends = {"start_m": mission.start_m, "goal_m": mission.goal_m}
    for name, (east, north) in ends.items():
        if min(east - xmin, xmax - east, north - ymin, ymax - north) < 0.0:
            told = f"is {[east, north]}; must lie inside area.bounds_m {list(area.bounds_m)}"
            raise KeyFault(("mission", name), told)
    straight_m = math.dist(mission.start_m, mission.goal_m)
    if straight_m <= mission.goal_radius_m:
        raise KeyFault(
            ("mission", "goal_m"),
            f"is {straight_m:g} m from start_m, inside goal_radius_m {mission.goal_radius_m:g} m; must be further away",
        )
    at_first = [(each.active_s or (0.0,))[0] <= 0.0 for each in obstacles]
    there = {"start_m": at_first, "goal_m": [each.fixed for each in obstacles]}
    for end, point in ends.items():
        for obstacle, told, counts in zip(obstacles, names, there[end], strict=True):
            distance_m = _distance_to(obstacle, point, clearance_m) if counts else math.inf
            if distance_m < clearance_m:
                where = f"{distance_m:.6g} m from" if distance_m > 0 else "inside"
                raise KeyFault(
                    ("mission", end),
                    f"lies {where} {told}; must be {clearance_m:g} m (planner.clearance_m) away",
                )


def _distance_to(obstacle: Obstacle, point: Point, wanted_m: float) -> float:
    """Distance in metres from a point to the edge of an obstacle where the file puts it; negative inside.

    It is +inf where a polygon's upright box alone says that it is more than is wanted: of 100,000 obstacles most are.
    """
    if obstacle.circle:
        return math.dist(point, obstacle.circle.center_m) - obstacle.circle.radius_m
    assert obstacle.polygon
    (x, y), (east, north) = point, zip(*obstacle.polygon.vertices_m, strict=True)
    if max(min(east) - x, x - max(east), min(north) - y, y - max(north)) > wanted_m:
        return math.inf
    import shapely

    polygon, place = (
        shapely.Polygon(obstacle.polygon.vertices_m, obstacle.polygon.holes_m),
        shapely.Point(point),
    )
    return float(shapely.distance(polygon, place) or -shapely.distance(polygon.boundary, place))


def check_start_leads_in(area: Area, mission: MissionSpec, turn_radius_m: float) -> None:
    """Raises a KeyFault, with a course that would do, if the flight begins by leaving the area.

    It does not if straight on, or a tightest turn to one side, keeps within it.
    """
    if _stays_inside(area, mission.start_m, mission.course_deg, turn_radius_m):
        return
    courses = range(0, 360, COURSE_STEP_DEG)
    good = (each for each in courses if _stays_inside(area, mission.start_m, each, turn_radius_m))
    course = next(good, None)
    told = (
        "none would do: start farther from the border" if course is None else f"must be another, as {course}"
    )
    raise KeyFault(
        ("mission", "course_deg"),
        f"is {mission.course_deg:.0f}, which leads out of area.bounds_m at once: no turn of {turn_radius_m:.0f} m from "
        f"start_m {list(mission.start_m)} stays inside; {told}",
    )


def _stays_inside(area: Area, start: Point, course_deg: float, radius_m: float) -> bool:
    """Whether a turn to one side, or none, stays in the area until two radii straight ahead are inside."""
    xmin, ymin, xmax, ymax = area.bounds_m
    turned = np.radians(np.arange(0, 361, COURSE_STEP_DEG))
    for side in (1.0, -1.0):  # to the right, to the left
        ahead = np.exp(1j * (math.radians(90.0 - course_deg) - side * turned))  # east and north
        places = complex(*start) - side * 1j * radius_m * (ahead[0] - ahead)
        both = np.stack((places, places + 2.0 * radius_m * ahead))
        east, north = both.real, both.imag
        inside = (np.abs(2.0 * east - xmin - xmax) <= xmax - xmin + 2.0 * ROUNDING_M) & (
            np.abs(2.0 * north - ymin - ymax) <= ymax - ymin + 2.0 * ROUNDING_M
        )
        inside[1, -1] = True  # a whole circle
        if (np.logical_and.accumulate(inside[0]) & inside[1]).any():
            return True
    return False
