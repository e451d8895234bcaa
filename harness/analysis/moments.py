"""When in a flight its figures came about: a figure without a time sends the reader through the whole recording."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from harness.analysis.smoothness import flown_profile
from harness.flight.record import FloatArray, Track

BANK_SLACK_DEG = 0.01
"""As near to the largest bank command counts as at the limit."""


def moments(track: Track, clearance_m: float, bank_at_limit: bool) -> Mapping[str, float]:
    """Simulated time, s, of the largest and least figures of a track, by `Metric.short`; without those it has not.

    Of several equal values the first counts. The time below the wanted clearance has its beginning, and so has that at
    the bank limit.

    Args:
        track: with at least one row.
        clearance_m: the wanted one.
        bank_at_limit: whether the bank command was ever at its limit; then its largest value is the limit.
    """
    bank_deg = np.abs(track.roll_command_deg)
    top_deg = bank_deg.max(initial=0.0) - BANK_SLACK_DEG if bank_at_limit else np.inf
    rows = {
        "clear m": _largest(-track.clearance_m),
        "below s": _first(track.clearance_m < clearance_m),
        "κ·R fl.": _largest(np.abs(flown_profile(track).curvature_1pm)),
        "bank %": _first(bank_deg >= top_deg),
        "tse max": _largest(np.where(track.plan_index >= 0, np.abs(track.cross_track_m), np.nan)),
    }
    if track.has_beliefs:
        off_m = track.believed_m[:, :2] - np.column_stack((track.east_m, track.north_m))
        jump = _largest(np.hypot(*np.diff(off_m, axis=0).T))
        rows |= {
            "nav max": _largest(track.navigation_error_m),
            "nav jump": None if jump is None else jump + 1,
        }
    return {short: float(track.time_s[row]) for short, row in rows.items() if row is not None}


def _largest(values: FloatArray) -> int | None:
    """The first row with the largest finite value; None where no value is finite, or all are 0."""
    known = np.where(np.isfinite(values), values, -np.inf)
    return int(known.argmax()) if np.isfinite(known).any() and known.any() else None


def _first(holds: NDArray[np.bool_]) -> int | None:
    return int(holds.argmax()) if holds.any() else None
