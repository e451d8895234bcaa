"""Files of maps and GPS tools: GeoJSON, KML, GPX."""

from __future__ import annotations

import json
import math
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from harness.run_files.exports.exported_path import ExportedPath

LINE_COLOURS: Final = {"flown": "ff40b3ff", "planned": "ffffc440"}
"""Colours of the recordings, as KML writes them: alpha, blue, green, red."""
DIGITS: Final = 9
"""Decimal places of degrees: a tenth of a millimetre."""
GPX: Final = "http://www.topografix.com/GPX/1/1"
KML: Final = "http://www.opengis.net/kml/2.2"
GX: Final = "http://www.google.com/kml/ext/2.2"


def places(path: ExportedPath) -> list[tuple[float, float, float]]:
    """Latitude, longitude, altitude of every point, rounded for a file."""
    columns = (path.latitude_deg.round(DIGITS), path.longitude_deg.round(DIGITS), path.altitude_m.round(3))
    return list(zip(*(column.tolist() for column in columns), strict=True))


def dates(path: ExportedPath) -> list[str]:
    """Date and time of every point, ISO 8601 in UTC, to a millisecond."""
    return [
        path.date(time).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        for time in path.time_s.tolist()
    ]


def geojson_text(path: ExportedPath) -> str:
    """A LineString after RFC 7946, its altitudes above mean sea level.

    Across the antimeridian it goes on beyond 180 degrees, so that no line leads round the earth.

    Figures of single points are lists in `coordinateProperties`, `times` among them, as Mapbox's togeojson has it.
    """
    figures: dict[str, list[Any]] = {
        "times": dates(path),
        "time_s": [round(time, 3) for time in path.time_s.tolist()],
        **{name: [_number(value) for value in column.tolist()] for name, column in path.attributes.items()},
    }
    latitude, longitude, up = zip(*places(path), strict=True)
    longitude = tuple(np.unwrap(longitude, period=360.0).round(DIGITS).tolist())
    feature = {
        "type": "Feature",
        "properties": {
            "name": path.name,
            "what": path.what,
            "airspeed_mps": path.airspeed_mps,
            "coordinateProperties": figures,
        },
        "geometry": {
            "type": "LineString",
            "coordinates": list(zip(longitude, latitude, up, strict=True)),
        },
    }
    return json.dumps({"type": "FeatureCollection", "features": [feature]}) + "\n"


def _number(value: float) -> float | None:
    """A number as JSON has it: what is not finite is null."""
    return round(value, 4) if math.isfinite(value) else None


def kml_text(path: ExportedPath) -> str:
    """A document of KML 2.2, https://www.ogc.org/standard/kml: what was planned as a line, what was flown as a track.

    A track (gx:Track of Google's extension) has a date for every point.
    """
    root = ElementTree.Element("kml", {"xmlns": KML, "xmlns:gx": GX})
    document = _added(root, "Document")
    _added(document, "name", path.name)
    placemark = _added(document, "Placemark")
    _added(placemark, "name", f"{path.name}, {path.what}")
    when = dates(path)
    span = _added(placemark, "TimeSpan")
    _added(span, "begin", when[0])
    _added(span, "end", when[-1])
    style = _added(_added(placemark, "Style"), "LineStyle")
    _added(style, "color", LINE_COLOURS[path.what])
    _added(style, "width", "3")
    data = _added(placemark, "ExtendedData")
    figures = {
        "airspeed_mps": f"{path.airspeed_mps:g}",
        "altitude_m": f"{path.held_altitude_m:g}",
        "flight_time_s": f"{path.time_s[-1] - path.time_s[0]:.1f}",
    }
    for name, value in figures.items():
        _added(_added(data, "Data", name=name), "value", value)
    numbers = [f"{longitude},{latitude},{up}" for latitude, longitude, up in places(path)]
    if path.what == "planned":
        line = _added(placemark, "LineString")
        _added(line, "altitudeMode", "absolute")
        _added(line, "coordinates", " ".join(numbers))
    else:
        line = _added(placemark, "gx:Track")
        _added(line, "altitudeMode", "absolute")
        for date in when:
            _added(line, "when", date)
        for each in numbers:
            _added(line, "gx:coord", each.replace(",", " "))
    return _text(root)


def gpx_text(path: ExportedPath) -> str:
    """A track of GPX 1.1, https://www.topografix.com/gpx.asp: elevation above mean sea level, date and time."""
    root = ElementTree.Element("gpx", xmlns=GPX, version="1.1", creator="wayproof")
    track = _added(root, "trk")
    _added(track, "name", f"{path.name}, {path.what}")
    segment = _added(track, "trkseg")
    for (latitude, longitude, up), date in zip(places(path), dates(path), strict=True):
        point = _added(segment, "trkpt", lat=f"{latitude:.{DIGITS}f}", lon=f"{longitude:.{DIGITS}f}")
        _added(point, "ele", str(up))
        _added(point, "time", date)
    return _text(root)


def _added(parent: ElementTree.Element, tag: str, text: str = "", **attributes: str) -> ElementTree.Element:
    """A new element in another."""
    child = ElementTree.SubElement(parent, tag, attributes)
    child.text = text or None
    return child


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
