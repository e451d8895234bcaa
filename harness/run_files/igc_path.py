"""Flights recorded by gliders' loggers: IGC files (FAI, Technical Specification for GNSS Flight Recorders)."""

from __future__ import annotations

import io
import math
import re
from typing import Any, Final

from harness.files.input_file import InputError
from harness.run_files.path_as_read import PathAsRead

FLYING_MPS: Final = 12.0
"""Before the first fix and after the last at this ground speed the aircraft rolls, or stands."""

FASTEST_MPS: Final = 150.0
STEEPEST_MPS: Final = 80.0
"""Faster than these over the ground, and up or down, no glider flies: a fix that is so far from both its neighbours is
an error of the receiver."""

MOST_BROKEN: Final = 0.05
"""A file of which a larger share of fixes cannot be read is refused."""

DATE: Final = re.compile(r"^H[FOP]DTE", re.MULTILINE)
EARTH_M: Final = 6_371_000.0


def read_igc(text: str, source: str) -> PathAsRead:
    """The fixes of a flight, from the takeoff to the landing, at their GNSS altitude.

    Where the logger has no GNSS altitude (0 or no 3-D fix), all of it is at the pressure altitude.

    Args:
        text: of the file.
        source: its name, for faults.

    Raises:
        InputError: it is no IGC file, or has no flight in it.
    """
    fixes, broken = _fixes(text, source)
    valid = [fix for fix in fixes if abs(fix["lat"]) > 1e-9 or abs(fix["lon"]) > 1e-9]
    right = _without_leaps(valid)
    flown = _in_flight(right)
    if len(flown) < 2:
        raise InputError(f"{source}: has {len(fixes)} fixes, none of them in flight; must be a flight")
    known, kind, notes = _with_altitudes(flown)
    if broken:
        notes.append(f"{broken} B records that cannot be read passed over")
    if len(valid) > len(right):
        leaps = len(valid) - len(right)
        notes.append(f"{leaps} {'fix' if leaps == 1 else 'fixes'} too far from both neighbours passed over")
    if len(right) > len(flown):
        notes.append(f"{len(right) - len(flown)} fixes on the ground not flown")
    if len(fixes) > len(valid):
        notes.append(f"{len(fixes) - len(valid)} fixes without a position passed over")
    return PathAsRead(
        False,
        tuple((float(fix["lat"]), float(fix["lon"])) for fix in known),
        tuple(float(fix[kind] or 0.0) for fix in known if kind),
        notes=tuple(notes),
    )


def _with_altitudes(flown: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], str, list[str]]:
    """Fixes that have an altitude, the name of the one that they have, and what to say of it.

    Where the logger has none, all fixes and no name.
    """
    by_satellites = [fix for fix in flown if fix["gps_alt"] not in (None, 0) and fix.get("validity") != "V"]
    if len(by_satellites) == len(flown):
        return flown, "gps_alt", ["GNSS altitudes of the logger taken as above the sea"]
    if any(fix["pressure_alt"] for fix in flown):
        return flown, "pressure_alt", ["pressure altitudes of the logger taken as above the sea"]
    if len(by_satellites) < 2:
        return flown, "", ["its logger has no altitudes"]
    notes = [
        "GNSS altitudes of the logger taken as above the sea",
        f"{len(flown) - len(by_satellites)} fixes without an altitude passed over: the logger has no barometer",
    ]
    return by_satellites, "gps_alt", notes


def _fixes(text: str, source: str) -> tuple[list[dict[str, Any]], int]:
    """The fixes of a file, and how many more cannot be read."""
    from aerofiles.igc import Reader

    if not text.lstrip("\ufeff").startswith("A"):
        raise InputError(f"{source}:1: must begin with an A record, the logger's number; is no IGC file")
    if not DATE.search(text):
        raise InputError(f"{source}: has no date (an HFDTE record); must have one before the first fix")
    # A reader that goes on after a broken line; of each it keeps the error.
    try:
        read = Reader(skip_duplicates=True).read(io.StringIO(text))
    except Exception as error:  # whatever its parser meets
        raise InputError(f"{source}: is not IGC ({type(error).__name__}: {error})") from error
    broken, fixes = read["fix_records"]
    if len(broken) > MOST_BROKEN * len(fixes):
        raise InputError(
            f"{source}: has {len(broken)} B records that cannot be read, of {len(broken) + len(fixes)}; must be at "
            f"most {MOST_BROKEN:.0%}"
        )
    return list(fixes), len(broken)


def _in_flight(fixes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The fixes from the first to the last that is flown."""
    flying = [
        place for place in range(1, len(fixes)) if _speed_mps(fixes[place - 1], fixes[place]) >= FLYING_MPS
    ]
    return fixes[flying[0] - 1 : flying[-1] + 1] if flying else []


def _without_leaps(fixes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The fixes without those that are too far from both their neighbours, which are not too far from each other."""
    kept = fixes[:1]
    for place in range(1, len(fixes)):
        fix, after = fixes[place], fixes[place + 1] if place + 1 < len(fixes) else None
        if after is None or not (
            _leaps(kept[-1], fix) and _leaps(fix, after) and not _leaps(kept[-1], after)
        ):
            kept.append(fix)
    return kept


def _leaps(before: dict[str, Any], after: dict[str, Any]) -> bool:
    """Whether no glider gets from one fix to another in the time between them."""
    elapsed_s = (after["datetime"] - before["datetime"]).total_seconds()
    ends = before["gps_alt"], after["gps_alt"]
    rise_m = ends[1] - ends[0] if all(ends) else 0.0  # 0: the logger has none
    return elapsed_s > 0 and (
        _speed_mps(before, after) > FASTEST_MPS or abs(rise_m) > STEEPEST_MPS * elapsed_s
    )


def _speed_mps(before: dict[str, Any], after: dict[str, Any]) -> float:
    """Ground speed between two fixes."""
    north = math.radians(after["lat"] - before["lat"])
    east = math.radians(math.remainder(after["lon"] - before["lon"], 360.0)) * math.cos(
        math.radians(after["lat"])
    )
    elapsed_s = (after["datetime"] - before["datetime"]).total_seconds()
    return EARTH_M * math.hypot(north, east) / elapsed_s if elapsed_s > 0 else 0.0
