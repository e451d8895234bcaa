"""Buildings of OpenStreetMap: XML with the standard library, PBF with osmium (`wayproof[maps]`).

Buildings and their parts (`building:part`) are all taken, each with its own height: where they overlap the union is
solid, which is never less than the Simple 3D Buildings scheme has it. Outlines that the edge of an extract has cut
open are closed by a straight line.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.world_files.bounded import read_bytes, xml_events
from harness.world_files.parts import WGS84, Contents, Part, Reading, WorldFileError, counted
from harness.world_files.readers import limits, rings

MAX_BYTES: Final = 400_000_000
AREAS: Final = ("building", "building:part")
MULTIPOLYGON: Final = "multipolygon"

Line = list[tuple[float, float]]
"""Longitude and latitude of the nodes of a way that are known."""
Member = tuple[int, bool]
"""Number of a way, and whether it is an inner ring."""


class _Collected:
    """Parts so far, and what has to be said of them."""

    def __init__(self, reading: Reading) -> None:
        self.parts: list[Part] = []
        self.reading = reading
        self._rings: list[tuple[Mapping[str, str], Line, str]] = []
        self.guessed = self.broken = self.closed = 0

    def way(self, tags: Mapping[str, str], line: Line, name: str) -> None:
        """A building that is one way; those that are whole rings are made all at once."""
        if len(line) >= 4 and line[0] == line[-1]:
            self._rings.append((tags, line, name))
        else:
            self._add(tags, [line], [], name)

    def relation(
        self, tags: Mapping[str, str], members: Iterable[Member], ways: Mapping[int, Line], name: str
    ) -> None:
        """A building of several ways, as far as they are in the file."""
        there = [(ways[number], inner) for number, inner in members if number in ways]
        self._add(tags, [w for w, inner in there if not inner], [w for w, inner in there if inner], name)

    def _add(self, tags: Mapping[str, str], outer: Sequence[Line], inner: Sequence[Line], name: str) -> None:
        import shapely

        solid, closed = _area(outer)
        if solid is None:
            self.broken += 1
            return
        self.closed += closed
        hollow, _ = _area(inner) if inner else (None, False)
        footprint = solid if hollow is None else shapely.difference(solid, hollow)
        part, guessed = limits.building(tags, footprint, self.reading, name)
        self.parts.append(part)
        self.guessed += guessed

    def contents(self) -> Contents:
        """What was found.

        Raises:
            WorldFileError: nothing was.
        """
        shapes = rings.shapes_of([[[np.array(line)]] for _, line, _ in self._rings])
        for (tags, _, name), shape in zip(self._rings, shapes, strict=True):
            if shape is None:
                self.broken += 1
                continue
            part, guessed = limits.building(tags, shape, self.reading, name)
            self.parts.append(part)
            self.guessed += guessed
        if not self.parts:
            raise WorldFileError("has no building; must be an extract of OpenStreetMap with some")
        notes = []
        if self.guessed:
            height_m = self.reading.default_height_m
            notes.append(
                f"{counted(self.guessed, 'building')} without height and levels taken as {height_m:g} m high"
                " (default_height_m)"
            )
        if self.closed:
            notes.append(f"{counted(self.closed, 'building')} cut open by the edge of the extract closed")
        if self.broken:
            notes.append(f"{counted(self.broken, 'building')} whose outline is not there passed over")
        return Contents("osm", WGS84, tuple(self.parts), notes=tuple(notes))


def read_xml(path: Path, reading: Reading) -> Contents:
    """Reads the buildings of an OpenStreetMap XML file.

    Raises:
        WorldFileError: it is not whole, or has no building.
    """
    places: dict[int, tuple[float, float]] = {}
    ways: dict[int, Line] = {}
    found = _Collected(reading)
    root = None
    for event, element in xml_events(read_bytes(path, MAX_BYTES), ends_only=False):
        root = element if root is None else root
        if event == "start" or element.tag not in ("node", "way", "relation"):
            continue
        number = _number(element, "id")
        if element.tag == "node":
            if element.get("visible") != "false":
                places[number] = _place(element)
        elif element.tag == "way":
            refs = [_number(nd, "ref") for nd in element.iter("nd")]
            ways[number] = [places[ref] for ref in refs if ref in places]
            if _is_building(tags := _tags(element)):
                found.way(tags, ways[number], f"way {number}")
        elif _is_building(tags := _tags(element)) and tags.get("type", MULTIPOLYGON) == MULTIPOLYGON:
            inner = [
                (_number(member, "ref"), member.get("role") == "inner")
                for member in element.iter("member")
                if member.get("type") == "way"
            ]
            found.relation(tags, inner, ways, f"relation {number}")
        root.clear()  # what has been read is not kept
    return found.contents()


def _number(element: Any, name: str) -> int:
    try:
        return int(element.get(name, ""))
    except ValueError as error:
        raise WorldFileError(
            f"has a {element.tag} whose {name} is no number; must be OpenStreetMap XML"
        ) from error


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


def _is_building(tags: Mapping[str, str]) -> bool:
    return any(tags.get(name, "no") != "no" for name in AREAS)


def _area(lines: Sequence[Line]) -> tuple[Any, bool]:
    """The area inside lines that are rings or pieces of them, None without; and whether any had to be closed."""
    import shapely

    closed_lines = [line for line in lines if len(line) >= 4 and line[0] == line[-1]]
    pieces = [shapely.LineString(line) for line in lines if len(line) >= 2 and line[0] != line[-1]]
    closed = False
    if pieces:
        joined = shapely.line_merge(shapely.MultiLineString(pieces))
        for chain in shapely.get_parts(joined):
            corners = list(chain.coords)
            if len(corners) >= 3:
                closed |= corners[0] != corners[-1]
                closed_lines.append(corners)
    shapes = [shapely.Polygon(line) for line in closed_lines]
    valid = [shapely.make_valid(each, method="structure", keep_collapsed=False) for each in shapes]
    whole = valid[0] if len(valid) == 1 else shapely.union_all(valid)
    return (None if whole.is_empty or whole.area == 0.0 else whole), closed


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
    if path.stat().st_size > MAX_BYTES:
        raise WorldFileError(
            f"is larger than {MAX_BYTES // 10**6} MB; cut the area of interest out of it first"
        )
    found = _Collected(reading)
    buildings = osmium.filter.KeyFilter(*AREAS)
    try:
        wanted: dict[int, tuple[dict[str, str], list[Member]]] = {}
        for each in osmium.FileProcessor(str(path), osmium.osm.RELATION).with_filter(buildings):
            tags = {tag.k: tag.v for tag in each.tags}
            if _is_building(tags) and tags.get("type", MULTIPOLYGON) == MULTIPOLYGON:
                wanted[each.id] = tags, [(m.ref, m.role == "inner") for m in each.members if m.type == "w"]
        needed = {number for _, members in wanted.values() for number, _ in members}
        ways: dict[int, Line] = {}
        entities = osmium.osm.NODE | osmium.osm.WAY
        for each in osmium.FileProcessor(str(path), entities).with_locations():
            if not each.is_way() or not (each.id in needed or any(name in each.tags for name in AREAS)):
                continue
            line = [(node.lon, node.lat) for node in each.nodes if node.location.valid()]
            if each.id in needed:
                ways[each.id] = line
            if _is_building(tags := {tag.k: tag.v for tag in each.tags}):
                found.way(tags, line, f"way {each.id}")
    except (RuntimeError, ValueError, OSError, MemoryError) as error:
        raise WorldFileError(
            f"cannot be read as PBF ({' '.join(str(error).split())[:80]}); it may be torn"
        ) from error
    for number, (tags, members) in wanted.items():
        found.relation(tags, members, ways, f"relation {number}")
    return found.contents()
