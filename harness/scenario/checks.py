"""What the keys of a scenario must be to each other: start and goal, obstacles and bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence

from harness.scenario.obstacles import Obstacle
from harness.scenario.sections import Area, MissionSpec, Point
from harness.scenario.validation import KeyFault


def check_start_and_goal(
    area: Area, obstacles: Sequence[Obstacle], mission: MissionSpec, clearance_m: float
) -> None:
    """Start and goal lie in the area and, as far as it can be told, clear of obstacles.

    The start must be clear of what is there at time 0, the goal of what is there for ever; a moving or timed
    obstacle may lie on the goal.

    Args:
        area: the area.
        obstacles: all of them.
        mission: start and goal.
        clearance_m: wanted distance from obstacle edges.

    Raises:
        KeyFault: one of them does not.
    """
    ends = (("start_m", mission.start_m), ("goal_m", mission.goal_m))
    for name, point in ends:
        xmin, ymin, xmax, ymax = area.bounds_m
        if not (xmin <= point[0] <= xmax and ymin <= point[1] <= ymax):
            raise KeyFault(
                ("mission", name), f"is {list(point)}; must lie inside area.bounds_m {list(area.bounds_m)}"
            )
    if math.dist(mission.start_m, mission.goal_m) <= mission.goal_radius_m:
        raise KeyFault(
            ("mission", "goal_m"),
            f"is {math.dist(mission.start_m, mission.goal_m):g} m from start_m, inside goal_radius_m "
            f"{mission.goal_radius_m:g} m; must be further away",
        )
    for name, point in ends:
        at_start = name == "start_m"
        there = [o.fixed if not at_start else o.active_s is None or o.active_s[0] <= 0 for o in obstacles]
        for index in (index for index, present in enumerate(there) if present):
            distance_m = distance_to(obstacles[index], point)
            if distance_m < clearance_m:
                where = f"{distance_m:.6g} m from" if distance_m > 0 else "inside"
                raise KeyFault(
                    ("mission", name),
                    f"lies {where} obstacles[{index}]; must be {clearance_m:g} m (planner.clearance_m) away",
                )


def distance_to(obstacle: Obstacle, point: Point) -> float:
    """Distance in metres from a point to the edge of an obstacle where the file puts it; negative inside."""
    if obstacle.circle:
        return math.dist(point, obstacle.circle.center_m) - obstacle.circle.radius_m
    assert obstacle.polygon
    import shapely

    polygon, place = shapely.Polygon(obstacle.polygon.vertices_m), shapely.Point(point)
    return float(shapely.distance(polygon, place) or -shapely.distance(polygon.exterior, place))
