"""Paths in GeoJSON files (RFC 7946): one LineString, and polygons as areas to stay out of or inside of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.run_files.fences import Fence, Fences
from harness.run_files.path_as_read import PathAsRead
from harness.run_files.read_values import finite, parsed_json, shown

PARTS: Final = {"MultiLineString": "LineString", "MultiPolygon": "Polygon", "MultiPoint": "Point"}
"""What a geometry of several parts is made of."""

FENCE: Final = "fence"
"""A feature's property that says what its polygons are; one of `MEANINGS`."""

MEANINGS: Final = ("exclusion", "inclusion", "none")
"""A polygon is to be stayed out of, to be stayed inside of, or means nothing for the path."""

Shape = tuple[str, str, Any, str | None]
"""Where a geometry stands, its kind, its coordinates, and what its feature says that it is."""


def read_geojson(text: str, source: str) -> PathAsRead:
    """The path of a GeoJSON file.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is none, or holds no LineString or several.
    """
    shapes = list(_shapes(parsed_json(text, source), source, "", None))
    lines = [shape for shape in shapes if shape[1] == "LineString"]
    if len(lines) != 1:
        raise InputError(f"{source}: has {len(lines)} LineStrings; must have exactly one, the path")
    key, _, coordinates, _ = lines[0]
    positions, altitudes = _places(coordinates, source, key)
    if altitudes and len(altitudes) != len(positions):
        raise InputError(f"{source}: {key}: has an altitude at some points only; give it at all or none")
    polygons = [shape for shape in shapes if shape[1] == "Polygon"]
    fences = tuple(_fence(shape, source) for shape in polygons if shape[3] != "none")
    passed_over = Counter(kind for _, kind, _, meaning in shapes if kind == "Point" or meaning == "none")
    notes = tuple(
        f"{counted(count, kind)} beside the path passed over" for kind, count in passed_over.items()
    )
    return PathAsRead(False, tuple(positions), tuple(altitudes), fences=Fences(fences), notes=notes)


def _shapes(node: Any, source: str, key: str, meaning: str | None) -> Iterator[Shape]:
    """All LineStrings, Polygons and Points of a GeoJSON object."""
    kind = node.get("type") if isinstance(node, dict) else None
    if kind == "Feature":
        if node.get("geometry") is not None:  # else it lies nowhere
            inner = f"{key}.geometry".lstrip(".")
            yield from _shapes(node["geometry"], source, inner, _meaning(node, source, key))
        return
    if kind in ("FeatureCollection", "GeometryCollection"):
        name = "features" if kind == "FeatureCollection" else "geometries"
        parts = node.get(name)
        if not isinstance(parts, list):
            raise InputError(f"{source}: {f'{key}.{name}'.lstrip('.')}: must be a list")
        for number, part in enumerate(parts):
            yield from _shapes(part, source, f"{key}.{name}[{number}]".lstrip("."), meaning)
        return
    if kind not in ("LineString", "Polygon", "Point", *PARTS):
        told = f"the type {shown(str(kind))}" if kind else "no type"
        raise InputError(f"{source}: {f'{key}: ' if key else ''}has {told}; must be a GeoJSON LineString")
    key, coordinates = f"{key}.coordinates".lstrip("."), node.get("coordinates")
    if kind not in PARTS:
        yield key, kind, coordinates, meaning
        return
    if not isinstance(coordinates, list):
        raise InputError(f"{source}: {key}: must be a list")
    for number, part in enumerate(coordinates):
        yield f"{key}[{number}]", PARTS[kind], part, meaning


def _meaning(feature: dict[str, Any], source: str, key: str) -> str | None:
    properties = feature.get("properties")
    meaning = properties.get(FENCE) if isinstance(properties, dict) else None
    if meaning is not None and meaning not in MEANINGS:
        where = f"{key}.properties.{FENCE}".lstrip(".")
        raise InputError(
            f"{source}: {where}: is {shown(str(meaning))!r}; must be one of {', '.join(MEANINGS)}"
        )
    return meaning


def _fence(shape: Shape, source: str) -> Fence:
    key, _, rings, meaning = shape
    if not isinstance(rings, list) or not rings:
        raise InputError(f"{source}: {key}: must be a list of rings, each a list of [longitude, latitude]")
    places = tuple(tuple(_places(ring, source, f"{key}[{number}]")[0]) for number, ring in enumerate(rings))
    name = key.replace(".coordinates", "").replace(".geometry", "")
    return Fence(name, meaning == "inclusion", places, stated=meaning is not None)


def _places(coordinates: Any, source: str, key: str) -> tuple[list[tuple[float, float]], list[float]]:
    """Latitudes and longitudes of a list of positions, and the altitudes of those that have one."""
    if not isinstance(coordinates, list):
        raise InputError(f"{source}: {key}: must be a list of [longitude, latitude]")
    positions, altitudes = [], []
    for number, point in enumerate(coordinates):
        where = f"{source}: {key}[{number}]"
        if not isinstance(point, list) or len(point) not in (2, 3):
            raise InputError(f"{where}: must be [longitude, latitude] or [longitude, latitude, altitude]")
        longitude, latitude, *altitude = (finite(value, where) for value in point)
        positions.append((latitude, longitude))
        altitudes += altitude
    return positions, altitudes
