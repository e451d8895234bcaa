"""Files of maps and GPS tools: GeoJSON, KML, GPX."""

from __future__ import annotations

import json
import math
from typing import Any, Final
from xml.etree import ElementTree

from harness.run_files.exports.antimeridian import pieces
from harness.run_files.exports.exported_path import ExportedPath

LINE_COLOURS: Final = {"flown": "ff40b3ff", "planned": "ffffc440"}
"""Those of the recordings, as KML writes them: alpha, blue, green, red."""
DIGITS: Final = 9
"""Decimal places of degrees: a tenth of a millimetre."""
GPX: Final = "http://www.topografix.com/GPX/1/1"


def places(path: ExportedPath) -> list[tuple[float, float, float]]:
    """Latitude, longitude, altitude of every point, rounded for a file."""
    return [
        (round(latitude, DIGITS), round(longitude, DIGITS), round(altitude, 3))
        for latitude, longitude, altitude in zip(
            path.latitude_deg.tolist(), path.longitude_deg.tolist(), path.altitude_m.tolist(), strict=True
        )
    ]


def dates(path: ExportedPath) -> list[str]:
    """Date and time of every point, ISO 8601 in UTC, to a millisecond."""
    return [
        path.date(time).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        for time in path.time_s.tolist()
    ]


def geojson_text(path: ExportedPath) -> str:
    """A feature after RFC 7946, its altitudes above mean sea level: a LineString, several where it crosses 180 degrees.

    Figures of single points are lists in `coordinateProperties`, `times` among them, as Mapbox's togeojson has it: of
    several LineStrings a list each.
    """
    parts = pieces(path)
    lines = [[[longitude, latitude, up] for latitude, longitude, up in places(part)] for part in parts]
    figures = [_figures(part) for part in parts]
    whole = len(parts) == 1
    feature = {
        "type": "Feature",
        "properties": {
            "name": path.name,
            "what": path.what,
            "airspeed_mps": path.airspeed_mps,
            "coordinateProperties": figures[0]
            if whole
            else {name: [each[name] for each in figures] for name in figures[0]},
        },
        "geometry": {
            "type": "LineString" if whole else "MultiLineString",
            "coordinates": lines[0] if whole else lines,
        },
    }
    return json.dumps({"type": "FeatureCollection", "features": [feature]}) + "\n"


def _figures(path: ExportedPath) -> dict[str, list[Any]]:
    """A list for each figure, a value a point."""
    return {
        "times": dates(path),
        "time_s": [round(time, 3) for time in path.time_s.tolist()],
        **{name: [_number(value) for value in column.tolist()] for name, column in path.attributes.items()},
    }


def _number(value: float) -> float | None:
    """A number as JSON has it: what is not finite is null."""
    return round(value, 4) if math.isfinite(value) else None


def kml_text(path: ExportedPath) -> str:
    """A document of KML 2.2, https://www.ogc.org/standard/kml: what was planned as a line, what was flown as a track.

    A track (gx:Track of Google's extension) has a date for every point and figures of the flight beside it.
    """
    import fastkml
    from fastkml import enums, styles

    line_style = styles.LineStyle(color=LINE_COLOURS[path.what], width=3)
    coordinates = [(longitude, latitude, up) for latitude, longitude, up in places(path)]
    geometry: Any
    if path.what == "planned":
        geometry = fastkml.LineString(
            altitude_mode=enums.AltitudeMode.absolute, kml_coordinates=_kml(coordinates)
        )
    else:
        geometry = _track(path, coordinates)
    placemark = fastkml.Placemark(
        name=f"{path.name}, {path.what}",
        styles=[fastkml.Style(styles=[line_style])],
        times=fastkml.TimeSpan(begin=_instant(path, 0), end=_instant(path, -1)),
        extended_data=fastkml.ExtendedData(
            elements=[
                fastkml.Data(name="airspeed_mps", value=f"{path.airspeed_mps:g}"),
                fastkml.Data(name="altitude_m", value=f"{path.held_altitude_m:g}"),
                fastkml.Data(name="flight_time_s", value=f"{path.time_s[-1] - path.time_s[0]:.1f}"),
            ]
        ),
        kml_geometry=geometry,
    )
    document = fastkml.Document(name=path.name, features=[placemark])
    text = fastkml.KML(features=[document]).to_string(prettyprint=True)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}'


def _kml(coordinates: list[tuple[float, float, float]]) -> Any:
    from fastkml.geometry import Coordinates

    return Coordinates(coords=coordinates)


def _instant(path: ExportedPath, point: int) -> Any:
    from fastkml.enums import DateTimeResolution
    from fastkml.times import KmlDateTime

    return KmlDateTime(path.date(float(path.time_s[point])), resolution=DateTimeResolution.datetime)


def _track(path: ExportedPath, coordinates: list[tuple[float, float, float]]) -> Any:
    from fastkml import enums, gx

    return gx.Track(
        altitude_mode=enums.AltitudeMode.absolute,
        whens=[_instant(path, point) for point in range(len(coordinates))],
        coords=coordinates,
    )


def gpx_text(path: ExportedPath) -> str:
    """A track of GPX 1.1, https://www.topografix.com/gpx.asp: elevation above mean sea level, date and time."""
    ElementTree.register_namespace("", GPX)
    root = ElementTree.Element(f"{{{GPX}}}gpx", version="1.1", creator="wayproof")
    track = ElementTree.SubElement(root, f"{{{GPX}}}trk")
    ElementTree.SubElement(track, f"{{{GPX}}}name").text = f"{path.name}, {path.what}"
    segment = ElementTree.SubElement(track, f"{{{GPX}}}trkseg")
    for (latitude, longitude, up), date in zip(places(path), dates(path), strict=True):
        point = ElementTree.SubElement(
            segment, f"{{{GPX}}}trkpt", lat=f"{latitude:.{DIGITS}f}", lon=f"{longitude:.{DIGITS}f}"
        )
        ElementTree.SubElement(point, f"{{{GPX}}}ele").text = str(up)
        ElementTree.SubElement(point, f"{{{GPX}}}time").text = date
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
