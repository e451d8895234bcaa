"""GeoJSON (RFC 7946): buildings by their heights, airspace by its limits."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import shapely

from harness.files.wording import counted
from harness.world_files.bounded import json_of
from harness.world_files.parts import WGS84, Contents, Reading, WorldFileError
from harness.world_files.readers import limits


def read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a GeoJSON file; points and lines are passed over and counted."""
    content = whole(path)
    shapes = [
        (tags, polygon_of(each)) for tags, geometry in features_of(content) for each in simple(geometry)
    ]
    notes: list[str] = []
    parts = limits.parts_of([each for each in shapes if each[1] is not None], reading, notes)
    if passed := sum(shape is None for _, shape in shapes):
        notes.append(f"{counted(passed, 'point or line')} without an area passed over")
    # An older file may name a system that is not WGS84.
    named = re.search(r"EPSG:+(?:[\d.]*:)?(\d+)", str(content.get("crs")))
    crs = reading.crs or (f"EPSG:{named[1]}" if named else WGS84)
    return Contents("geojson", crs, parts, notes=tuple(notes))


def whole(path: Path) -> Any:
    """The content of a GeoJSON file; features that stand one a line are a collection."""
    contents = json_of(path, lines=True)
    return contents[0] if len(contents) == 1 else {"type": "FeatureCollection", "features": contents}


def features_of(content: Any) -> Iterator[tuple[dict[str, Any], Any]]:
    """Attributes and geometry of each feature; its `id` is an attribute where it has no name."""
    kind = content.get("type") if isinstance(content, dict) else None
    features = content.get("features") if kind == "FeatureCollection" else [content]
    if not isinstance(features, list) or not all(isinstance(each, dict) for each in features):
        raise WorldFileError("has no list of features; must be GeoJSON")
    for feature in features:
        if feature.get("type") == "Feature":
            tags = feature.get("properties")
            named = {"identifier": feature.get("id")}
            yield {**named, **(tags if isinstance(tags, dict) else {})}, feature.get("geometry")
        else:
            yield {}, feature


def simple(geometry: Any) -> Iterator[dict[str, Any]]:
    """The geometries of a collection one after the other; an empty one where there is none."""
    if not isinstance(geometry, dict):
        yield {}
    elif geometry.get("type") == "GeometryCollection":
        for each in geometry.get("geometries") or ():
            yield from simple(each)
    else:
        yield geometry


def polygon_of(geometry: dict[str, Any]) -> Any:
    """The shapely geometry of a Polygon or MultiPolygon; None of anything else."""
    if geometry.get("type") not in ("Polygon", "MultiPolygon"):
        return None
    try:
        return shapely.force_2d(shapely.geometry.shape(geometry))
    except (TypeError, ValueError, LookupError, AttributeError, shapely.GEOSException) as error:
        said = " ".join(str(error).split())[:60]
        raise WorldFileError(f"has a polygon whose rings are not lists of positions ({said})") from error
