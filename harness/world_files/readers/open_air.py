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

from harness.world_files.bounded import MAX_TREE_BYTES, read_bytes, text_of
from harness.world_files.parts import (
    NO_BOTTOM,
    NO_TOP,
    WGS84,
    Contents,
    Limit,
    Part,
    Reading,
    WorldFileError,
    counted,
)
from harness.world_files.readers import limits, rings
from harness.world_files.readers.rings import NAUTICAL_MILE_M, Place

_COORDINATE: Final = re.compile(
    r"(\d+(?:\.\d+)?)(?:[:\s°']+(\d+(?:\.\d+)?))?(?:[:\s']+(\d+(?:\.\d+)?))?[\s\"']*([NS])[\s,]*"
    r"(\d+(?:\.\d+)?)(?:[:\s°']+(\d+(?:\.\d+)?))?(?:[:\s']+(\d+(?:\.\d+)?))?[\s\"']*([EW])",
    re.IGNORECASE,
)
CLOSED: Final = ("AC", "AN", "AL", "AH", "DP", "DC", "DA", "DB", "DY", "V")
"""Commands that are read."""
DRAWN: Final = ("AT", "AY", "AF", "AG", "AX", "AI", "TO", "TC", "SP", "SB", "TP", "T")
"""Labels, kinds, radio and drawing: they have no bearing on where an airspace is. All others are named."""


class _Airspace:
    """One airspace while it is read."""

    def __init__(self, kind: str) -> None:
        self.kind, self.name = kind, ""
        self.lower: Limit | None = NO_BOTTOM
        self.upper: Limit | None = NO_TOP
        self.center: Place | None = None
        self.clockwise, self.width_m = True, 0.0
        self.ring: list[Place] = []
        self.line: list[Place] = []
        self.circles: list[Any] = []

    def needed_center(self, line: int) -> Place:
        if self.center is None:
            raise WorldFileError(f"line {line}: has an arc or circle before its centre `V X=`")
        return self.center

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
        if command == "AC":
            spaces.append(_Airspace(rest))
        elif spaces and command in CLOSED:
            _take(spaces[-1], command, rest, number)
        elif command and command not in DRAWN:
            ignored[command] += 1
    notes: list[str] = []
    parts = [
        Part(shape, *limits.band_of(each.lower, each.upper, notes, each.name), name=each.name)
        for each in spaces
        for shape in each.footprints()
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
        space.name = rest[:40]
    elif command == "AL":
        space.lower = limits.limit_of(rest)
    elif command == "AH":
        space.upper = limits.limit_of(rest)
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
        space.ring += rings.arc(space.needed_center(line), begin, end, (away, away), space.clockwise)
    elif command == "DB":
        places = [_place(match.group(0), line) for match in _COORDINATE.finditer(rest)]
        if len(places) != 2:
            raise WorldFileError(f"line {line}: DB has {len(places)} places; must have two")
        center = space.needed_center(line)
        (begin, near), (end, far) = (rings.polar(center, place) for place in places)
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


def _place(text: str, line: int) -> Place:
    match = _COORDINATE.search(text)
    if match is None:
        raise WorldFileError(f"line {line}: has {text[:40]!r}; must be a place, as 46:30:00 N 009:15:00 E")
    north, east = (
        sum(float(match[first + k] or 0.0) / 60.0**k for k in range(3)) for first in (1, 5)
    )  # fmt: skip
    latitude = -north if match[4].upper() == "S" else north
    longitude = -east if match[8].upper() == "W" else east
    try:
        return rings.on_earth(longitude, latitude)
    except WorldFileError as error:
        raise WorldFileError(f"line {line}: {error}") from error
