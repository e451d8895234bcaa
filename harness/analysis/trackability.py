"""Which parts of what was planned could be tracked, and why the others could not.

A plan is trackable where the aircraft stayed as close to it as the planner counted on. Planners put a margin
between their paths and the wanted clearance, by default the larger of a tenth of the clearance and twice the
tracking error that the aircraft promises; a larger cross-track error uses up distance from an obstacle that
was asked for. Altitude, airspeed and load factor have limits of their own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.analysis.as_given import AsGiven
from harness.analysis.smoothness import planned_profile, window_m
from harness.flight.record import AcceptedPlan, FloatArray, IntArray, Track
from planner.geometry.margin import tolerance_m

SHORTEST_LEG_S = 5.0
"""A plan flown for less time is judged together with its successor."""

LEAD_S = 5.0
"""The cause is looked for from this time before the error became too large up to where it is largest."""

SPEED_S = 20.0
"""Airspeed is averaged over this, so that it is what the engine can hold and not what a gust adds."""

LOAD_S = 1.0
"""Load factor is averaged over this, so that it is that of the manoeuvre and not that of a gust."""

SATURATED_SHARE = 0.2
"""Share of the lead time with a signal at its limit that makes this limit the cause."""

ROLL_RATE_SHARE = 0.8
"""Share of the roll rate limit from which on the aircraft rolls as fast as it may; the loop behind it lags."""

WIND_SHARE = 0.1
"""Cross-wind, as a share of the airspeed, from which on a drift downwind is the wind's."""

LATE_SHARE = 0.25
"""Share of the largest error there already when the plan took effect that makes the plan too late."""

ROUNDING = 1.001
"""A radius smaller by no more than this factor is not smaller."""

FULL_THROTTLE, IDLE_THROTTLE = 0.99, 0.01


@dataclass(frozen=True)
class FlightLimits:
    """What a flight is measured against.

    Attributes:
        altitude_m: altitude to be held, above mean sea level.
        clearance_m: wanted distance from every obstacle edge.
        bank_limit_rad: largest roll command of the guidance.
        turn_radius_m: smallest radius a plan may have, in the flight's wind and turbulence.
        tracking_error_m: cross-track error that the guidance is to stay within.
        airspeed_mps: true airspeed to be held; NaN where it is not judged.
        calm_radius_m: what `turn_radius_m` would be in calm air; None: the same.
        tightest_radius_m: radius that the bank limit gives at that airspeed in calm air, nothing kept back;
            None: `turn_radius_m`.
        roll_rate_radps: fastest change of the roll command.
        sensor_range_m: how far obstacles are seen.
        horizon_m: how far they have to be seen, so that a turn along a wall straight ahead keeps the clearance.
        max_cross_track_m: largest cross-track error; None: the larger of a tenth of the clearance and two
            tracking errors.
        max_altitude_error_m: largest altitude error.
        max_airspeed_error_mps: largest error of the airspeed averaged over `SPEED_S`.
        max_load_factor: largest load factor averaged over `LOAD_S`.
        navigation_margin_m: what the planner keeps from obstacles beyond the clearance, for the navigation error.
    """

    altitude_m: float
    clearance_m: float
    bank_limit_rad: float
    turn_radius_m: float
    tracking_error_m: float
    airspeed_mps: float = math.nan
    calm_radius_m: float | None = None
    tightest_radius_m: float | None = None
    roll_rate_radps: float = math.inf
    sensor_range_m: float = math.inf
    horizon_m: float = 0.0
    max_cross_track_m: float | None = None
    max_altitude_error_m: float = math.inf
    max_airspeed_error_mps: float = math.inf
    max_load_factor: float = math.inf
    navigation_margin_m: float = 0.0

    @property
    def cross_track_threshold_m(self) -> float:
        """What the cross-track error may be."""
        if self.max_cross_track_m is not None:
            return self.max_cross_track_m
        return tolerance_m(self.clearance_m, self.tracking_error_m)


@dataclass(frozen=True)
class Leg:
    """A stretch of flight under one plan, and the verdict on it.

    Attributes:
        start_s: simulated time of its first row.
        end_s: simulated time of its last row.
        max_cross_track_m: largest absolute cross-track error.
        threshold_m: what it may be.
        max_altitude_error_m: largest absolute altitude error.
        max_airspeed_error_mps: largest absolute error of the airspeed, averaged over `SPEED_S`; None where the
            airspeed is not judged.
        max_load_factor: largest load factor, averaged over `LOAD_S`.
        waypoint: the number of the point of a given path that it leads to; None where it leads to none.
        corner_cut_m: how far from the corner at its end the plan passes; 0 without one.
        max_deviation_m: largest distance from the path as given; None where a planner made the path.
        trackable: whether all of them stayed within what they may be.
        cause: why not; None where trackable. The first that applies of:
            "lost control";
            "navigation error": what is too large of the true cross-track or altitude error is not too large of the
            believed one: the aircraft did what it was to do, elsewhere;
            "planner too late": the aircraft was off the plan already when it took effect;
            "sensor horizon": a turn too tight, near an obstacle that the sensor shows too late for any other;
            "turn radius too tight": the plan bends more than the bank limit allows in calm air, or is further from
            the path as given than it may be, which it is at corners;
            "climb too steep", "descent too steep": the altitude is off, and the path asks for more than the fastest
            climb or descent of the aircraft;
            "speed or throttle saturation": the airspeed is off by more than it may be, or the throttle at a
            stop while altitude is lost;
            "wind drift": the bank is used up in a turn that only the wind makes too tight, or the aircraft is
            off downwind in a cross-wind;
            "bank limit": the guidance asked for all the bank there is, for longer than the aircraft rolled as
            fast as it may;
            "actuator": a servo was at its rate limit;
            "roll rate": the aircraft rolled as fast as it may;
            "load factor": it is larger than it may be;
            "tracking error": none of these.
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


def legs(
    track: Track,
    plans: Sequence[AcceptedPlan],
    limits: FlightLimits,
    lost_control: bool = False,
    given: AsGiven | None = None,
) -> tuple[Leg, ...]:
    """Judges a flight leg by leg.

    Args:
        track: the flown track.
        plans: `plans[i]` is the plan of rows with `plan_index` i.
        limits: what to judge by.
        lost_control: the flight ended so; its last leg is then not trackable.
        given: the path as given that the only plan follows.

    Returns:
        The legs in order of time; empty where no plan was flown.
    """
    corners = given.corners if given else ()
    ends = np.array([corner.arc_length_m for corner in corners])
    leg = track.plan_index + np.searchsorted(ends, track.arc_length_m) if corners else track.plan_index
    along = np.maximum.accumulate(np.nan_to_num(track.arc_length_m))
    reached = np.searchsorted(along, ends) - 1
    judged, over_m = [], -math.inf
    for first, last in _stretches(track, leg):
        passed = [c for c, row in zip(corners, reached, strict=True) if first <= row <= last]
        lost = lost_control and last == len(track) - 1
        verdict = _judge(track, first, last, plans, limits, lost, given)
        if given is not None:
            # All of a corner belongs to the leg that it ends.
            verdict = replace(
                verdict,
                waypoint=passed[-1].waypoint if passed else None,
                corner_cut_m=max((corner.cut_m for corner in passed), default=0.0),
            )
            since_m, over_m = over_m, passed[-1].arc_length_m + passed[-1].half_m if passed else math.inf
            verdict = _judged_as_given(verdict, given, (along > since_m) & (along <= over_m))
        judged.append(verdict)
    return tuple(judged)


def _stretches(track: Track, leg: IntArray) -> list[tuple[int, int]]:
    """First and last row of every leg; a short one joins the next, a short last one the one before.

    Args:
        track: the flown track.
        leg: (n,) a number that changes from one leg to the next.
    """
    flown = np.flatnonzero(track.plan_index >= 0)
    if not len(flown):
        return []
    changes = np.flatnonzero(np.diff(leg[flown]) != 0) + 1
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
    given: AsGiven | None,
) -> Leg:
    leg, rows = track.part(first, last + 1), slice(first, last + 1)
    off = np.nan_to_num(np.abs(leg.cross_track_m))
    wanted_m = given.altitude_m[rows] if given else limits.altitude_m
    high = np.abs(leg.up_m - wanted_m)
    asked_mps = given.airspeed_mps[rows] if given else limits.airspeed_mps
    slow = np.abs(_averaged(leg.airspeed_mps - asked_mps, leg, SPEED_S))
    load = float(_averaged(leg.load_factor, leg, LOAD_S).max())
    threshold = limits.cross_track_threshold_m
    cause = None
    if lost_control:
        cause = "lost control"
    elif off.max() > threshold and _believed_within(leg.believed_cross_track_m, 0.0, threshold):
        cause = "navigation error"
    elif off.max() > threshold:
        cause = _cause(track, _before_peak(track, first + int(off.argmax()), threshold), plans, limits)
    elif load > limits.max_load_factor:
        cause = "load factor"
    elif slow.max() > limits.max_airspeed_error_mps:
        cause = "speed or throttle saturation"
    elif high.max() > limits.max_altitude_error_m and _believed_within(
        leg.believed_up_m, wanted_m, limits.max_altitude_error_m
    ):
        cause = "navigation error"
    elif high.max() > limits.max_altitude_error_m:
        cause = _altitude_cause(track, first + int(high.argmax()), limits, given)
    return Leg(
        start_s=float(track.time_s[first]),
        end_s=float(track.time_s[last]),
        max_cross_track_m=float(off.max()),
        threshold_m=threshold,
        max_altitude_error_m=float(high.max()),
        max_airspeed_error_mps=float(slow.max()) if np.isfinite(slow.max()) else None,
        max_load_factor=load,
        waypoint=None,
        corner_cut_m=0.0,
        max_deviation_m=None,
        trackable=cause is None,
        cause=cause,
    )


def _believed_within(believed: FloatArray | None, wanted: FloatArray | float, most: float) -> bool:
    """Whether what the aircraft believed was never too far from what was wanted; not where that is not known."""
    if believed is None:
        return False
    off = np.abs(believed - wanted)
    known = off[np.isfinite(off)]
    return bool(len(known)) and float(known.max()) <= most


def _altitude_cause(track: Track, peak: int, limits: FlightLimits, given: AsGiven | None) -> str:
    """Why the altitude is off, at the row where it is most."""
    if given is not None:
        # What was asked for since the altitude was last as it should be.
        kept = np.flatnonzero(
            np.abs(track.up_m[:peak] - given.altitude_m[:peak]) <= 0.5 * limits.max_altitude_error_m
        )
        since = slice(int(kept[-1]) if len(kept) else 0, peak + 1)
        up = given.climb_mps[since] - given.fastest_mps[since, 0]
        down = -given.climb_mps[since] - given.fastest_mps[since, 1]
        if max(up.max(), down.max()) > 0.0:
            return "climb too steep" if up.max() >= down.max() else "descent too steep"
    sinking = max(peak, 1)
    before = track.part(int(np.searchsorted(track.time_s, track.time_s[sinking] - LEAD_S)), sinking)
    return (
        "speed or throttle saturation" if _at_a_stop(before).mean() >= SATURATED_SHARE else "tracking error"
    )


def _judged_as_given(leg: Leg, given: AsGiven, rows: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Leg:
    """A leg that is not trackable either where it is too far from the path as given, which is at a corner."""
    off = np.nan_to_num(given.deviation_m[rows])
    kept = bool((off <= given.allowed_m[rows]).all())
    cause = leg.cause if kept or leg.cause else "turn radius too tight"
    return replace(leg, max_deviation_m=float(off.max(initial=0.0)), trackable=cause is None, cause=cause)


def _before_peak(track: Track, peak: int, threshold_m: float) -> Track:
    """The rows up to a peak of the cross-track error, from shortly before it outgrew what it may be."""
    within = np.flatnonzero(np.abs(track.cross_track_m[:peak]) <= threshold_m)
    grows = int(within[-1]) if len(within) else 0
    return track.part(int(np.searchsorted(track.time_s, track.time_s[grows] - LEAD_S)), peak + 1)


def _cause(track: Track, lead: Track, plans: Sequence[AcceptedPlan], limits: FlightLimits) -> str:
    """Why the cross-track error became large, from the rows before its peak."""
    error = np.abs(lead.cross_track_m)
    begins = int(np.searchsorted(track.plan_index, lead.plan_index[-1]))
    at_start = abs(float(track.cross_track_m[begins]))
    if at_start > limits.cross_track_threshold_m and at_start >= LATE_SHARE * error[-1]:
        return "planner too late"
    bend = _tightest_1pm(lead, plans)
    tightest_m = limits.turn_radius_m if limits.tightest_radius_m is None else limits.tightest_radius_m
    if bend * tightest_m > ROUNDING:
        seen_late = limits.sensor_range_m < limits.horizon_m
        near = lead.clearance_m.min() <= limits.sensor_range_m
        return "sensor horizon" if seen_late and near else "turn radius too tight"
    too_slow = abs(float(lead.airspeed_mps.mean()) - limits.airspeed_mps) > limits.max_airspeed_error_mps
    if too_slow:
        return "speed or throttle saturation"
    banked = float(saturated(lead, limits.bank_limit_rad).mean())
    rolling = float(_rolling(lead, limits.roll_rate_radps).mean()) if len(lead) > 1 else 0.0
    if banked >= max(SATURATED_SHARE, rolling):
        calm_m = limits.turn_radius_m if limits.calm_radius_m is None else limits.calm_radius_m
        only_in_wind = bend * calm_m <= ROUNDING < bend * limits.turn_radius_m
        return "wind drift" if only_in_wind else "bank limit"
    drift = _wind_from_left_mps(lead)
    if abs(drift) >= WIND_SHARE * lead.airspeed_mps.mean() and drift * lead.cross_track_m[-1] > 0:
        return "wind drift"
    if _actuator_share(lead) >= SATURATED_SHARE:
        return "actuator"
    if rolling >= SATURATED_SHARE:
        return "roll rate"
    if _averaged(lead.load_factor, lead, LOAD_S).max() > limits.max_load_factor:
        return "load factor"
    return "tracking error"


def _tightest_1pm(lead: Track, plans: Sequence[AcceptedPlan]) -> float:
    """Largest curvature of what was planned, up to a window beyond the last station.

    An aircraft that overshoots a corner stays at its station.
    """
    window = window_m(lead)
    reach = lead.arc_length_m.copy()
    reach[-1] += window
    planned = planned_profile(replace(lead, arc_length_m=reach), plans, window)
    return float(np.abs(planned.curvature_1pm).max(initial=0.0))


def saturated(track: Track, bank_limit_rad: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(n,) whether the bank command is at its limit, to a hundredth of a degree."""
    at_limit: np.ndarray[tuple[int], np.dtype[np.bool_]]
    at_limit = np.abs(track.roll_command_deg) >= math.degrees(bank_limit_rad) - 0.01
    return at_limit


def _rolling(track: Track, roll_rate_radps: float) -> FloatArray:
    """(n - 1,) 1 where the aircraft rolls about as fast as it may, else 0."""
    rate = np.abs(np.diff(track.roll_deg)) / np.maximum(np.diff(track.time_s), 1e-9)
    return np.where(rate >= ROLL_RATE_SHARE * math.degrees(roll_rate_radps), 1.0, 0.0)


def _actuator_share(track: Track) -> float:
    """Share of the time for which servos were at their rate limits, each counted."""
    assert track.actuator_limited_s is not None
    limited_s = float(track.actuator_limited_s[-1] - track.actuator_limited_s[0])
    return limited_s / max(float(track.time_s[-1] - track.time_s[0]), 1e-9)


def _at_a_stop(track: Track) -> FloatArray:
    """(n,) 1 where the throttle is full or idle, else 0; 0 without an engine."""
    return np.where((track.throttle >= FULL_THROTTLE) | (track.throttle <= IDLE_THROTTLE), 1.0, 0.0)


def _averaged(values: FloatArray, track: Track, over_s: float) -> FloatArray:
    """Running mean over a time, over the whole where that is shorter."""
    span = float(track.time_s[-1] - track.time_s[0])
    rows = 1 + round(over_s * (len(values) - 1) / span) if span > over_s else len(values)
    total = np.append(0.0, np.cumsum(values))
    mean: FloatArray = (total[rows:] - total[:-rows]) / rows
    return mean


def _wind_from_left_mps(track: Track) -> float:
    """Mean wind across the course, positive towards the right; sideslip is taken to be zero."""
    angle = np.radians(track.heading_deg - track.course_deg)
    across: FloatArray = -track.airspeed_mps * np.sin(angle)
    return float(across.mean())
