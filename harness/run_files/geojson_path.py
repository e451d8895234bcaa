"""Paths in GeoJSON files (RFC 7946): one LineString, and polygons as areas to stay out of or inside of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.run_files.fences import Fence, Fences
from harness.run_files.path_as_read import PathAsRead, Point, finite, of_points, parsed_json, shown

PARTS: Final = {"MultiLineString": "LineString", "MultiPolygon": "Polygon", "MultiPoint": "Point"}
"""What a geometry of several parts is made of."""
COLLECTIONS: Final = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
FENCE: Final = "fence"
"""A feature's property that says what its polygons are; one of `MEANINGS`."""
MEANINGS: Final = ("exclusion", "inclusion", "none")
"""A polygon is to be stayed out of (the default), to be stayed inside of, or means nothing for the path."""


class Shape(NamedTuple):
    """A geometry of one part: where it stands, and what its feature says that it is."""

    key: str
    kind: str
    coordinates: Any
    meaning: str | None


def read_geojson(text: str, source: str) -> PathAsRead:
    """The path of a GeoJSON file.

    Raises:
        InputError: it is none, or holds no LineString or several.
    """
    shapes = list(_shapes(parsed_json(text, source), source, "", None))
    lines = [shape for shape in shapes if shape.kind == "LineString"]
    if len(lines) != 1:
        raise InputError(f"{source}: has {len(lines)} LineStrings; must have exactly one, the path")
    fenced = [shape for shape in shapes if shape.kind == "Polygon" and shape.meaning != "none"]
    fences = Fences(tuple(_fence(shape, source) for shape in fenced))
    others = Counter(shape.kind for shape in shapes if shape not in (lines[0], *fenced))
    notes = [f"{counted(count, kind)} beside the path passed over" for kind, count in others.items()]
    key, coordinates = lines[0].key, lines[0].coordinates
    return of_points(_places(coordinates, source, key), f"{source}: {key}", fences, notes)


def _shapes(node: Any, source: str, key: str, meaning: str | None) -> Iterator[Shape]:
    """All geometries of one part of a GeoJSON object."""
    kind = str(node.get("type") or "") if isinstance(node, dict) else ""
    if kind == "Feature":
        if node.get("geometry") is not None:  # else it lies nowhere
            yield from _shapes(node["geometry"], source, _in(key, "geometry"), _meaning(node, source, key))
    elif kind in COLLECTIONS:
        key = _in(key, COLLECTIONS[kind])
        for number, part in enumerate(_listed(node.get(COLLECTIONS[kind]), source, key)):
            yield from _shapes(part, source, f"{key}[{number}]", meaning)
    elif kind in PARTS:
        key = _in(key, "coordinates")
        for number, part in enumerate(_listed(node.get("coordinates"), source, key)):
            yield Shape(f"{key}[{number}]", PARTS[kind], part, meaning)
    elif kind in PARTS.values():
        yield Shape(_in(key, "coordinates"), kind, node.get("coordinates"), meaning)
    else:
        told = f"the type {shown(kind)}" if kind else "no type"
        raise InputError(f"{source}: {f'{key}: ' if key else ''}has {told}; must be a GeoJSON LineString")


def _in(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name


def _listed(value: Any, source: str, key: str, of: str = "") -> list[Any]:
    if not isinstance(value, list):
        raise InputError(f"{source}: {key}: must be a list{of}")
    return value


def _meaning(feature: dict[str, Any], source: str, key: str) -> str | None:
    properties = feature.get("properties")
    meaning = properties.get(FENCE) if isinstance(properties, dict) else None
    if meaning is not None and meaning not in MEANINGS:
        where = _in(key, f"properties.{FENCE}")
        raise InputError(
            f"{source}: {where}: is {shown(str(meaning))!r}; must be one of {', '.join(MEANINGS)}"
        )
    return meaning


def _fence(shape: Shape, source: str) -> Fence:
    rings = _listed(shape.coordinates, source, shape.key, " of rings, each a list of [longitude, latitude]")
    places = tuple(
        tuple(place[:2] for place in _places(ring, source, f"{shape.key}[{number}]"))
        for number, ring in enumerate(rings)
    )
    name = shape.key.replace(".coordinates", "").replace(".geometry", "")
    return Fence(name, shape.meaning == "inclusion", places)


def _places(coordinates: Any, source: str, key: str) -> list[Point]:
    found: list[Point] = []
    for number, point in enumerate(_listed(coordinates, source, key, " of [longitude, latitude]")):
        where = f"{source}: {key}[{number}]"
        if not isinstance(point, list) or len(point) not in (2, 3):
            raise InputError(f"{where}: must be [longitude, latitude] or [longitude, latitude, altitude]")
        longitude, latitude, *altitude = (finite(value, where) for value in point)
        found.append((latitude, longitude, altitude[0] if altitude else None))
    return found
