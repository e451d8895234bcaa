"""Why what was planned could not be tracked: what it asked for that was not there, or what was at its limit meanwhile.

A plan that asks for more than is in force (`harness.analysis.in_force`) is the cause, whatever the aircraft did then.
Otherwise the cause is the limit that the aircraft was at while the error grew. `FINDINGS` has all causes, and
`harness.analysis.trackability` the order in which the limits are checked.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from aircraft.interface import GRAVITY_MPS2
from harness.analysis.flight_limits import LOAD_AVERAGED_S, AsGiven, FlightLimits
from harness.analysis.in_force import InForce, demand
from harness.flight.record import SURFACES, AcceptedPlan, FloatArray, Track
from harness.run_files.given_path import CutCorner, Tightest, least_m, off_radii

LEAD_S = 5.0  # the cause is looked for from this time before the error became too large up to its peak
SATURATED_SHARE = 0.2
"""A limit is the cause if a signal was at it for this share of the time that is looked at (see `LEAD_S`)."""
ROLL_RATE_SHARE = 0.8
"""Share of the roll rate limit from which on the aircraft rolls as fast as it may; the loop behind it lags."""
WIND_SHARE = 0.1  # cross-wind, as a share of the airspeed, from which on a drift downwind is the wind's
LATE_SHARE = 0.25  # share of the largest error, there when the plan took effect, that makes the plan too late
ROUNDING = 1.001  # a demand larger than what is in force by no more than this factor is not larger
STRAIGHT_DEG = 30.0  # an aircraft that turns by more than this at a corner is not off it for the cross-wind
ROLLED_SHARE = 0.1
"""If a plan asks for a faster roll than is in force, this share of the lead time at that rate makes it the cause."""
HELD_DEG = 3.0  # so far short of the stall the autopilot keeps the lift (`aircraft.survey.ALPHA_MARGIN_DEG`)
AT_STOP = 0.995  # a control surface deflected by this share of its travel is at its stop
CLIMBS_IN_S = 1.0  # an aircraft takes about so long to change its climb: it may cut a change of slope
LEAST_CLIMB_MPS = 0.2  # a path that climbs or sinks more slowly is level
FULL_THROTTLE, IDLE_THROTTLE = 0.99, 0.01
"""A throttle (0 to 1) is at a stop from the first of these on, and down to the second."""
NAVIGATION_ERROR = "navigation error"
"""Cause where the aircraft did as it believed: neither it nor the plan is at fault."""
SURE_SIGMAS = 3.0
"""An airspeed that is off by no more sigmas of its measurement, the throttle at no stop, is believed to be right."""
PLAN_ENDED = "plan ended"  # cause where the aircraft flew beyond the end of its plan by more than its limit
FINDINGS: Mapping[str, str] = {
    "planner too late": "the aircraft was off the plan already, as far as it knew, when the plan took effect",
    PLAN_ENDED: "the aircraft flew on beyond the end of its plan, where nothing was planned",
    "turn radius too tight": "the plan turns on a radius below V\N{SUPERSCRIPT TWO} / (g tan(bank limit)) at the "
    "commanded airspeed in calm air, or a corner cannot be kept without one",
    "sensor horizon": "the plan turns on such a radius within sensing range of an obstacle, and `sensor.range_m` is "
    "too short for a turn before a wall (clearance, turn radius, and the way flown while sensing, computing and "
    "rolling in)",
    "wind drift": "the plan turns on a radius, or a corner needs one, that only the wind makes too tight; or the "
    "aircraft was off downwind in a cross-wind with no limit reached",
    "bank limit": "the bank command was at its limit, on a radius that the limit allows in that wind: the aircraft was "
    "late or disturbed",
    "roll rate": "the plan asks for a faster roll than the roll rate limit, or the aircraft rolled at that limit, or "
    "with full aileron, for longer than the bank command was at its own",
    "control saturation": "elevator, ailerons or rudder were at a stop",
    "stall": "angle of attack or airspeed was beyond that of the stall, or the aircraft sank within 3 degrees of it",
    "actuator": "a servo was at its rate limit",
    "load factor": "the load factor was larger than allowed",
    "speed or throttle saturation": "the aircraft was off the commanded airspeed, or off its altitude with the "
    "throttle at a stop",
    "climb too steep": "the aircraft was off its altitude, airspeed or load factor, on a path that climbs faster than "
    "its survey or its specific excess power at that height and speed allows, or off its altitude at a corner of the "
    "path's slope, whose change of climb in a second is larger than the altitude error allowed",
    "descent too steep": "the aircraft was off its altitude, airspeed or load factor, on a path that sinks faster than "
    "its survey, or idle throttle at that height and speed, allows, or off its altitude at such a corner of it",
    NAVIGATION_ERROR: "where the true position was furthest off, the believed one was within the limits, or the "
    "larger part of the error lay between the two, there or before a fix came back; or the airspeed was off by no "
    "more than 3 `navigation.airspeed_sigma_mps`, with the throttle at no stop",
    "lost control": "the flight ended with loss of control",
    "tracking error": "none of the other causes",
}
"""What each cause says was found, for people."""


def is_allowed_for(causes: Collection[str], error_m: float | None, margin_m: float | None) -> bool:
    """Whether a flight was not tracked for navigation errors alone that are within what was planned for them.

    Nearly all flights with a receiver of the usual kind are so, and hide those in which something went wrong.
    """
    planned_for = error_m is not None and margin_m is not None and error_m <= margin_m
    return planned_for and set(causes) == {NAVIGATION_ERROR}


def cross_track_cause(
    track: Track,
    peak: int,
    plans: Sequence[AcceptedPlan],
    limits: FlightLimits,
    force: InForce,
    wide: bool = False,
) -> str:
    """Names the cause for which the aircraft is off the plan, at the row where it is most: the first that applies.

    `wide`: it passes a corner that needs no tight arc, which may have been rounded more tightly where the wind helps.
    """
    within = np.flatnonzero(np.abs(track.cross_track_m[:peak]) <= limits.cross_track_threshold_m)
    first = int(np.searchsorted(track.time_s, track.time_s[int(within[-1]) if len(within) else 0] - LEAD_S))
    lead, force = track.part(first, peak + 1), force.part(first, peak + 1)
    begun = int(np.searchsorted(track.plan_index, lead.plan_index[-1]))
    at_start_m = np.fmin(*np.abs((track.cross_track_m[begun], track.believed_cross_track_m[begun])))
    if at_start_m > max(limits.cross_track_threshold_m, LATE_SHARE * abs(lead.cross_track_m[-1])):
        return "planner too late"
    needed = demand(lead, plans, force)
    if needed.calm > ROUNDING and not (wide and needed.windy <= ROUNDING):
        seen_late = limits.sensor_range_m < limits.horizon_m
        near = lead.clearance_m.min() <= limits.sensor_range_m
        return "sensor horizon" if seen_late and near else "turn radius too tight"
    fast_mps = float((lead.airspeed_mps - force.commanded_mps).mean())
    if abs(fast_mps) > limits.max_airspeed_error_mps:
        return speed_cause(lead, fast_mps, limits)
    if needed.windy > ROUNDING:
        return "wind drift"
    turned_deg = abs(float(lead.course_deg[-1] - lead.course_deg[0] + 180.0) % 360.0 - 180.0)
    turns = wide and turned_deg > STRAIGHT_DEG
    return _limit_reached(lead, limits, force, needed.roll_rate > ROUNDING, turns)


def corner_cause(corner: CutCorner, allowed_m: float, row: int, force: InForce) -> str | None:
    """Names the cause for which a corner was passed too far off: too tight in calm air, or in that wind; else None."""
    off = max(float(min(off_radii(np.radians(corner.turn_deg)))), 1e-9)
    needed = GRAVITY_MPS2 * math.tan(force.bank_limit_rad) * allowed_m / off
    speed, wind_mps = float(force.commanded_mps[row]), complex(*force.wind_mps[row])
    if speed**2 > needed:
        return "turn radius too tight"
    ahead = np.full(2, np.exp(1j * math.radians(90.0 - corner.course_deg)))
    in_wind = least_m(ahead, np.radians([corner.turn_deg]), Tightest(speed**2, 0.0, wind_mps / speed))
    return "wind drift" if in_wind[0] > needed else None


def altitude_cause(track: Track, peak: int, limits: FlightLimits, given: AsGiven | None) -> str:
    """Names the cause for which the altitude is off, at the row where it is most."""
    wanted_m = given.altitude_m if given else np.full(len(track), limits.altitude_m)
    good = np.flatnonzero(np.abs(track.up_m[:peak] - wanted_m[:peak]) <= 0.5 * limits.max_altitude_error_m)
    steep = steepness_cause(track, int(good[-1]) if len(good) else 0, peak + 1, given)
    last = max(peak, 1)
    first = int(np.searchsorted(track.time_s, track.time_s[last] - LEAD_S))
    lead = track.part(first, last)
    limit = steep or _vertical_limit(lead, limits)
    climb = np.zeros(1) if given is None else given.climb_mps[first : peak + 1]
    if limit is None and np.abs(np.diff(climb)).max(initial=0.0) * CLIMBS_IN_S > limits.max_altitude_error_m:
        limit = "climb too steep" if climb.max() >= -climb.min() else "descent too steep"
    if limit is None and _throttle_share(lead) >= SATURATED_SHARE:
        limit = "speed or throttle saturation"
    near = (lead.angle_of_attack_deg >= limits.stall_angle_deg - HELD_DEG).mean() >= SATURATED_SHARE
    return limit or ("stall" if near and track.up_m[peak] < wanted_m[peak] else "tracking error")


def speed_cause(lead: Track, fast_mps: float, limits: FlightLimits) -> str:
    """Names the cause for which the mean airspeed over some rows is too high by this (negative: too low)."""
    sure = abs(fast_mps) > SURE_SIGMAS * limits.airspeed_sigma_mps or _throttle_share(lead) >= SATURATED_SHARE
    return _vertical_limit(lead, limits) or ("speed or throttle saturation" if sure else NAVIGATION_ERROR)


def steepness_cause(track: Track, first: int, stop: int, given: AsGiven | None) -> str | None:
    """Whether a path climbs or sinks faster than the aircraft can in some rows; None if it does not.

    What the aircraft can is known of its survey, near sea level. Flown with full or idle throttle, the rate of its
    specific energy, climb in the air + V dV/dt / g, is its specific excess power at that height, weight and speed.
    """
    if given is None:
        return None
    climb_mps, fastest = given.climb_mps[first:stop], given.fastest_mps[first:stop]
    excess = {1.0: climb_mps - fastest[:, 0], -1.0: -climb_mps - fastest[:, 1]}
    if len(lead := track.part(first, stop)) > 1:
        power = _energy_rate_mps(lead)
        for side, at_stop in ((1.0, lead.throttle >= FULL_THROTTLE), (-1.0, lead.throttle <= IDLE_THROTTLE)):
            if (rows := at_stop & (side * climb_mps > LEAST_CLIMB_MPS)).mean() >= SATURATED_SHARE:
                excess[side] = np.append(excess[side], side * float((climb_mps - power)[rows].mean()))
    up, down = float(excess[1.0].max()), float(excess[-1.0].max())
    if max(up, down) <= 0.0:
        return None
    return "climb too steep" if up >= down else "descent too steep"


def _energy_rate_mps(lead: Track) -> FloatArray:
    """(n,) climb + V dV/dt / g, the climb that in the air, by attitude; over ground where no alpha is known."""
    pitch, roll, alpha = np.radians((lead.pitch_deg, lead.roll_deg, lead.angle_of_attack_deg))
    own = lead.airspeed_mps * (np.cos(alpha) * np.sin(pitch) - np.sin(alpha) * np.cos(pitch) * np.cos(roll))
    climb = np.where(np.isfinite(own), own, np.gradient(lead.up_m, lead.time_s))
    return climb + lead.airspeed_mps * np.gradient(lead.airspeed_mps, lead.time_s) / GRAVITY_MPS2


def _limit_reached(lead: Track, limits: FlightLimits, force: InForce, rolls_fast: bool, turns: bool) -> str:
    """Returns the limit that the aircraft was at while it came off a plan that asks for no more than is in force.

    Where it `turns` at a corner that has room for that in the wind, the drift is no reason.
    """
    rate = np.abs(np.diff(lead.roll_deg)) / np.maximum(np.diff(lead.time_s), 1e-9)
    rolling = np.append(False, rate >= ROLL_RATE_SHARE * math.degrees(force.roll_rate_radps))
    rolled = float(rolling.mean())
    banked = float((saturated(lead, force.bank_limit_rad) & ~rolling).mean())
    full_aileron = _stop_share(lead, ("aileron",)) >= SATURATED_SHARE
    # The mean wind across the course, positive towards the right; sideslip is taken to be zero.
    across = -lead.airspeed_mps * np.sin(np.radians(lead.heading_deg - lead.course_deg))
    drift, blown = float(across.mean()), WIND_SHARE * lead.airspeed_mps.mean()
    load = averaged(lead.load_factor, lead, LOAD_AVERAGED_S).max()
    # The demand of turns of less than a second is not in their mean curvature: then the command moves at its limit.
    slew = np.abs(np.diff(lead.roll_command_deg)) / np.maximum(np.diff(lead.time_s), 1e-9)
    slewing = np.append(False, slew >= AT_STOP * math.degrees(force.roll_rate_radps))
    too_fast = rolls_fast or (full_aileron and slewing.mean() >= SATURATED_SHARE)
    found = {
        "stall": _has_stalled(lead, limits),
        "roll rate": too_fast and (full_aileron or rolled >= ROLLED_SHARE),
        "control saturation": _stop_share(lead, SURFACES) >= SATURATED_SHARE,
        "bank limit": banked >= max(SATURATED_SHARE, rolled),
        "wind drift": not turns and abs(drift) >= blown and drift * lead.cross_track_m[-1] > 0,
        "actuator": _servo_share(lead, lateral=True) >= SATURATED_SHARE,
        "load factor": rolled < SATURATED_SHARE and load > limits.max_load_factor,
    }
    other = "roll rate" if rolled >= SATURATED_SHARE else "tracking error"
    return next((cause for cause, holds in found.items() if holds), other)


def _vertical_limit(lead: Track, limits: FlightLimits) -> str | None:
    """The limit of wing, elevator or servo that kept the aircraft from its altitude or airspeed; None without one."""
    if _has_stalled(lead, limits):
        return "stall"
    if _stop_share(lead, ("elevator",)) >= SATURATED_SHARE:
        return "control saturation"
    slow = _servo_share(lead, lateral=False) >= max(SATURATED_SHARE, _throttle_share(lead))
    return "actuator" if slow else None


def _has_stalled(lead: Track, limits: FlightLimits) -> bool:
    """Tells whether the angle of attack was beyond that of the stall; False where it is not known."""
    return bool((np.abs(lead.angle_of_attack_deg) > limits.stall_angle_deg).any())


def _stop_share(lead: Track, names: Sequence[str]) -> float:
    """Share of the rows in which one of some control surfaces was at its stop; 0 where that is not known."""
    deflected = np.nan_to_num(np.abs([getattr(lead, name) for name in names])).max(axis=0)
    return float((deflected >= AT_STOP).mean())


def saturated(track: Track, bank_limit_rad: float) -> NDArray[np.bool_]:
    """(n,) whether the bank command is at its limit, to a hundredth of a degree."""
    return np.greater_equal(np.abs(track.roll_command_deg), math.degrees(bank_limit_rad) - 0.01)


def _servo_share(lead: Track, lateral: bool) -> float:
    """Summed shares of the time for which servos, of aileron and rudder or of the others, were at their rate limits."""
    limited_s = lead.vertical_actuator_limited_s
    limited_s = lead.actuator_limited_s - limited_s if lateral else limited_s
    return float(limited_s[-1] - limited_s[0]) / max(float(lead.time_s[-1] - lead.time_s[0]), 1e-9)


def _throttle_share(track: Track) -> float:
    """Share of the rows in which the throttle is full or idle; 0 without an engine."""
    return float(((track.throttle >= FULL_THROTTLE) | (track.throttle <= IDLE_THROTTLE)).mean())


def averaged(values: FloatArray, track: Track, over_s: float) -> FloatArray:
    """Returns the running means of a track's values over a time; where the track is no longer, one mean of all."""
    span = float(track.time_s[-1] - track.time_s[0])
    rows = 1 + round(over_s * (len(values) - 1) / span) if span > over_s else len(values)
    total: FloatArray = np.append(0.0, np.cumsum(values))
    return (total[rows:] - total[:-rows]) / rows
