"""What happened in a flight that its outcome does not say: plans that ended, came late or contradict each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from harness.analysis.flight_limits import FlightLimits
from harness.analysis.smoothness import flown_profile, smoothness, tangent_of
from harness.flight.record import AcceptedPlan, Flight, FloatArray, Track

IN_TIME_S: Final = 1.0  # what ends, or a plan that comes, within this time of the end of a plan is in time
AHEAD_S: Final = 5.0  # two plans are compared where they lead to within this time of flight
APART_DEG: Final = 15.0
"""A plan leads to one side of the course if it turns away from it by at least this angle within `AHEAD_S`."""
FEW_CONTRADICTIONS: Final = 2
"""Up to this many contradictions of plans are no finding: what is sensed for the first time may turn a plan round."""
BANKED_DEG: Final = 10.0  # a bank command of at least this angle counts as a bank to one side


@dataclass(frozen=True)
class Finding:
    """One thing that happened in a flight, for the first time at `time_s`, and that its outcome does not say.

    `kind` is `plan ended`, `planner slower than the scans` or `plans contradict each other`; `text` a clause with
    figures.
    """

    kind: str
    time_s: float
    text: str


def findings(flight: Flight, limits: FlightLimits) -> tuple[Finding, ...]:
    """All findings of a flight, in order of time."""
    found = (_plan_ended(flight, limits), _planner_too_slow(flight, limits), _plans_contradict(flight))
    return tuple(sorted((each for each in found if each is not None), key=lambda each: each.time_s))


def beyond_end_m(track: Track, plans: Sequence[AcceptedPlan]) -> FloatArray:
    """(n,) how far beyond the end of the plan in effect the aircraft is; 0 on it, without one, and if it loiters."""
    length = np.array([plan.length_m for plan in plans])
    flown = track.plan_index >= 0
    beyond = np.zeros(len(track))
    beyond[flown] = np.maximum(track.arc_length_m[flown] - length[track.plan_index[flown]], 0.0)
    return np.nan_to_num(beyond)


def flown_beyond_m(track: Track, plans: Sequence[AcceptedPlan]) -> FloatArray:
    """(n,) how far the aircraft flew beyond the end of its plan, or of one after another within the last `AHEAD_S`."""
    beyond = beyond_end_m(track, plans)
    flown = np.concatenate(([0.0], np.cumsum(np.maximum(np.diff(beyond, prepend=0.0), 0.0))))
    before = np.searchsorted(track.time_s, track.time_s - AHEAD_S)
    within: FloatArray = (flown[1:] - flown[before]) * (beyond > 0.0)
    return np.maximum(beyond, within)


def is_past_end(track: Track, plans: Sequence[AcceptedPlan], limits: FlightLimits) -> NDArray[np.bool_]:
    """(n,) whether the aircraft flew further beyond its plan than it may be off it and flies in a second."""
    allowed_m = limits.cross_track_threshold_m + IN_TIME_S * track.groundspeed_mps
    return np.greater(flown_beyond_m(track, plans), allowed_m)


def bank_reversals_per_min(track: Track) -> float:
    """Counts how often the bank command goes from `BANKED_DEG` on one side to as much on the other, per minute."""
    side = np.sign(track.roll_command_deg)[np.abs(track.roll_command_deg) >= BANKED_DEG]
    minutes = float(track.time_s[-1] - track.time_s[0]) / 60.0
    return float(np.count_nonzero(np.diff(side))) / minutes if minutes > 0.0 else 0.0


def contradictions_s(track: Track, plans: Sequence[AcceptedPlan]) -> list[float]:
    """Times (s) at which a plan took effect that, `AHEAD_S` on, leads to the other side of the course than the last."""
    index = track.plan_index
    times = []
    for row in (np.flatnonzero((np.diff(index) > 0) & (index[:-1] >= 0)) + 1).tolist():
        reach = AHEAD_S * float(track.groundspeed_mps[row])
        course = math.pi / 2.0 - math.radians(float(track.course_deg[row]))
        turns = []
        for at in (row - 1, row):
            east, north = tangent_of(plans[index[at]], float(track.arc_length_m[at]) + reach)
            turns.append(math.remainder(math.atan2(north, east) - course, math.tau))
        if turns[0] * turns[1] < 0.0 and min(map(abs, turns)) >= math.radians(APART_DEG):
            times.append(float(track.time_s[row]))
    return times


def _plan_ended(flight: Flight, limits: FlightLimits) -> Finding | None:
    beyond = flown_beyond_m(flight.track, flight.plans)
    if not len(rows := np.flatnonzero(is_past_end(flight.track, flight.plans, limits))):
        return None
    one = beyond.max() == beyond_end_m(flight.track, flight.plans).max()
    ends = "the end of its plan" if one else f"the ends of plans within {AHEAD_S:g} s"
    text = f"the aircraft flew on up to {beyond.max():,.0f} m beyond {ends}, where nothing was planned"
    return Finding("plan ended", float(flight.track.time_s[rows[0]]), text)


def _planner_too_slow(flight: Flight, limits: FlightLimits) -> Finding | None:
    allowed_ms = 1e3 * max(limits.scan_period_s, limits.compute_latency_s)
    if not (slow := [each for each in flight.compute_ms if each > allowed_ms]):
        return None
    text = (
        f"{len(slow)} of {len(flight.compute_ms)} searches took longer than {allowed_ms:,.0f} ms, up to "
        f"{max(slow):,.0f} ms; scans are {1e3 * limits.scan_period_s:,.0f} ms apart, flown as if they took "
        f"{1e3 * limits.compute_latency_s:,.0f} ms (planner.compute_latency_s)"
    )
    times = [plan.time_s for plan in flight.plans if plan.compute_ms > allowed_ms]
    return Finding("planner slower than the scans", next(iter(times), float(flight.track.time_s[0])), text)


def _plans_contradict(flight: Flight) -> Finding | None:
    if len(times := contradictions_s(flight.track, flight.plans)) <= FEW_CONTRADICTIONS:
        return None
    turned_deg = smoothness(flown_profile(flight.track), 1.0).heading_change_deg
    text = (
        f"{len(times)} of {len(flight.plans)} plans lead to the other side of the course than the one before; "
        f"{bank_reversals_per_min(flight.track):.1f} bank reversals a minute, {turned_deg:.0f} deg turned in all"
    )
    return Finding("plans contradict each other", times[0], text)
