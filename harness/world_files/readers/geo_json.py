"""GeoJSON: buildings by their heights, airspace by its limits; ED-318 geozones, which are GeoJSON with layers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.files.wording import counted
from harness.world_files.bounded import json_of
from harness.world_files.parts import (
    FOOT_M,
    NO_BOTTOM,
    NO_TOP,
    WGS84,
    Contents,
    Datum,
    FloatArray,
    Limit,
    Part,
    Reading,
    WorldFileError,
)
from harness.world_files.plane import in_degrees
from harness.world_files.readers import limits, rings
from harness.world_files.readers.lengths import metres_of, names_unit

DEEPEST: Final = 8
ABOVE_GROUND: Final = ("AGL", "SFC", "GND")
ABOVE_SEA: Final = ("AMSL", "MSL")
ABOVE_ELLIPSOID: Final = ("WGS84", "W84", "HAE")
LEVEL_M: Final = 100.0 * FOOT_M
LIMIT_UNITS_M: Final = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("ft", "f", "foot", "feet"), FOOT_M),
    "fl": LEVEL_M,
}
"""Units of the limits of geozones."""
FREE: Final = ("NO_RESTRICTION",)
"""Restrictions of a geozone that forbid nothing."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a GeoJSON file; points and lines are passed over and counted.

    Raises:
        WorldFileError: it is not GeoJSON, or has no polygon.
    """
    content = _whole(path)
    notes: list[str] = []
    parts: list[Part] = []
    doubts = limits.Doubts()
    features = list(_features(content))
    every = [(tags, name, one) for tags, geometry, name in features for one in _simple(geometry, 0)]
    passed, bare = sum(geometry is None for _, geometry, _ in features), 0
    crs = reading.crs or _crs(content)
    shapes = rings.shapes_of([rings_of(one) for _, _, one in every], in_degrees(crs))
    for (tags, name, _), footprint in zip(every, shapes, strict=True):
        if footprint is None:
            passed += 1
        elif limits.is_building(tags):
            parts.append(limits.building(tags, footprint, reading, doubts, name))
        else:
            bare += not limits.has_limits(tags)
            bottom, top = limits.limits(tags, notes, name)
            parts.append(Part(footprint, bottom, top, name=name))
    if not parts:
        raise WorldFileError("has no polygon; must be GeoJSON with some")
    notes += doubts.notes(reading)
    if bare:
        notes.append(f"{counted(bare, 'polygon')} without height limits taken as solid at every altitude")
    if passed:
        notes.append(f"{counted(passed, 'point, line or polygon')} without an area passed over")
    return Contents("geojson", crs, tuple(parts), notes=tuple(notes))


def read_ed318(path: Path, reading: Reading) -> Contents:
    """Reads ED-318 geozones: a layer, and for a circle an extent, in each geometry.

    Raises:
        WorldFileError: it is not ED-318, or has no zone.
    """
    notes: list[str] = []
    parts: list[Part] = []
    passed = free = timed = empty = 0
    for tags, geometry, name in _features(_whole(path)):
        if str(tags.get("type", "")).upper() in FREE:
            free += 1
            continue
        empty += geometry is None
        timed += bool(tags.get("limitedApplicability"))
        for one in _simple(geometry, 0):
            layer, extent = one.get("layer"), one.get("extent")
            if isinstance(extent, dict) and one.get("type") == "Point":
                place = places_of([one.get("coordinates")])[0]
                footprint = rings.circle(place, radius_of(extent.get("radius")))
            else:
                footprint = footprint_of(one)
            if footprint is None:
                passed += 1
                continue
            bottom, top = _layer(layer if isinstance(layer, dict) else {}, notes, name)
            parts.append(Part(footprint, bottom, top, name=name))
    if not parts:
        raise WorldFileError("has no zone with an area; must be ED-318 with some")
    if empty:
        notes.append(f"{counted(empty, 'zone')} without a geometry passed over")
    if passed:
        notes.append(f"{counted(passed, 'geometry')} without an area passed over")
    if free:
        notes.append(f"{counted(free, 'zone')} without restriction passed over")
    if timed:
        notes.append(f"{counted(timed, 'zone')} that apply at times only taken as always there")
    return Contents("ed318", WGS84, tuple(parts), notes=tuple(notes))


def _layer(layer: dict[str, Any], notes: list[str], name: str) -> tuple[Limit, Limit]:
    unit_m = limit_unit_m(layer.get("uom"))
    found: list[Limit | None] = []
    for word, none in (("lower", NO_BOTTOM), ("upper", NO_TOP)):
        value = layer.get(word)
        reference = str(layer.get(f"{word}Reference") or "")
        found.append(none if value is None else zone_limit(value, reference, unit_m, notes, name))
    return limits.band_of(found[0], found[1], notes, name)


def limit_unit_m(name: Any) -> float:
    """Length of the unit of a geozone's limits; a metre where none is named.

    Raises:
        WorldFileError: it is none that is known.
    """
    word = str(name or "m").strip().lower()
    if word not in LIMIT_UNITS_M:
        raise WorldFileError(f"has limits in {word[:20]!r}; must be in m, ft or FL")
    return LIMIT_UNITS_M[word]


def zone_limit(value: Any, reference: str, unit_m: float, notes: list[str], name: str) -> Limit | None:
    """A limit of a geozone, above ground (AGL) or above mean sea level (AMSL, WGS84).

    Args:
        value: a number, or one with a unit of its own.
        reference: what it is counted from.
        unit_m: length of the unit of a number; a hundred feet: flight levels, above mean sea level.
        notes: are added to.
        name: of the zone, for them.
    """
    number = metres_of(value)
    if number is None:
        return None
    level = unit_m == LEVEL_M
    datum = Datum.GROUND if reference.upper() in ABOVE_GROUND and not level else Datum.SEA
    if datum is Datum.GROUND and number == 0.0:
        return NO_BOTTOM
    if datum is Datum.SEA and reference.upper() not in ABOVE_SEA and not level:
        told = "are above the ellipsoid" if reference.upper() in ABOVE_ELLIPSOID else "name no reference"
        note = f"{name or 'a zone'}: its limits {told}; taken as above mean sea level"
        notes += [] if note in notes[-1:] else [note]
    return Limit(number if names_unit(value) else number * unit_m, datum)


def radius_of(value: Any) -> float:
    """A radius in metres.

    Raises:
        WorldFileError: it is none.
    """
    radius = metres_of(value)
    if radius is None:
        raise WorldFileError("has a circle without a radius")
    return radius


def _whole(path: Path) -> Any:
    """The content of a GeoJSON file; features that stand one a line are a collection."""
    contents = json_of(path, lines=True)
    return contents[0] if len(contents) == 1 else {"type": "FeatureCollection", "features": contents}


def _features(content: Any) -> Iterator[tuple[dict[str, Any], Any, str]]:
    """Attributes, geometry and name of each feature."""
    kind = content.get("type") if isinstance(content, dict) else None
    features = content.get("features") if kind == "FeatureCollection" else [content]
    if not isinstance(features, list):
        raise WorldFileError("has no list of features; must be GeoJSON")
    for feature in features:
        if not isinstance(feature, dict):
            raise WorldFileError("has a feature that is no mapping; must be GeoJSON")
        if feature.get("type") == "Feature":
            tags = feature.get("properties")
            tags = tags if isinstance(tags, dict) else {}
            named = {key.lower(): value for key, value in tags.items()}
            name = named.get("name") or named.get("identifier") or feature.get("id") or ""
            yield (
                tags,
                feature.get("geometry"),
                (name if isinstance(name, str) else str(named.get("identifier", "")))[:40],
            )
        else:
            yield {}, feature, ""


def _simple(geometry: Any, depth: int) -> Iterator[dict[str, Any]]:
    """The geometries of a collection, one after the other."""
    if not isinstance(geometry, dict) or depth > DEEPEST:
        return
    if geometry.get("type") == "GeometryCollection":
        for each in geometry.get("geometries") or ():
            yield from _simple(each, depth + 1)
    else:
        yield geometry


def footprint_of(geometry: dict[str, Any]) -> Any:
    """The area of a Polygon or MultiPolygon; None of anything else, or without one."""
    return rings.shapes_of([rings_of(geometry)], degrees=True)[0]


def rings_of(geometry: dict[str, Any]) -> list[list[FloatArray]]:
    """The rings of each polygon of a geometry; none of what is no Polygon or MultiPolygon."""
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    if kind not in ("Polygon", "MultiPolygon") or not isinstance(coordinates, list):
        return []
    polygons = [coordinates] if kind == "Polygon" else coordinates
    if not all(
        isinstance(polygon, list) and all(isinstance(r, list) for r in polygon) for polygon in polygons
    ):
        raise WorldFileError("has a polygon whose rings are not lists of positions")
    return [[_places(ring) for ring in polygon] for polygon in polygons if polygon]


def _places(positions: list[Any]) -> FloatArray:
    """(k, 2) the first two numbers of each position."""
    try:
        numbers = np.array([each[:2] for each in positions], dtype=np.float64).reshape(-1, 2)
    except (TypeError, ValueError, IndexError, KeyError) as error:
        raise WorldFileError("has a position that is not two numbers") from error
    if not np.isfinite(numbers).all():
        raise WorldFileError("has a position that is not finite")
    return numbers


def places_of(positions: list[Any]) -> list[rings.Place]:
    """First and second number of each position.

    Raises:
        WorldFileError: one is not two finite numbers.
    """
    return [(east, north) for east, north in _places(positions).tolist()]


def _crs(content: Any) -> str:
    """WGS84, unless an older file names another system."""
    named = content.get("crs") if isinstance(content, dict) else None
    match = re.search(r"EPSG:+(?:[\d.]*:)?(\d+)", str(named)) if named else None
    return f"EPSG:{match[1]}" if match else WGS84
