"""Buildings from CityJSON 1.0 to 2.0: each object between its lowest and its highest vertex.

Heights are those of the file's vertical datum, taken as mean sea level.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.world_files.bounded import json_of
from harness.world_files.parts import Contents, FloatArray, Limit, Part, Reading, WorldFileError

SOLID: Final = ("Building", "Bridge", "OtherConstruction")
"""Beginnings of the types that are taken."""
DEEPEST: Final = 5
"""A ring's indices lie no deeper than this in `boundaries`."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads the buildings and bridges of a CityJSON file.

    Raises:
        WorldFileError: it is not CityJSON, or has nothing solid.
    """
    content = json_of(path)
    objects = content.get("CityObjects") if isinstance(content, dict) else None
    if not isinstance(objects, dict):
        raise WorldFileError("has no CityObjects; must be CityJSON")
    vertices = _vertices(content)
    parts, passed = [], Counter[str]()
    for name, each in objects.items():
        kind = str(each.get("type", "?")) if isinstance(each, dict) else "?"
        if not kind.startswith(SOLID):
            passed[kind] += 1
            continue
        part = _part(name, each, vertices)
        if part is not None:
            parts.append(part)
    if not parts:
        raise WorldFileError("has no building with a shape; must have some")
    notes = []
    if passed:
        notes.append("passed over: " + ", ".join(f"{count} {kind}" for kind, count in passed.most_common(4)))
    crs = reading.crs or _crs(content)
    if crs is None:
        notes.append("names no coordinate reference system: its metres are taken as they are (crs)")
    return Contents("cityjson", crs, tuple(parts), notes=tuple(notes))


def _vertices(content: dict[str, Any]) -> FloatArray:
    try:
        vertices = np.array(content.get("vertices", []), dtype=np.float64).reshape(-1, 3)
        how = content.get("transform")
        if how is not None:
            vertices = vertices * np.array(how["scale"], dtype=np.float64) + np.array(
                how["translate"], np.float64
            )
    except (TypeError, ValueError, KeyError) as error:
        raise WorldFileError("has vertices or a transform that are not numbers in threes") from error
    if not np.isfinite(vertices).all():
        raise WorldFileError("has vertices that are not finite")
    return vertices


def _part(name: str, thing: dict[str, Any], vertices: FloatArray) -> Part | None:
    """One object: the union of its surfaces seen from above; None where it has none."""
    import shapely

    shapes = [each for each in thing.get("geometry") or () if isinstance(each, dict) and "boundaries" in each]
    if not shapes:
        return None
    best = max(str(each.get("lod", "0")) for each in shapes)
    surfaces, heights = [], []
    for shape in (each for each in shapes if str(each.get("lod", "0")) == best):
        for surface in _surfaces(shape["boundaries"], 0):
            try:
                rings = [vertices[np.array(ring, dtype=np.int64)] for ring in surface]
            except (IndexError, TypeError, ValueError, OverflowError) as error:
                raise WorldFileError(
                    f"has an object {name[:40]!r} with a vertex that is not there"
                ) from error
            heights += [rings[0][:, 2]]
            if len(rings[0]) >= 3:
                surfaces.append(
                    shapely.Polygon(rings[0][:, :2], [r[:, :2] for r in rings[1:] if len(r) >= 3])
                )
    if not surfaces:
        return None
    seen = shapely.make_valid(np.array(surfaces), method="structure", keep_collapsed=False)
    footprint = shapely.union_all(seen[shapely.area(seen) > 1e-6])
    if footprint.is_empty:
        return None
    z = np.concatenate(heights)
    return Part(footprint, Limit(float(z.min())), Limit(float(z.max())), name=name[:40])


def _surfaces(boundaries: Any, depth: int) -> Iterator[list[list[int]]]:
    """Surfaces, each a list of rings of indices, of a MultiSurface, Solid or MultiSolid."""
    if not isinstance(boundaries, list) or depth > DEEPEST:
        raise WorldFileError("has boundaries that are not lists of rings")
    if boundaries and isinstance(boundaries[0], list) and boundaries[0] and isinstance(boundaries[0][0], int):
        yield boundaries
        return
    for each in boundaries:
        if isinstance(each, list) and each:
            yield from _surfaces(each, depth + 1)


def _crs(content: dict[str, Any]) -> str | None:
    metadata = content.get("metadata")
    named = metadata.get("referenceSystem") if isinstance(metadata, dict) else None
    match = re.search(r"EPSG[:/]+(?:[\d.]*[:/])?(\d+)", str(named), re.IGNORECASE) if named else None
    return f"EPSG:{match[1]}" if match else None
