"""Files of OpenStreetMap: XML and the JSON of Overpass by the standard library, PBF by osmium (`wayproof[maps]`)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from harness.world_files.bounded import json_of, read_bytes, xml_tags
from harness.world_files.parts import Contents, Reading, WorldFileError
from harness.world_files.readers.osm_elements import (
    AREAS,
    FIRST_INLINE,
    POINTS,
    Collected,
    Elements,
    is_building,
)
from harness.world_files.readers.osm_relations import BUILDING, HEIGHT, Line, Member, Relations

MAX_BYTES: Final = 400_000_000
MOST_NUMBER: Final = 1 << 62


def read_xml(path: Path, reading: Reading) -> Contents:
    """Reads the buildings of an OpenStreetMap XML file, its elements in any order.

    Raises:
        WorldFileError: it is not whole, or has no building.
    """
    document = _Document()
    xml_tags(read_bytes(path, MAX_BYTES), document.begin)
    document.finish()
    return document.elements.contents(reading)


class _Document:
    """Tags of an OpenStreetMap XML file made into elements; a way ends where the next element begins."""

    def __init__(self) -> None:
        self.elements = Elements()
        self._kind, self._number = "", 0
        self._tags: dict[str, str] = {}
        self._refs: list[int] = []
        self._members: list[Member] = []
        self._inline = FIRST_INLINE

    def begin(self, tag: str, attributes: dict[str, str]) -> None:
        """An element begins; what stands in a way or relation belongs to that."""
        if tag == "nd":
            if "lat" in attributes:
                self._place_of_way(attributes)
            else:
                self._refs.append(_whole(tag, attributes, "ref"))
        elif tag == "tag":
            self._tags[attributes.get("k", "")] = attributes.get("v", "")
        elif tag == "member":
            self._finish_member()
            kind = attributes.get("type")
            if kind in ("way", "relation"):
                number = _whole(tag, attributes, "ref")
                self._members.append(Member(number, attributes.get("role", ""), kind == "way"))
        elif tag in ("node", "way", "relation"):
            if self._kind:
                self.finish()
            deleted = attributes.get("visible") == "false" or attributes.get("action") == "delete"
            self._number, self._kind = _whole(tag, attributes, "id"), "" if deleted else tag
            if tag == "node" and not deleted:
                self.elements.node(self._number, *_place(attributes))
            self._tags, self._refs, self._members = {}, [], []

    def finish(self) -> None:
        """The last element ends."""
        if self._kind == "node":
            if self._tags:  # most nodes are corners of ways, and have none
                self.elements.point(self._tags)
        elif self._kind == "way":
            self.elements.way(self._number, self._refs, self._tags)
        elif self._kind == "relation":
            self._finish_member()
            self.elements.relation(self._number, self._members, self._tags)
        self._kind = ""

    def _finish_member(self) -> None:
        """Overpass's `out geom` gives the line of a way as a member of a relation."""
        if self._members and self._refs:
            self.elements.way(self._members[-1].number, self._refs, {})
        self._refs = []

    def _place_of_way(self, attributes: dict[str, str]) -> None:
        """A node with its place in a way, as `out geom` has it; in a relation it has no number."""
        number = _whole("nd", attributes, "ref") if "ref" in attributes else self._inline
        self._inline -= 1
        self.elements.node(number, *_place(attributes))
        self._refs.append(number)


def _whole(tag: str, attributes: Mapping[str, str], name: str) -> int:
    try:
        number = int(attributes[name])
        if -MOST_NUMBER < number < MOST_NUMBER:
            return number
    except (KeyError, ValueError):
        pass
    raise WorldFileError(f"has a {tag} whose {name} is no number; must be OpenStreetMap XML")


def _place(attributes: Mapping[str, Any]) -> tuple[float, float]:
    try:
        longitude, latitude = float(attributes["lon"]), float(attributes["lat"])
    except (KeyError, TypeError, ValueError) as error:
        raise WorldFileError(f"has node {attributes.get('id')} whose lat or lon is no number") from error
    if -180.0 <= longitude <= 180.0 and -90.0 <= latitude <= 90.0:
        return longitude, latitude
    raise WorldFileError(
        f"has node {attributes.get('id')} at lat {latitude:g}, lon {longitude:g}; must be degrees"
    )


def read_json(path: Path, reading: Reading) -> Contents:
    """Reads the buildings of what Overpass answers as JSON (`out:json`), with nodes or with `out geom`.

    Raises:
        WorldFileError: it is not that, or has no building.
    """
    content = json_of(path)
    elements = content.get("elements") if isinstance(content, dict) else None
    if not isinstance(elements, list) or not all(isinstance(each, dict) for each in elements):
        raise WorldFileError("has no list of elements; must be an answer of Overpass")
    found = Elements()
    inline = FIRST_INLINE

    def refs_of(thing: Mapping[str, Any]) -> list[int]:
        nonlocal inline
        refs = []
        places = [each for each in thing.get("geometry") or () if isinstance(each, dict)]
        for each in places:
            inline -= 1
            found.node(inline, *_place(each))
            refs.append(inline)
        # A ring is told by its first node's coming again as its last.
        return refs or [int(each) for each in thing.get("nodes") or ()]

    try:
        for each in elements:
            kind, tags = each.get("type"), {str(k): str(v) for k, v in (each.get("tags") or {}).items()}
            if kind == "node":
                found.node(int(each["id"]), *_place(each))
                if tags:
                    found.point(tags)
            elif kind == "way":
                found.way(int(each["id"]), refs_of(each), tags)
            elif kind == "relation":
                members = [m for m in each.get("members") or () if m.get("type") in ("way", "relation")]
                for member in members:
                    if member.get("geometry"):
                        found.way(int(member["ref"]), refs_of(member), {})
                found.relation(
                    int(each["id"]),
                    [Member(int(m["ref"]), str(m.get("role") or ""), m["type"] == "way") for m in members],
                    tags,
                )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        if isinstance(error, WorldFileError):
            raise
        raise WorldFileError("has an element that is not whole; must be an answer of Overpass") from error
    return found.contents(reading)


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
    found = Collected(reading)
    try:
        relations = _pbf_relations(path)
        needed, taken = relations.ways(), set[int]()
        ways: dict[int, Line] = {}
        tags_of: dict[int, Mapping[str, str]] = {}
        points = osmium.filter.KeyFilter(*POINTS, HEIGHT)
        for each in osmium.FileProcessor(str(path), osmium.osm.NODE).with_filter(points):
            found.point({tag.k: tag.v for tag in each.tags})
        entities = osmium.osm.NODE | osmium.osm.WAY
        for each in osmium.FileProcessor(str(path), entities).with_locations():
            if not each.is_way() or not (
                each.id in needed or any(name in each.tags for name in (*AREAS, HEIGHT))
            ):
                continue
            line = [(node.lon, node.lat) for node in each.nodes if node.location.valid()]
            tags = {tag.k: tag.v for tag in each.tags}
            if each.id in needed:
                ways[each.id], tags_of[each.id] = line, tags
            if is_building(tags):
                taken.add(each.id)
                found.way(tags, line, f"way {each.id}")
            elif each.id not in needed:
                found.other(tags)
    except (RuntimeError, ValueError, OSError, MemoryError) as error:
        raise WorldFileError(
            f"cannot be read as PBF ({' '.join(str(error).split())[:80]}); it may be torn"
        ) from error
    found.areas(relations.areas(taken, tags_of), ways, relations)
    return found.contents()


def _pbf_relations(path: Path) -> Relations:
    """The relations that buildings need, and those with a height, by three passes: most relations are none of them."""
    import osmium

    relations = Relations()

    def keep(selection: Any) -> None:
        for each in osmium.FileProcessor(str(path), osmium.osm.RELATION).with_filter(selection):
            tags = {tag.k: tag.v for tag in each.tags}
            members = [Member(m.ref, m.role, m.type == "w") for m in each.members if m.type in ("w", "r")]
            relations.add(each.id, members, tags, is_building(tags))

    keep(osmium.filter.KeyFilter(*AREAS, HEIGHT))
    # Those of the first pass that are of this type come again, and replace themselves.
    keep(osmium.filter.TagFilter(("type", BUILDING)))
    if missing := relations.outlines_missing():
        keep(osmium.filter.IdFilter(missing))
    return relations
