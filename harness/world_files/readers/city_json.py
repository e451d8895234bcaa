"""Buildings from CityJSON 1.0 to 2.0: each object between its lowest and its highest vertex.

Heights are those of the file's vertical datum, taken as mean sea level.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely

from harness.world_files.bounded import json_of
from harness.world_files.parts import Contents, FloatArray, Limit, Part, Reading, WorldFileError
from harness.world_files.plane import axis_units
from harness.world_files.readers import limits

SOLID: Final = ("Building", "Bridge", "OtherConstruction")
"""Beginnings of the types that are taken."""
INSTANCE: Final = "GeometryInstance"
"""Type of a geometry that is a template of the file, put somewhere."""
ROOFS: Final = ("b3_h_dak_max", "b3_h_nok", "h_dak_max")
"""Attributes of 3DBAG with the height of the roof above the datum, for buildings whose geometry is flat."""
LOW_M: Final = 0.1
"""An object that is lower than this is a footprint without a height of its own."""
WALL: Final = 1e-9
"""A surface is a wall where its area from above is less than this share of its length squared."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads the buildings and bridges of a CityJSON file, or of a sequence of them (CityJSONSeq), a feature a line.

    A building that is flat, as those of level of detail 0 are, is as high as its attributes say.
    """
    contents = json_of(path, lines=True)
    if not all(isinstance(each, dict) and isinstance(each.get("CityObjects"), dict) for each in contents):
        raise WorldFileError("has no CityObjects; must be CityJSON")
    crs = reading.crs or _crs(contents[0].get("metadata"))
    notes: list[str] = []
    unit_m = 1.0 if crs is None else _height_unit_m(crs, notes)
    parts: list[Part] = []
    passed, doubts = Counter[str](), limits.Doubts()
    for content in contents:
        vertices = _vertices(content, contents[0].get("transform"))
        vertices[:, 2] *= unit_m
        for name, thing in content["CityObjects"].items():
            part = _object(name, thing, vertices, reading, doubts, passed)
            parts += [] if part is None else [part]
    if not parts:
        raise WorldFileError("has no building with a shape; must have some")
    notes += doubts.notes(reading)
    if told := [f"{number} {kind}" for kind, number in passed.most_common() if number]:
        notes.append(f"passed over: {', '.join(told[:4])}{' and others' if len(told) > 4 else ''}")
    if crs is None:
        notes.append("names no coordinate reference system: its metres are taken as they are (crs)")
    return Contents("cityjson", crs, tuple(parts), notes=tuple(notes))


def _object(
    name: str, thing: Any, vertices: FloatArray, reading: Reading, doubts: limits.Doubts, passed: Counter[str]
) -> Part | None:
    """The part that an object is, if it is one; what of it is passed over is counted."""
    kind = str(thing.get("type", "?")) if isinstance(thing, dict) else "?"
    if not kind.startswith(SOLID):
        passed[kind] += 1
        return None
    instances = sum(each["type"] == INSTANCE for each in _geometries(thing))
    passed[INSTANCE] += instances
    part = _part(name, thing, vertices, reading, doubts)
    passed["building without a shape"] += part is None and not (thing.get("children") or instances)
    return part


def _height_unit_m(crs: str, notes: list[str]) -> float:
    """Length of the unit of heights in metres: that of the vertical system, else that of the plane."""
    units = axis_units(crs)
    if units.height_m is None and units.plane_m != 1.0:
        notes.append(f"its heights name no unit: taken in {units.plane}, as its plane")
        return units.plane_m
    if units.height_m not in (None, 1.0):
        notes.append(f"its heights are its numbers times {units.height_m:.6g}, as it says")
    return units.height_m or 1.0


def _vertices(content: dict[str, Any], common: Any) -> FloatArray:
    """(n, 3) x, y, z of a file or feature; `common` is how all of a sequence are scaled."""
    try:
        vertices = np.array(content.get("vertices", []), dtype=np.float64).reshape(-1, 3)
        if (how := content.get("transform", common)) is not None:
            vertices = vertices * np.array(how["scale"], np.float64) + np.array(how["translate"], np.float64)
    except (TypeError, ValueError, KeyError) as error:
        raise WorldFileError("has vertices or a transform that are not numbers in threes") from error
    if not np.isfinite(vertices).all():
        raise WorldFileError("has vertices that are not finite")
    return vertices


def _geometries(thing: dict[str, Any]) -> list[dict[str, Any]]:
    """Geometries of an object that say of what type they are."""
    shapes = thing.get("geometry") or ()
    return [each for each in shapes if isinstance(each, dict) and isinstance(each.get("type"), str)]


def _part(
    name: str, thing: dict[str, Any], vertices: FloatArray, reading: Reading, doubts: limits.Doubts
) -> Part | None:
    """An object at its highest level of detail: its surfaces from above, between its lowest and highest vertex."""
    shapes, low, high = [], math.inf, -math.inf
    for surface in _best_surfaces(thing):
        rings = [_places(ring, vertices, name) for ring in surface if len(ring) >= 3]
        if not rings or len(surface[0]) < 3:
            continue
        heights = np.concatenate(rings)[:, 2]
        low, high = min(low, float(heights.min())), max(high, float(heights.max()))
        shape = shapely.Polygon(rings[0][:, :2], [ring[:, :2] for ring in rings[1:]])
        if not shape.is_valid:
            shape = shapely.make_valid(shape, method="structure", keep_collapsed=False)
        if shape.area > WALL * shape.length**2:
            shapes.append(shape)
    if not shapes:
        return None
    footprint, tags = shapely.union_all(shapes), thing.get("attributes")
    tags = tags if isinstance(tags, dict) else {}
    if high - low < LOW_M:
        high = max(limits.metres_of(tags.get(key)) or -math.inf for key in ROOFS)
        if high <= low:
            high = low + limits.building(tags, footprint, reading, doubts).top.height_m
    return Part(footprint, Limit(low), Limit(high), name=name[:40])


def _best_surfaces(thing: dict[str, Any]) -> Iterator[list[list[Any]]]:
    """Surfaces of an object at its highest level of detail."""
    areal = [each for each in _geometries(thing) if each["type"].endswith(("Surface", "Solid"))]
    best = max((str(each.get("lod", "0")) for each in areal), default="")
    for geometry in areal:
        if str(geometry.get("lod", "0")) == best:
            yield from _surfaces(geometry.get("boundaries"))


def _places(ring: list[Any], vertices: FloatArray, name: str) -> FloatArray:
    if not all(isinstance(index, int) and 0 <= index < len(vertices) for index in ring):
        raise WorldFileError(f"has an object {name[:40]!r} with a vertex that is not there")
    found: FloatArray = vertices[ring]
    return found


def _surfaces(boundaries: Any) -> Iterator[list[list[Any]]]:
    """Surfaces, each a list of rings of indices, of a MultiSurface, Solid or MultiSolid."""
    if not isinstance(boundaries, list) or not all(isinstance(each, list) for each in boundaries):
        raise WorldFileError("has boundaries that are not lists of rings")
    if boundaries and boundaries[0] and not isinstance(boundaries[0][0], list):
        yield boundaries
        return
    for each in boundaries:
        yield from _surfaces(each)


def _crs(metadata: Any) -> str | None:
    if not isinstance(metadata, dict):
        return None
    old = metadata.get("crs")  # before version 1.0
    named = metadata.get("referenceSystem") or (f"EPSG:{old.get('epsg')}" if isinstance(old, dict) else None)
    match = re.search(r"EPSG[:/]+(?:[\d.]*[:/])?(\d+)", str(named), re.IGNORECASE) if named else None
    return f"EPSG:{match[1]}" if match else None
