"""Polygons of KML, plain or packed as KMZ."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import shapely

from harness.files.kml import Shape, read_kml
from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, read_bytes
from harness.world_files.parts import (
    NO_BOTTOM,
    NO_TOP,
    WGS84,
    Contents,
    Datum,
    Limit,
    Part,
    Reading,
    WorldFileError,
)
from harness.world_files.readers import limits

DATUMS: Final = {"absolute": Datum.SEA, "relativeToGround": Datum.GROUND}
"""What an altitude of KML is above, by its altitudeMode; clamped to the ground it means nothing."""
PLAIN: Final = ("Point", "LinearRing")
"""Shapes without an area; other elements that are passed over name other files."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a KML file, or of a KMZ archive with one.

    Each is solid from the ground up to its highest corner; on the ground it is solid at every altitude. Limits in its
    ExtendedData go before altitudes.
    """
    found = read_kml(read_bytes(path, MAX_TREE_BYTES), "", MAX_TREE_BYTES)
    notes: list[str] = []
    parts = tuple(_part(each, notes) for each in found.polygons if each.rings)
    flat = sum((part.bottom, part.top) == (NO_BOTTOM, NO_TOP) for part in parts)
    if flat:
        notes.append(f"{counted(flat, 'polygon')} on the ground taken as solid at every altitude")
    if len(parts) > flat:
        notes.append("a polygon in the air is taken as solid from the ground up to its highest corner")
    linked = sum(count for kind, count in found.others.items() if kind not in PLAIN)
    passed = len(found.lines) + sum(found.others[kind] for kind in PLAIN)
    if linked:
        notes.append(f"{counted(linked, 'image or link')} to other files passed over")
    if passed:
        notes.append(f"{counted(passed, 'point, line or wall')} passed over")
    return Contents("kml", reading.crs or WGS84, parts, notes=tuple(notes))


def _part(shape: Shape, notes: list[str]) -> Part:
    """The part that a polygon of KML is."""
    rings = [[(longitude, latitude) for latitude, longitude, _ in ring] for ring in shape.rings]
    footprint, name, datum = _polygon(rings, shape.name), shape.name[:40], DATUMS.get(shape.mode)
    if limits.has_limits(shape.data):
        return Part(footprint, *limits.limits(shape.data, notes, name), name=name)
    if datum is None:
        return Part(footprint, name=name)
    top_m = max(altitude or 0.0 for ring in shape.rings for *_, altitude in ring)
    return Part(footprint, top=Limit(top_m, datum), name=name)


def _polygon(rings: list[list[tuple[float, float]]], name: str) -> Any:
    try:
        return shapely.Polygon(rings[0], [ring for ring in rings[1:] if ring])
    except ValueError as error:  # of one or two corners
        raise WorldFileError(f"{name}: has a ring that encloses no area ({error})") from error
