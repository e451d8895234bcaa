"""Files of maps: GeoJSON and KML."""

from __future__ import annotations

import json
from typing import Final
from xml.etree import ElementTree

import numpy as np

from harness.run_files.exports.exported_path import DIGITS, ExportedPath
from harness.scenario.scenario import Scenario

LINE_COLOURS: Final = {"flown": "ff40b3ff", "planned": "ffffc440"}
"""Colours of the recordings, as KML writes them: alpha, blue, green, red."""
KML: Final = "http://www.opengis.net/kml/2.2"
GX: Final = "http://www.google.com/kml/ext/2.2"


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
