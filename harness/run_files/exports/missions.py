"""Missions: plans of QGroundControl and the plain-text missions of MAVLink ground stations.

Commands and frames: https://mavlink.io/en/messages/common.html; the plan: QGroundControl's developer guide, Plan file
format. A mission is the path's points as waypoints at the altitude that the run held; takeoff and landing are left to
whoever flies it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from harness.run_files.exports.exported_path import ExportedPath, geodetic
from harness.run_files.mission.commands import WAYPOINT
from harness.scenario.obstacles import Polygon
from harness.scenario.scenario import Scenario

ABOVE_SEA: Final = 0
"""MAV_FRAME_GLOBAL: latitude and longitude, altitude above mean sea level."""
ABSOLUTE: Final = 2
"""QGroundControl's AltitudeMode above mean sea level."""
PX4, FIXED_WING = 12, 1


def plan_text(path: ExportedPath, scenario: Scenario) -> str:
    """A plan of QGroundControl: mission, area and standing obstacles as fences."""
    held = scenario.mission.altitude_m
    items = [
        {
            "AMSLAltAboveTerrain": None,
            "Altitude": held,
            "AltitudeMode": ABSOLUTE,
            "autoContinue": True,
            "command": WAYPOINT,
            "doJumpId": number,
            "frame": ABOVE_SEA,
            "params": [0, 0, 0, None, *place, held],
            "type": "SimpleItem",
        }
        for number, place in enumerate(path.degrees.tolist(), start=1)
    ]
    mission = {
        "cruiseSpeed": scenario.aircraft.airspeed_mps,
        "firmwareType": PX4,
        "globalPlanAltitudeMode": ABSOLUTE,
        "hoverSpeed": 5,
        "items": items,
        "plannedHomePosition": [*path.degrees[0].tolist(), 0.0],
        "vehicleType": FIXED_WING,
        "version": 2,
    }
    plan = {
        "fileType": "Plan",
        "geoFence": fences(scenario),
        "groundStation": "QGroundControl",
        "mission": mission,
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
    return json.dumps(plan, indent=1) + "\n"


def waypoints_text(path: ExportedPath, scenario: Scenario) -> str:
    """The mission plain-text file, https://mavlink.io/en/file_formats; item 0 is home, at the path's start."""
    degrees, held = path.degrees.tolist(), scenario.mission.altitude_m
    places = [(*degrees[0], 0.0), *((*place, held) for place in degrees)]
    rows = [
        (number, int(number == 0), ABOVE_SEA, WAYPOINT, 0, 0, 0, 0, *place, 1)
        for number, place in enumerate(places)
    ]
    return "\n".join(("QGC WPL 110", *("\t".join(map(str, row)) for row in rows))) + "\n"


def fences(scenario: Scenario) -> dict[str, Any]:
    """A plan's geoFence: the area to stay in, and what stands in it for ever to stay out of.

    A fence of QGroundControl has no holes: a polygon with holes is several triangles.
    """
    xmin, ymin, xmax, ymax = scenario.area.bounds_m
    area = [(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax)]
    rings: list[tuple[bool, Sequence[Sequence[float]]]] = [(True, area)]
    circles = []
    for obstacle in scenario.obstacles:
        if obstacle.fixed and obstacle.circle is not None:
            (center,) = geodetic(scenario, np.array([obstacle.circle.center_m])).tolist()
            circle = {"center": center, "radius": obstacle.circle.radius_m}
            circles.append({"circle": circle, "inclusion": False, "version": 1})
        if obstacle.fixed and obstacle.polygon is not None:
            rings += [(False, ring) for ring in _without_holes(obstacle.polygon)]
    polygons = [
        {"inclusion": inclusion, "polygon": geodetic(scenario, np.array(ring)).tolist(), "version": 1}
        for inclusion, ring in rings
    ]
    return {"circles": circles, "polygons": polygons, "version": 2}


def _without_holes(polygon: Polygon) -> list[Sequence[Sequence[float]]]:
    """Rings, not closed, that together are a polygon without its holes."""
    if not polygon.holes_m:
        return [polygon.vertices_m]
    import shapely

    triangles = shapely.constrained_delaunay_triangles(shapely.Polygon(polygon.vertices_m, polygon.holes_m))
    return [shapely.get_coordinates(each)[:-1].tolist() for each in shapely.get_parts(triangles)]
