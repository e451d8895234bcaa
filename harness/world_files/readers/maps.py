"""Polygons of maps: GeoJSON (RFC 7946), buildings by their heights and airspace by its limits; KML, also as KMZ."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

import shapely

from harness.files.input_file import InputError, listed, numbers, shown
from harness.files.kml import Shape, read_kml
from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, json_of, read_bytes
from harness.world_files.parts import WGS84, Contents, Datum, FileSpec, Limit, Part
from harness.world_files.plane import crs_of
from harness.world_files.readers import limits

WITHOUT_AREA: Final = ("Point", "MultiPoint", "LineString", "MultiLineString")
BESIDE: Final[dict[str, dict[str, str]]] = {  # says more of a limit's `value`; words of openAIP's codes
    **{"unit": {"0": "M", "1": "FT", "6": "FL"}, "referenceDatum": {"0": "GND", "1": "MSL", "2": "STD"}},
    **{key: {} for key in ("uom", "reference", "datum", "ref")},
}
CRS_NAME: Final = re.compile(r"(?i)(EPSG|ESRI|OGC)\W+(?:[\d.]*[:/])?(CRS\d+|\d+)")  # of an older GeoJSON
WITH_ALTITUDE: Final = re.compile(r"\[[^][,]+,[^][,]+,[^][]+\]")  # matches a place of three numbers
DATUMS: Final = {  # datum of a KML altitude by its altitudeMode; "" is the first of those without one
    **{"absolute": Datum.SEA, "relativeToGround": Datum.GROUND},
    **dict.fromkeys(("clampToGround", "clampToSeaFloor", "relativeToSeaFloor", "")),
}


def read_geojson(spec: FileSpec) -> Contents:
    """Reads the polygons of a GeoJSON file; points and lines are passed over and counted."""
    content = json_of(spec.path)
    every = [(tags, *each) for tags, geometry, key in features_of(content) for each in simple(geometry, key)]
    shapes = [(tags, polygon_of(geometry, key)) for tags, geometry, key in every]
    notes: list[str] = []
    if any(WITH_ALTITUDE.search(str(geometry.get("coordinates"))) for _, geometry, _ in every):
        notes.append("altitudes of corners passed over: heights are attributes, as floor and ceiling")
    parts = limits.parts_of([each for each in shapes if each[1] is not None], spec, notes)
    if passed := sum(shape is None for _, shape in shapes):
        notes.append(f"{counted(passed, 'point or line')} without an area passed over")
    return Contents(crs_named(content, spec.crs), parts, notes=tuple(notes))


def crs_named(content: Mapping[str, Any], given: str | None = None) -> str:
    """Returns the crs of a GeoJSON: as an older file names it, else as given, or WGS84; InputError: it is not known."""
    named = CRS_NAME.search(text := str(content.get("crs") or ""))
    if text and not (named or given):
        raise InputError(f"crs: is {shown(text)!r}; must name it as EPSG:N")
    return crs_of(f"{named[1]}:{named[2]}".upper() if named else None, given) or WGS84


def features_of(content: Any) -> Iterator[tuple[dict[str, Any], Any, str]]:
    """Yields attributes, geometry and the geometry's key of each feature; its `id` is the attribute `identifier`."""
    is_collection = isinstance(content, dict) and content.get("type") == "FeatureCollection"
    features = content.get("features") if is_collection else [content]
    if not isinstance(features, list) or not all(isinstance(each, dict) for each in features):
        raise InputError("has no list of features; must be GeoJSON")
    for number, feature in enumerate(features):
        key = f"features[{number}]." if is_collection else ""
        if feature.get("type") == "Feature":
            if not isinstance(tags := feature.get("properties") or {}, dict):
                raise InputError(f"{key}properties: is {shown(str(tags))!r}; must be a mapping or null")
            yield {"identifier": feature.get("id"), **_flat(tags)}, feature.get("geometry"), f"{key}geometry"
        else:
            yield {}, feature, key.rstrip(".")


def _flat(tags: Mapping[str, Any]) -> dict[str, Any]:
    """Returns attributes without mappings: one with a `value` as a text, the attributes of any other as their own."""
    flat: dict[str, Any] = {}
    for key, value in tags.items():
        if isinstance(value, dict) and "value" in value:
            more = (BESIDE[k].get(str(v), v) for k, v in value.items() if k in BESIDE and v is not None)
            flat[key.replace("Ceiling", "Limit")] = " ".join(map(str, (value["value"], *more)))
        else:
            flat |= _flat(value) if isinstance(value, dict) else {key: value}
    return flat


def simple(geometry: Any, key: str) -> Iterator[tuple[dict[str, Any], str]]:
    """Yields the geometries of a collection one after the other with their keys, and an empty one for null."""
    if isinstance(geometry, dict) and geometry.get("type") == "GeometryCollection":
        key = f"{key}.geometries".lstrip(".")
        for number, each in enumerate(listed(geometry.get("geometries"), key)):
            yield from simple(each, f"{key}[{number}]")
    elif geometry is not None and not isinstance(geometry, dict):
        raise InputError(f"{key}: is {shown(str(geometry))!r}; must be a GeoJSON geometry")
    else:
        yield geometry or {}, key


def polygon_of(geometry: dict[str, Any], key: str) -> Any:
    """Returns the shapely geometry of a Polygon or MultiPolygon at a key, None for a point, a line or nothing."""
    if not geometry or (kind := geometry.get("type")) in WITHOUT_AREA:
        return None
    if kind not in ("Polygon", "MultiPolygon"):
        at, kind_text = f"{key}.type".lstrip("."), "missing" if kind is None else repr(shown(str(kind)))
        raise InputError(f"{at}: is {kind_text}; must be that of a GeoJSON geometry")
    key, given = f"{key}.coordinates".lstrip("."), geometry.get("coordinates")
    if kind == "Polygon":
        return _polygon(given, key)
    return shapely.MultiPolygon([_polygon(each, f"{key}[{k}]") for k, each in enumerate(listed(given, key))])


def _polygon(given: Any, key: str) -> Any:
    each = enumerate(listed(given, key, " of rings"))
    rings = [_ring(ring, f"{key}[{number}]") for number, ring in each if ring != []]
    return shapely.Polygon(*rings[:1], rings[1:])


def _ring(given: Any, key: str) -> list[list[float]]:
    """Returns the places of a ring; an InputError names the key of what is none."""
    places = enumerate(listed(given, key, " of [longitude, latitude]"))
    pairs = ((number, place[:2] if isinstance(place, list) else place) for number, place in places)
    ring = [numbers(place, f"{key}[{number}]", "[longitude, latitude]", (2,)) for number, place in pairs]
    if len(ring) < 3:
        raise InputError(f"{key}: has {counted(len(ring), 'place')}; a ring has at least 3")
    return ring


def read_kml_polygons(spec: FileSpec) -> Contents:
    """Reads the polygons of a KML file, or of a KMZ archive with one, by limits in their ExtendedData or altitudes."""
    found = read_kml(read_bytes(spec.path, MAX_TREE_BYTES), "", MAX_TREE_BYTES)
    notes: list[str] = []
    parts = tuple(_kml_part(each, notes) for each in found.polygons)
    if flat := sum(not part.is_limited for part in parts):
        notes.append(f"{counted(flat, 'polygon')} without height limits taken as solid at every altitude")
    both = zip(parts, found.polygons, strict=True)
    if any(part.is_limited and not limits.has_limits(each.data) for part, each in both):
        notes.append("a polygon in the air is taken as solid from the ground up to its highest corner")
    others = {"LineString": len(found.lines), **found.others}
    notes += [f"{counted(count, kind)} passed over" for kind, count in others.items() if count > 0]
    return Contents(WGS84, parts, notes=tuple(notes))


def _kml_part(shape: Shape, notes: list[str]) -> Part:
    """Returns a polygon of KML as a part: between its limits, or up to its highest corner if it is in the air."""
    rings = [[(longitude, latitude) for latitude, longitude, _ in ring] for ring in shape.rings]
    name, datum = shape.name[:40], DATUMS.get(shape.mode)
    if shape.mode not in DATUMS:
        wanted = ", ".join(filter(None, DATUMS))
        raise InputError(f"{name}: has the altitudeMode {shown(shape.mode)!r}; must be one of {wanted}")
    try:
        footprint = shapely.Polygon(rings[0], [ring for ring in rings[1:] if ring])
    except ValueError as error:
        raise InputError(f"{name}: has a ring of one or two corners; must have at least 3") from error
    if limits.has_limits(shape.data):
        return Part(footprint, *limits.limits(shape.data, notes, name), name=name)
    altitudes = [altitude for ring in shape.rings for *_, altitude in ring if altitude is not None]
    if datum is None or not altitudes:
        return Part(footprint, name=name)
    return Part(footprint, top=Limit(max(altitudes), datum), name=name)
