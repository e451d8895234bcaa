"""Writes a run for other tools; a mission has waypoints at the altitude that it held, without takeoff and fences."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Final, NamedTuple
from xml.etree import ElementTree

import numpy as np

from aircraft.frames import LocalPlane
from harness.files.errors import RunFolderError
from harness.files.mavlink.commands import WAYPOINT
from harness.flight.polylines import needed
from harness.flight.record import FloatArray, IntArray
from harness.run_files.run_folder import Run
from harness.scenario.scenario import Scenario, parse_scenario
from harness.scenario.sections import Origin

FORWARD_M: Final = 0.5  # a planned point less ahead of the one before is left out, as where a new plan begins
TOLERANCE_M: Final = 0.25  # a point is left out only if it is nearer to the path that remains, from above
CLIMB_M: Final = 1.0  # a point is left out only if its altitude is nearer than this to the remaining path's
DIGITS: Final = 9  # decimal places of degrees in files: a tenth of a millimetre
MISSIONS: Final = ("plan", "waypoints")  # formats that an autopilot flies
ABOVE_SEA: Final = 0  # MAV_FRAME_GLOBAL: latitude and longitude, altitude above mean sea level
ABSOLUTE: Final = 2  # QGroundControl's AltitudeMode above mean sea level
PX4, FIXED_WING = 12, 1


class ExportedPath(NamedTuple):
    """A path, "flown" or "planned": (n, 2) latitude and longitude (WGS84), (n,) altitudes above mean sea level."""

    what: str
    scenario: Scenario
    degrees: FloatArray
    altitude_m: FloatArray


def export_run(run: Run, form: str, what: str) -> tuple[bytes, list[str]]:
    """Writes a run in one of `FORMATS`, its track or the plans in effect; returns it, with notes for its user."""
    if len((path := _path_of(run, what, held=form in MISSIONS)).degrees) < 2:
        raise RunFolderError(f"the run in {run.folder} has no {what} path: it is too short")
    origin, outcome, notes = path.scenario.area.origin, run.metrics["outcome"], []
    if form in MISSIONS and outcome != "reached":
        ended = f"{outcome.replace('_', ' ')}: {run.metrics['reason']}"
        notes.append(f"the run did not reach its goal, and its mission would not either ({ended})")
    check = run.metrics.get("check") or {}
    done = [(each["name"], each["what"]) for each in check.get("items", ())]
    held = {"fences": check.get("fences"), "changes of airspeed": ("change speed", "flown") in done}
    if lost := [name for name, of in held.items() if of]:
        notes.append(f"the file has no {' and no '.join(lost)}, unlike the path that was checked")
    if origin == Origin():  # nobody knows any more whether it was given
        at = f"{origin.latitude_deg:g}, {origin.longitude_deg:g}"
        notes.append(f"area.origin is {at}, also the default of scenarios without one: the file lies there")
    return FORMATS[form](path).encode(), notes


def _path_of(run: Run, what: str, held: bool) -> ExportedPath:
    """Returns the path of a run with no more points than it needs, at altitudes flown, or those to be `held` there."""
    scenario = parse_scenario(run.scenario_yaml, str(run.folder / "scenario.yaml"), as_flown=True)
    track, profile = run.track, (run.metrics.get("check") or {}).get("profile") or {}
    known = profile.get("arc_length_m", [0.0]), profile.get("altitude_m", [scenario.mission.altitude_m])
    held_m = np.interp(np.nan_to_num(track.arc_length_m), *known)
    points, rows = np.column_stack((track.east_m, track.north_m)), np.arange(len(track))
    if what == "planned":
        points, rows = planned_points(run)
    held_m, altitude_m = held_m[rows], (held_m if what == "planned" else track.up_m)[rows]
    if len(points) > 1:
        along_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
        indices = needed(points, TOLERANCE_M)
        for heights in (held_m, altitude_m):
            indices = np.union1d(indices, needed(np.column_stack((along_m, heights)), CLIMB_M))
        points, held_m, altitude_m = points[indices], held_m[indices], altitude_m[indices]
    plane = LocalPlane(scenario.area.origin.latitude_deg, scenario.area.origin.longitude_deg)
    degrees = np.array([plane.geodetic(*point) for point in points.tolist()]).reshape(-1, 2).round(DIGITS)
    return ExportedPath(what, scenario, degrees, (held_m if held else altitude_m).round(3))


def planned_points(run: Run) -> tuple[FloatArray, IntArray]:
    """Returns (n, 2) places on the plan in effect, and the (n,) rows of the track that they belong to."""
    track = run.track
    points = np.full((len(track), 2), np.nan)
    for plan in run.plans:
        rows = np.flatnonzero(track.plan_index == plan.plan_index)
        chord = np.append(0.0, np.cumsum(np.hypot(*np.diff(plan.path_m, axis=0).T)))
        # The chords are a little shorter than the arcs that arc length is counted along.
        along = chord * (plan.length_m / chord[-1])
        for axis in (0, 1):
            points[rows, axis] = np.interp(track.arc_length_m[rows], along, plan.path_m[:, axis])
    course = np.radians(track.course_deg)
    ahead = np.column_stack((np.sin(course), np.cos(course)))
    indices: list[int] = []
    for row in np.flatnonzero(np.isfinite(points[:, 0])).tolist():
        if not indices or (points[row] - points[indices[-1]]) @ ahead[row] > FORWARD_M:
            indices.append(row)
    return points[indices], np.array(indices, dtype=np.int64)


def _places(path: ExportedPath) -> list[list[float]]:
    """(n, 3) latitude, longitude, altitude."""
    return list(np.column_stack((path.degrees, path.altitude_m)).tolist())


def plan_text(path: ExportedPath) -> str:
    """Returns a plan of QGroundControl, without fences."""
    simple = {"autoContinue": True, "command": WAYPOINT, "frame": ABOVE_SEA, "type": "SimpleItem"}
    items = [
        {**simple, "doJumpId": number, "params": [0, 0, 0, None, *place]}
        for number, place in enumerate(_places(path), start=1)
    ]
    plan = {
        "fileType": "Plan",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": path.scenario.aircraft.airspeed_mps,
            "firmwareType": PX4,
            "globalPlanAltitudeMode": ABSOLUTE,
            "hoverSpeed": 5,
            "items": items,
            "plannedHomePosition": [*path.degrees[0].tolist(), 0.0],
            "vehicleType": FIXED_WING,
            "version": 2,
        },
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
    return json.dumps(plan, indent=1) + "\n"


def waypoints_text(path: ExportedPath) -> str:
    """Returns a mission plain-text file, https://mavlink.io/en/file_formats; item 0 is home, at the path's start."""
    places = _places(path)
    places = [[*places[0][:2], 0.0], *places]
    rows = [(n, int(n == 0), ABOVE_SEA, WAYPOINT, 0, 0, 0, 0, *place, 1) for n, place in enumerate(places)]
    return "\n".join(("QGC WPL 110", *("\t".join(map(str, row)) for row in rows))) + "\n"


def geojson_text(path: ExportedPath) -> str:
    """Returns a LineString after RFC 7946; across the antimeridian it goes on beyond 180 degrees."""
    latitude, longitude = path.degrees.T
    places = np.column_stack((np.unwrap(longitude, period=360.0).round(DIGITS), latitude, path.altitude_m))
    airspeed_mps = path.scenario.aircraft.airspeed_mps
    feature = {
        "type": "Feature",
        "properties": {"name": path.scenario.name, "what": path.what, "airspeed_mps": airspeed_mps},
        "geometry": {"type": "LineString", "coordinates": places.tolist()},
    }
    return json.dumps({"type": "FeatureCollection", "features": [feature]}) + "\n"


def kml_text(path: ExportedPath) -> str:
    """Returns KML 2.2 with one line, its altitudes above mean sea level: https://www.ogc.org/standard/kml."""
    root = ElementTree.Element("kml", {"xmlns": "http://www.opengis.net/kml/2.2"})
    placemark = ElementTree.SubElement(ElementTree.SubElement(root, "Document"), "Placemark")
    ElementTree.SubElement(placemark, "name").text = f"{path.scenario.name}, {path.what}"
    line = ElementTree.SubElement(placemark, "LineString")
    ElementTree.SubElement(line, "altitudeMode").text = "absolute"
    ElementTree.SubElement(line, "coordinates").text = " ".join(f"{b},{a},{up}" for a, b, up in _places(path))
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


FORMATS: Final[dict[str, Callable[[ExportedPath], str]]] = {  # writers by the name of the format
    "plan": plan_text,
    "waypoints": waypoints_text,
    "geojson": geojson_text,
    "kml": kml_text,
}
