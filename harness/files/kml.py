"""Shapes of KML files (OGC 12-007r2), plain or packed as KMZ; elements are known by their names, in any namespace."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import Final, NamedTuple
from xml.etree import ElementTree

from harness.files.input_file import InputError, finite, shown
from harness.files.zip_archive import unpacked

COUNTED_ELEMENTS: Final = frozenset(  # elements that are counted in a note, since they are not read
    ["Point", "Model", "NetworkLink", "GroundOverlay", "ScreenOverlay", "PhotoOverlay", "LinearRing"]
)
REFUSED_ELEMENTS: Final = ("altitudeOffset", "Track", "MultiTrack")  # Google's elements, which are refused
COMMA: Final = re.compile(r"\s*,\s*")  # comma between coordinates; blanks about it are dropped

Element = ElementTree.Element
Point = tuple[float, float, float | None]  # latitude, longitude, altitude


class Shape(NamedTuple):
    """A line or a polygon of KML, with the name, or number, and the ExtendedData of its Placemark."""

    name: str
    mode: str  # its altitudeMode, or empty
    rings: tuple[tuple[Point, ...], ...]  # points of the line, or of the outer and the inner boundaries
    data: Mapping[str, str]


class Kml(NamedTuple):
    """Lines and polygons of a KML file, counts of its other elements, and its name for faults."""

    source: str
    lines: list[Shape]
    polygons: list[Shape]
    others: Counter[str]


def read_kml(data: bytes, source: str, most: int) -> Kml:
    """Reads a KML file, or an archive with one of at most `most` bytes; `source` begins an InputError if not empty."""
    if data.startswith(b"PK"):
        try:
            name, data = unpacked(data, ".kml", most)
        except InputError as error:
            raise InputError(f"{source}: {error}" if source else str(error)) from error
        source = f"{source} ({name})" if source else ""
    root = parsed_xml(data, source, "kml")
    marks = list(enumerate(named(root, "Placemark"), start=1))
    lines = [shape for mark in marks for shape in _shapes(*mark, source, "LineString")]
    polygons = [shape for mark in marks for shape in _shapes(*mark, source, "Polygon")]
    others = Counter(kind for each in root.iter() if (kind := name_of(each)) in COUNTED_ELEMENTS)
    others["LinearRing"] -= sum(len(each.rings) for each in polygons)
    return Kml(source, lines, polygons, others)


def _shapes(number: int, placemark: Element, source: str, kind: str) -> list[Shape]:
    """Returns the lines or polygons of a Placemark, with the names and values of its ExtendedData."""
    name = shown(text_of(placemark, "name") or f"Placemark {number}")
    where = f"{source}: {name}" if source else name
    values = {item.get("name", ""): text_of(item, "value") for item in named(placemark, "Data")}
    values |= {item.get("name", ""): (item.text or "").strip() for item in named(placemark, "SimpleData")}
    found = []
    for each in named(placemark, kind):
        bounds = named(each, "outerBoundaryIs") + named(each, "innerBoundaryIs")
        if kind == "Polygon" and not bounds:
            raise InputError(f"{where}: is a Polygon without a boundary; must have outerBoundaryIs")
        rings = tuple(_points(ring, where, "corner" if bounds else "point") for ring in bounds or [each])
        found.append(Shape(name, text_of(each, "altitudeMode"), rings, values))
    return found


def parsed_xml(data: bytes, source: str, root: str) -> Element:
    """Returns the root of an XML text, named `root` and without entities; `source` begins an InputError."""
    where = f"{source}: " if source else ""
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:  # a few lines of entities unpack to gigabytes
        raise InputError(f"{where}declares a document type or XML entities; remove the declaration")
    try:
        found = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        at = f"{source}:{error.position[0]}" if source else f"line {error.position[0]}"
        raise InputError(f"{at}: is not whole XML ({error}); it may be torn") from error
    except (ValueError, LookupError, RecursionError) as error:
        raise InputError(f"{where}is not XML ({error})") from error
    if name_of(found).lower() != root:
        raise InputError(f"{where}is {shown(name_of(found))}; must be {root.upper()}")
    for each in found.iter():
        if name_of(each) in REFUSED_ELEMENTS:
            raise InputError(f"{where}has gx:{name_of(each)}, which is not read; save it as plain lines and shapes")
    return found


def name_of(element: Element) -> str:
    """Returns the name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def named(element: Element, name: str) -> list[Element]:
    """Returns all elements of a name within an element, whatever their namespace."""
    return element.findall(f".//{{*}}{name}")


def text_of(element: Element, name: str) -> str:
    """Returns the text of the first element of a name; empty where there is none."""
    return element.findtext(f".//{{*}}{name}", "").strip()


def _points(element: Element, where: str, what: str) -> tuple[Point, ...]:
    """Returns the points of a line or a ring; blanks round a comma do not part positions."""
    points: list[Point] = []
    for number, text in enumerate(COMMA.sub(",", text_of(element, "coordinates")).split()):
        at, cells = f"{where}: {what} {number}", text.split(",")
        if len(cells) not in (2, 3):
            raise InputError(f"{at}: is {shown(text)!r}; must be longitude,latitude[,altitude]")
        longitude, latitude, *altitude = (finite(each, at, text=True) for each in cells)
        points.append((latitude, longitude, altitude[0] if altitude else None))
    return tuple(points)
