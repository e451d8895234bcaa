"""Which parts of what was planned could be tracked, and why the others could not.

A plan is trackable where the aircraft stayed as close to it as the planner counted on. Planners put a margin
between their paths and the wanted clearance, by default the larger of a tenth of the clearance and twice the
tracking error that the aircraft promises; a larger cross-track error uses up distance from an obstacle that
was asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.record import AcceptedPlan, FloatArray, Track
from harness.smoothness import planned_profile, window_m

SHORTEST_LEG_S = 5.0
"""A plan flown for less time is judged together with its successor."""

LEAD_S = 5.0
"""The cause is looked for in this time before the largest cross-track error."""

SATURATED_SHARE = 0.2
"""Share of that time with the bank command at its limit that makes the bank limit the cause."""

WIND_SHARE = 0.1
"""Cross-wind, as a share of the airspeed, from which on a drift downwind is the wind's."""

GRAVITY_MPS2 = 9.80665


@dataclass(frozen=True)
class FlightLimits:
    """What a flight is measured against.

    Attributes:
        altitude_m: altitude to be held, above mean sea level.
        clearance_m: wanted distance from every obstacle edge.
        bank_limit_rad: largest roll command of the guidance.
        turn_radius_m: smallest radius a plan may have.
        tracking_error_m: cross-track error that the guidance is to stay within.
    """

    altitude_m: float
    clearance_m: float
    bank_limit_rad: float
    turn_radius_m: float
    tracking_error_m: float

    @property
    def cross_track_threshold_m(self) -> float:
        """The larger of a tenth of the clearance and two tracking errors."""
        return max(0.1 * self.clearance_m, 2.0 * self.tracking_error_m)


@dataclass(frozen=True)
class Leg:
    """A stretch of flight under one plan, and the verdict on it.

    Attributes:
        start_s: simulated time of its first row.
        end_s: simulated time of its last row.
        max_cross_track_m: largest absolute cross-track error.
        threshold_m: what it may be.
        trackable: whether it stayed within.
        cause: why not: "lost control", "turn radius too tight" (the plan bends more than the aircraft's
            smallest radius), "bank limit" (the guidance asked for all the bank there is), "wind drift" (off
            downwind in a cross-wind), or "tracking error" (none of these); None where trackable.
    """

    start_s: float
    end_s: float
    max_cross_track_m: float
    threshold_m: float
    trackable: bool
    cause: str | None


def legs(
    track: Track, plans: Sequence[AcceptedPlan], limits: FlightLimits, lost_control: bool = False
) -> tuple[Leg, ...]:
    """Judges a flight leg by leg.

    Args:
        track: the flown track.
        plans: `plans[i]` is the plan of rows with `plan_index` i.
        limits: what to judge by.
        lost_control: the flight ended so; its last leg is then not trackable.

    Returns:
        The legs in order of time; empty where no plan was flown.
    """
    stretches = _stretches(track)
    return tuple(
        _judge(track, first, last, plans, limits, lost_control and last == len(track) - 1)
        for first, last in stretches
    )


def _stretches(track: Track) -> list[tuple[int, int]]:
    """First and last row of every leg; a short one joins the next, a short last one the one before."""
    flown = np.flatnonzero(track.plan_index >= 0)
    if not len(flown):
        return []
    changes = np.flatnonzero(np.diff(track.plan_index[flown]) != 0) + 1
    bounds = [0, *changes.tolist(), len(flown)]
    joined: list[tuple[int, int]] = []
    first = int(flown[0])
    for end in bounds[1:]:
        last = int(flown[end - 1])
        if track.time_s[last] - track.time_s[first] >= SHORTEST_LEG_S:
            joined.append((first, last))
            first = last + 1
    if first <= flown[-1]:
        start = joined.pop()[0] if joined else first
        joined.append((start, int(flown[-1])))
    return joined


def _judge(
    track: Track,
    first: int,
    last: int,
    plans: Sequence[AcceptedPlan],
    limits: FlightLimits,
    lost_control: bool,
) -> Leg:
    error = np.abs(track.cross_track_m[first : last + 1])
    peak = first + int(np.nanargmax(error))
    largest = float(error[peak - first])
    threshold = limits.cross_track_threshold_m
    cause = None
    if lost_control:
        cause = "lost control"
    elif largest > threshold:
        begin = int(np.searchsorted(track.time_s, track.time_s[peak] - LEAD_S))
        cause = _cause(_rows(track, begin, peak + 1), plans, limits)
    return Leg(
        start_s=float(track.time_s[first]),
        end_s=float(track.time_s[last]),
        max_cross_track_m=largest,
        threshold_m=threshold,
        trackable=cause is None,
        cause=cause,
    )


def _cause(before: Track, plans: Sequence[AcceptedPlan], limits: FlightLimits) -> str:
    """Why the cross-track error became large, from the rows before its peak."""
    planned = planned_profile(before, plans, window_m(before))
    bend = float(np.abs(planned.curvature_1pm).max(initial=0.0))
    if bend * limits.turn_radius_m > 1.001:
        return "turn radius too tight"
    if saturated(before, limits.bank_limit_rad).mean() >= SATURATED_SHARE:
        return "bank limit"
    drift = _wind_from_left_mps(before)
    if abs(drift) >= WIND_SHARE * before.airspeed_mps.mean() and drift * before.cross_track_m[-1] > 0:
        return "wind drift"
    return "tracking error"


def saturated(track: Track, bank_limit_rad: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(n,) whether the bank command is at its limit, to a hundredth of a degree."""
    at_limit: np.ndarray[tuple[int], np.dtype[np.bool_]]
    at_limit = np.abs(track.roll_command_deg) >= math.degrees(bank_limit_rad) - 0.01
    return at_limit


def _wind_from_left_mps(track: Track) -> float:
    """Mean wind across the course, positive towards the right; sideslip is taken to be zero."""
    angle = np.radians(track.heading_deg - track.course_deg)
    across: FloatArray = -track.airspeed_mps * np.sin(angle)
    return float(across.mean())


def _rows(track: Track, first: int, stop: int) -> Track:
    """A part of a track."""
    return Track(**{name: column[first:stop] for name, column in vars(track).items()})
