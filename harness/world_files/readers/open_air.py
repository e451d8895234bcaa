"""Airspace in the OpenAir format, version 1 and 2 (Naviter, OpenAir file format, 2024; Winpilot's original).

Read here rather than with a library: aerofiles 1.5 gives up on version 2, and no reader makes shapes of arcs.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, read_bytes, text_of
from harness.world_files.parts import NO_BOTTOM, NO_TOP, WGS84, Contents, Limit, Part, Reading, WorldFileError
from harness.world_files.readers import limits, rings
from harness.world_files.readers.rings import NAUTICAL_MILE_M, Place

_ANGLE: Final = r"(\d+(?:\.\d+)?)(?:[:\s°']+(\d+(?:\.\d+)?))?(?:[:\s']+(\d+(?:\.\d+)?))?"
_COORDINATE: Final = re.compile(rf"{_ANGLE}[\s\"']*([NS])[\s,]*{_ANGLE}[\s\"']*([EW])", re.IGNORECASE)
_SIDE_FIRST: Final = re.compile(rf"\b([NS])\s*{_ANGLE}[\s\"',]*([EW])\s*{_ANGLE}", re.IGNORECASE)
LATITUDE_DIGITS, LONGITUDE_DIGITS = 2, 3
"""Digits of whole degrees where minutes, and perhaps seconds, follow without a mark: `265644.00N 0500434.00E`."""
MOST_SIXTIETHS: Final = 60.0
CLOSED: Final = ("AC", "AN", "AL", "AH", "DP", "DC", "DA", "DB", "DY", "V")
"""Commands that are read."""
MOST_LETTERS: Final = 40
"""Of a name."""
DRAWN: Final = ("AT", "AY", "AF", "AG", "AX", "AI", "TO", "TC", "SP", "SB", "TP", "T")
"""Labels, kinds, radio and drawing: they have no bearing on where an airspace is. All others are named."""


class _Airspace:
    """One airspace while it is read."""

    def __init__(self, kind: str) -> None:
        self.kind, self.name = kind, ""
        self.lowers: list[Limit | None] = []
        self.uppers: list[Limit | None] = []
        self.center: Place | None = None
        self.clockwise, self.width_m = True, 0.0
        self.ring: list[Place] = []
        self.line: list[Place] = []
        self.circles: list[Any] = []

    def needed_center(self, line: int) -> Place:
        if self.center is None:
            raise WorldFileError(f"line {line}: has an arc or circle before its centre `V X=`")
        return self.center

    @property
    def is_drawn(self) -> bool:
        """Whether something of its shape has been read."""
        return bool(self.ring or self.line or self.circles)

    def band(self, notes: list[str]) -> tuple[Limit, Limit]:
        """Bottom and top. Of limits that are given twice the wider ones are taken; what is missing is no limit."""
        name = self.name or "an airspace"
        for which, given in (("lower", self.lowers), ("upper", self.uppers)):
            if not given:
                notes.append(f"{name}: its {which} limit is missing; taken as without")
            if len(given) > 1:
                notes.append(f"{name}: its {which} limit is given more than once; the widest is taken")
        lower = _widest(self.lowers or [NO_BOTTOM], NO_BOTTOM)
        upper = _widest(self.uppers or [NO_TOP], NO_TOP)
        return limits.band_of(lower, upper, notes, self.name)

    def footprints(self) -> list[Any]:
        found = [*self.circles]
        if self.ring and (shape := rings.ring(self.ring)) is not None:
            found.append(shape)
        if len(self.line) > 1 and self.width_m > 0:
            found.append(rings.corridor(self.line, self.width_m))
        return found


def read(path: Path, reading: Reading) -> Contents:
    """Reads every airspace, whatever its class.

    Raises:
        WorldFileError: a coordinate or a radius cannot be read (with its line), or there is no airspace.
    """
    lines = text_of(read_bytes(path, MAX_TREE_BYTES)).splitlines()
    spaces: list[_Airspace] = []
    ignored = Counter[str]()
    for number, line in enumerate(lines, 1):
        command, *more = line.partition("*")[0].split(None, 1) or ("",)
        command, rest = command.upper(), more[0].strip() if more else ""
        if command == "AC" and spaces and not spaces[-1].kind and not spaces[-1].is_drawn:
            spaces[-1].kind = rest  # its name stood before its class
        elif command == "AC":
            spaces.append(_Airspace(rest))
        elif command == "AN" and (not spaces or spaces[-1].is_drawn):  # of one without a class
            spaces.append(_Airspace(""))
            spaces[-1].name = rest[:MOST_LETTERS]
        elif spaces and command in CLOSED:
            _take(spaces[-1], command, rest, number)
        elif command and command not in DRAWN:
            ignored[command] += 1
    notes: list[str] = []
    parts = [
        Part(shape, *band, name=each.name)
        for each in spaces
        if (shapes := each.footprints())
        for band in (each.band(notes),)
        for shape in shapes
    ]
    if not parts:
        raise WorldFileError("has no airspace with an area; must be OpenAir with some")
    classes = Counter(each.kind or "none" for each in spaces)
    told = ", ".join(f"{count} {kind[:12]}" for kind, count in classes.most_common(6))
    notes.append(
        f"airspaces of every class are solid ({told}{', and others' if len(classes) > 6 else ''}): take out what may "
        "be flown in"
    )
    if timed := ignored.pop("AA", 0):
        notes.append(f"{counted(timed, 'time')} of activation passed over: taken as always active")
    if ignored:
        words = ", ".join(repr(word[:12]) for word, _ in ignored.most_common(4))
        notes.append(
            f"{counted(ignored.total(), 'line')} with commands that are not known passed over: {words}"
        )
    empty = sum(not each.footprints() for each in spaces)
    if empty:
        notes.append(f"{counted(empty, 'airspace')} without an area passed over")
    return Contents("openair", WGS84, tuple(parts), notes=tuple(notes))


def _take(space: _Airspace, command: str, rest: str, line: int) -> None:
    """One command of an airspace."""
    if command == "AN":
        space.name = rest[:MOST_LETTERS]
    elif command == "AL":
        space.lowers.append(limits.limit_of(rest))
    elif command == "AH":
        space.uppers.append(limits.limit_of(rest))
    elif command == "V":
        _set(space, rest, line)
    elif command == "DP":
        space.ring.append(_place(rest, line))
    elif command == "DY":
        space.line.append(_place(rest, line))
    elif command == "DC":
        (radius,) = _numbers(rest, 1, line)
        space.circles.append(rings.circle(space.needed_center(line), radius * NAUTICAL_MILE_M))
    elif command == "DA":
        radius, begin, end = _numbers(rest, 3, line)
        away = radius * NAUTICAL_MILE_M
        if begin != end and (end - begin) % 360.0 == 0.0:
            space.circles.append(rings.circle(space.needed_center(line), away))
            return
        space.ring += rings.arc(space.needed_center(line), begin, end, (away, away), space.clockwise)
    elif command == "DB":
        places = [_place_of(match, line) for match in _places_in(rest)]
        if len(places) != 2:
            raise WorldFileError(f"line {line}: DB has {len(places)} places; must have two")
        center = space.needed_center(line)
        (begin, near), (end, far) = (rings.polar(center, place) for place in places)
        if places[0] == places[1] and not space.ring:  # else a small arc whose ends were rounded
            space.circles.append(rings.circle(center, near))
            return
        space.ring += [
            places[0],
            *rings.arc(center, begin, end, (near, far), space.clockwise)[1:-1],
            places[1],
        ]


def _set(space: _Airspace, rest: str, line: int) -> None:
    name, _, value = (part.strip() for part in rest.partition("="))
    if name.upper() == "X":
        space.center = _place(value, line)
    elif name.upper() == "D":
        space.clockwise = not value.startswith("-")
    elif name.upper() == "W":
        space.width_m = _numbers(value, 1, line)[0] * NAUTICAL_MILE_M


def _numbers(text: str, count: int, line: int) -> Sequence[float]:
    words = text.replace(",", " ").split()[:count]
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise WorldFileError(f"line {line}: has {text[:40]!r}; must be {counted(count, 'number')}")
    return numbers


def _widest(given: Sequence[Limit | None], none: Limit) -> Limit | None:
    """The lowest of lower limits, the highest of upper ones; none where that cannot be told.

    Args:
        given: as read; None where one is not known.
        none: what stands for no limit.
    """
    known = [each for each in given if each is not None]
    if len(given) == 1 or not known:
        return given[0]
    if none in known or len({each.datum for each in known}) > 1:
        return none
    return (min if none is NO_BOTTOM else max)(known, key=lambda each: each.height_m)


def _places_in(text: str) -> list[re.Match[str]]:
    """The places of a text, their sides behind the numbers or before them."""
    return [*(_COORDINATE.finditer(text))] or [*(_SIDE_FIRST.finditer(text))]


def _place(text: str, line: int) -> Place:
    found = _places_in(text)
    if not found:
        raise WorldFileError(f"line {line}: has {text[:40]!r}; must be a place, as 46:30:00 N 009:15:00 E")
    return _place_of(found[0], line)


def _place_of(match: re.Match[str], line: int) -> Place:
    if match.re is _COORDINATE:
        north, north_side, east, east_side = match.group(1, 2, 3), match[4], match.group(5, 6, 7), match[8]
    else:
        north_side, north, east_side, east = match[1], match.group(2, 3, 4), match[5], match.group(6, 7, 8)
    latitude = _degrees(north, LATITUDE_DIGITS, line) * (-1 if north_side.upper() == "S" else 1)
    longitude = _degrees(east, LONGITUDE_DIGITS, line) * (-1 if east_side.upper() == "W" else 1)
    try:
        return rings.on_earth(longitude, latitude)
    except WorldFileError as error:
        raise WorldFileError(f"line {line}: {error}") from error


def _degrees(angle: Sequence[str | None], digits: int, line: int) -> float:
    """An angle of degrees, minutes and seconds, of which the last two may be missing, or not be marked."""
    whole, _, part = (angle[0] or "0").partition(".")
    if angle[1] is None and len(whole) in (digits + 2, digits + 4):
        ends = [digits, *range(digits + 2, len(whole) + 1, 2)]
        packed = [whole[begin:end] for begin, end in zip([0, *ends[:-1]], ends, strict=True)]
        angle = [*packed[:-1], f"{packed[-1]}.{part or 0}"]
    numbers = [float(each or 0.0) for each in angle]
    if max(numbers[1:]) > MOST_SIXTIETHS:  # 60 of them are written where numbers are rounded
        raise WorldFileError(f"line {line}: has {max(numbers[1:]):g} minutes or seconds; must be at most 60")
    return sum(number / 60.0**k for k, number in enumerate(numbers))
