"""Airspace in the OpenAir format, version 1 and 2 (Naviter, OpenAir file format, 2024; Winpilot's original)."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, read_bytes, text_of
from harness.world_files.parts import NO_BOTTOM, NO_TOP, WGS84, Contents, Limit, Part, Reading, WorldFileError
from harness.world_files.readers import limits
from harness.world_files.readers.footprints import (
    NAUTICAL_MILE_M,
    Place,
    arc,
    circle,
    corridor,
    on_earth,
    polar,
)

_ANGLE: Final = r"(\d+(?:\.\d+)?)(?:[:\s°']+(\d+(?:\.\d+)?))?(?:[:\s']+(\d+(?:\.\d+)?))?"
_PLACES: Final = (
    re.compile(rf"{_ANGLE}[\s\"']*(?P<ns>[NS])[\s,]*{_ANGLE}[\s\"']*(?P<ew>[EW])", re.IGNORECASE),
    re.compile(rf"\b(?P<ns>[NS])\s*{_ANGLE}[\s\"',]*(?P<ew>[EW])\s*{_ANGLE}", re.IGNORECASE),
)
"""A place with its sides behind the numbers, or before them."""
READ: Final = ("AN", "AL", "AH", "DP", "DC", "DA", "DB", "DY", "V")
DRAWN: Final = ("AT", "AY", "AF", "AG", "AX", "AI", "TO", "TC", "SP", "SB", "TP", "T")
"""Labels, kinds, radio and drawing, which do not say where an airspace is. Other commands are named in a note."""


@dataclass
class _Airspace:
    """One airspace while it is read."""

    kind: str
    name: str = ""
    limits: dict[str, list[Limit | None]] = field(default_factory=lambda: {"lower": [], "upper": []})
    center: Place | None = None
    clockwise: bool = True
    width_m: float = 0.0
    ring: list[Place] = field(default_factory=list)
    line: list[Place] = field(default_factory=list)
    shapes: list[Any] = field(default_factory=list)

    @property
    def is_drawn(self) -> bool:
        """Whether something of its shape has been read."""
        return bool(self.ring or self.line or self.shapes)

    def take(self, command: str, rest: str) -> None:
        """One command of it."""
        if command == "AN":
            self.name = rest[:40]
        elif command in ("AL", "AH"):
            self.limits["lower" if command == "AL" else "upper"].append(limits.limit_of(rest))
        elif command == "V":
            self._set(*(part.strip() for part in rest.partition("=")[::2]))
        elif command in ("DP", "DY"):
            (self.ring if command == "DP" else self.line).append(_places(rest, 1)[0])
        elif self.center is None:
            raise WorldFileError("has an arc or circle before its centre `V X=`")
        elif command == "DC":
            self.shapes.append(circle(self.center, _numbers(rest, 1)[0] * NAUTICAL_MILE_M))
        elif command == "DA":
            radius, begin, end = _numbers(rest, 3)
            if begin != end and (end - begin) % 360.0 == 0.0:
                self.shapes.append(circle(self.center, radius * NAUTICAL_MILE_M))
            else:
                self.ring += arc(self.center, begin, end, (radius * NAUTICAL_MILE_M,) * 2, self.clockwise)
        elif command == "DB":
            first, last = _places(rest, 2)
            (begin, near), (end, far) = (polar(self.center, place) for place in (first, last))
            if first == last and not self.ring:  # else a small arc whose ends were rounded
                self.shapes.append(circle(self.center, near))
            else:
                self.ring += [first, *arc(self.center, begin, end, (near, far), self.clockwise)[1:-1], last]

    def _set(self, name: str, value: str) -> None:
        if name.upper() == "X":
            self.center = _places(value, 1)[0]
        elif name.upper() == "D":
            self.clockwise = not value.startswith("-")
        elif name.upper() == "W":
            self.width_m = _numbers(value, 1)[0] * NAUTICAL_MILE_M

    def parts(self, notes: list[str]) -> list[Part]:
        """What it is. Of limits that are given twice the wider ones are taken; what is missing is no limit."""
        import shapely

        found = [*self.shapes]
        if len(set(self.ring)) >= 3:
            found.append(shapely.Polygon(self.ring))
        if len(self.line) > 1 and self.width_m > 0:
            found.append(corridor(self.line, self.width_m))
        if not found:
            return []
        band = []
        for which, none in (("lower", NO_BOTTOM), ("upper", NO_TOP)):
            given = self.limits[which]
            if len(given) != 1:
                told = "given more than once; the widest is taken" if given else "missing; taken as without"
                notes.append(f"{self.name or 'an airspace'}: its {which} limit is {told}")
            band.append(_widest(given or [none], none))
        bottom, top = limits.band_of(band[0], band[1], notes, self.name)
        return [Part(shape, bottom, top, name=self.name) for shape in found]


def read(path: Path, reading: Reading) -> Contents:
    """Reads every airspace, whatever its class.

    Raises:
        WorldFileError: a coordinate or a radius cannot be read (with its line), or there is no airspace.
    """
    spaces: list[_Airspace] = []
    ignored = Counter[str]()
    for number, line in enumerate(text_of(read_bytes(path, MAX_TREE_BYTES)).splitlines(), 1):
        command, *more = line.partition("*")[0].split(None, 1) or ("",)
        command, rest = command.upper(), more[0].strip() if more else ""
        if command == "AC" and spaces and not spaces[-1].kind and not spaces[-1].is_drawn:
            spaces[-1].kind = rest  # its name stood before its class
        elif command == "AC":
            spaces.append(_Airspace(rest))
        elif command == "AN" and (not spaces or spaces[-1].is_drawn):  # of one without a class
            spaces.append(_Airspace("", rest[:40]))
        elif spaces and command in READ:
            try:
                spaces[-1].take(command, rest)
            except WorldFileError as error:
                raise WorldFileError(f"line {number}: {error}") from error
        elif command and command not in DRAWN:
            ignored[command] += 1
    notes: list[str] = []
    each_parts = [each.parts(notes) for each in spaces]
    if not any(each_parts):
        raise WorldFileError("has no airspace with an area; must be OpenAir with some")
    classes = Counter(each.kind or "none" for each in spaces)
    told = ", ".join(f"{count} {kind[:12]}" for kind, count in classes.most_common(6))
    told += ", and others" if len(classes) > 6 else ""
    notes.append(f"airspaces of every class are solid ({told}): take out what may be flown in")
    if timed := ignored.pop("AA", 0):
        notes.append(f"{counted(timed, 'time')} of activation passed over: taken as always active")
    if ignored:
        words = ", ".join(repr(word[:12]) for word, _ in ignored.most_common(4))
        lines = counted(ignored.total(), "line")
        notes.append(f"{lines} with commands that are not known passed over: {words}")
    if empty := sum(not each for each in each_parts):
        notes.append(f"{counted(empty, 'airspace')} without an area passed over")
    return Contents(
        "openair", WGS84, tuple(part for parts in each_parts for part in parts), notes=tuple(notes)
    )


def _numbers(text: str, count: int) -> Sequence[float]:
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()[:count]]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise WorldFileError(f"has {text[:40]!r}; must be {counted(count, 'number')}")
    return numbers


def _widest(given: Sequence[Limit | None], none: Limit) -> Limit | None:
    """The lowest of lower limits, the highest of upper ones; `none` where that cannot be told."""
    known = [each for each in given if each is not None]
    if len(given) == 1 or not known:
        return given[0]
    if none in known or len({each.datum for each in known}) > 1:
        return none
    return (min if none is NO_BOTTOM else max)(known, key=lambda each: each.height_m)


def _places(text: str, count: int) -> list[Place]:
    found = [*_PLACES[0].finditer(text)] or [*_PLACES[1].finditer(text)]
    if len(found) < count or count == 2 != len(found):
        wanted = "a place, as 46:30:00 N 009:15:00 E" if count == 1 else "two places"
        raise WorldFileError(f"has {text[:40]!r}; must be {wanted}")
    places = []
    for match in found[:count]:
        angles = [each for each in match.groups() if each is None or not each.isalpha()]
        signs = (-1 if match["ns"].upper() == "S" else 1), (-1 if match["ew"].upper() == "W" else 1)
        latitude, longitude = _degrees(angles[:3], 2), _degrees(angles[3:], 3)
        places.append(on_earth(signs[1] * longitude, signs[0] * latitude))
    return places


def _degrees(angle: Sequence[str | None], digits: int) -> float:
    """An angle of degrees, minutes and seconds, of which the last two may be missing, or not be marked.

    Args:
        angle: the three numbers.
        digits: of whole degrees where the others follow without a mark: `265644.00N 0500434.00E`.
    """
    whole, _, part = (angle[0] or "0").partition(".")
    if angle[1] is None and len(whole) in (digits + 2, digits + 4):
        packed = [whole[:digits], *(whole[k : k + 2] for k in range(digits, len(whole), 2))]
        angle = [*packed[:-1], f"{packed[-1]}.{part or 0}"]
    numbers = [float(each or 0.0) for each in angle]
    if max(numbers[1:]) > 60.0:  # 60 of them are written where numbers are rounded
        raise WorldFileError(f"has {max(numbers[1:]):g} minutes or seconds; must be at most 60")
    return sum(number / 60.0**k for k, number in enumerate(numbers))
