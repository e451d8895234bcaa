"""Airspace in the OpenAir format, version 1 and 2 (Naviter, OpenAir file format, 2024; Winpilot's original)."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Final

import shapely

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.world_files.bounded import MAX_TREE_BYTES, read_bytes, text_of
from harness.world_files.parts import WGS84, Contents, FileSpec, Limit, Part
from harness.world_files.readers import limits
from harness.world_files.readers.footprints import GEOD, Place, arc, circle, corridor, on_earth

MILE_M: Final = 1852.0  # length of a nautical mile
COMMANDS: Final = ("AN", "AL", "AH", "DP", "DC", "DA", "DB", "DY", "V")  # commands with a value after a blank
TERRAIN: Final = ("TO", "TC")  # commands that begin a line or an area of the ground, up to the next airspace
_PLACE: Final = re.compile(r"([\d.:\s°'\",]+)([NS])([\d.:\s°'\",]+)([EW])")


@dataclass
class _Airspace:
    """One airspace while it is read; `limits` collects every limit given by each of the two commands AL and AH."""

    kind: str
    name: str = ""
    limits: dict[str, list[Limit | None]] = field(default_factory=lambda: {"AL": [], "AH": []})
    center: Place | None = None
    clockwise: bool = True
    width_m: float = 0.0
    ring: list[Place] = field(default_factory=list)
    line: list[Place] = field(default_factory=list)
    shapes: list[Any] = field(default_factory=list)

    def take(self, command: str, rest: str) -> None:
        """Takes one command of the airspace, `rest` being the text behind it."""
        name, _, value = (part.strip() for part in rest.upper().partition("="))
        if command == "AN":
            self.name = rest[:40]
        elif command in self.limits:
            self.limits[command].append(limits.limit_of(rest))
        elif command in ("DP", "DY"):
            (self.ring if command == "DP" else self.line).append(_places(rest, 1)[0])
        elif command != "V":
            self.draw(command, rest)
        elif name == "X":
            self.center = _places(value, 1)[0]
        elif name == "D":
            if value not in ("+", "-"):
                raise InputError(f"has {rest[:40]!r}; must be D=+ or D=-")
            self.clockwise = value == "+"
        elif name == "W":
            self.width_m = _numbers(value, 1)[0] * MILE_M

    def draw(self, command: str, rest: str) -> None:
        if self.center is None:
            raise InputError("has an arc or circle before its centre `V X=`")
        if command == "DB":
            first, last = _places(rest, 2)
            (begin, _, near), (end, _, far) = (GEOD.inv(*self.center, *place) for place in (first, last))
            is_whole = first == last and not self.ring  # else a small arc whose ends were rounded
        else:
            radius, begin, end = _numbers(rest, 3) if command == "DA" else (*_numbers(rest, 1), 0.0, 360.0)
            near = far = radius * MILE_M
            is_whole = begin != end and (end - begin) % 360.0 == 0.0
        drawn = arc(self.center, begin, end, (near, far), self.clockwise)
        if is_whole:
            self.shapes.append(circle(self.center, near))
        else:
            self.ring += [first, *drawn[1:-1], last] if command == "DB" else drawn

    def parts(self, notes: list[str]) -> list[Part]:
        """Returns one part for each shape; a limit that is missing, or given more than once, is not known."""
        found = self.shapes + ([shapely.Polygon(self.ring)] if len(set(self.ring)) >= 3 else [])
        found += [corridor(self.line, self.width_m)] if len(self.line) > 1 and self.width_m > 0 else []
        lower, upper = (given[0] if len(given) == 1 else None for given in self.limits.values())
        return [Part(shape, *limits.band_of(lower, upper, notes, self.name), self.name) for shape in found]


def read(spec: FileSpec) -> Contents:
    """Reads every airspace of whatever class; an InputError names the line at fault."""
    spaces, ignored = _airspaces(text_of(read_bytes(spec.path, MAX_TREE_BYTES)))
    notes: list[str] = []
    parts = [each.parts(notes) for each in spaces]
    if not any(parts):
        raise InputError("has no airspace with an area; must be OpenAir with some")
    kinds = ", ".join(dict.fromkeys(each.kind[:12] or "no class" for each in spaces))
    notes.append(f"airspaces of every class are solid at all times ({kinds}): take out what may be flown in")
    if ignored:
        words = ", ".join(repr(word[:12]) for word in [*ignored][:4])
        notes.append(f"{counted(ignored.total(), 'line')} that draw no airspace passed over: {words}")
    if empty := parts.count([]):
        notes.append(f"{counted(empty, 'airspace')} without an area passed over")
    return Contents(WGS84, tuple(part for each in parts for part in each), notes=tuple(notes))


def _airspaces(text: str) -> tuple[list[_Airspace], Counter[str]]:
    """Returns the airspaces of a file, and how often which commands came that draw none."""
    spaces, ignored, is_ground = list[_Airspace](), Counter[str](), False
    for number, line in enumerate(text.splitlines(), 1):
        command, rest = re.findall(r"^\s*([^\s\d]+|\S*)\s*(.*)", line.partition("*")[0])[0]
        is_ground = command.upper() in TERRAIN or (is_ground and command.upper() not in ("AC", "AN"))
        try:
            _take([] if is_ground else spaces, command.upper(), rest.strip(), ignored)
        except InputError as error:
            raise InputError(f"line {number}: {error}") from error
    return spaces, ignored


def _take(spaces: list[_Airspace], command: str, rest: str, ignored: Counter[str]) -> None:
    """Takes one line of a file; an airspace begins with its class, or without one with its name."""
    last = spaces[-1] if spaces else _Airspace("none", shapes=[None])  # as behind one that is whole
    is_drawn = any((last.ring, last.line, last.shapes))
    if command == "AC" and not last.kind and not is_drawn:
        last.kind = rest  # its name stood before its class
    elif command == "AC" or (command == "AN" and is_drawn):
        spaces.append(_Airspace(*((rest, "") if command == "AC" else ("", rest[:40]))))
    elif spaces and command in COMMANDS:
        last.take(command, rest)
    elif command:
        ignored[command] += 1


def _numbers(text: str, count: int) -> list[float]:
    words = text.upper().removesuffix("NM").replace(",", " ").split()
    if len(words) != count or not all(re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)", word) for word in words):
        raise InputError(f"has {text[:40]!r}; must be {counted(count, 'number')}, a length in nautical miles")
    return [float(word) for word in words]


def _places(text: str, count: int) -> list[Place]:
    if (line := text.upper())[:1] in ("N", "S"):  # the sides stand before the numbers
        line = re.sub(r"([NSEW])([^NSEW]*)", r"\2\1", line)
    found = _PLACE.findall(line)[:count]
    if len(found) < count or not line.startswith("".join(map("".join, found))):
        raise InputError(f"has {text[:40]!r}; must be a place, as 46:30:00 N 009:15:00 E, of an arc two")
    return [on_earth(_degrees(x, 3, ew == "W"), _degrees(y, 2, ns == "S")) for y, ns, x, ew in found]


def _degrees(text: str, digits: int, negative: bool) -> float:
    """Reads an angle of degrees, minutes and seconds; unmarked ones follow `digits` of degrees, as in `0500434.00E`."""
    numbers = re.findall(r"\d+(?:\.\d+)?", text)
    whole, _, part = numbers[0].partition(".") if numbers else ("", "", "")
    if len(numbers) == 1 and len(whole) in (digits + 2, digits + 4):
        numbers = [whole[:digits], *(whole[k : k + 2] for k in range(digits, len(whole), 2))]
        numbers[-1] += f".{part or 0}"
    if not 1 <= len(numbers) <= 3 or any(float(each) > 60.0 for each in numbers[1:]):  # 60: rounded
        raise InputError(f"has the angle {text.strip()!r}; must be degrees, minutes, seconds")
    return (-1.0 if negative else 1.0) * sum(float(number) / 60.0**k for k, number in enumerate(numbers))
