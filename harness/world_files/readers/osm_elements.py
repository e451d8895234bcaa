"""Buildings of OpenStreetMap from nodes, ways and relations in any order.

Buildings and their parts (`building:part`), chimneys, towers and tanks (`man_made`) are all taken, each with its own
height: where they overlap the union is solid, which is never less than the Simple 3D Buildings scheme has it. Outlines
that the edge of an extract has cut open are closed by a straight line.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from harness.files.wording import counted
from harness.world_files.parts import WGS84, BoolArray, Contents, FloatArray, Part, Reading, WorldFileError
from harness.world_files.readers import limits, rings
from harness.world_files.readers.lengths import lengths_of
from harness.world_files.readers.osm_relations import HEIGHT, Area, Line, Member, Relations

AREAS: Final = ("building", "building:part", "man_made")
TALL: Final = frozenset(
    (
        "chimney",
        "communications_tower",
        "cooling_tower",
        "gasometer",
        "mast",
        "silo",
        "storage_tank",
        "tower",
        "water_tower",
    )
)
"""Of `man_made`, what stands up like a building; piers, pipelines and the like do not."""
POINTS: Final = ("building", "man_made", "power")
"""What tags of a node have that may be something tall; it has no outline."""
ENTRANCE: Final = "entrance"
"""Of `building`, a door."""


class _Building(NamedTuple):
    """A building that was found.

    Attributes:
        tags: of it.
        name: for messages.
        outer: rings of its outline.
        inner: rings of its holes.
        closed: a ring of its outline was open.
    """

    tags: Mapping[str, str]
    name: str
    outer: Sequence[Line]
    inner: Sequence[Line] = ()
    closed: bool = False


class Collected:
    """Parts so far, and what has to be said of them."""

    def __init__(self, reading: Reading) -> None:
        self.parts: list[Part] = []
        self.reading = reading
        self._ways: list[_Building] = []
        self._areas: list[_Building] = []
        self.doubts = limits.Doubts()
        self.broken = self.closed = 0
        self._others: Mapping[str, int] = {}
        self._high: list[float] = []  # heights of what is no building
        self._high_kinds = Counter[str]()  # what of it are ways, relations and points
        self._points: list[float] = []  # heights of what has no outline, 0 where none is known

    def point(self, tags: Mapping[str, str]) -> None:
        """A node with tags; what is tall and has no outline is counted, and what else says how high it is."""
        if is_tall(tags):
            self._points.append(_height_m(tags))
        else:
            self.other(tags, "point")

    def other(self, tags: Mapping[str, str], kind: str = "way") -> None:
        """A way, a relation or a point that is no building; one that says how high it is is counted."""
        height_m = _height_m(tags)
        if height_m > 0.0:
            self._high.append(height_m)
            self._high_kinds[kind] += 1

    def way(self, tags: Mapping[str, str], line: Line, name: str) -> None:
        """A building that is one way."""
        if _is_ring(line):
            self._ways.append(_Building(tags, name, [line]))
        else:
            self._add(tags, [line], [], name)

    def areas(self, areas: Iterable[Area], ways: Mapping[int, Line], relations: Relations) -> None:
        """Buildings of several ways, as far as they are in the file; other relations are counted."""
        for tags, outer, inner, name in areas:
            solid, hollow = ([ways[each] for each in numbers if each in ways] for numbers in (outer, inner))
            self._add(tags, solid, hollow, name)
        self._others = relations.others
        for tags in relations.high():
            self.other(tags, "relation")

    def _add(self, tags: Mapping[str, str], outer: Sequence[Line], inner: Sequence[Line], name: str) -> None:
        """A building of several ways, or of one that is open."""
        solid, closed = _rings(outer)
        hollow, _ = _rings(inner)
        self._areas.append(_Building(tags, name, solid, hollow, closed))

    def contents(self) -> Contents:
        """What was found.

        Raises:
            WorldFileError: nothing was.
        """
        lines = [[[np.array(each.outer[0])]] for each in self._ways]
        for several, shapes in (
            (self._areas, _areas_of(self._areas)),
            (self._ways, rings.shapes_of(lines, degrees=True)),
        ):
            for each, shape in zip(several, shapes, strict=True):
                if shape is None:
                    self.broken += 1
                    continue
                self.closed += each.closed
                self.parts.append(limits.building(each.tags, shape, self.reading, self.doubts, each.name))
        if not self.parts:
            raise WorldFileError("has no building; must be an extract of OpenStreetMap with some")
        notes = self.doubts.notes(self.reading)
        if self.closed:
            notes.append(f"{counted(self.closed, 'building')} cut open by the edge of the extract closed")
        if self.broken:
            notes.append(f"{counted(self.broken, 'building')} whose outline is not there passed over")
        if self._others:
            types = ", ".join(sorted(self._others))
            many = counted(sum(self._others.values()), "relation")
            notes.append(f"{many} of buildings that is no area passed over (type {types})")
        if self._high:
            many = " and ".join(counted(count, kind) for kind, count in self._high_kinds.items())
            verb = "is" if len(self._high) == 1 else "are"
            notes.append(
                f"{many} with a height that {verb} no building passed over, the highest {max(self._high):g} m"
            )
        if self._points:
            highest_m = max(self._points)
            told = f", the highest {highest_m:g} m" if highest_m > 0.0 else ""
            many = counted(len(self._points), "point")
            notes.append(f"{many} for towers, masts or buildings without an outline passed over{told}")
        return Contents("osm", WGS84, tuple(self.parts), notes=tuple(notes))


FIRST_INLINE: Final = -(1 << 61)
"""Numbers below it are given here to nodes that have none."""


class Elements:
    """Nodes, ways and relations of a file, in any order: Overpass puts nodes behind the ways that need them."""

    def __init__(self) -> None:
        self._ids, self._x, self._y = array("q"), array("d"), array("d")
        self._refs = array("q")
        self._spans: dict[int, tuple[int, int]] = {}
        self._buildings: dict[int, dict[str, str]] = {}
        self._heights: dict[int, dict[str, str]] = {}
        self._relations = Relations()
        self._points: list[Mapping[str, str]] = []

    def point(self, tags: Mapping[str, str]) -> None:
        """Tags of a node."""
        if HEIGHT in tags or is_tall(tags):
            self._points.append(tags)

    def node(self, number: int, longitude: float, latitude: float) -> None:
        """A place."""
        self._ids.append(number)
        self._x.append(longitude)
        self._y.append(latitude)

    def way(self, number: int, refs: Sequence[int], tags: dict[str, str]) -> None:
        """A way, by the numbers of its nodes; one without nodes does not replace one with them."""
        if refs or number not in self._spans:
            self._spans[number] = len(self._refs), len(self._refs) + len(refs)
            self._refs.extend(refs)
        if is_building(tags):
            self._buildings[number] = tags
        elif any("height" in name or "level" in name for name in tags):
            self._heights[number] = tags

    def relation(self, number: int, members: list[Member], tags: dict[str, str]) -> None:
        """A relation; those that are no building's are passed over."""
        self._relations.add(number, members, tags, is_building(tags))

    def contents(self, reading: Reading) -> Contents:
        """The buildings.

        Raises:
            WorldFileError: there is none.
        """
        places, known = self._places()
        found = Collected(reading)

        def line(number: int) -> Line:
            span = slice(*self._spans[number])
            return list(map(tuple, places[span][known[span]].tolist()))

        for tags in self._points:
            found.point(tags)
        for number, tags in self._buildings.items():
            found.way(tags, line(number), f"way {number}")
        needed = self._relations.ways()
        for number, tags in self._heights.items():
            if number not in needed:
                found.other(tags)
        ways = {number: line(number) for number in needed & self._spans.keys()}
        areas = self._relations.areas(self._buildings, self._heights)
        found.areas(areas, ways, self._relations)
        return found.contents()

    def _places(self) -> tuple[FloatArray, BoolArray]:
        """(k, 2) where the nodes of all ways lie, one way after the other, and which of them are known."""
        ids, refs = np.array(self._ids, dtype=np.int64), np.array(self._refs, dtype=np.int64)
        if not len(ids) or not len(refs):
            return np.zeros((len(refs), 2)), np.zeros(len(refs), dtype=np.bool_)
        order = np.argsort(ids, kind="stable")
        at = order[np.minimum(np.searchsorted(ids, refs, sorter=order), len(ids) - 1)]
        return np.column_stack((np.array(self._x)[at], np.array(self._y)[at])), ids[at] == refs


def is_building(tags: Mapping[str, str]) -> bool:
    """Whether tags are those of a building, of a part of one, or of what stands up like one."""
    building, part, made = AREAS
    return tags.get(building, "no") != "no" or tags.get(part, "no") != "no" or tags.get(made) in TALL


def is_tall(tags: Mapping[str, str]) -> bool:
    """Whether tags of a node are those of something that stands up: a building, a tower, a wind turbine."""
    if tags.get("building") == ENTRANCE:
        return False
    return is_building(tags) or tags.get("power") == "tower" or tags.get("generator:source") == "wind"


def _height_m(tags: Mapping[str, str]) -> float:
    """How high something is, 0 where it does not say so."""
    return max(lengths_of(tags.get(HEIGHT)).metres, default=0.0)


def _is_ring(line: Line) -> bool:
    return len(line) >= 4 and line[0] == line[-1]


def _rings(lines: Sequence[Line]) -> tuple[list[Line], bool]:
    """Rings, pieces of which some lines may be, and whether any had to be closed."""
    found, pieces = [], []
    for line in lines:
        if _is_ring(line):
            found.append(line)
        elif len(line) >= 2 and line[0] != line[-1]:
            pieces.append(line)
    if not pieces:
        return found, False
    import shapely

    closed = False
    for chain in shapely.get_parts(shapely.line_merge(shapely.MultiLineString(pieces))):
        corners = list(chain.coords)
        if len(corners) >= 3:
            closed |= corners[0] != corners[-1]
            found.append(corners)
    return found, closed


def _areas_of(buildings: Sequence[_Building]) -> list[Any]:
    """What lies inside the outlines of each and in none of its holes; None where that is nothing."""
    import shapely

    if not buildings:
        return []
    solid, hollow = (_insides(each) for each in ([b.outer for b in buildings], [b.inner for b in buildings]))
    whole = np.array(solid, dtype=object)
    holed = np.array([inner is not None for inner in hollow])
    if holed.any():
        whole[holed] = shapely.difference(whole[holed], np.array(hollow, dtype=object)[holed])
    known = (outer is not None for outer in solid)
    return [shape if there else None for shape, there in zip(whole, known, strict=True)]


def _insides(every: Sequence[Sequence[Line]]) -> list[Any]:
    """The area inside any of some rings, of many buildings at once; None where there is none."""
    import shapely

    flat = [line for lines in every for line in lines]
    if not flat:
        return [None] * len(every)
    counts = [len(line) for line in flat]
    corners = np.array([place for line in flat for place in line])
    polygons = shapely.polygons(shapely.linearrings(corners, indices=np.repeat(np.arange(len(flat)), counts)))
    valid = iter(shapely.make_valid(polygons, method="structure", keep_collapsed=False))
    found: list[Any] = []
    for lines in every:
        shapes = [next(valid) for _ in lines]
        found.append(shapely.union_all(shapes) if len(shapes) != 1 else shapes[0])
    return [shape if area > 0.0 else None for shape, area in zip(found, shapely.area(found), strict=True)]
