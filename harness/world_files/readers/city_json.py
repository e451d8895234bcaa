"""Buildings from CityJSON 1.0 to 2.0, each between its lowest and its highest vertex, above mean sea level."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import shapely

from harness.files.input_file import InputError, shown
from harness.world_files.bounded import json_of
from harness.world_files.parts import Contents, FileSpec, FloatArray, Limit, Part
from harness.world_files.plane import check_metres, crs_of
from harness.world_files.readers import limits

SOLID_TYPES: Final = ("Building", "Bridge", "OtherConstruction")  # beginnings of solid types
INSTANCE: Final = "GeometryInstance"  # type of a geometry that places a template; passed over and counted
LOW_M: Final = 0.1  # an object lower than this is a footprint whose height its attributes may give
WALL_SHARE: Final = 1e-9  # a surface is a wall if its area from above is less of its length squared


def read(spec: FileSpec) -> Contents:
    """Reads the buildings, bridges and other constructions of a CityJSON file; other objects are counted in a note."""
    content = json_of(spec.path)
    if not isinstance(content, dict) or not isinstance(content.get("CityObjects"), dict):
        raise InputError("has no CityObjects; must be CityJSON")
    crs, vertices = _crs(content.get("metadata"), spec.crs), _vertices(content)
    parts: list[Part] = []
    passed, buildings = Counter[str](), limits.Buildings(spec)
    for name, body in content["CityObjects"].items():
        if (kind := str(body.get("type", "?")) if isinstance(body, dict) else "?").startswith(SOLID_TYPES):
            parts += _parts(name, body, vertices, buildings, passed)
        else:
            passed[kind] += 1
    if not parts:
        raise InputError("has no building with a shape; must have some")
    notes = buildings.notes()
    if listed := [f"{number} {kind}" for kind, number in (+passed).most_common()]:
        notes.append(f"passed over: {', '.join(listed)}")
    unknown = ("names no coordinate reference system: its metres are taken as they are (crs)",)
    notes += unknown if crs is None else check_metres(crs)
    return Contents(crs, tuple(parts), notes=tuple(notes))


def _parts(
    name: str, body: dict[str, Any], vertices: FloatArray, buildings: limits.Buildings, passed: Counter[str]
) -> list[Part]:
    """Returns the part that an object is, its surfaces seen from above; a flat one is as high as its attributes say."""
    instances = sum(each["type"] == INSTANCE for each in _geometries(body))
    passed[INSTANCE] += instances
    surfaces = list(_best_surfaces(name, body, vertices))
    drawn = [shapely.Polygon(rings[0][:, :2], [ring[:, :2] for ring in rings[1:]]) for rings in surfaces]
    shapes = np.array(shapely.make_valid(drawn, method="structure", keep_collapsed=False), dtype=object)
    footprint = shapely.union_all(shapes[shapely.area(shapes) > WALL_SHARE * shapely.length(shapes) ** 2])
    if footprint.is_empty:
        passed["building without a shape"] += not (body.get("children") or instances)
        return []
    heights = np.concatenate([np.concatenate(rings)[:, 2] for rings in surfaces])
    low, high = float(heights.min()), float(heights.max())
    if high - low < LOW_M:
        tags = body["attributes"] if isinstance(body.get("attributes"), dict) else {}
        high = low + buildings.part(tags, footprint).top.height_m
    return [Part(footprint, Limit(low), Limit(high), name=name[:40])]


def _vertices(content: dict[str, Any]) -> FloatArray:
    """(n, 3) x, y, z of a file."""
    try:
        vertices = np.array(content.get("vertices", []), dtype=np.float64).reshape(-1, 3)
        if (how := content.get("transform")) is not None:
            vertices = vertices * np.array(how["scale"], np.float64) + np.array(how["translate"], np.float64)
    except (TypeError, ValueError, KeyError) as error:
        raise InputError("has vertices or a transform that are not numbers in threes") from error
    if not np.isfinite(vertices).all():
        raise InputError("has vertices that are not finite")
    return vertices


def _geometries(body: dict[str, Any]) -> list[dict[str, Any]]:
    """Returns the geometries of an object that say of what type they are."""
    shapes = body.get("geometry") or ()
    return [each for each in shapes if isinstance(each, dict) and isinstance(each.get("type"), str)]


def _best_surfaces(name: str, body: dict[str, Any], vertices: FloatArray) -> Iterator[list[FloatArray]]:
    """Yields the surfaces of an object at its highest level of detail, as rings of at least three corners."""
    areal = [each for each in _geometries(body) if each["type"].endswith(("Surface", "Solid"))]
    best = max((str(each.get("lod", "0")) for each in areal), default="")
    for geometry in areal:
        if str(geometry.get("lod", "0")) == best:
            for surface in _surfaces(geometry.get("boundaries")):
                if surface and len(surface[0]) >= 3:
                    yield [_ring_corners(ring, vertices, name) for ring in surface if len(ring) >= 3]


def _ring_corners(ring: list[Any], vertices: FloatArray, name: str) -> FloatArray:
    if not all(isinstance(index, int) and 0 <= index < len(vertices) for index in ring):
        raise InputError(f"has an object {name[:40]!r} with a vertex that is not there")
    return vertices[ring]


def _surfaces(boundaries: Any) -> Iterator[list[list[Any]]]:
    """Yields the surfaces of a MultiSurface, Solid or MultiSolid, each a list of rings of vertex indices."""
    if not isinstance(boundaries, list) or not all(isinstance(each, list) for each in boundaries):
        raise InputError("has boundaries that are not lists of rings")
    if boundaries and boundaries[0] and not isinstance(boundaries[0][0], list):
        yield boundaries
        return
    for each in boundaries:
        yield from _surfaces(each)


def _crs(metadata: Any, given: str | None) -> str | None:
    found = metadata if isinstance(metadata, dict) else {}
    named = found.get("referenceSystem", found.get("crs"))
    match = re.search(r"EPSG[:/]+(?:[\d.]*[:/])?(\d+)", str(named), re.IGNORECASE)
    if named and not (match or given):
        raise InputError(f"has its crs as {shown(str(named))!r}, which is not read; give crs, as EPSG:N")
    return crs_of(f"EPSG:{match[1]}" if match else None, given)
