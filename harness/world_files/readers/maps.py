"""Polygons of maps: GeoJSON (RFC 7946), buildings by their heights and airspace by its limits; KML, also as KMZ."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, Final

import shapely

from harness.files.input_file import InputError
from harness.files.kml import Shape, read_kml
from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, json_of, read_bytes
from harness.world_files.parts import NO_BOTTOM, NO_TOP, WGS84, Contents, Datum, FileSpec, Limit, Part
from harness.world_files.readers import limits

DATUMS: Final = {"absolute": Datum.SEA, "relativeToGround": Datum.GROUND}
"""Datum of a KML altitude by its altitudeMode; an altitude that is clamped to the ground has none."""


def read_geojson(spec: FileSpec) -> Contents:
    """Reads the polygons of a GeoJSON file; points and lines are passed over and counted."""
    content = json_of(spec.path)
    shapes = [
        (tags, polygon_of(each)) for tags, geometry in features_of(content) for each in simple(geometry)
    ]
    notes: list[str] = []
    parts = limits.parts_of([each for each in shapes if each[1] is not None], spec, notes)
    if passed := sum(shape is None for _, shape in shapes):
        notes.append(f"{counted(passed, 'point or line')} without an area passed over")
    # An older file may name a system that is not WGS84.
    named = re.search(r"EPSG:+(?:[\d.]*:)?(\d+)", str(content.get("crs")))
    crs = spec.crs or (f"EPSG:{named[1]}" if named else WGS84)
    return Contents(crs, parts, notes=tuple(notes))


def features_of(content: Any) -> Iterator[tuple[dict[str, Any], Any]]:
    """Yields attributes and geometry of each feature; its `id` is the attribute `identifier`."""
    kind = content.get("type") if isinstance(content, dict) else None
    features = content.get("features") if kind == "FeatureCollection" else [content]
    if not isinstance(features, list) or not all(isinstance(each, dict) for each in features):
        raise InputError("has no list of features; must be GeoJSON")
    for feature in features:
        if feature.get("type") == "Feature":
            tags = feature.get("properties")
            named = {"identifier": feature.get("id")}
            yield {**named, **(tags if isinstance(tags, dict) else {})}, feature.get("geometry")
        else:
            yield {}, feature


def simple(geometry: Any) -> Iterator[dict[str, Any]]:
    """Yields the geometries of a collection one after the other, and an empty one for what is no geometry."""
    if not isinstance(geometry, dict):
        yield {}
    elif geometry.get("type") == "GeometryCollection":
        for each in geometry.get("geometries") or ():
            yield from simple(each)
    else:
        yield geometry


def polygon_of(geometry: dict[str, Any]) -> Any:
    """Returns the shapely geometry of a Polygon or MultiPolygon, None for any other type."""
    if geometry.get("type") not in ("Polygon", "MultiPolygon"):
        return None
    try:
        return shapely.force_2d(shapely.geometry.shape(geometry))
    except (TypeError, ValueError, LookupError, AttributeError, shapely.GEOSException) as error:
        said = " ".join(str(error).split())[:60]
        raise InputError(f"has a polygon whose rings are not lists of positions ({said})") from error


def read_kml_polygons(spec: FileSpec) -> Contents:
    """Reads the polygons of a KML file, or of a KMZ archive with one, by limits in their ExtendedData or altitudes."""
    found = read_kml(read_bytes(spec.path, MAX_TREE_BYTES), "", MAX_TREE_BYTES)
    notes: list[str] = []
    parts = tuple(_kml_part(each, notes) for each in found.polygons)
    if flat := sum((part.bottom, part.top) == (NO_BOTTOM, NO_TOP) for part in parts):
        notes.append(f"{counted(flat, 'polygon')} on the ground taken as solid at every altitude")
    if any(each.mode in DATUMS and not limits.has_limits(each.data) for each in found.polygons):
        notes.append("a polygon in the air is taken as solid from the ground up to its highest corner")
    others = {"LineString": len(found.lines), **found.others}
    notes += [f"{counted(count, kind)} passed over" for kind, count in others.items() if count > 0]
    return Contents(spec.crs or WGS84, parts, notes=tuple(notes))


def _kml_part(shape: Shape, notes: list[str]) -> Part:
    """Returns a polygon of KML as a part: between its limits, or up to its highest corner if it is in the air."""
    rings = [[(longitude, latitude) for latitude, longitude, _ in ring] for ring in shape.rings]
    name, datum = shape.name[:40], DATUMS.get(shape.mode)
    try:
        footprint = shapely.Polygon(rings[0], [ring for ring in rings[1:] if ring])
    except ValueError as error:  # of one or two corners
        raise InputError(f"{name}: has a ring that encloses no area ({error})") from error
    if limits.has_limits(shape.data):
        return Part(footprint, *limits.limits(shape.data, notes, name), name=name)
    if datum is None:
        return Part(footprint, name=name)
    top_m = max((altitude or 0.0 for ring in shape.rings for *_, altitude in ring), default=0.0)
    return Part(footprint, top=Limit(top_m, datum), name=name)
