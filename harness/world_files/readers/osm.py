"""Buildings of OpenStreetMap: XML with the standard library, PBF with osmium (`wayproof[maps]`).

Buildings and their parts (`building:part`) are all taken, each with its own height: where they overlap the union is
solid, which is never less than the Simple 3D Buildings scheme has it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from harness.world_files.bounded import read_bytes, xml_events
from harness.world_files.parts import WGS84, Contents, Part, Reading, WorldFileError, counted
from harness.world_files.readers import limits

MAX_XML_BYTES: Final = 400_000_000
AREAS: Final = ("building", "building:part")


class _Collected:
    """Parts so far, and what has to be said of them."""

    def __init__(self, reading: Reading) -> None:
        self.parts: list[Part] = []
        self.reading = reading
        self.guessed = self.broken = 0

    def add(self, tags: dict[str, str], footprint: Any, name: str) -> None:
        if footprint is None or footprint.is_empty:
            self.broken += 1
            return
        part, guessed = limits.building(tags, footprint, self.reading, name)
        self.parts.append(part)
        self.guessed += guessed

    def contents(self) -> Contents:
        if not self.parts:
            raise WorldFileError("has no building; must be an extract of OpenStreetMap with some")
        notes = []
        if self.guessed:
            height_m = self.reading.default_height_m
            notes.append(
                f"{counted(self.guessed, 'building')} without height and levels taken as {height_m:g} m high"
                " (default_height_m)"
            )
        if self.broken:
            notes.append(f"{counted(self.broken, 'building')} whose outline is not whole passed over")
        return Contents("osm", WGS84, tuple(self.parts), notes=tuple(notes))


def read_xml(path: Path, reading: Reading) -> Contents:
    """Reads the buildings of an OpenStreetMap XML file.

    Raises:
        WorldFileError: it is not whole, or has no building.
    """
    places: dict[str, tuple[float, float]] = {}
    ways: dict[str, list[str]] = {}
    found = _Collected(reading)
    root = None
    for event, element in xml_events(read_bytes(path, MAX_XML_BYTES), ends_only=False):
        root = element if root is None else root
        if event == "start" or element.tag not in ("node", "way", "relation"):
            continue
        number = str(element.get("id"))
        if element.tag == "node":
            if element.get("visible") != "false":
                places[number] = _place(element)
        elif element.tag == "way":
            ways[number] = [str(nd.get("ref")) for nd in element.iter("nd")]
            tags = _tags(element)
            if _is_area(tags):
                found.add(tags, _polygons([_line(ways[number], places)], []), f"way {number}")
        else:
            tags = _tags(element)
            if _is_area(tags) and tags.get("type", "multipolygon") == "multipolygon":
                found.add(tags, _relation(element, ways, places), f"relation {number}")
        root.clear()  # what has been read is not kept
    return found.contents()


def _place(element: Any) -> tuple[float, float]:
    try:
        longitude, latitude = float(element.get("lon", "nan")), float(element.get("lat", "nan"))
    except ValueError as error:
        raise WorldFileError(f"has node {element.get('id')} whose lat or lon is no number") from error
    if not (abs(longitude) <= 180.0 and abs(latitude) <= 90.0):
        raise WorldFileError(
            f"has node {element.get('id')} at lat {latitude:g}, lon {longitude:g}; must be degrees"
        )
    return longitude, latitude


def _tags(element: Any) -> dict[str, str]:
    return {str(tag.get("k")): str(tag.get("v")) for tag in element.iter("tag")}


def _is_area(tags: dict[str, str]) -> bool:
    return any(tags.get(name, "no") != "no" for name in AREAS)


def _line(refs: Iterable[str], places: dict[str, tuple[float, float]]) -> list[tuple[float, float]]:
    return [places[ref] for ref in refs if ref in places]


def _relation(element: Any, ways: dict[str, list[str]], places: dict[str, tuple[float, float]]) -> Any:
    """Footprint of a multipolygon; None where ways of it are missing."""
    rings: dict[bool, list[list[tuple[float, float]]]] = {True: [], False: []}
    for member in element.iter("member"):
        ref = str(member.get("ref"))
        if member.get("type") != "way":
            continue
        if ref not in ways:  # cut off at the edge of the extract
            return None
        rings[member.get("role") != "inner"].append(_line(ways[ref], places))
    return _polygons(rings[True], rings[False])


def _polygons(outer: Sequence[list[tuple[float, float]]], inner: Sequence[list[tuple[float, float]]]) -> Any:
    """The area inside closed lines but outside others; lines may be pieces of rings. None where nothing closes."""
    import shapely

    def area(lines: Sequence[list[tuple[float, float]]]) -> Any:
        whole = [line for line in lines if len(line) >= 4 and line[0] == line[-1]]
        pieces = [line for line in lines if len(line) >= 2 and line[0] != line[-1]]
        shapes = [shapely.Polygon(line) for line in whole]
        if pieces:
            shapes += list(shapely.polygonize([shapely.LineString(line) for line in pieces]).geoms)
        valid = [shapely.make_valid(each, method="structure", keep_collapsed=False) for each in shapes]
        return shapely.union_all(valid) if len(valid) != 1 else valid[0]

    solid = area(outer)
    if solid.is_empty or solid.area == 0.0:
        return None
    return shapely.difference(solid, area(inner)) if inner else solid


def read_pbf(path: Path, reading: Reading) -> Contents:
    """Reads the buildings of an OpenStreetMap PBF file, with osmium.

    Raises:
        WorldFileError: osmium is not there, or the file is damaged or has no building.
    """
    try:
        import osmium
    except ImportError as error:
        raise WorldFileError(
            "is OpenStreetMap PBF, which osmium reads: pip install 'wayproof[maps]'"
        ) from error
    import shapely

    if path.stat().st_size > MAX_XML_BYTES:
        raise WorldFileError(
            f"is larger than {MAX_XML_BYTES // 10**6} MB; cut the area of interest out of it first"
        )
    found = _Collected(reading)
    factory = osmium.geom.WKBFactory()
    try:
        areas = osmium.FileProcessor(str(path)).with_areas(osmium.filter.KeyFilter(*AREAS))
        for each in areas.with_filter(osmium.filter.KeyFilter(*AREAS)):
            if not each.is_area():
                continue
            tags = {tag.k: tag.v for tag in each.tags}
            if not _is_area(tags):
                continue
            kind = "way" if each.from_way() else "relation"
            try:
                shape = shapely.from_wkb(factory.create_multipolygon(each))
            except (RuntimeError, ValueError):
                shape = None
            found.add(tags, shape, f"{kind} {each.orig_id()}")
    except (RuntimeError, ValueError, OSError, MemoryError) as error:
        raise WorldFileError(
            f"cannot be read as PBF ({' '.join(str(error).split())[:80]}); it may be torn"
        ) from error
    return found.contents()
