"""Relations of OpenStreetMap that are buildings: multipolygons, and relations of `type=building`.

A multipolygon with a building's tags is an area of ways. A relation of `type=building` (Simple 3D Buildings) names the
outline of a building and its parts, which mostly have tags of their own and are taken for those. What has none is
taken with the tags of the relation.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple

MULTIPOLYGON: Final = "multipolygon"
BUILDING: Final = "building"
HEIGHT: Final = "height"
"""Tag of what stands up, be it a building or not."""
INNER: Final = "inner"
"""Role of a hole of a multipolygon."""
OUTLINES: Final = ("outline", "outer", "")
"""Roles of the outline of a building, as it is drawn; the second and third are mistaken, and meant so."""
PART: Final = "part"

Tags = Mapping[str, str]
Line = list[tuple[float, float]]
"""Longitude and latitude of the nodes of a way that are known."""


class Member(NamedTuple):
    """A member of a relation.

    Attributes:
        number: of a way, or of a relation.
        role: in the relation.
        way: it is a way.
    """

    number: int
    role: str
    way: bool = True


class Area(NamedTuple):
    """A building of several ways.

    Attributes:
        tags: of the building.
        outer: its ways, by number.
        inner: those of its holes.
        name: for messages.
    """

    tags: Tags
    outer: tuple[int, ...]
    inner: tuple[int, ...]
    name: str


class Relations:
    """Relations of a file, in any order."""

    def __init__(self) -> None:
        self._areas: dict[int, tuple[Tags, list[Member]]] = {}
        self._plain: dict[int, tuple[Tags, list[Member]]] = {}
        self._buildings: dict[int, tuple[Tags, list[Member]]] = {}
        self._high: dict[int, Tags] = {}
        self.others = Counter[str]()

    def add(self, number: int, members: list[Member], tags: Tags, solid: bool) -> None:
        """A relation; `solid` says that it has a building's tags. Of other types those are counted by their type."""
        kind = tags.get("type", MULTIPOLYGON)
        if kind == MULTIPOLYGON:
            (self._areas if solid else self._plain)[number] = tags, members
        elif kind == BUILDING:
            self._buildings[number] = tags, members
        elif solid:
            self.others[kind] += 1
        if HEIGHT in tags and not solid and kind != BUILDING:
            self._high[number] = tags

    def high(self) -> list[Tags]:
        """Tags of the relations that are no building, and no member of one, and may say how high they are."""
        nested = self._nested() if self._high else set()
        return [tags for number, tags in self._high.items() if number not in nested]

    def outlines_missing(self) -> set[int]:
        """Relations that are members of buildings and are not here."""
        return self._nested() - self._areas.keys() - self._plain.keys()

    def ways(self) -> set[int]:
        """Ways that buildings may need."""
        plain = (self._plain[number][1] for number in self._nested() & self._plain.keys())
        lists = (*(each for _, each in (*self._areas.values(), *self._buildings.values())), *plain)
        return {member.number for members in lists for member in members if member.way}

    def _nested(self) -> set[int]:
        """Relations that are members of buildings."""
        return {each.number for _, members in self._buildings.values() for each in members if not each.way}

    def areas(self, taken: Iterable[int], tags_of: Mapping[int, Tags]) -> Iterator[Area]:
        """The buildings.

        Args:
            taken: ways that are buildings themselves.
            tags_of: tags of ways that are none.
        """
        outer = (
            m.number for _, members in self._areas.values() for m in members if m.way and m.role != INNER
        )
        taken = {*taken, *outer}
        for number, (tags, members) in self._areas.items():
            yield _area(tags, members, f"relation {number}")
        done = set[int]()
        for number, (tags, members) in self._buildings.items():
            wanted = [m for m in members if m.role in (*OUTLINES, PART)]
            ways = [m for m in wanted if m.way and m.number not in taken]
            outline = tuple(m.number for m in ways if m.role != PART)
            if outline:
                own = tags_of.get(outline[0], {}) if len(outline) == 1 else {}
                yield Area({**tags, **own}, outline, (), f"relation {number}")
            for member in ways:
                if member.role == PART:
                    own = tags_of.get(member.number, {})
                    yield Area({**tags, **own}, (member.number,), (), f"way {member.number}")
            for member in wanted:
                if not member.way and member.number not in self._areas and member.number not in done:
                    done.add(member.number)
                    own, inside = self._plain.get(member.number, ({}, []))
                    yield _area({**tags, **own}, inside, f"relation {member.number}")


def _area(tags: Tags, members: Iterable[Member], name: str) -> Area:
    """A multipolygon."""
    ways = [member for member in members if member.way]
    outer = tuple(member.number for member in ways if member.role != INNER)
    return Area(tags, outer, tuple(member.number for member in ways if member.role == INNER), name)
