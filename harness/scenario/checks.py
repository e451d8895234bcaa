"""What the keys of a scenario must be to each other: start and goal, obstacles and bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from harness.scenario.obstacles import Obstacle
from harness.scenario.sections import Area, MissionSpec, Point
from harness.scenario.validation import KeyFault

PLANE_REACH_M: Final = 400_000.0
"""Up to this distance from any origin within 85 degrees of the equator the local plane is right to 0.9 m (`pyproj`)."""


def check_local_plane(area: Area) -> None:
    """The local plane about the area's origin is right to a metre wherever the area reaches.

    Raises:
        KeyFault: it is not.
    """
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
    """Start and goal lie in the area and, as far as it can be told, clear of obstacles.

    The start must be clear of what is there at time 0, the goal of what is there for ever; a moving or timed
    obstacle may lie on the goal.

    Args:
        area: gives the bounds.
        obstacles: all of them.
        mission: start and goal.
        clearance_m: wanted distance from obstacle edges.
        names: what messages call each obstacle.

    Raises:
        KeyFault: one of them does not.
    """
    ends = (("start_m", mission.start_m), ("goal_m", mission.goal_m))
    xmin, ymin, xmax, ymax = area.bounds_m
    for name, point in ends:
        if not (xmin <= point[0] <= xmax and ymin <= point[1] <= ymax):
            raise KeyFault(
                ("mission", name), f"is {list(point)}; must lie inside area.bounds_m {list(area.bounds_m)}"
            )
    straight_m = math.dist(mission.start_m, mission.goal_m)
    if straight_m <= mission.goal_radius_m:
        raise KeyFault(
            ("mission", "goal_m"),
            f"is {straight_m:g} m from start_m, inside goal_radius_m {mission.goal_radius_m:g} m; must be further away",
        )
    for name, point in ends:
        for obstacle, told in zip(obstacles, names, strict=True):
            at_first = obstacle.active_s is None or obstacle.active_s[0] <= 0
            if not (at_first if name == "start_m" else obstacle.fixed) or _is_far(
                obstacle, point, clearance_m
            ):
                continue
            distance_m = distance_to(obstacle, point)
            if distance_m < clearance_m:
                where = f"{distance_m:.6g} m from" if distance_m > 0 else "inside"
                raise KeyFault(
                    ("mission", name),
                    f"lies {where} {told}; must be {clearance_m:g} m (planner.clearance_m) away",
                )


COURSE_STEP_DEG: Final = 5
"""Arcs and courses are looked at in steps of this."""


def check_start_leads_in(area: Area, mission: MissionSpec, turn_radius_m: float) -> None:
    """The flight does not begin by leaving the area: straight on, or a tightest turn to one side, keeps within it.

    Raises:
        KeyFault: it begins so; the sentence has a course that would do.
    """
    if _stays_inside(area, mission.start_m, mission.course_deg, turn_radius_m):
        return
    courses = range(0, 360, COURSE_STEP_DEG)
    good = (each for each in courses if _stays_inside(area, mission.start_m, float(each), turn_radius_m))
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

    def inside(east: float, north: float) -> bool:
        return xmin - 1e-3 <= east <= xmax + 1e-3 and ymin - 1e-3 <= north <= ymax + 1e-3

    for side in (1.0, -1.0):  # to the right, to the left
        for turned_deg in range(0, 361, COURSE_STEP_DEG):
            course, turned = math.radians(course_deg), side * math.radians(turned_deg)
            east = start[0] + side * radius_m * (math.cos(course) - math.cos(course + turned))
            north = start[1] - side * radius_m * (math.sin(course) - math.sin(course + turned))
            if not inside(east, north):
                break
            ahead_m = 2.0 * radius_m
            if turned_deg == 360 or inside(
                east + ahead_m * math.sin(course + turned), north + ahead_m * math.cos(course + turned)
            ):
                return True
    return False


def _is_far(obstacle: Obstacle, point: Point, distance_m: float) -> bool:
    """Whether a polygon's upright box alone says that it is farther away: of 100,000 obstacles most are."""
    if obstacle.polygon is None:
        return False
    east, north = zip(*obstacle.polygon.vertices_m, strict=True)
    x, y = point
    away = max(min(east) - x, x - max(east), min(north) - y, y - max(north))
    return bool(away > distance_m)


def distance_to(obstacle: Obstacle, point: Point) -> float:
    """Distance in metres from a point to the edge of an obstacle where the file puts it; negative inside."""
    if obstacle.circle:
        return math.dist(point, obstacle.circle.center_m) - obstacle.circle.radius_m
    assert obstacle.polygon
    import shapely

    polygon = shapely.Polygon(obstacle.polygon.vertices_m, obstacle.polygon.holes_m)
    place = shapely.Point(point)
    return float(shapely.distance(polygon, place) or -shapely.distance(polygon.boundary, place))
