"""Flies a model to find out what kind of aircraft it is: mass, speeds, gains, roll, banks it can keep.

Every flight begins trimmed, 300 m above the sea, in calm air. Speeds are true airspeeds.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, astuple, replace
from typing import Any

import numpy as np

from aircraft import autopilot
from aircraft.airframe import FIGURES, Airframe, AirframeEntry
from aircraft.autopilot import LEAST_AILERON_S, NEEDED_MARGIN_DEG, Derivatives, Gains, gains
from aircraft.guidance.preview import bandwidth_of_delay_margin
from aircraft.interface import GRAVITY_MPS2
from aircraft.jsbsim_loading import NO_TRIM, inertia_factor, lift_limit, linearised, mass_kg, trimmed
from aircraft.model_files import AircraftError, ModelFiles, TrimError
from aircraft.trials import not_held, roll_in_s, steepest_level_bank_deg, turn_rate_share, weaving_error_m

SLOWEST_MPS, FASTEST_MPS = 8.0, 300.0
"""Airspeeds outside of these are not tried: below the second, air counts as incompressible."""
SPEED_STEP_FACTOR, SPEED_TOLERANCE_SHARE, SPEED_DECIMALS = 1.12, 0.01, 1
"""Airspeeds are tried in steps of the factor; the slowest and fastest are found to the share and decimals."""
OFF_THE_STALL = (1.1, 1.2)
"""Banks are measured at so many times the slowest airspeed, too: they grow fast there, as lift goes with its square."""
GAIN_DIGITS = 5  # significant digits of derived gains: processors and compilers agree on more
BANK_LIMIT_DEG = 45.0  # bank limit of an airframe whose entry gives none
ROLL_COMMAND_SHARE = 0.5  # share of the steady roll rate at full aileron that the roll command may ask for
ALPHA_MARGIN_DEG = 3.0  # pitch commands stay this far from an angle of attack at which the model stalls
UNSTALLED_DEG = 20.0  # angle of attack that counts as stalled where the lift of a model never stops rising
BANDWIDTH_SHARE = 0.36
"""Bandwidth of the cross-track correction over that of roll: more and the two begin to work against each other."""
ROLL_LIMITED_S = 0.1
"""A cross-track error as long as this time of flight is corrected without reaching the limit of roll rate. Correcting
an error e at bandwidth w takes a change of g * roll of w^3 e."""
DELAY_MARGIN_S = 0.5
"""Further delay that the cross-track loop of `preview` bears where the latency of the state is known."""
REVERSAL_BANKS_DEG = (30.0, -30.0, 15.0, 0.0)  # banks that an aircraft must hold at cruise, in this order
WELL_TRACKED_S = 0.01
"""An autopilot tracks a weave well if its cross-track error is at most the distance flown in this time."""
PACES = (1.0, 0.7, 0.5, 0.35)
"""Paces are shares of the feedback in roll and yaw of `aircraft.autopilot.gains`, tried in this order."""
FALLBACK_PACE = 0.25  # pace that is tried only for an aircraft that none of `PACES` holds
CLIMB_PACES = (*PACES, FALLBACK_PACE, 0.18, 0.12)
"""Paces of the climb and altitude loops on a late state, tried in this order."""
LEAST_TURN_SHARE = 0.5
"""An aircraft that turns at less than this share of a coordinated turn's rate is not flown by its bank."""


def survey(entry: AirframeEntry, files: ModelFiles) -> dict[str, Any]:
    """Measures the attributes of an `Airframe`, by name; AircraftError if it cannot be loaded, trimmed or held."""
    cruise = entry.cruise_mps or middle_of_trims(files)
    frame = _held_at_cruise(entry, files, cruise)
    low, high = _last_held_mps(frame, 1.0 / SPEED_STEP_FACTOR), _last_held_mps(frame, SPEED_STEP_FACTOR)
    frame = replace(frame, airspeed_range_mps=(low, high))
    slow = [round(min(factor * low, high), SPEED_DECIMALS) for factor in OFF_THE_STALL]
    speeds = sorted({*np.linspace(low, high, 5).round(SPEED_DECIMALS).tolist(), *slow, cruise})
    return {
        "mass_kg": float(f"{frame.mass_kg:.4g}"),
        "airspeed_range_mps": [low, high],
        "cruise_mps": cruise,
        "roll_in_s": roll_in_s(frame, cruise),
        "weave_error_m": float(f"{frame.weave_error_m:.3g}"),
        "level_banks": [(speed, steepest_level_bank_deg(frame, speed)) for speed in speeds],
        "gains": asdict(frame.gains),
        **{key: getattr(frame, key) for key in FIGURES},
    }


def _held_at_cruise(entry: AirframeEntry, files: ModelFiles, cruise: float) -> Airframe:
    """Derives the airframe from its cruise alone, with the fastest loops that track a weave well, else the best ones.

    Raises AircraftError if it has no trim at cruise, no gains can be derived there, or it is held at no pace.
    """
    best, reason = None, ""
    try:
        at = derivatives_at(files, cruise)
        pitch_paces = _pitch_paces(at, _servo_lag_s(files, "elevator"), files.latency_s)
        for pace in (*PACES, FALLBACK_PACE):
            if pace == FALLBACK_PACE and best is not None:
                break
            found = _with_paces(entry, files, cruise, at, pace, *pitch_paces)
            if isinstance(found, str):
                reason = found
                continue
            if best is None or found.weave_error_m < best.weave_error_m:
                best = found
            if found.weave_error_m <= WELL_TRACKED_S * cruise:
                break
    except TrimError:
        raise
    except ValueError as error:
        reason = str(error)
    if best is None:
        late = f" on a state {files.latency_s:g} s old" if files.latency_s else ""
        raise AircraftError(f"{files.name} cannot be held at {cruise:g} m/s{late}: {reason}")
    return best


def derivatives_at(files: ModelFiles, airspeed_mps: float) -> Derivatives:
    """Derivatives in level flight, without the gyroscopic moments of the heavier propellers that JSBSim's trim needs.

    These moments are linear in the moment of inertia: the derivatives with two and three times that of the trim, with
    which the linear model settles soon, are extrapolated to the model's own.
    """
    if not files.has_electric_propeller:
        return linearised(trimmed(files, airspeed_mps))
    light, heavy = (ratio * inertia_factor(files) for ratio in (2.0, 3.0))
    at_light, at_heavy = (astuple(linearised(trimmed(files, airspeed_mps, factor))) for factor in (light, heavy))
    share = (1.0 - light) / (heavy - light)
    return Derivatives(*(a + share * (b - a) for a, b in zip(at_light, at_heavy, strict=True)))


def _with_paces(
    entry: AirframeEntry, files: ModelFiles, cruise: float, at: Derivatives, *paces: float
) -> Airframe | str:
    """Returns the airframe with the loops at these paces in roll, pitch and climb, or says why they do not hold it."""
    placed = replace(gains(at, *paces).rounded(GAIN_DIGITS), **entry.gains)
    late = _servo_lag_s(files, "aileron"), files.latency_s
    if any(late) and (margin_deg := autopilot.roll_margin_deg(at, placed, *late)) < NEEDED_MARGIN_DEG:
        return _too_slow_text("aileron", sum(late), "roll", margin_deg)
    frame = _provisional(entry, files, cruise, at, placed, paces[0])
    if reason := not_held(frame, cruise, REVERSAL_BANKS_DEG):
        return reason
    if "turn_rate_share" not in entry.figures:
        if not LEAST_TURN_SHARE <= (share := turn_rate_share(frame, cruise)) <= 2.0 - LEAST_TURN_SHARE:
            return f"it turns at {share:.2g} of the rate of a coordinated turn"
        frame = replace(frame, turn_rate_share=share)
    if (error_m := weaving_error_m(frame, cruise)) == math.inf:
        return "control is lost on a weave of turns"
    return replace(frame, weave_error_m=error_m)


def _servo_lag_s(files: ModelFiles, control: str) -> float:
    """Time constant of the servo of a control; 0 without a servo."""
    servos = dict(files.actuators)
    return servos[control].lag_s if control in servos else 0.0


def _pitch_paces(at: Derivatives, lag_s: float, latency_s: float) -> tuple[float, float]:
    """The fastest paces with enough phase margin: in pitch (ValueError if none), and in climb (the slowest if none)."""
    late = lag_s or latency_s
    for pace in PACES if late else PACES[:1]:
        margin_deg = autopilot.pitch_margin_deg(at, gains(at, 1.0, pace), lag_s, latency_s)
        if not late or margin_deg >= NEEDED_MARGIN_DEG:
            break
    else:
        raise ValueError(_too_slow_text("elevator", lag_s + latency_s, "pitch", margin_deg))
    for climb_pace in CLIMB_PACES if latency_s else PACES[:1]:
        margin_deg = autopilot.climb_margin_deg(at, gains(at, 1.0, pace, climb_pace), lag_s, latency_s)
        if margin_deg >= NEEDED_MARGIN_DEG:
            break
    return pace, climb_pace


def _too_slow_text(control: str, lag_s: float, loop: str, margin_deg: float) -> str:
    """Says that even the slowest loop has too little phase margin behind a lag."""
    return (
        f"behind a lag of the {control} of {lag_s:g} s the slowest {loop} loop has a phase margin of {margin_deg:.0f} "
        f"degrees; it must have {NEEDED_MARGIN_DEG:g}"
    )


def _provisional(
    entry: AirframeEntry, files: ModelFiles, cruise: float, at: Derivatives, placed: Gains, pace: float
) -> Airframe:
    """Makes the airframe that trials are flown with before its limits are measured."""
    full_aileron_dps = math.degrees(1.0 / max(abs(placed.aileron_p_forward), LEAST_AILERON_S))
    roll_rate_dps = ROLL_COMMAND_SHARE * full_aileron_dps
    if any((servo.rate_limit_1ps or math.inf) < placed.roll for _, servo in files.actuators):
        roll_rate_dps *= pace  # a servo that takes longer to its stop than roll does cannot follow
    roll_rate_dps = float(math.floor(roll_rate_dps))
    slow = (GRAVITY_MPS2 * math.radians(roll_rate_dps) / (ROLL_LIMITED_S * cruise)) ** (1.0 / 3.0)
    roll_delay_s = round(1.0 / (abs(at.lp) + at.lda * placed.aileron_p) + _servo_lag_s(files, "aileron"), 2)
    roll_delay_s = round(roll_delay_s + files.latency_s, 3)
    slow = min(slow, bandwidth_of_delay_margin(DELAY_MARGIN_S, roll_delay_s))
    stall_deg = math.ceil(lift_limit(files, cruise, 1.0)[0] or UNSTALLED_DEG)
    named_stall_deg = entry.figures.get("stall_angle_deg", stall_deg)
    figures = {
        "bank_limit_deg": BANK_LIMIT_DEG,
        "roll_rate_dps": roll_rate_dps,
        "stall_angle_deg": stall_deg,
        "least_lift": _lift_short_of_stall(files, cruise, -1.0, None),
        "most_lift": _lift_short_of_stall(files, cruise, 1.0, named_stall_deg),
        "roll_lag_s": round(1.0 / placed.roll, 3),
        "roll_delay_s": roll_delay_s,
        "guidance_bandwidth_radps": round(min(BANDWIDTH_SHARE * placed.roll, slow), 3),
        "turn_rate_share": 1.0,
        **entry.figures,
    }
    provisional = {
        "mass_kg": mass_kg(trimmed(files, cruise)),
        "airspeed_range_mps": (SLOWEST_MPS, FASTEST_MPS),
        "cruise_mps": cruise,
        "roll_in_s": 1.0,
        "weave_error_m": 0.0,
        "level_banks": ((cruise, figures["bank_limit_deg"]),),
        "gains": vars(placed),
    }
    return Airframe.of(entry, files, {**provisional, **figures})


def _lift_short_of_stall(files: ModelFiles, airspeed: float, side: float, stall_deg: float | None) -> float:
    """Lift, over that of level flight, `ALPHA_MARGIN_DEG` short of a stall or where lift stops, or half way to it."""
    stops_deg, tried = lift_limit(files, airspeed, side)
    stops_deg = stall_deg or stops_deg or side * UNSTALLED_DEG
    margin_deg = min(ALPHA_MARGIN_DEG, 0.5 * abs(tried[0, 0] - stops_deg))
    return round(float(np.interp(side * stops_deg - margin_deg, side * tried[:, 0], tried[:, 1])), 3)


def middle_of_trims(files: ModelFiles) -> float:
    """Geometric middle (m/s) of the longest range of speeds at which a model trims; AircraftError if there is none."""
    runs: list[list[float]] = [[]]
    reasons: Counter[str] = Counter()
    speed = SLOWEST_MPS
    while speed <= FASTEST_MPS:
        try:
            trimmed(files, speed)
            runs[-1].append(speed)
        except TrimError as error:
            runs.append([])
            reasons[str(error).partition("level: ")[2]] += 1
        speed *= SPEED_STEP_FACTOR
    if not (longest := max(runs, key=len)):
        reason = max(reasons, key=lambda each: (each != NO_TRIM, reasons[each]))
        raise AircraftError(
            f"{files.name} cannot be trimmed for level flight at any speed from {SLOWEST_MPS:g} to "
            f"{FASTEST_MPS:g} m/s: {reason}"
        )
    return round(math.sqrt(longest[0] * longest[-1]), SPEED_DECIMALS)


def _last_held_mps(frame: Airframe, factor: float) -> float:
    """The slowest or fastest speed that is held, sought from cruise in steps of a factor, to 1 % and 0.1 m/s.

    Every speed that counts as held has been flown: near the stall some trims fail between others that do not.
    """
    good = bad = frame.cruise_mps
    while bad == good and SLOWEST_MPS < good < FASTEST_MPS:
        bad = round(min(max(good * factor, SLOWEST_MPS), FASTEST_MPS), SPEED_DECIMALS)
        good = bad if not_held(frame, bad) is None else good
    while abs(good - bad) > max(SPEED_TOLERANCE_SHARE * good, 10.0**-SPEED_DECIMALS):
        middle = round(0.5 * (good + bad), SPEED_DECIMALS)
        if middle in (good, bad):  # a step apart: floats tell 8.3 - 8.2 from 0.1
            break
        good, bad = (middle, bad) if not_held(frame, middle) is None else (good, middle)
    return good
