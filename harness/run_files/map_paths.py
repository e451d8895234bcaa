"""Paths in files of maps and GPS tools: KML (OGC 12-007r2) and GPX 1.1.

Read with Python's XML parser: GDAL makes zero of a coordinate that is no number. Tags are told by their names,
whatever the namespace: files of both kinds carry several.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import Final
from xml.etree import ElementTree

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.run_files.fences import Fence, Fences
from harness.run_files.path_as_read import PathAsRead, Point, finite, of_points, shown

LINES: Final = ("LineString", "Track")
PASSED: Final = (
    "Point",
    "Model",
    "NetworkLink",
    "GroundOverlay",
    "ScreenOverlay",
    "PhotoOverlay",
    "LinearRing",
)
GIVEN_UP: Final = ("altitudeOffset", "MultiTrack")
"""Elements of Google's extension that are refused by name."""
BOUNDARIES: Final = ("outerBoundaryIs", "innerBoundaryIs")
COMMA: Final = re.compile(r"\s*,\s*")
ABSOLUTE, RELATIVE, CLAMPED = "absolute", "relativeToGround", "clampToGround"
"""Values of KML's altitudeMode; with any other the altitude means nothing. The last is the default."""

Element = ElementTree.Element


def read_kml(text: str, source: str) -> PathAsRead:
    """The path of a KML file: its one LineString or gx:Track; polygons are fences to stay out of.

    Raises:
        InputError: it is none, or holds no line or several.
    """
    root = _parsed(text, source, "kml")
    for each in root.iter():
        if _name(each) in GIVEN_UP:
            raise InputError(f"{source}: has gx:{_name(each)}, which is not read; save it as plain lines")
    placemarks = [
        (shown(_text(each, "name") or f"Placemark {number}"), each)
        for number, each in enumerate(_all(root, "Placemark"), start=1)
    ]
    lines = [(name, line) for name, each in placemarks for kind in LINES for line in _all(each, kind)]
    fences = [_polygon(area, name, source) for name, each in placemarks for area in _all(each, "Polygon")]
    if len(lines) != 1:
        told = f" ({', '.join(name for name, _ in lines[:4])})" if lines else ""
        raise InputError(f"{source}: has {len(lines)} lines{told}; must have exactly one, the path")
    ((name, line),) = lines
    points, notes = _with_altitudes(_points(line, f"{source}: {name}"), mode := _text(line, "altitudeMode"))
    notes = [*_others(root), *notes]
    return of_points(points, f"{source}: {name}", Fences(tuple(fences)), notes, mode == RELATIVE)


def _with_altitudes(points: list[Point], mode: str) -> tuple[list[Point], list[str]]:
    """Points with the altitudes that their mode gives a meaning, and what is said of others."""
    if mode in (ABSOLUTE, RELATIVE):
        return points, []
    passed = any(altitude for *_, altitude in points)
    notes = [f"altitudes passed over: their altitudeMode is {shown(mode or CLAMPED)}"] if passed else []
    return [(latitude, longitude, None) for latitude, longitude, _ in points], notes


def _others(root: Element) -> list[str]:
    """What is beside the path in a KML file and no polygon."""
    others = Counter(kind for each in root.iter() if (kind := _name(each)) in PASSED)
    rings = (ring for kind in BOUNDARIES for each in _all(root, kind) for ring in _all(each, "LinearRing"))
    others["LinearRing"] -= sum(1 for _ in rings)
    return _notes(others)


def read_gpx(text: str, source: str) -> PathAsRead:
    """The path of a GPX file: its one track, else its one route; waypoints are passed over.

    Raises:
        InputError: it is none, or holds no track and no route, or several.
    """
    root = _parsed(text, source, "gpx")
    tracks, routes = list(_all(root, "trk")), list(_all(root, "rte"))
    lines, kind, tag = (tracks, "track", "trkpt") if tracks else (routes, "route", "rtept")
    if len(lines) != 1:
        raise InputError(f"{source}: has {counted(len(lines), kind)}; must have exactly one, the path")
    points: list[Point] = []
    for number, each in enumerate(_all(lines[0], tag)):
        where = f"{source}: {tag} {number}"
        latitude, longitude = (finite(each.get(key), f"{where}: {key}") for key in ("lat", "lon"))
        height = _text(each, "ele")
        points.append((latitude, longitude, finite(height, f"{where}: ele") if height else None))
    segments = sum(1 for _ in _all(lines[0], "trkseg"))
    notes = [f"{segments} segments of the track joined by straight lines"] if segments > 1 else []
    notes += _notes({"route": len(routes) if tracks else 0, "waypoint": sum(1 for _ in _all(root, "wpt"))})
    return of_points(points, f"{source}: {shown(_text(lines[0], 'name') or tag)}", Fences(), notes)


def _notes(others: dict[str, int]) -> list[str]:
    return [
        f"{counted(count, what)} beside the path passed over" for what, count in others.items() if count > 0
    ]


def _parsed(text: str, source: str, root: str) -> Element:
    if "<!DOCTYPE" in text or "<!ENTITY" in text:  # a few lines of entities unpack to gigabytes
        raise InputError(f"{source}: declares a document type or entities; remove the declaration")
    try:
        found = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"{source}:{error.position[0]}: is not XML ({error})") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: is not XML ({error})") from error
    if _name(found).lower() != root:
        raise InputError(f"{source}: is {shown(_name(found))}; must be {root.upper()}")
    return found


def _name(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _all(element: Element, name: str) -> Iterator[Element]:
    return (each for each in element.iter() if _name(each) == name)


def _text(element: Element, name: str) -> str:
    """The text of the first element of a name; empty where there is none."""
    return next(((each.text or "").strip() for each in _all(element, name)), "")


def _points(element: Element, where: str, what: str = "point") -> list[Point]:
    """Points of a line, one element each in a gx:Track; blanks round a comma do not part positions."""
    if _name(element) == "Track":
        rows = [(each.text or "").split() for each in _all(element, "coord")]
    else:
        rows = [part.split(",") for part in COMMA.sub(",", _text(element, "coordinates")).split()]
    return [_point(row, f"{where}: {what} {number}") for number, row in enumerate(rows)]


def _point(row: list[str], where: str) -> Point:
    if len(row) not in (2, 3):
        raise InputError(f"{where}: is {shown(','.join(row))!r}; must be longitude,latitude[,altitude]")
    longitude, latitude, *altitude = (finite(each, where) for each in row)
    return latitude, longitude, altitude[0] if altitude else None


def _polygon(element: Element, name: str, source: str) -> Fence:
    rings = tuple(
        tuple(point[:2] for point in _points(each, f"{source}: {name}", "corner"))
        for boundary in BOUNDARIES
        for each in _all(element, boundary)
    )
    if not rings:
        raise InputError(f"{source}: {name}: is a Polygon without a boundary; must have outerBoundaryIs")
    return Fence(name, False, rings)
