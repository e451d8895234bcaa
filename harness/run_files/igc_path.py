"""Flights recorded by gliders' loggers: IGC files (FAI, Technical Specification for GNSS Flight Recorders)."""

from __future__ import annotations

import io
import re
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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

FloatArray = NDArray[np.float64]
Fix = dict[str, Any]
"""A fix as aerofiles has it."""


def read_igc(text: str, source: str) -> PathAsRead:
    """The fixes of a flight, from the takeoff to the landing, at their GNSS altitude; InputError without a flight.

    Where the logger has no GNSS altitude (0 or no 3-D fix), all of it is at the pressure altitude.
    """
    fixes, broken = igc_fixes(text, source)
    rows = np.array([_row(fix) for fix in fixes], dtype=np.float64).reshape(-1, 5)
    placed = rows[np.abs(rows[:, :2]).max(axis=1) > 1e-9]
    first, second = placed[:-1], placed[1:]
    leaps, over = _leaps(first, second), _leaps(placed[:-2], placed[2:])
    right = placed[~np.pad(leaps[:-1] & leaps[1:] & ~over, 1)] if len(placed) > 2 else placed
    moving = np.flatnonzero(
        _away_m(right[:-1], right[1:]) >= FLYING_MPS * np.maximum(np.diff(right[:, 4]), 1e-9)
    )
    flown = right[moving[0] : moving[-1] + 2] if len(moving) else right[:0]
    if len(flown) < 2:
        raise InputError(f"{source}: has {len(fixes)} fixes, none of them in flight; must be a flight")
    altitudes, note = flown[:, 2], "GNSS altitudes of the logger taken as above the sea"
    if (altitudes == 0).any() and (flown[:, 3] != 0).any():
        altitudes, note = flown[:, 3], "pressure altitudes of the logger taken as above the sea"
        known = np.full(len(flown), True)
    else:
        known = altitudes != 0
    if known.sum() < 2:
        known, altitudes, note = ~known | known, altitudes[:0], "its logger has no altitudes"
    counts = {
        "fixes without an altitude passed over: the logger has no barometer": len(flown) - int(known.sum()),
        "B records that cannot be read passed over": broken,
        "fixes too far from both neighbours passed over": len(placed) - len(right),
        "fixes on the ground not flown": len(right) - len(flown),
        "fixes without a position passed over": len(rows) - len(placed),
    }
    notes = (note, *(f"{count} {what}" for what, count in counts.items() if count))
    places = ((latitude, longitude) for latitude, longitude in flown[known, :2].tolist())
    return PathAsRead(
        False, tuple(places), tuple(altitudes[known].tolist()) if len(altitudes) else (), notes=notes
    )


def _row(fix: Fix) -> tuple[float, ...]:
    """Latitude, longitude, GNSS altitude or 0 without a 3-D fix, pressure altitude or 0, and time (s) of a fix."""
    height = 0.0 if fix.get("validity") == "V" else fix["gps_alt"] or 0.0
    return fix["lat"], fix["lon"], height, fix["pressure_alt"] or 0.0, fix["datetime"].timestamp()


def _away_m(before: FloatArray, after: FloatArray) -> FloatArray:
    """Distances over the ground from fixes to others."""
    north, east = np.radians((after - before)[:, :2]).T
    east = np.remainder(east + np.pi, 2.0 * np.pi) - np.pi
    away: FloatArray = EARTH_M * np.hypot(north, east * np.cos(np.radians(after[:, 0])))
    return away


def _leaps(before: FloatArray, after: FloatArray) -> NDArray[np.bool_]:
    """Whether no glider gets from fixes to others in the time between them."""
    elapsed = after[:, 4] - before[:, 4]
    rise = np.where(
        before[:, 2] * after[:, 2] != 0, after[:, 2] - before[:, 2], 0.0
    )  # 0: the logger has none
    fast = (_away_m(before, after) > FASTEST_MPS * elapsed) | (np.abs(rise) > STEEPEST_MPS * elapsed)
    found: NDArray[np.bool_] = fast & (elapsed > 0.0)
    return found


def igc_fixes(text: str, source: str) -> tuple[list[Fix], int]:
    """The fixes of a file, and how many more cannot be read."""
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
