"""Missions: plans of QGroundControl and the plain-text missions of MAVLink ground stations.

Commands and frames are those of MAVLink's common dialect, https://mavlink.io/en/messages/common.html; the plan's form
is that of QGroundControl's developer guide (Plan file format).
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from aircraft.frames import LocalPlane
from harness.run_files.exports.exported_path import ExportedPath, geodetic
from harness.scenario.obstacles import Polygon
from harness.scenario.scenario import Scenario

NAV_WAYPOINT: Final = 16
NAV_LAND: Final = 21
NAV_TAKEOFF: Final = 22
NAV_LOITER_TO_ALT: Final = 31
DO_LAND_START: Final = 189

ABOVE_SEA: Final = 0
"""MAV_FRAME_GLOBAL: latitude and longitude, altitude above mean sea level."""
NO_PLACE: Final = 2
"""MAV_FRAME_MISSION: the item has no place."""

ABSOLUTE: Final = 2
"""QGroundControl's AltitudeMode above mean sea level."""

PX4, FIXED_WING = 12, 1
DIGITS: Final = 9
"""Decimal places of degrees: a tenth of a millimetre."""

SLIVER_M2: Final = 1e-6
"""What is left of a polygon beside a cut and is smaller than this is rounding."""

CLIMB_SLOPE: Final = math.tan(math.radians(8.0))
"""Slope of the climb after takeoff; small fixed-wing aircraft climb at 8 to 15 degrees."""
GLIDE_SLOPE: Final = math.tan(math.radians(5.0))
"""Slope of the landing approach, QGroundControl's default of its fixed-wing landing pattern rounded down."""
APPROACH_HEIGHT_M: Final = 40.0
"""Height above the ground at which the landing approach begins, QGroundControl's default for fixed-wing aircraft."""
LEAST_LOITER_RADIUS_M: Final = 75.0
"""Radius of the descending turn where no plan of the run turned; QGroundControl's default."""


@dataclass(frozen=True)
class MissionItem:
    """One item: command, frame, four parameters (None: left to the autopilot), latitude, longitude, altitude."""

    command: int
    frame: int
    params: tuple[float | None, float | None, float | None, float | None]
    latitude_deg: float
    longitude_deg: float
    altitude_m: float


def mission_items(path: ExportedPath, plane: LocalPlane, ground_m: float | None) -> list[MissionItem]:
    """The items that fly a path.

    Args:
        path: what is to be flown, at its held altitude.
        plane: the local plane.
        ground_m: altitude of the ground at both ends; None: no takeoff and no landing.

    Returns:
        The path's points as waypoints; with a ground, a takeoff before them, and after them a descending turn at the
        last point and a straight landing on along the last leg.
    """
    held = path.held_altitude_m
    ways = [
        MissionItem(
            NAV_WAYPOINT, ABOVE_SEA, (0, 0, 0, None), round(latitude, DIGITS), round(longitude, DIGITS), held
        )
        for latitude, longitude in zip(path.latitude_deg.tolist(), path.longitude_deg.tolist(), strict=True)
    ]
    if ground_m is None:
        return ways
    radius = path.turn_radius_m if math.isfinite(path.turn_radius_m) else LEAST_LOITER_RADIUS_M
    approach_m = ground_m + min(APPROACH_HEIGHT_M, held - ground_m)
    first, last = ways[0], ways[-1]
    landing = _beyond(path, plane, (approach_m - ground_m) / GLIDE_SLOPE)
    return [
        MissionItem(NAV_TAKEOFF, ABOVE_SEA, (0, 0, 0, None), first.latitude_deg, first.longitude_deg, held),
        *ways,
        MissionItem(DO_LAND_START, NO_PLACE, (0, 0, 0, 0), 0, 0, 0),
        MissionItem(
            NAV_LOITER_TO_ALT,
            ABOVE_SEA,
            (1, round(radius, 1), 0, 1),
            last.latitude_deg,
            last.longitude_deg,
            approach_m,
        ),
        MissionItem(NAV_LAND, ABOVE_SEA, (0, 0, 0, None), *landing, ground_m),
    ]


def _beyond(path: ExportedPath, plane: LocalPlane, distance_m: float) -> tuple[float, float]:
    """Latitude and longitude of a point beyond the end of a path, on along its last leg."""
    (east, north), (before_east, before_north) = path.points_m[-1].tolist(), path.points_m[-2].tolist()
    leg_m = math.hypot(east - before_east, north - before_north)
    share = distance_m / leg_m
    latitude, longitude = plane.geodetic(
        east + share * (east - before_east), north + share * (north - before_north)
    )
    return round(latitude, DIGITS), round(longitude, DIGITS)


def home_of(path: ExportedPath, plane: LocalPlane, ground_m: float | None) -> tuple[float, float, float]:
    """Latitude, longitude and altitude of home: the path's start, or with a ground the foot of a climb to it."""
    if ground_m is None:
        return round(float(path.latitude_deg[0]), DIGITS), round(float(path.longitude_deg[0]), DIGITS), 0.0
    (east, north), (next_east, next_north) = path.points_m[0].tolist(), path.points_m[1].tolist()
    share = (path.held_altitude_m - ground_m) / CLIMB_SLOPE / math.hypot(next_east - east, next_north - north)
    latitude, longitude = plane.geodetic(
        east - share * (next_east - east), north - share * (next_north - north)
    )
    return round(latitude, DIGITS), round(longitude, DIGITS), ground_m


def plan_text(path: ExportedPath, scenario: Scenario, plane: LocalPlane, ground_m: float | None) -> str:
    """A plan of QGroundControl: mission, area and standing obstacles as fences."""
    items = [
        _plan_item(item, number) for number, item in enumerate(mission_items(path, plane, ground_m), start=1)
    ]
    plan = {
        "fileType": "Plan",
        "geoFence": fences(scenario, plane),
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": path.airspeed_mps,
            "firmwareType": PX4,
            "globalPlanAltitudeMode": ABSOLUTE,
            "hoverSpeed": 5,
            "items": items,
            "plannedHomePosition": list(home_of(path, plane, ground_m)),
            "vehicleType": FIXED_WING,
            "version": 2,
        },
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
    return json.dumps(plan, indent=1) + "\n"


def _plan_item(item: MissionItem, number: int) -> dict[str, Any]:
    return {
        "AMSLAltAboveTerrain": None,
        "Altitude": item.altitude_m,
        "AltitudeMode": ABSOLUTE,
        "autoContinue": True,
        "command": item.command,
        "doJumpId": number,
        "frame": item.frame,
        "params": [*item.params, item.latitude_deg, item.longitude_deg, item.altitude_m],
        "type": "SimpleItem",
    }


def fences(scenario: Scenario, plane: LocalPlane) -> dict[str, Any]:
    """A plan's geoFence: the area to stay in, and what stands in it for ever to stay out of.

    A fence of QGroundControl has no holes: a polygon with holes is several fences.
    """
    xmin, ymin, xmax, ymax = scenario.area.bounds_m
    corners = [(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax)]
    polygons: list[dict[str, Any]] = [{"inclusion": True, "polygon": _ring(corners, plane), "version": 1}]
    circles: list[dict[str, Any]] = []
    for obstacle in scenario.obstacles:
        if obstacle.fixed and obstacle.circle is not None:
            (centre,) = _ring([obstacle.circle.center_m], plane)
            circle = {"center": centre, "radius": obstacle.circle.radius_m}
            circles.append({"circle": circle, "inclusion": False, "version": 1})
        if obstacle.fixed and obstacle.polygon is not None:
            polygons += [
                {"inclusion": False, "polygon": _ring(part, plane), "version": 1}
                for part in _without_holes(obstacle.polygon)
            ]
    return {"circles": circles, "polygons": polygons, "version": 2}


def _without_holes(polygon: Polygon) -> list[Sequence[Sequence[float]]]:
    """Rings, not closed, that together are a polygon without its holes: it is cut north to south through each."""
    if not polygon.holes_m:
        return [polygon.vertices_m]
    import shapely

    whole = [shapely.Polygon(polygon.vertices_m, polygon.holes_m)]
    rings: list[Sequence[Sequence[float]]] = []
    while whole:
        shape = whole.pop()
        if not shape.interiors:
            rings.append(list(shape.exterior.coords)[:-1])
            continue
        xmin, ymin, xmax, ymax = shape.bounds
        middles = sorted(0.5 * (hole.bounds[0] + hole.bounds[2]) for hole in shape.interiors)
        cut = middles[len(middles) // 2]
        for side in (shapely.box(xmin, ymin, cut, ymax), shapely.box(cut, ymin, xmax, ymax)):
            parts = shapely.get_parts(shapely.intersection(shape, side))
            whole += [part for part in parts if part.area > SLIVER_M2]
    return rings


def _ring(points_m: Sequence[Sequence[float]], plane: LocalPlane) -> list[list[float]]:
    """[latitude, longitude] of points of the plane."""
    return [
        [round(value, DIGITS) for value in place] for place in geodetic(plane, np.array(points_m)).tolist()
    ]


def waypoints_text(path: ExportedPath, plane: LocalPlane, ground_m: float | None) -> str:
    """The mission plain-text file, https://mavlink.io/en/file_formats; item 0 is home."""
    home = MissionItem(NAV_WAYPOINT, ABOVE_SEA, (0, 0, 0, 0), *home_of(path, plane, ground_m))
    lines = [
        "\t".join(
            map(
                str,
                (
                    *(number, int(number == 0), item.frame, item.command),
                    *(0 if value is None else value for value in item.params),
                    *(item.latitude_deg, item.longitude_deg, item.altitude_m, 1),
                ),
            )
        )
        for number, item in enumerate([home, *mission_items(path, plane, ground_m)])
    ]
    return "\n".join(("QGC WPL 110", *lines)) + "\n"
