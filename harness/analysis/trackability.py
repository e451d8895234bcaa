"""Which parts of what was planned could be tracked, and why the others could not.

A plan is trackable where the true position stayed within `FlightLimits.cross_track_threshold_m` of it. A path that was
given is judged as it was given, corner by corner, not by the arcs that were made of it. Altitude, airspeed and load
factor have limits of their own. No limit depends on who flies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.analysis.as_given import AsGiven, Corner
from harness.analysis.causes import (
    LEAD_S,
    NAVIGATION_ERROR,
    PLAN_ENDED,
    altitude_cause,
    averaged,
    corner_cause,
    cross_track_cause,
    speed_cause,
    steepness_cause,
)
from harness.analysis.deviation import ABOUT
from harness.analysis.findings import is_past_end
from harness.analysis.flight_limits import LOAD_S, SPEED_S, FlightLimits
from harness.analysis.in_force import InForce
from harness.flight.record import AcceptedPlan, FloatArray, IntArray, Track

SHORTEST_LEG_S = 5.0
"""A plan flown for less time is judged together with its successor."""


@dataclass(frozen=True)
class Leg:
    """A stretch of flight under one plan, and the verdict on it.

    Errors are absolute; airspeed is averaged over `SPEED_S` (None where it is not judged), load factor over `LOAD_S`.
    `threshold_m` is what the cross-track error may be. `waypoint` is the number of the point of a given path that the
    leg leads to, `corner_cut_m` how far from the corner there the plan passes, `max_deviation_m` the largest distance
    from the path as given. Of several limits that were exceeded the first is the cause: control lost, cross-track error
    or distance from the path as given, load factor, airspeed, altitude.
    """

    start_s: float
    end_s: float
    max_cross_track_m: float
    threshold_m: float
    max_altitude_error_m: float
    max_airspeed_error_mps: float | None
    max_load_factor: float
    waypoint: int | None
    corner_cut_m: float
    max_deviation_m: float | None
    trackable: bool
    cause: str | None


@dataclass(frozen=True, eq=False)
class _Flown:
    """A flight that is judged: its track and plans, the limits, what was in force, and the path that was given."""

    track: Track
    plans: Sequence[AcceptedPlan]
    limits: FlightLimits
    force: InForce
    given: AsGiven | None

    def wanted(self, rows: slice) -> tuple[FloatArray | float, FloatArray | float]:
        """Altitude and airspeed to be held at some rows."""
        if self.given is None:
            return self.limits.altitude_m, self.limits.airspeed_mps
        return self.given.altitude_m[rows], self.given.airspeed_mps[rows]

    def unheld_mps(self, first: int, rows: int) -> float:
        """Mean over some rows of how far the airspeed asked for is beyond those that the aircraft holds."""
        beyond = np.broadcast_to(self.given.unheld_mps if self.given else 0.0, len(self.track))
        return float(beyond[first : first + rows].mean())


def legs(
    track: Track,
    plans: Sequence[AcceptedPlan],
    limits: FlightLimits,
    lost: str | None = None,
    given: AsGiven | None = None,
) -> tuple[Leg, ...]:
    """Judges a flight leg by leg; empty where no plan was flown.

    Args:
        track: the flown track.
        plans: `plans[i]` is the plan of rows with `plan_index` i.
        limits: what to judge by.
        lost: why control was lost at the end of the flight, whose last leg is then not trackable; None: it was not.
        given: the path as given that the only plan follows.
    """
    flown = _Flown(
        track, plans, limits, InForce.of(track, limits, given.airspeed_mps if given else None), given
    )
    past_end = is_past_end(track, plans, limits)
    corners = given.corners if given else ()
    ends = np.array([corner.arc_length_m for corner in corners])
    number = track.plan_index + np.searchsorted(ends, track.arc_length_m) if corners else track.plan_index
    along = np.maximum.accumulate(np.nan_to_num(track.arc_length_m))
    reached = np.searchsorted(along, ends) - 1
    judged, over_m = [], -math.inf
    for first, last in _stretches(track, number):
        leg = _judge(flown, first, last)
        if given is not None:
            # All of a corner belongs to the leg that it ends.
            passed = [c for c, row in zip(corners, reached, strict=True) if first <= row <= last]
            since_m, over_m = over_m, passed[-1].arc_length_m + passed[-1].half_m if passed else math.inf
            rows = np.flatnonzero((along > since_m) & (along <= over_m))
            leg = _judged_as_given(leg, flown, given, rows, passed)
        if past_end[first : last + 1].any():
            leg = replace(leg, trackable=False, cause=PLAN_ENDED)
        judged.append(leg)
    if lost is not None and judged and last == len(track) - 1:
        judged[-1] = replace(
            judged[-1], trackable=False, cause="stall" if "stalled" in lost else "lost control"
        )
    return tuple(judged)


def _stretches(track: Track, leg: IntArray) -> list[tuple[int, int]]:
    """First and last row of every leg; a short one joins the next, a short last one the one before."""
    flown = np.flatnonzero(track.plan_index >= 0)
    if not len(flown):
        return []
    changes = np.flatnonzero(np.diff(leg[flown]) != 0) + 1
    joined: list[tuple[int, int]] = []
    first = int(flown[0])
    for end in [*changes.tolist(), len(flown)]:
        last = int(flown[end - 1])
        if track.time_s[last] - track.time_s[first] >= SHORTEST_LEG_S:
            joined.append((first, last))
            first = last + 1
    if first <= flown[-1]:
        start = joined.pop()[0] if joined else first
        joined.append((start, int(flown[-1])))
    return joined


def _judge(flown: _Flown, first: int, last: int) -> Leg:
    """A leg by its plan, or of a given path by altitude, airspeed and load factor alone."""
    leg, limits = flown.track.part(first, last + 1), flown.limits
    wanted_m, commanded_mps = flown.wanted(slice(first, last + 1))
    off, high = np.nan_to_num(np.abs(leg.cross_track_m)), np.abs(leg.up_m - wanted_m)
    slow = np.abs(averaged(leg.airspeed_mps - commanded_mps, leg, SPEED_S))
    loads = averaged(leg.load_factor, leg, LOAD_S)
    cause = None
    if flown.given is None and off.max() > limits.cross_track_threshold_m:
        cause = _cross_track_cause(flown, leg, first, int(off.argmax()))
    elif loads.max() > limits.max_load_factor:
        cause = _steep(flown, first + int(loads.argmax()), len(leg) - len(loads) + 1) or "load factor"
    elif slow.max() > limits.max_airspeed_error_mps:
        begins, rows = int(slow.argmax()), len(leg) - len(slow) + 1
        cause = _steep(flown, first + begins, rows)
        if cause is None and flown.unheld_mps(first + begins, rows) > limits.max_airspeed_error_mps:
            cause = "speed or throttle saturation"
        cause = cause or speed_cause(leg.part(begins, begins + rows), limits)
    elif high.max() > limits.max_altitude_error_m:
        cause = _altitude_cause(flown, leg, wanted_m, first, int(high.argmax()))
    return Leg(
        start_s=float(leg.time_s[0]),
        end_s=float(leg.time_s[-1]),
        max_cross_track_m=float(off.max()),
        threshold_m=limits.cross_track_threshold_m,
        max_altitude_error_m=float(high.max()),
        max_airspeed_error_mps=float(slow.max()) if np.isfinite(slow.max()) else None,
        max_load_factor=float(loads.max()),
        waypoint=None,
        corner_cut_m=0.0,
        max_deviation_m=None,
        trackable=cause is None,
        cause=cause,
    )


def _cross_track_cause(flown: _Flown, leg: Track, first: int, row: int) -> str:
    """Why a leg is off its plan at a row of it."""
    if _is_misled(leg.believed_cross_track_m, leg.cross_track_m, flown.limits.cross_track_threshold_m, row):
        return NAVIGATION_ERROR
    return cross_track_cause(flown.track, first + row, flown.plans, flown.limits, flown.force)


def _altitude_cause(flown: _Flown, leg: Track, wanted_m: FloatArray | float, first: int, row: int) -> str:
    """Why a leg is off its altitude at a row of it."""
    believed = None if leg.believed_up_m is None else leg.believed_up_m - wanted_m
    if _is_misled(believed, leg.up_m - wanted_m, flown.limits.max_altitude_error_m, row):
        return NAVIGATION_ERROR
    return altitude_cause(flown.track, first + row, flown.limits, flown.given)


def _is_misled(believed: FloatArray | None, true: FloatArray, most: float, row: int) -> bool:
    """Whether the larger part of the largest true error, or all of it beyond the limit, is navigation's.

    It is not where the belief is unknown. At other rows the aircraft may have believed to be off: it flies to where its
    first fix says that it should be.
    """
    if believed is None or not np.isfinite(believed[row]):
        return False
    return bool(abs(believed[row]) <= max(most, abs(true[row] - believed[row])))


def _steep(flown: _Flown, first: int, rows: int) -> str | None:
    """Whether the path was too steep over the rows of a mean, or shortly before."""
    time_s = flown.track.time_s
    since = int(np.searchsorted(time_s, time_s[first] - LEAD_S))
    return steepness_cause(flown.track, since, first + rows, flown.given)


def _judged_as_given(
    leg: Leg, flown: _Flown, given: AsGiven, rows: IntArray, passed: Sequence[Corner]
) -> Leg:
    """A leg that is not trackable either where it is too far from the path as given; the last corner is at its end."""
    off, cause = np.nan_to_num(given.deviation_m[rows]), leg.cause
    excess = off - given.allowed_m[rows]
    if len(rows) and excess.max() > 0.0:
        cause = _cause_off_given(flown, given, int(rows[excess.argmax()]))
    return replace(
        leg,
        waypoint=passed[-1].waypoint if passed else None,
        corner_cut_m=max((corner.cut_m for corner in passed), default=0.0),
        max_deviation_m=float(off.max(initial=0.0)),
        trackable=cause is None,
        cause=cause,
    )


def _cause_off_given(flown: _Flown, given: AsGiven, worst: int) -> str:
    """Why the aircraft is too far off the path as given, at the row where that is worst."""
    track, believed_m = flown.track, given.believed_off_m
    allowed_m, along_m = float(given.allowed_m[worst]), float(track.arc_length_m[worst])
    if believed_m is not None and believed_m[worst] <= max(allowed_m, track.navigation_error_m[worst]):
        return NAVIGATION_ERROR
    for corner in given.corners:
        reach_m = max(corner.half_m, ABOUT * allowed_m)
        after_m = reach_m + LEAD_S * float(track.groundspeed_mps[worst])
        if -reach_m <= along_m - corner.arc_length_m <= after_m:
            cause = corner_cause(corner, allowed_m, worst, flown.force)
            if cause is not None:
                return cause
    return cross_track_cause(track, worst, flown.plans, flown.limits, flown.force)
