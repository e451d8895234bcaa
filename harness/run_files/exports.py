"""A run in the files of other tools: missions of QGroundControl and of MAVLink ground stations, GeoJSON, KML.

Commands and frames of missions: https://mavlink.io/en/messages/common.html; the plan: QGroundControl's developer guide,
Plan file format. A mission is the path's points as waypoints at the altitude that the run held; takeoff and landing are
left to whoever flies it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from harness.files.errors import RunFolderError
from harness.files.wording import counted
from harness.run_files.exported_path import DIGITS, ExportedPath, geodetic, path_of, scenario_of_run
from harness.run_files.mission.commands import WAYPOINT
from harness.run_files.run_folder import Run
from harness.scenario.obstacles import Polygon
from harness.scenario.scenario import Scenario
from harness.scenario.sections import Origin

MISSIONS: Final = ("plan", "waypoints")
"""Formats that an autopilot flies."""
ABOVE_SEA: Final = 0
"""MAV_FRAME_GLOBAL: latitude and longitude, altitude above mean sea level."""
ABSOLUTE: Final = 2
"""QGroundControl's AltitudeMode above mean sea level."""
PX4, FIXED_WING = 12, 1
LINE_COLOURS: Final = {"flown": "ff40b3ff", "planned": "ffffc440"}
"""Colours of the recordings, as KML writes them: alpha, blue, green, red."""
KML: Final = "http://www.opengis.net/kml/2.2"
GX: Final = "http://www.google.com/kml/ext/2.2"


@dataclass(frozen=True)
class Exported:
    """What an exported file holds, and what its user should know.

    Attributes:
        content: of the file.
        notes: sentences about what the format cannot hold, and what does not hold of the run.
    """

    content: bytes
    notes: tuple[str, ...] = ()


def exported(run: Run, form: str, what: str, tolerance_m: float) -> Exported:
    """A run as a file of another tool.

    Args:
        run: the run.
        form: one of `FORMATS`.
        what: "flown" or "planned".
        tolerance_m: how far a point that is left out may be from the path, seen from above.

    Raises:
        RunFolderError: the run has no such path.
    """
    scenario = scenario_of_run(run)
    path = path_of(run, scenario, what, tolerance_m)
    if len(path.degrees) < 2:
        raise RunFolderError(f"the run in {run.folder} has no {what} path: it is too short")
    return Exported(FORMATS[form](path, scenario).encode(), tuple(_notes(run, scenario, form)))


def _notes(run: Run, scenario: Scenario, form: str) -> list[str]:
    """What is said of a file beside what it holds."""
    origin, outcome = scenario.area.origin, run.metrics["outcome"]
    others = sum(not obstacle.fixed for obstacle in scenario.obstacles)
    notes = []
    if form in MISSIONS and outcome != "reached":
        ended = f"{outcome.replace('_', ' ')}: {run.metrics['reason']}"
        notes.append(f"the run did not reach its goal, and its mission would not either ({ended})")
    if origin == Origin():  # nobody knows any more whether it was given
        place = f"{origin.latitude_deg:g}, {origin.longitude_deg:g}"
        notes.append(f"area.origin is the default: the file lies about {place}")
    if form == "plan" and others:
        notes.append(f"not among the plan's fences: {counted(others, 'obstacle')} that moves or appears")
    return notes


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


def geojson_text(path: ExportedPath, scenario: Scenario) -> str:
    """A LineString after RFC 7946, its altitudes above mean sea level.

    Across the antimeridian it goes on beyond 180 degrees, so that no line leads round the earth. Times of single points
    are lists in `coordinateProperties`, as Mapbox's togeojson has it.
    """
    latitude, longitude = path.degrees.T
    places = np.column_stack((np.unwrap(longitude, period=360.0).round(DIGITS), latitude, path.altitude_m))
    feature = {
        "type": "Feature",
        "properties": {
            "name": path.name,
            "what": path.what,
            "airspeed_mps": scenario.aircraft.airspeed_mps,
            "coordinateProperties": {"times": path.dates, "time_s": path.time_s.round(3).tolist()},
        },
        "geometry": {"type": "LineString", "coordinates": places.tolist()},
    }
    return json.dumps({"type": "FeatureCollection", "features": [feature]}) + "\n"


def kml_text(path: ExportedPath, scenario: Scenario) -> str:
    """A document of KML 2.2, https://www.ogc.org/standard/kml: what was planned as a line, what was flown as a track.

    A track (gx:Track of Google's extension) has a date for every point.
    """
    root = ElementTree.Element("kml", {"xmlns": KML, "xmlns:gx": GX})
    placemark = _added(_added(root, "Document"), "Placemark")
    _added(placemark, "name", f"{path.name}, {path.what}")
    style = _added(_added(placemark, "Style"), "LineStyle")
    _added(style, "color", LINE_COLOURS[path.what])
    _added(style, "width", "3")
    line = _added(placemark, "LineString" if path.what == "planned" else "gx:Track")
    _added(line, "altitudeMode", "absolute")
    rows = [(str(b), str(a), str(up)) for (a, b), up in zip(path.degrees, path.altitude_m, strict=True)]
    if path.what == "planned":
        _added(line, "coordinates", " ".join(map(",".join, rows)))
    else:
        for date in path.dates:
            _added(line, "when", date)
        for row in rows:
            _added(line, "gx:coord", " ".join(row))
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _added(parent: ElementTree.Element, tag: str, text: str | None = None) -> ElementTree.Element:
    """A new element in another."""
    child = ElementTree.SubElement(parent, tag)
    child.text = text
    return child


FORMATS: Final[dict[str, Callable[[ExportedPath, Scenario], str]]] = {
    "plan": plan_text,
    "waypoints": waypoints_text,
    "geojson": geojson_text,
    "kml": kml_text,
}
"""Writers by the name of the format."""
