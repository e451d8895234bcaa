"""What a file says of a path, before it is put into the local plane, and values of such files: JSON, finite numbers."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn

from harness.files.input_file import InputError
from harness.run_files.fences import Fences

Point = tuple[float, float, float | None]
"""Latitude, longitude, altitude."""


@dataclass(frozen=True)
class PathAsRead:
    """A path as its file has it.

    Attributes:
        local: positions are east and north in metres; else latitude and longitude in degrees.
        positions: one a point.
        altitudes_m: above mean sea level, one a point; none where the file has none.
        above_ground: the altitudes are above the ground instead.
        fences: areas that come with it, their positions as those of the points.
        notes: what else is in the file and does not change the path, a line each.
    """

    local: bool
    positions: tuple[tuple[float, float], ...]
    altitudes_m: tuple[float, ...]
    above_ground: bool = False
    fences: Fences = field(default_factory=Fences)
    notes: tuple[str, ...] = ()


def of_points(
    points: Sequence[Point],
    where: str,
    fences: Fences,
    notes: Sequence[str],
    above_ground: bool = False,
) -> PathAsRead:
    """A path in degrees.

    Raises:
        InputError: some of its points have an altitude, and others none.
    """
    heights = tuple(altitude for *_, altitude in points if altitude is not None)
    if heights and len(heights) != len(points):
        raise InputError(
            f"{where}: has an altitude at {len(heights)} of {len(points)} points; give it at all or none"
        )
    positions = tuple((latitude, longitude) for latitude, longitude, _ in points)
    return PathAsRead(False, positions, heights, above_ground and bool(heights), fences, tuple(notes))


def parsed_json(text: str, source: str) -> Any:
    """What a JSON text holds; a fault of it names the file.

    Raises:
        InputError: it is not JSON, has a key twice in one place, or a number that is not finite.
    """

    def refuse(name: str) -> NoReturn:
        raise InputError(f"{source}: has the number {name}; must be finite")

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [name for name, _ in pairs]
            again = next(name for name in names if names.count(name) > 1)
            raise InputError(f"{source}: has the key {shown(again)!r} twice in one place; must have it once")
        return found

    try:
        return json.loads(text, parse_constant=refuse, object_pairs_hook=once)
    except json.JSONDecodeError as error:
        raise InputError(f"{source}:{error.lineno}: is not JSON ({error.msg})") from error
    except RecursionError as error:
        raise InputError(f"{source}: is nested too deeply; must be a path") from error
    except InputError:
        raise
    except ValueError as error:  # what Python says of a number of thousands of digits
        raise InputError(f"{source}: has a number that is too long; must be a path") from error


def finite(value: Any, where: str) -> float:
    """A finite number, from JSON or from text."""
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        told = "missing, or null" if value is None else repr(shown(str(value)))
        raise InputError(f"{where}: is {told}; must be a finite number")
    return number


def whole(value: Any, where: str) -> int:
    """A whole number, from JSON or from text."""
    number = finite(value, where)
    if number != int(number):
        raise InputError(f"{where}: is {number:g}; must be a whole number")
    return int(number)


def shown(text: str) -> str:
    """A text as a line can show it."""
    short = text if len(text) <= 80 else f"{text[:77]}..."
    return short if short.isprintable() else ascii(short)
