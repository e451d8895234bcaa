"""Buildings from CityJSON 1.0 to 2.0: each object between its lowest and its highest vertex.

Heights are those of the file's vertical datum, taken as mean sea level.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.files.wording import counted
from harness.world_files.bounded import json_of
from harness.world_files.parts import BoolArray, Contents, FloatArray, Limit, Part, Reading, WorldFileError
from harness.world_files.plane import flat_crs, has_heights, unit_that_is_no_metre, vertical_unit_m
from harness.world_files.readers import limits, rings
from harness.world_files.readers.lengths import metres_of

SOLID: Final = ("Building", "Bridge", "OtherConstruction")
"""Beginnings of the types that are taken."""
DEEPEST: Final = 5
"""A ring's indices lie no deeper than this in `boundaries`."""
AREAS: Final = ("Surface", "Solid")
"""Ends of the types of geometry that are taken; points and lines are not solid."""
INSTANCE: Final = "GeometryInstance"
"""A geometry that is a template of the file, put somewhere."""
MOST_NAMED: Final = 4
ROOFS: Final = ("b3_h_dak_max", "b3_h_nok", "h_dak_max")
"""Attributes of 3DBAG with the height of the roof above the datum, for buildings whose geometry is flat."""
LOW_M: Final = 0.1
"""An object that is lower is a footprint."""
FLAT: Final = 1e-9
"""A ring is a line seen from above where its bends, as areas, are less than this share of its length squared."""

IntArray = NDArray[np.int64]
Ring = list[int]
"""Indices of vertices."""
Surface = list[Ring]
"""Its outline, then its holes."""


class _Object(NamedTuple):
    """An object of a file: its vertices are some of all."""

    name: str
    begin: int
    end: int
    surfaces: list[Surface]
    attributes: dict[str, Any]
    told: bool  # by its parts, or as a template: what it is without a shape of its own


def read(path: Path, reading: Reading) -> Contents:
    """Reads the buildings and bridges of a CityJSON file, or of a sequence of them (CityJSONSeq), a feature a line.

    A building that is flat, as those of level of detail 0 are, is as high as its attributes say.

    Raises:
        WorldFileError: it is not CityJSON, or has nothing solid.
    """
    contents = json_of(path, lines=True)
    crs = reading.crs or _crs(contents[0])
    objects, places, passed = _objects(contents)
    contents.clear()  # hundreds of megabytes, perhaps
    notes: list[str] = []
    if crs is not None and _latitude_first(crs, places):
        places = places[:, [1, 0, 2]]
        notes.append("its latitudes are taken to come first")
    if crs is not None:
        places[:, 2] *= _height_unit_m(crs, notes)
    parts = _parts(objects, places, reading, notes)
    if not parts:
        raise WorldFileError("has no building with a shape; must have some")
    if passed:
        more = " and others" if len(passed) > MOST_NAMED else ""
        named = ", ".join(f"{number} {kind}" for kind, number in passed.most_common(MOST_NAMED))
        notes.append(f"passed over: {named}{more}")
    if crs is None:
        notes.append("names no coordinate reference system: its metres are taken as they are (crs)")
    return Contents("cityjson", crs, tuple(parts), notes=tuple(notes))


def _objects(contents: Sequence[Any]) -> tuple[list[_Object], FloatArray, Counter[str]]:
    """Objects that are solid, the vertices of all, and how many of which other types there are.

    Args:
        contents: the file, or the lines of a sequence: metadata first, then features with vertices of their own.
    """
    objects: list[_Object] = []
    passed = Counter[str]()
    vertices, begin = [], 0
    for content in contents:
        found = content.get("CityObjects") if isinstance(content, dict) else None
        if not isinstance(found, dict):
            raise WorldFileError("has no CityObjects; must be CityJSON")
        vertices.append(_vertices(content, contents[0].get("transform")))
        end = begin + len(vertices[-1])
        for name, each in found.items():
            kind = str(each.get("type", "?")) if isinstance(each, dict) else "?"
            if kind.startswith(SOLID):
                instances = sum(each["type"] == INSTANCE for each in _geometries(each))
                passed[INSTANCE] += instances
                told = bool(each.get("children") or instances)
                objects.append(_Object(name, begin, end, _surfaces_of(each), _attributes(each), told))
            else:
                passed[kind] += 1
        begin = end
    return objects, np.concatenate(vertices), +passed


def _height_unit_m(crs: str, notes: list[str]) -> float:
    """Length of the unit of heights in metres: that of the vertical system, else that of the plane."""
    if has_heights(crs):
        unit_m = vertical_unit_m(crs)
        if unit_m != 1.0:
            notes.append(f"its heights are its numbers times {unit_m:.6g}, as it says")
        return unit_m
    name = unit_that_is_no_metre(crs)
    if not name:
        return 1.0
    notes.append(f"its heights name no unit: taken in {name}, as its plane")
    return float(flat_crs(crs).axis_info[0].unit_conversion_factor)


def _latitude_first(crs: str, places: FloatArray) -> bool:
    """Whether places can only be degrees with the latitude before the longitude, as some programs write them."""
    if not len(places) or not flat_crs(crs).is_geographic:
        return False
    return bool(np.abs(places[:, 1]).max() > 90.0 >= np.abs(places[:, 0]).max())


def _vertices(content: dict[str, Any], common: Any) -> FloatArray:
    """(n, 3) x, y, z.

    Args:
        content: has them, and how they are scaled unless all of a sequence are scaled alike.
        common: how all are.
    """
    try:
        vertices = np.array(content.get("vertices", []), dtype=np.float64).reshape(-1, 3)
        how = content.get("transform", common)
        if how is not None:
            vertices = vertices * np.array(how["scale"], dtype=np.float64) + np.array(
                how["translate"], np.float64
            )
    except (TypeError, ValueError, KeyError) as error:
        raise WorldFileError("has vertices or a transform that are not numbers in threes") from error
    if not np.isfinite(vertices).all():
        raise WorldFileError("has vertices that are not finite")
    return vertices


def _attributes(thing: dict[str, Any]) -> dict[str, Any]:
    attributes = thing.get("attributes")
    return attributes if isinstance(attributes, dict) else {}


def _geometries(thing: dict[str, Any]) -> list[dict[str, Any]]:
    """Those of an object that say of what type they are."""
    return [
        each
        for each in thing.get("geometry") or ()
        if isinstance(each, dict) and isinstance(each.get("type"), str)
    ]


def _surfaces_of(thing: dict[str, Any]) -> list[Surface]:
    """Surfaces of an object at its highest level of detail."""
    shapes = [each for each in _geometries(thing) if "boundaries" in each and each["type"].endswith(AREAS)]
    best = max((str(each.get("lod", "0")) for each in shapes), default="")
    return [
        surface
        for shape in shapes
        if str(shape.get("lod", "0")) == best
        for surface in _surfaces(shape["boundaries"], 0)
    ]


def _parts(
    objects: Sequence[_Object], vertices: FloatArray, reading: Reading, notes: list[str]
) -> list[Part]:
    """Objects: the union of the surfaces of each seen from above, between its lowest and its highest vertex.

    Args:
        objects: all of them.
        vertices: (n, 3) x, y, z.
        reading: has the height of what has none.
        notes: are added to.
    """
    every = [ring for each in objects for surface in each.surfaces for ring in surface]
    if not every:
        return []
    counts = np.array([len(ring) for ring in every])
    ends = np.cumsum(counts)
    owners = np.repeat(
        np.repeat(np.arange(len(objects)), [sum(map(len, each.surfaces)) for each in objects]), counts
    )
    places = _places(every, owners, objects, vertices)
    low, high = np.full(len(objects), np.inf), np.full(len(objects), -np.inf)
    np.minimum.at(low, owners, places[:, 2])
    np.maximum.at(high, owners, places[:, 2])
    flat = np.split(places[:, :2], ends[:-1])
    wall = _are_walls(places[:, :2], counts).tolist()
    batch: list[list[list[FloatArray]]] = []
    at = 0
    for each in objects:
        batch.append([])
        for surface in each.surfaces:
            if not wall[at]:
                batch[-1].append(flat[at : at + len(surface)])
            at += len(surface)
    parts: list[Part] = []
    doubts = limits.Doubts()
    shapeless = 0
    for each, footprint, bottom, top in zip(
        objects, rings.shapes_of(batch), low.tolist(), high.tolist(), strict=True
    ):
        if footprint is None:
            shapeless += not each.told
        else:
            if top - bottom < LOW_M:
                roof_m = max(metres_of(each.attributes.get(key)) or -math.inf for key in ROOFS)
                if roof_m > bottom:
                    top = roof_m
                else:
                    high_m = limits.building(each.attributes, footprint, reading, doubts).top.height_m
                    top = bottom + high_m
            parts.append(Part(footprint, Limit(bottom), Limit(top), name=each.name[:40]))
    notes += doubts.notes(reading)
    if shapeless:
        notes.append(f"{counted(shapeless, 'building')} without a shape passed over")
    return parts


def _places(
    every: Sequence[Ring],
    owners: IntArray,
    objects: Sequence[_Object],
    vertices: FloatArray,
) -> FloatArray:
    """(k, 3) vertices of all rings, one after the other.

    Args:
        every: the rings.
        owners: (k,) the object of each vertex.
        objects: by whose name a vertex is told that is not there.
        vertices: (n, 3) x, y, z.
    """
    indices = list(chain.from_iterable(every))
    numbers = np.array([each if _is_index(each) else -1 for each in indices], dtype=np.int64)
    from_, to = (np.array([each[k] for each in objects], dtype=np.int64)[owners] for k in (1, 2))
    bad = (numbers < 0) | (numbers >= to - from_)
    if bad.any():
        name = objects[int(owners[int(bad.argmax())])].name
        raise WorldFileError(f"has an object {name[:40]!r} with a vertex that is not there")
    found: FloatArray = vertices[numbers + from_]
    return found


def _is_index(value: Any) -> bool:
    return isinstance(value, int) and 0 <= value < 1 << 40


def _are_walls(places: FloatArray, counts: IntArray) -> BoolArray:
    """Which of some rings are lines seen from above.

    Args:
        places: (k, 2) of all rings, one after the other.
        counts: (r,) places of each.
    """
    begins = np.cumsum(counts) - counts
    after = np.arange(1, len(places) + 1)
    last = (begins + counts - 1)[counts > 0]
    after[last] = begins[counts > 0]
    edge = places[after] - places
    bend = np.abs(edge[:, 0] * edge[after, 1] - edge[:, 1] * edge[after, 0])
    length = np.hypot(edge[:, 0], edge[:, 1])
    ring = np.repeat(np.arange(len(counts)), counts)
    bends, lengths = (np.bincount(ring, each, len(counts)) for each in (bend, length))
    walls: BoolArray = bends <= FLAT * lengths**2
    return walls


def _surfaces(boundaries: Any, depth: int) -> Iterator[Surface]:
    """Surfaces, each a list of rings of indices, of a MultiSurface, Solid or MultiSolid."""
    if not isinstance(boundaries, list) or depth > DEEPEST:
        raise WorldFileError("has boundaries that are not lists of rings")
    if boundaries and isinstance(boundaries[0], list) and boundaries[0] and isinstance(boundaries[0][0], int):
        yield boundaries
        return
    for each in boundaries:
        if isinstance(each, list) and each:
            yield from _surfaces(each, depth + 1)


def _crs(content: Any) -> str | None:
    metadata = content.get("metadata") if isinstance(content, dict) else None
    if not isinstance(metadata, dict):
        return None
    old = metadata.get("crs")  # before version 1.0
    named = metadata.get("referenceSystem") or (f"EPSG:{old.get('epsg')}" if isinstance(old, dict) else None)
    match = re.search(r"EPSG[:/]+(?:[\d.]*[:/])?(\d+)", str(named), re.IGNORECASE) if named else None
    return f"EPSG:{match[1]}" if match else None
