"""Flights recorded by gliders' loggers: IGC files (FAI, Technical Specification for GNSS Flight Recorders)."""

from __future__ import annotations

import io
import math
import re
from typing import Any, Final

from harness.files.input_file import InputError
from harness.run_files.drawn_lines import PathAsRead

FLYING_MPS: Final = 12.0
"""Before the first fix and after the last at this ground speed the aircraft rolls, or stands."""
FASTEST_MPS, STEEPEST_MPS = 150.0, 80.0
"""No glider flies faster than these over the ground, and up or down: a fix that is so far from both its neighbours is
an error of the receiver."""
MOST_BROKEN: Final = 0.05
"""A file of which a larger share of fixes cannot be read is refused."""
DATE: Final = re.compile(r"^H[FOP]DTE", re.MULTILINE)
EARTH_M: Final = 6_371_000.0
NEEDS_LOGS: Final = "needs the extra wayproof[logs]: pip install 'wayproof[logs]'"

Fix = dict[str, Any]
"""A fix as aerofiles has it."""


def read_igc(text: str, source: str) -> PathAsRead:
    """The fixes of a flight, from the takeoff to the landing, at their GNSS altitude; InputError without a flight.

    Where the logger has no GNSS altitude (0 or no 3-D fix), all of it is at the pressure altitude.
    """
    fixes, broken = igc_fixes(text, source)
    placed = [fix for fix in fixes if abs(fix["lat"]) > 1e-9 or abs(fix["lon"]) > 1e-9]
    right = _without_leaps(placed)
    moving = [k for k in range(1, len(right)) if _speed_mps(right[k - 1], right[k]) >= FLYING_MPS]
    flown = right[moving[0] - 1 : moving[-1] + 1] if moving else []
    if len(flown) < 2:
        raise InputError(f"{source}: has {len(fixes)} fixes, none of them in flight; must be a flight")
    known, kind, note = _with_altitude(flown)
    counts = {
        "fixes without an altitude passed over: the logger has no barometer": len(flown) - len(known),
        "B records that cannot be read passed over": broken,
        "fixes too far from both neighbours passed over": len(placed) - len(right),
        "fixes on the ground not flown": len(right) - len(flown),
        "fixes without a position passed over": len(fixes) - len(placed),
    }
    return PathAsRead(
        False,
        tuple((float(fix["lat"]), float(fix["lon"])) for fix in known),
        tuple(float(fix[kind] or 0.0) for fix in known) if kind else (),
        notes=(note, *(f"{count} {what}" for what, count in counts.items() if count)),
    )


def _with_altitude(flown: list[Fix]) -> tuple[list[Fix], str, str]:
    """The fixes that have the altitude they are flown at, its key, and what is said of it."""
    known = [fix for fix in flown if fix["gps_alt"] not in (None, 0) and fix.get("validity") != "V"]
    if len(known) < len(flown) and any(fix["pressure_alt"] for fix in flown):
        return flown, "pressure_alt", "pressure altitudes of the logger taken as above the sea"
    if len(known) < 2:
        return flown, "", "its logger has no altitudes"
    return known, "gps_alt", "GNSS altitudes of the logger taken as above the sea"


def igc_fixes(text: str, source: str) -> tuple[list[Fix], int]:
    """The fixes of a file, and how many more cannot be read.

    Raises:
        InputError: it is no IGC file, most of it cannot be read, or aerofiles is not installed.
    """
    try:
        from aerofiles.igc import Reader
    except ImportError as error:
        raise InputError(f"{source}: {NEEDS_LOGS} ({error.name})") from error
    if not text.lstrip("\ufeff").startswith("A"):
        raise InputError(f"{source}:1: must begin with an A record, the logger's number; is no IGC file")
    if not DATE.search(text):
        raise InputError(f"{source}: has no date (an HFDTE record); must have one before the first fix")
    try:
        read = Reader(skip_duplicates=True).read(io.StringIO(text))  # of a broken line it keeps the error
    except Exception as error:  # whatever its parser meets
        raise InputError(f"{source}: is not IGC ({type(error).__name__}: {error})") from error
    broken, fixes = read["fix_records"]
    if len(broken) > MOST_BROKEN * len(fixes):
        raise InputError(
            f"{source}: has {len(broken)} B records that cannot be read, of {len(broken) + len(fixes)}; must be at "
            f"most {MOST_BROKEN:.0%}"
        )
    return list(fixes), len(broken)


def _without_leaps(fixes: list[Fix]) -> list[Fix]:
    """The fixes without those that are too far from both their neighbours, which are not too far from each other."""
    kept = fixes[:1]
    for fix, after in zip(fixes[1:], [*fixes[2:], None], strict=True) if fixes else ():
        out = after is not None and _leaps(fix, after) and not _leaps(kept[-1], after)
        if not (out and _leaps(kept[-1], fix)):
            kept.append(fix)
    return kept


def _leaps(before: Fix, after: Fix) -> bool:
    """Whether no glider gets from one fix to another in the time between them."""
    elapsed_s = (after["datetime"] - before["datetime"]).total_seconds()
    ends = before["gps_alt"], after["gps_alt"]
    rise_m = ends[1] - ends[0] if all(ends) else 0.0  # 0: the logger has none
    steep = abs(rise_m) > STEEPEST_MPS * elapsed_s
    return elapsed_s > 0 and (_speed_mps(before, after) > FASTEST_MPS or steep)


def _speed_mps(before: Fix, after: Fix) -> float:
    """Ground speed between two fixes."""
    north = math.radians(after["lat"] - before["lat"])
    east = math.radians(math.remainder(after["lon"] - before["lon"], 360.0))
    elapsed_s = (after["datetime"] - before["datetime"]).total_seconds()
    away_m = EARTH_M * math.hypot(north, east * math.cos(math.radians(after["lat"])))
    return away_m / elapsed_s if elapsed_s > 0 else 0.0
