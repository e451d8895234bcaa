"""What the keys of a scenario must be to each other: start and goal, obstacles and bounds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from aircraft.frames import LocalPlane
from harness.scenario.obstacles import Obstacle
from harness.scenario.sections import Area, MissionSpec, Point
from harness.scenario.validation import KeyFault

PLANE_RIGHT_M: Final = 1.0
"""The local plane must put every point of the area this near to where the geodesic has it."""

SURELY_RIGHT_M: Final = 250_000.0
"""Up to this distance from an origin within `SURELY_RIGHT_DEG` of the equator the plane is off by 0.22 m at most."""

SURELY_RIGHT_DEG: Final = 80.0
"""At this latitude the pole is 1,117 km away, far beyond `SURELY_RIGHT_M`."""

POLE_ROOM_M: Final = 10_000.0
"""No area comes nearer to a pole: there, longitude turns too fast for the guidance's patches of 500 m of the plane."""

SIDE_POINTS: Final = 16
"""Number of points of each side of an area that are compared with the geodesic."""


def check_local_plane(area: Area) -> None:
    """The local plane about the area's origin is right wherever the area reaches.

    Raises:
        KeyFault: it is not; the sentence has the place and the error.
    """
    xmin, ymin, xmax, ymax = area.bounds_m
    reach_m = math.hypot(max(abs(xmin), abs(xmax)), max(abs(ymin), abs(ymax)))
    latitude_deg, longitude_deg = area.origin.latitude_deg, area.origin.longitude_deg
    if reach_m <= SURELY_RIGHT_M and abs(latitude_deg) <= SURELY_RIGHT_DEG:
        return
    import pyproj

    geod, plane = pyproj.Geod(ellps="WGS84"), LocalPlane(latitude_deg, longitude_deg)
    for name, sign in (("north", 1.0), ("south", -1.0)):
        pole_m = sign * geod.inv(longitude_deg, latitude_deg, longitude_deg, sign * 90.0)[2]
        outside_m = math.hypot(max(xmin, -xmax, 0.0), max(ymin - pole_m, pole_m - ymax, 0.0))
        if outside_m < POLE_ROOM_M:
            raise KeyFault(
                ("area", "origin"),
                f"the {name} pole lies at [0, {pole_m:.0f}] of the plane about it, closer than {POLE_ROOM_M:.0f} m to "
                "area.bounds_m; move the area away from the pole",
            )

    def off_m(place: Point) -> float:
        point_deg = plane.geodetic(*place)
        azimuth_deg, _, length_m = geod.inv(longitude_deg, latitude_deg, point_deg[1], point_deg[0])
        azimuth = math.radians(azimuth_deg)
        found = length_m * math.sin(azimuth), length_m * math.cos(azimuth)
        return math.dist(place, found) if abs(point_deg[0]) <= 90.0 else math.inf

    worst = max(_outline(area), key=off_m)
    if not (error_m := off_m(worst)) <= PLANE_RIGHT_M:
        told = f"{error_m:.3g} m" if math.isfinite(error_m) else "kilometres"
        raise KeyFault(
            ("area", "origin"),
            f"the plane about it is off by {told} at {[round(each) for each in worst]} of "
            f"area.bounds_m; it must be right to {PLANE_RIGHT_M:g} m: lay the origin nearer to its middle, or take a "
            "smaller area",
        )


def _outline(area: Area) -> Iterator[Point]:
    """Points all round the area."""
    xmin, ymin, xmax, ymax = area.bounds_m
    for step in range(SIDE_POINTS + 1):
        share = step / SIDE_POINTS
        east, north = xmin + share * (xmax - xmin), ymin + share * (ymax - ymin)
        yield from ((east, ymin), (east, ymax), (xmin, north), (xmax, north))


def check_start_and_goal(
    area: Area,
    obstacles: Sequence[Obstacle],
    mission: MissionSpec,
    clearance_m: float,
    names: Sequence[str],
) -> None:
    """Start and goal lie in the area and, as far as it can be told, clear of obstacles.

    The start must be clear of what is there at time 0, the goal of what is there for ever; a moving or timed
    obstacle may lie on the goal.

    Args:
        area: the area.
        obstacles: all of them.
        mission: start and goal.
        clearance_m: wanted distance from obstacle edges.
        names: what messages call each obstacle.

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
            if _is_far(obstacles[index], point, clearance_m):
                continue
            distance_m = distance_to(obstacles[index], point)
            if distance_m < clearance_m:
                where = f"{distance_m:.6g} m from" if distance_m > 0 else "inside"
                raise KeyFault(
                    ("mission", name),
                    f"lies {where} {names[index]}; must be {clearance_m:g} m (planner.clearance_m) away",
                )


COURSE_STEP_DEG: Final = 5
"""Arcs and courses are looked at in steps of this."""


def check_start_leads_in(area: Area, mission: MissionSpec, turn_radius_m: float) -> None:
    """The flight does not begin by leaving the area: straight on, or a turn to one side, keeps within it.

    Args:
        area: the area.
        mission: start and course.
        turn_radius_m: the tightest turn over the ground.

    Raises:
        KeyFault: it begins so; the sentence has the courses that would do.
    """
    if _stays_inside(area, mission.start_m, mission.course_deg, turn_radius_m):
        return
    courses = range(0, 360, COURSE_STEP_DEG)
    good = [each for each in courses if _stays_inside(area, mission.start_m, float(each), turn_radius_m)]
    told = f"such as {_ranges(good)}" if good else "and no course would do: start farther from the border"
    raise KeyFault(
        ("mission", "course_deg"),
        f"is {mission.course_deg:.0f}, which leads out of area.bounds_m at once: no turn of {turn_radius_m:.0f} m from "
        f"start_m {list(mission.start_m)} stays inside; must be another, {told}",
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


def _ranges(courses: Sequence[int]) -> str:
    """Courses in steps as ranges, over north too."""
    parts: list[list[int]] = []
    for course in courses:
        if parts and course - parts[-1][-1] == COURSE_STEP_DEG:
            parts[-1].append(course)
        else:
            parts.append([course])
    if len(parts) > 1 and parts[0][0] == 0 and parts[-1][-1] == 360 - COURSE_STEP_DEG:
        parts[0] = parts.pop() + parts[0]
    return " or ".join(
        f"{part[0]} to {part[-1]} deg" if len(part) > 1 else f"{part[0]} deg" for part in parts
    )


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
