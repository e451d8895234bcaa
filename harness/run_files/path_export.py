"""Paths as other tools read them: QGroundControl, MAVLink ground stations, maps, Tacview."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from typing import Final

import numpy as np

from aircraft.frames import LocalPlane
from harness.files.errors import RunFolderError
from harness.run_files.mission_items import NAV_WAYPOINT
from harness.run_files.run_folder import Run
from harness.run_files.run_paths import ExportedPath, geodetic, path_of
from harness.scenario.scenario import parse_scenario

ABOVE_SEA: Final = 0
"""MAV_FRAME_GLOBAL: latitude and longitude, altitude above mean sea level."""

ABSOLUTE: Final = 2
"""QGroundControl's AltitudeMode above mean sea level."""

PX4, FIXED_WING = 12, 1
LINE_COLOURS: Final = {"flown": "ff40b3ff", "planned": "ffffc440"}
"""Those of the recordings, as KML writes them: alpha, blue, green, red."""

TOLERANCE_M: Final = 0.25
DIGITS: Final = 9
"""Of degrees: a tenth of a millimetre."""


def exported(run: Run, form: str, what: str, tolerance_m: float = TOLERANCE_M) -> str:
    """The text of a file with a run's path.

    Args:
        run: the run.
        form: a name of `FORMATS`, or "acmi".
        what: "flown" or "planned".
        tolerance_m: how far a point that is left out may be from the path, seen from above; `acmi` has every row of
            the track.

    Raises:
        RunFolderError: the run has no such path.
    """
    if form == "acmi":
        if what != "flown":
            raise RunFolderError("an ACMI file holds what was flown; a plan has no times")
        return _acmi(run)
    path = path_of(run, what, tolerance_m)
    if len(path.latitude_deg) < 2:
        raise RunFolderError(f"the run in {run.folder} has no {what} path: it is too short")
    return FORMATS[form](path)


def _places(path: ExportedPath) -> list[tuple[float, float, float]]:
    """Latitude, longitude, altitude of every point, rounded for a file."""
    return [
        (round(latitude, DIGITS), round(longitude, DIGITS), round(altitude, 3))
        for latitude, longitude, altitude in zip(
            path.latitude_deg.tolist(), path.longitude_deg.tolist(), path.altitude_m.tolist(), strict=True
        )
    ]


def _plan(path: ExportedPath) -> str:
    """A plan of QGroundControl, https://docs.qgroundcontrol.com (Plan file format)."""
    places = _places(path)
    held = path.held_altitude_m
    items = [
        {
            "AMSLAltAboveTerrain": None,
            "Altitude": held,
            "AltitudeMode": ABSOLUTE,
            "autoContinue": True,
            "command": NAV_WAYPOINT,
            "doJumpId": number,
            "frame": ABOVE_SEA,
            "params": [0, 0, 0, None, latitude, longitude, held],
            "type": "SimpleItem",
        }
        for number, (latitude, longitude, _) in enumerate(places, start=1)
    ]
    plan = {
        "fileType": "Plan",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": path.airspeed_mps,
            "firmwareType": PX4,
            "globalPlanAltitudeMode": ABSOLUTE,
            "hoverSpeed": 5,
            "items": items,
            "plannedHomePosition": [*places[0][:2], 0],
            "vehicleType": FIXED_WING,
            "version": 2,
        },
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
    return json.dumps(plan, indent=1) + "\n"


def _waypoints(path: ExportedPath) -> str:
    """The mission plain-text file, https://mavlink.io/en/file_formats; item 0 is home."""
    places = _places(path)
    rows = [(*places[0][:2], 0.0), *((*place[:2], path.held_altitude_m) for place in places)]
    lines = [
        "\t".join(map(str, (number, int(number == 0), ABOVE_SEA, NAV_WAYPOINT, 0, 0, 0, 0, *row, 1)))
        for number, row in enumerate(rows)
    ]
    return "\n".join(("QGC WPL 110", *lines)) + "\n"


def _geojson(path: ExportedPath) -> str:
    """A feature after RFC 7946; the altitude is written above mean sea level."""
    feature = {
        "type": "Feature",
        "properties": {"name": path.name, "what": path.what, "airspeed_mps": path.airspeed_mps},
        "geometry": {
            "type": "LineString",
            "coordinates": [[longitude, latitude, up] for latitude, longitude, up in _places(path)],
        },
    }
    return json.dumps({"type": "FeatureCollection", "features": [feature]}) + "\n"


def _kml(path: ExportedPath) -> str:
    """A line at its altitude, https://www.ogc.org/standard/kml, valid by the schema of KML 2.2."""
    from xml.etree import ElementTree

    root = ElementTree.Element("kml", xmlns="http://www.opengis.net/kml/2.2")
    document = ElementTree.SubElement(root, "Document")
    ElementTree.SubElement(document, "name").text = path.name
    placemark = ElementTree.SubElement(document, "Placemark")
    ElementTree.SubElement(placemark, "name").text = f"{path.name}, {path.what}"
    style = ElementTree.SubElement(ElementTree.SubElement(placemark, "Style"), "LineStyle")
    ElementTree.SubElement(style, "color").text = LINE_COLOURS[path.what]
    ElementTree.SubElement(style, "width").text = "3"
    line = ElementTree.SubElement(placemark, "LineString")
    ElementTree.SubElement(line, "altitudeMode").text = "absolute"
    ElementTree.SubElement(line, "coordinates").text = " ".join(
        f"{longitude},{latitude},{up}" for latitude, longitude, up in _places(path)
    )
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _acmi(run: Run) -> str:
    """A recording for Tacview, https://www.tacview.net/documentation/acmi: every row of the track.

    Angles are degrees; yaw is from true north.
    """
    scenario = parse_scenario(run.scenario_yaml, str(run.folder / "scenario.yaml"))
    origin = scenario.area.origin
    plane = LocalPlane(origin.latitude_deg, origin.longitude_deg)
    track = run.track
    places = geodetic(plane, np.column_stack((track.east_m, track.north_m))).tolist()
    aircraft = re.sub(r"[,\\]", " ", scenario.aircraft.model.rpartition("/")[2])
    lines = [
        "\ufeffFileType=text/acmi/tacview",
        "FileVersion=2.2",
        f"0,ReferenceTime={str(run.manifest['started_utc']).replace('+00:00', 'Z')}",
        f"0,Title={scenario.name}",
        "0,DataSource=wayproof",
        f"1,Name={aircraft},Type=Air+FixedWing",
    ]
    rows = zip(
        track.time_s.tolist(),
        places,
        track.up_m.tolist(),
        track.roll_deg.tolist(),
        track.pitch_deg.tolist(),
        track.heading_deg.tolist(),
        track.airspeed_mps.tolist(),
        track.east_m.tolist(),
        track.north_m.tolist(),
        strict=True,
    )
    for time, (latitude, longitude), up, roll, pitch, heading, airspeed, east, north in rows:
        yaw = (heading + math.degrees(plane.convergence_rad(east, north))) % 360.0
        lines += (
            f"#{time:.3f}",
            f"1,T={longitude:.{DIGITS}f}|{latitude:.{DIGITS}f}|{up:.3f}|{roll:.3f}|{pitch:.3f}|{yaw:.3f},"
            f"TAS={airspeed:.3f}",
        )
    return "\n".join(lines) + "\n"


FORMATS: Final[dict[str, Callable[[ExportedPath], str]]] = {
    "plan": _plan,
    "waypoints": _waypoints,
    "geojson": _geojson,
    "kml": _kml,
}
"""Writer by the name of the format; `exported` knows "acmi" besides."""
