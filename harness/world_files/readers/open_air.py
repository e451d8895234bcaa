"""Airspace in the OpenAir format, version 1 and 2 (Naviter, OpenAir file format, 2024; Winpilot's original)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, Final

import shapely

from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, read_bytes, text_of
from harness.world_files.parts import NO_BOTTOM, NO_TOP, WGS84, Contents, Limit, Part, Reading, WorldFileError
from harness.world_files.readers import limits
from harness.world_files.readers.footprints import Place, arc, circle, corridor, on_earth, polar

MILE_M: Final = 1852.0
COMMANDS: Final = ("AN", "AL", "AH", "DP", "DC", "DA", "DB", "DY", "V")
_ANGLE: Final = r"([\d.:\s°'\",]+)"
_SIDES: Final = (rf"{_ANGLE}([NS]){_ANGLE}([EW])", rf"([NS]){_ANGLE}([EW]){_ANGLE}")
"""A place with its sides behind the numbers, or before them."""


@dataclass
class _Airspace:
    """One airspace while it is read; of its limits each that is given."""

    kind: str
    name: str = ""
    lower: list[Limit | None] = field(default_factory=list)
    upper: list[Limit | None] = field(default_factory=list)
    center: Place | None = None
    clockwise: bool = True
    width_m: float = 0.0
    ring: list[Place] = field(default_factory=list)
    line: list[Place] = field(default_factory=list)
    shapes: list[Any] = field(default_factory=list)

    @property
    def is_drawn(self) -> bool:
        """Whether something of a shape was read."""
        return bool(self.ring or self.line or self.shapes)

    def take(self, command: str, rest: str) -> None:
        """One command of it."""
        name, _, value = (part.strip() for part in rest.upper().partition("="))
        if command == "AN":
            self.name = rest[:40]
        elif command in ("AL", "AH"):
            (self.lower if command == "AL" else self.upper).append(limits.limit_of(rest))
        elif command != "V":
            self.draw(command, rest)
        elif name == "X":
            self.center = _places(value, 1)[0]
        elif name == "D":
            self.clockwise = not value.startswith("-")
        elif name == "W":
            self.width_m = _numbers(value, 1)[0] * MILE_M

    def draw(self, command: str, rest: str) -> None:
        """A corner, a circle or an arc."""
        if command in ("DP", "DY"):
            (self.ring if command == "DP" else self.line).append(_places(rest, 1)[0])
        elif self.center is None:
            raise WorldFileError("has an arc or circle before its centre `V X=`")
        elif command == "DC":
            self.shapes.append(circle(self.center, _numbers(rest, 1)[0] * MILE_M))
        elif command == "DA":
            radius, begin, end = _numbers(rest, 3)
            if begin != end and (end - begin) % 360.0 == 0.0:
                self.shapes.append(circle(self.center, radius * MILE_M))
            else:
                self.ring += arc(self.center, begin, end, (radius * MILE_M,) * 2, self.clockwise)
        else:
            first, last = _places(rest, 2)
            (begin, near), (end, far) = (polar(self.center, place) for place in (first, last))
            if first == last and not self.ring:  # else a small arc whose ends were rounded
                self.shapes.append(circle(self.center, near))
            else:
                self.ring += [first, *arc(self.center, begin, end, (near, far), self.clockwise)[1:-1], last]

    def parts(self, notes: list[str]) -> list[Part]:
        """What it is; a limit that is missing, or given more than once, is none."""
        found = self.shapes + ([shapely.Polygon(self.ring)] if len(set(self.ring)) >= 3 else [])
        found += [corridor(self.line, self.width_m)] if len(self.line) > 1 and self.width_m > 0 else []
        if not found:
            return []
        band: list[Limit | None] = []
        for side, given, none in (("lower", self.lower, NO_BOTTOM), ("upper", self.upper, NO_TOP)):
            if len(given) != 1:
                told = "given more than once" if given else "missing"
                notes.append(f"{self.name or 'an airspace'}: its {side} limit is {told}; taken as without")
            band.append(given[0] if len(given) == 1 else none)
        bottom, top = limits.band_of(band[0], band[1], notes, self.name)
        return [Part(shape, bottom, top, name=self.name) for shape in found]


def read(path: Path, reading: Reading) -> Contents:
    """Reads every airspace, whatever its class; a fault of a coordinate or a radius names its line."""
    spaces: list[_Airspace] = []
    ignored = Counter[str]()
    for number, line in enumerate(text_of(read_bytes(path, MAX_TREE_BYTES)).splitlines(), 1):
        command, _, rest = (part.strip() for part in line.partition("*")[0].strip().partition(" "))
        try:
            if command:
                _take(spaces, command.upper(), rest, ignored)
        except WorldFileError as error:
            raise WorldFileError(f"line {number}: {error}") from error
    notes: list[str] = []
    parts = [each.parts(notes) for each in spaces]
    if not any(parts):
        raise WorldFileError("has no airspace with an area; must be OpenAir with some")
    notes += _passed_over(spaces, ignored, parts.count([]))
    return Contents("openair", WGS84, tuple(chain.from_iterable(parts)), notes=tuple(notes))


def _passed_over(spaces: Sequence[_Airspace], ignored: Counter[str], empty: int) -> Iterator[str]:
    """What is said of airspaces by their classes, of lines by their commands, and of airspaces without an area."""
    classes = Counter(each.kind or "none" for each in spaces).most_common()
    told = ", ".join(f"{count} {kind[:12]}" for kind, count in classes[:6])
    told += ", and others" if len(classes) > 6 else ""
    yield f"airspaces of every class are solid ({told}): take out what may be flown in"
    if timed := ignored.pop("AA", 0):
        yield f"{counted(timed, 'time')} of activation passed over: taken as always active"
    if ignored:
        words = ", ".join(repr(word[:12]) for word in [*ignored][:4])
        yield f"{counted(ignored.total(), 'line')} with commands that say nothing of a shape passed over: {words}"
    if empty:
        yield f"{counted(empty, 'airspace')} without an area passed over"


def _take(spaces: list[_Airspace], command: str, rest: str, ignored: Counter[str]) -> None:
    """One line of a file; an airspace begins with its class, or without one with its name."""
    # Before the first it is as behind one that is whole.
    last = spaces[-1] if spaces else _Airspace("none", shapes=[None])
    if command == "AC" and not last.kind and not last.is_drawn:
        last.kind = rest  # its name stood before its class
    elif command == "AC":
        spaces.append(_Airspace(rest))
    elif command == "AN" and last.is_drawn:
        spaces.append(_Airspace("", rest[:40]))
    elif spaces and command in COMMANDS:
        last.take(command, rest)
    else:
        ignored[command] += 1


def _numbers(text: str, count: int) -> Sequence[float]:
    words = text.replace(",", " ").split()[:count]
    if len(words) != count or not all(re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)", word) for word in words):
        raise WorldFileError(f"has {text[:40]!r}; must be {counted(count, 'number')}")
    return [float(word) for word in words]


def _places(text: str, count: int) -> list[Place]:
    word = text.upper()
    before = word[:1] in ("N", "S")
    found = re.findall(_SIDES[before], word)[:count]
    if len(found) < count or not word.startswith("".join(map("".join, found))):
        wanted = "a place, as 46:30:00 N 009:15:00 E" if count == 1 else "two places"
        raise WorldFileError(f"has {text[:40]!r}; must be {wanted}")
    places = []
    for each in found:
        north, ns, east, ew = (each[1], each[0], each[3], each[2]) if before else each
        latitude, longitude = _degrees(north, 2), _degrees(east, 3)
        places.append(on_earth(-longitude if ew == "W" else longitude, -latitude if ns == "S" else latitude))
    return places


def _degrees(text: str, digits: int) -> float:
    """An angle of degrees, minutes and seconds; unmarked ones follow `digits` of degrees, as in `0500434.00E`."""
    numbers = re.findall(r"\d+(?:\.\d+)?", text)
    whole, _, part = numbers[0].partition(".") if numbers else ("", "", "")
    if len(numbers) == 1 and len(whole) in (digits + 2, digits + 4):
        numbers = [whole[:digits], *(whole[k : k + 2] for k in range(digits, len(whole), 2))]
        numbers[-1] += f".{part or 0}"
    # Where numbers are rounded, 60 seconds are written.
    if not 1 <= len(numbers) <= 3 or any(float(each) > 60.0 for each in numbers[1:]):
        raise WorldFileError(f"has the angle {text.strip()!r}; must be degrees, minutes, seconds")
    return sum(float(number) / 60.0**k for k, number in enumerate(numbers))
