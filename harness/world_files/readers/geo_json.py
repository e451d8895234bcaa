"""GeoJSON (RFC 7946): buildings by their heights, airspace by its limits."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from harness.files.wording import counted
from harness.world_files.bounded import json_of
from harness.world_files.parts import WGS84, Contents, Reading, WorldFileError
from harness.world_files.readers import limits

DEEPEST: Final = 8
"""Collections of geometries nest no deeper than this."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a GeoJSON file; points and lines are passed over and counted.

    Raises:
        WorldFileError: it is not GeoJSON, or has no polygon.
    """
    content = whole(path)
    features: list[tuple[dict[str, Any], Any]] = []
    passed = 0
    for tags, geometry in features_of(content):
        shapes = [polygon_of(each) for each in simple(geometry)] or [None]
        features += [(tags, each) for each in shapes if each is not None]
        passed += sum(each is None for each in shapes)
    notes: list[str] = []
    parts = limits.parts_of(features, reading, notes)
    if passed:
        notes.append(f"{counted(passed, 'point or line')} without an area passed over")
    return Contents("geojson", reading.crs or _crs(content), parts, notes=tuple(notes))


def whole(path: Path) -> Any:
    """The content of a GeoJSON file; features that stand one a line are a collection."""
    contents = json_of(path, lines=True)
    return contents[0] if len(contents) == 1 else {"type": "FeatureCollection", "features": contents}


def features_of(content: Any) -> Iterator[tuple[dict[str, Any], Any]]:
    """Attributes and geometry of each feature; its `id` is an attribute where it has no name.

    Raises:
        WorldFileError: it is no GeoJSON.
    """
    kind = content.get("type") if isinstance(content, dict) else None
    features = content.get("features") if kind == "FeatureCollection" else [content]
    if not isinstance(features, list) or not all(isinstance(each, dict) for each in features):
        raise WorldFileError("has no list of features; must be GeoJSON")
    for feature in features:
        if feature.get("type") != "Feature":
            yield {}, feature
            continue
        tags = feature.get("properties")
        yield (
            {"identifier": feature.get("id"), **(tags if isinstance(tags, dict) else {})},
            feature.get("geometry"),
        )


def simple(geometry: Any, depth: int = 0) -> Iterator[dict[str, Any]]:
    """The geometries of a collection, one after the other."""
    if isinstance(geometry, dict) and depth <= DEEPEST:
        if geometry.get("type") != "GeometryCollection":
            yield geometry
            return
        for each in geometry.get("geometries") or ():
            yield from simple(each, depth + 1)


def polygon_of(geometry: dict[str, Any]) -> Any:
    """The shapely geometry of a Polygon or MultiPolygon; None of anything else.

    Raises:
        WorldFileError: it has fewer than three corners, or positions that are not two numbers.
    """
    import shapely
    from shapely.geometry import shape

    if geometry.get("type") not in ("Polygon", "MultiPolygon"):
        return None
    try:
        return shapely.force_2d(shape(geometry))
    except (TypeError, ValueError, LookupError, AttributeError, shapely.GEOSException) as error:
        said = " ".join(str(error).split())[:60]
        raise WorldFileError(f"has a polygon whose rings are not lists of positions ({said})") from error


def _crs(content: Any) -> str:
    """WGS84, unless an older file names another system."""
    named = content.get("crs") if isinstance(content, dict) else None
    match = re.search(r"EPSG:+(?:[\d.]*:)?(\d+)", str(named)) if named else None
    return f"EPSG:{match[1]}" if match else WGS84
