"""Paths in files of maps and GPS tools: KML (OGC 12-007r2) and GPX 1.1.

Tags are told by their names, whatever the namespace: files of both kinds carry several.
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
from harness.run_files.path_as_read import PathAsRead
from harness.run_files.read_values import finite, shown

MAX_ELEMENTS: Final = 4_000_000
DECLARED: Final = ("<!DOCTYPE", "<!ENTITY")
"""A file that declares entities is refused: none of these formats needs them."""

BOUNDARIES: Final = ("outerBoundaryIs", "innerBoundaryIs")
LINKED: Final = ("NetworkLink", "GroundOverlay", "ScreenOverlay", "PhotoOverlay")
COMMA: Final = re.compile(r"\s*,\s*")
ABSOLUTE, RELATIVE, CLAMPED = "absolute", "relativeToGround", "clampToGround"
"""Values of KML's altitudeMode; with any other the altitude means nothing. The last is the default."""

Point = tuple[float, float, float | None]
"""Latitude, longitude, altitude."""


def read_kml(text: str, source: str) -> PathAsRead:
    """The path of a KML file: its one LineString, gx:Track or gx:MultiTrack; polygons are fences, points passed over.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none, or holds no line or several.
    """
    root = _parsed(text, source, "kml")
    lines, fences, others = [], [], Counter[str]()
    for number, placemark in enumerate(_all(root, "Placemark"), start=1):
        name = shown(_text(placemark, "name") or f"Placemark {number}")
        for element in placemark.iter():
            kind = _name(element)
            if kind in ("LineString", "Track", "MultiTrack"):
                lines.append((name, element))
            elif kind == "Polygon":
                fences.append(_polygon(element, name, source))
            elif kind in ("Point", "Model", "LinearRing"):
                others[kind] += 1
            elif kind in BOUNDARIES:  # which hold the ring of a polygon
                others["LinearRing"] -= sum(1 for _ in _all(element, "LinearRing"))
    others.update(kind for element in root.iter() if (kind := _name(element)) in LINKED)
    joined = {id(track) for _, each in lines if _name(each) == "MultiTrack" for track in _all(each, "Track")}
    lines = [(name, each) for name, each in lines if id(each) not in joined]
    if len(lines) != 1:
        told = f" ({', '.join(name for name, _ in lines[:4])})" if lines else ""
        raise InputError(f"{source}: has {len(lines)} lines{told}; must have exactly one, the path")
    (name, line), *_ = lines
    points = _lifted(_kml_points(line, name, source), line, f"{source}: {name}")
    mode = _text(line, "altitudeMode")
    flat = mode not in (ABSOLUTE, RELATIVE)
    notes = [f"{counted(count, kind)} beside the path passed over" for kind, count in (+others).items()]
    if len(joined) > 1:
        notes.append(_joined(len(joined)))
    if flat and any(altitude for *_, altitude in points):
        notes.append(f"altitudes passed over: their altitudeMode is {shown(mode or CLAMPED)}")
    return _path(points, source, name, Fences(tuple(fences)), tuple(notes), flat, mode == RELATIVE)


def read_gpx(text: str, source: str) -> PathAsRead:
    """The path of a GPX file: its one track, else its one route; waypoints are passed over.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none, or holds no track and no route, or several.
    """
    root = _parsed(text, source, "gpx")
    tracks, routes = list(_all(root, "trk")), list(_all(root, "rte"))
    lines = tracks or routes
    if len(lines) != 1:
        kind = "track" if tracks else "route"
        raise InputError(f"{source}: has {counted(len(lines), kind)}; must have exactly one, the path")
    tag = "trkpt" if tracks else "rtept"
    points: list[Point] = []
    for number, each in enumerate(_all(lines[0], tag)):
        where = f"{source}: {tag} {number}"
        latitude, longitude = (finite(each.get(key), f"{where}: {key}") for key in ("lat", "lon"))
        height = _text(each, "ele")
        points.append((latitude, longitude, finite(height, f"{where}: ele") if height else None))
    notes = []
    segments = sum(1 for _ in _all(lines[0], "trkseg"))
    if segments > 1:
        notes.append(_joined(segments))
    for found, kind in ((routes if tracks else [], "route"), (list(_all(root, "wpt")), "waypoint")):
        if found:
            notes.append(f"{counted(len(found), kind)} beside the path passed over")
    name = shown(_text(lines[0], "name") or tag)
    return _path(points, source, name, Fences(), tuple(notes), False, False)


def _joined(segments: int) -> str:
    return f"{segments} segments of the track joined by straight lines"


def _path(
    points: list[Point],
    source: str,
    name: str,
    fences: Fences,
    notes: tuple[str, ...],
    flat: bool,
    above_ground: bool,
) -> PathAsRead:
    """A path of points; altitudes that are there at some only are a fault."""
    heights = [altitude for *_, altitude in points if altitude is not None]
    if not flat and heights and len(heights) != len(points):
        raise InputError(
            f"{source}: {name}: has an altitude at {len(heights)} of {len(points)} points; give it at all or none"
        )
    positions = tuple((latitude, longitude) for latitude, longitude, _ in points)
    altitudes = () if flat else tuple(heights)
    return PathAsRead(False, positions, altitudes, above_ground and bool(altitudes), fences, notes)


def _parsed(text: str, source: str, root: str) -> ElementTree.Element:
    if any(word in text for word in DECLARED):
        raise InputError(f"{source}: declares a document type or entities; remove the declaration")
    if text.count("<") > 2 * MAX_ELEMENTS:
        raise InputError(f"{source}: has more than {MAX_ELEMENTS:,} elements; must be a path")
    try:
        found = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"{source}:{error.position[0]}: is not XML ({error})") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: is not XML ({error})") from error
    if _name(found).lower() != root:
        raise InputError(f"{source}: is {shown(_name(found))}; must be {root.upper()}")
    return found


def _name(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _all(element: ElementTree.Element, name: str) -> Iterator[ElementTree.Element]:
    return (each for each in element.iter() if _name(each) == name)


def _text(element: ElementTree.Element, name: str) -> str:
    """The text of the first element of a name; empty where there is none."""
    return next(((each.text or "").strip() for each in _all(element, name)), "")


def _kml_points(line: ElementTree.Element, name: str, source: str) -> list[Point]:
    # Of a track: longitude latitude altitude, one an element.
    track = _name(line) != "LineString"
    rows = [(each.text or "").split() for each in _all(line, "coord")] if track else _coordinates(line)
    return [_point(row, f"{source}: {name}: point {number}") for number, row in enumerate(rows)]


def _lifted(points: list[Point], line: ElementTree.Element, where: str) -> list[Point]:
    """Points as high above theirs as gx:altitudeOffset of their line says."""
    offset = _text(line, "altitudeOffset")
    if not offset:
        return points
    by_m = finite(offset, f"{where}: altitudeOffset")
    return [(north, east, None if height is None else height + by_m) for north, east, height in points]


def _coordinates(element: ElementTree.Element) -> list[list[str]]:
    """Numbers of each position; blanks round a comma do not part positions."""
    return [part.split(",") for part in COMMA.sub(",", _text(element, "coordinates")).split()]


def _point(row: list[str], where: str) -> Point:
    if len(row) not in (2, 3):
        raise InputError(f"{where}: is {shown(','.join(row))!r}; must be longitude,latitude[,altitude]")
    longitude, latitude, *altitude = (finite(each, where) for each in row)
    return latitude, longitude, altitude[0] if altitude else None


def _polygon(element: ElementTree.Element, name: str, source: str) -> Fence:
    rings = []
    for boundary in BOUNDARIES:
        for each in _all(element, boundary):
            rows = _coordinates(each)
            where = f"{source}: {name}: corner"
            rings.append(tuple(_point(row, f"{where} {number}")[:2] for number, row in enumerate(rows)))
    if not rings:
        raise InputError(f"{source}: {name}: is a Polygon without a boundary; must have outerBoundaryIs")
    return Fence(name, False, tuple(rings), stated=False)
