"""Polygons of KML and KMZ: each from the ground up to its altitude, or solid at every altitude where it has none.

OGC KML 2.3: `altitudeMode` says what the altitude of a coordinate is counted from; clamped to the ground it means
nothing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from harness.files.kmz import MAIN_KML, further_kml
from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, read_bytes, unzipped, xml_events
from harness.world_files.parts import (
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
from harness.world_files.readers import limits, rings

DATUMS: Final = {"absolute": Datum.SEA, "relativeToGround": Datum.GROUND}
BOUNDARIES: Final = ("outerBoundaryIs", "innerBoundaryIs")
LINKED: Final = ("NetworkLink", "GroundOverlay", "ScreenOverlay", "PhotoOverlay")
PASSED: Final = ("Point", "LineString", "Model", "Track", "MultiTrack")
_COMMA: Final = re.compile(r"\s*,\s*")


def read(path: Path, reading: Reading) -> Contents:
    """Reads the polygons of a KML or KMZ file; limits in its ExtendedData go before altitudes.

    Raises:
        WorldFileError: it is not whole, or has no polygon.
    """
    data, others = read_bytes(path, MAX_TREE_BYTES), 0
    if data[:2] == b"PK":
        _, data, others = unzipped(data, ".kml", MAX_TREE_BYTES, MAIN_KML)
    notes = [further_kml(others)] if others else []
    parts: list[Part] = []
    passed = flat = linked = 0
    for _, element in xml_events(data):
        linked += _name(element) in LINKED
        if _name(element) != "Placemark":
            continue
        tags = _tags(element)
        lone = sum(_name(each) == "LinearRing" for each in element.iter())
        lone -= sum(_name(each) in BOUNDARIES for each in element.iter())
        passed += max(lone, 0)
        for each in element.iter():
            passed += _name(each) in PASSED
            if _name(each) != "Polygon":
                continue
            found = _polygon(each, tags, notes)
            if found is None:
                passed += 1
                continue
            part, is_flat = found
            flat += is_flat
            parts.append(part)
        element.clear()
    if not parts:
        raise WorldFileError("has no polygon; must be KML with some")
    if flat:
        notes.append(f"{counted(flat, 'polygon')} on the ground taken as solid at every altitude")
    if len(parts) > flat:
        notes.append(
            "a polygon in the air, its sides too, is taken as solid from the ground up to its highest corner"
        )
    if linked:
        notes.append(f"{counted(linked, 'image or link')} to other files passed over")
    if passed:
        notes.append(f"{counted(passed, 'point, line or wall')} passed over")
    return Contents("kml", WGS84, tuple(parts), notes=tuple(notes))


def _name(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _text(element: ElementTree.Element, name: str) -> str:
    return next(((each.text or "").strip() for each in element.iter() if _name(each) == name), "")


def _tags(placemark: ElementTree.Element) -> dict[str, Any]:
    tags: dict[str, Any] = {"name": _text(placemark, "name")[:40]}
    for each in placemark.iter():
        if _name(each) == "SimpleData":
            tags[str(each.get("name"))] = (each.text or "").strip()
        elif _name(each) == "Data":
            tags[str(each.get("name"))] = _text(each, "value")
    return tags


def _polygon(
    element: ElementTree.Element, tags: dict[str, Any], notes: list[str]
) -> tuple[Part, bool] | None:
    """The part, and whether it has no height; None where it has no area."""
    import shapely

    outer, inner = _rings(element, "outerBoundaryIs"), _rings(element, "innerBoundaryIs")
    if not outer:
        return None
    about = float(outer[0][0, 0])
    shell, *holes = (rings.short_ring(each[:, :2], about) for each in (outer[0], *inner))
    shape = shapely.Polygon(shell, holes)
    shape = shapely.make_valid(shape, method="structure", keep_collapsed=False)
    if shape.is_empty or shape.area == 0.0:
        return None
    name = str(tags["name"])
    if limits.has_limits(tags):
        return Part(shape, *limits.limits(tags, notes, name), name=name), False
    datum = DATUMS.get(_text(element, "altitudeMode"))
    top_m = float(outer[0][:, 2].max()) + _offset_m(element)
    if datum is None:
        return Part(shape, NO_BOTTOM, NO_TOP, name=name), True
    return Part(shape, NO_BOTTOM, Limit(top_m, datum), name=name), False


def _offset_m(element: ElementTree.Element) -> float:
    """How far a polygon is lifted as a whole: its gx:altitudeOffset."""
    offset = _text(element, "altitudeOffset")
    try:
        by_m = float(offset or 0.0)
    except ValueError:
        by_m = math.nan
    if not math.isfinite(by_m):
        raise WorldFileError(f"has the altitudeOffset {offset[:20]!r}; must be metres")
    return by_m


def _rings(element: ElementTree.Element, boundary: str) -> Sequence[FloatArray]:
    """(k, 3) longitude, latitude and altitude of each ring of a kind that has at least three places."""
    found = []
    for each in element.iter():
        if _name(each) != boundary:
            continue
        words = _COMMA.sub(",", _text(each, "coordinates")).split()
        try:
            numbers = [[float(part) for part in word.split(",")] for word in words]
            places = np.array([(*row, 0.0)[:3] for row in numbers], dtype=np.float64).reshape(-1, 3)
        except ValueError as error:
            raise WorldFileError("has coordinates that are not longitude,latitude[,altitude]") from error
        if not np.isfinite(places).all() or (np.abs(places[:, :2]) > (360.0, 90.0)).any():
            raise WorldFileError("has coordinates that are no degrees")
        if len({tuple(place) for place in places[:, :2].tolist()}) >= 3:
            found.append(places)
    return found
