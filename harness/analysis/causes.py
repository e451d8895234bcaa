"""Why what was planned could not be tracked: the limit that the aircraft was at while the error grew.

`harness.analysis.trackability.Leg` lists the causes. Two that are easily mistaken for one another: in "turn radius too
tight" the plan has a radius below V^2 / (g tan bank limit), which no guidance could fly; in "bank limit" the radius is
feasible, and guidance asked for all the bank there is nonetheless.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from harness.analysis.as_given import AsGiven
from harness.analysis.flight_limits import LOAD_S, FlightLimits
from harness.analysis.smoothness import planned_profile, turn_onto_first_plan_1pm, window_m
from harness.flight.record import AcceptedPlan, FloatArray, Track

LEAD_S = 5.0
"""The cause is looked for from this time before the error became too large up to where it is largest."""

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

NAVIGATION_ERROR = "navigation error"
"""Cause where the aircraft did as it believed: neither it nor the plan is at fault."""

FINDINGS: Mapping[str, str] = {
    "planner too late": "the aircraft was off the plan already when the plan took effect",
    "turn radius too tight": "the plan turns on a radius below V\N{SUPERSCRIPT TWO} / (g tan(bank limit)), or the "
    "aircraft was further from the path as given than allowed",
    "sensor horizon": "the plan turns on a radius below V\N{SUPERSCRIPT TWO} / (g tan(bank limit)), within "
    "sensing range of an obstacle, and `sensor.range_m` is too short for a turn before a wall (clearance, turn radius, "
    "and the way flown while sensing, computing and rolling in)",
    "bank limit": "the bank command was at its limit, on a radius that the limit allows: the aircraft was late or "
    "disturbed, not the plan too tight",
    "wind drift": "the bank command was at its limit, on a radius that only the wind makes too tight; or the aircraft "
    "was off downwind in a cross-wind",
    "roll rate": "the aircraft rolled at its largest rate",
    "actuator": "a servo was at its rate limit",
    "load factor": "the load factor was larger than allowed",
    "speed or throttle saturation": "the aircraft was off its airspeed, or off its altitude with the throttle at a "
    "stop",
    "climb too steep": "the aircraft was off its altitude, on a path steeper than its fastest climb",
    "descent too steep": "the aircraft was off its altitude, on a path steeper than its fastest descent",
    NAVIGATION_ERROR: "where the true position was furthest off, the believed one was within the limits",
    "lost control": "the flight ended with loss of control",
    "tracking error": "none of the other causes",
}
"""What each cause says was found, for people."""


def is_allowed_for(causes: Collection[str], error_m: float | None, margin_m: float | None) -> bool:
    """Whether a flight was not tracked for navigation errors alone that are within what was planned for them.

    Such a flight is as the scenario means it to be. Nearly all flights with a receiver of the usual kind are so, and
    hide those in which something went wrong.

    Args:
        causes: of all legs that were not trackable.
        error_m: largest distance from the true position to the believed one; None where navigation is perfect.
        margin_m: what the planner kept beyond the clearance for it; likewise.
    """
    if error_m is None or margin_m is None:
        return False
    return set(causes) == {NAVIGATION_ERROR} and error_m <= margin_m


FULL_THROTTLE, IDLE_THROTTLE = 0.99, 0.01


def cross_track_cause(track: Track, peak: int, plans: Sequence[AcceptedPlan], limits: FlightLimits) -> str:
    """Why the aircraft is off the plan, at the row where it is most."""
    return _lateral_cause(track, _before_peak(track, peak, limits.cross_track_threshold_m), plans, limits)


def altitude_cause(track: Track, peak: int, limits: FlightLimits, given: AsGiven | None) -> str:
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
    stopped, limited = float(_at_a_stop(before).mean()), _vertical_servo_share(before)
    if limited >= max(SATURATED_SHARE, stopped):
        return "actuator"
    return "speed or throttle saturation" if stopped >= SATURATED_SHARE else "tracking error"


def speed_cause(lead: Track) -> str:
    """Why the airspeed is off, over the rows of which it is the mean."""
    limited = _vertical_servo_share(lead)
    slow_servo = limited >= max(SATURATED_SHARE, float(_at_a_stop(lead).mean()))
    return "actuator" if slow_servo else "speed or throttle saturation"


def _before_peak(track: Track, peak: int, threshold_m: float) -> Track:
    """The rows up to a peak of the cross-track error, from shortly before it outgrew what it may be."""
    within = np.flatnonzero(np.abs(track.cross_track_m[:peak]) <= threshold_m)
    grows = int(within[-1]) if len(within) else 0
    return track.part(int(np.searchsorted(track.time_s, track.time_s[grows] - LEAD_S)), peak + 1)


def _lateral_cause(track: Track, lead: Track, plans: Sequence[AcceptedPlan], limits: FlightLimits) -> str:
    """Why the cross-track error became large, from the rows before its peak: the first cause that applies."""
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
        return speed_cause(lead)
    banked = float(saturated(lead, limits.bank_limit_rad).mean())
    rolling = float(_rolling(lead, limits.roll_rate_radps).mean()) if len(lead) > 1 else 0.0
    if banked >= max(SATURATED_SHARE, rolling):
        calm_m = limits.turn_radius_m if limits.calm_radius_m is None else limits.calm_radius_m
        only_in_wind = bend * calm_m <= ROUNDING < bend * limits.turn_radius_m
        return "wind drift" if only_in_wind else "bank limit"
    drift = _wind_from_left_mps(lead)
    if abs(drift) >= WIND_SHARE * lead.airspeed_mps.mean() and drift * lead.cross_track_m[-1] > 0:
        return "wind drift"
    if _lateral_servo_share(lead) >= SATURATED_SHARE:
        return "actuator"
    if rolling >= SATURATED_SHARE:
        return "roll rate"
    if averaged(lead.load_factor, lead, LOAD_S).max() > limits.max_load_factor:
        return "load factor"
    return "tracking error"


def _tightest_1pm(lead: Track, plans: Sequence[AcceptedPlan]) -> float:
    """Largest curvature of what was planned, up to a window beyond the last station, and of the turn onto it.

    An aircraft that overshoots a corner stays at its station.
    """
    window = window_m(lead)
    reach = lead.arc_length_m.copy()
    reach[-1] += window
    planned = planned_profile(replace(lead, arc_length_m=reach), plans, window)
    onto = turn_onto_first_plan_1pm(lead, plans, window)
    return float(np.abs(planned.curvature_1pm).max(initial=onto))


def saturated(track: Track, bank_limit_rad: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(n,) whether the bank command is at its limit, to a hundredth of a degree."""
    at_limit: np.ndarray[tuple[int], np.dtype[np.bool_]]
    at_limit = np.abs(track.roll_command_deg) >= math.degrees(bank_limit_rad) - 0.01
    return at_limit


def _rolling(track: Track, roll_rate_radps: float) -> FloatArray:
    """(n - 1,) 1 where the aircraft rolls about as fast as it may, else 0."""
    rate = np.abs(np.diff(track.roll_deg)) / np.maximum(np.diff(track.time_s), 1e-9)
    return np.where(rate >= ROLL_RATE_SHARE * math.degrees(roll_rate_radps), 1.0, 0.0)


def _lateral_servo_share(track: Track) -> float:
    """Share of the time for which the servos of aileron and rudder were at their rate limits, each counted."""
    assert track.actuator_limited_s is not None
    assert track.vertical_actuator_limited_s is not None
    return _share(track.actuator_limited_s - track.vertical_actuator_limited_s, track)


def _vertical_servo_share(track: Track) -> float:
    """Share of the time for which the servos of elevator and throttle were at their rate limits, each counted."""
    assert track.vertical_actuator_limited_s is not None
    return _share(track.vertical_actuator_limited_s, track)


def _share(limited_s: FloatArray, track: Track) -> float:
    """How much a time that is counted grows over the rows, over how much time goes by."""
    return float(limited_s[-1] - limited_s[0]) / max(float(track.time_s[-1] - track.time_s[0]), 1e-9)


def _at_a_stop(track: Track) -> FloatArray:
    """(n,) 1 where the throttle is full or idle, else 0; 0 without an engine."""
    return np.where((track.throttle >= FULL_THROTTLE) | (track.throttle <= IDLE_THROTTLE), 1.0, 0.0)


def averaged(values: FloatArray, track: Track, over_s: float) -> FloatArray:
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
