"""Flights that measure an aircraft: banks held, turns, roll, routes tracked.

Each begins trimmed, 300 m above the sea. Speeds are true airspeeds.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from aircraft.airframe import Airframe
from aircraft.envelope import performance
from aircraft.frames import LocalPlane
from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLaw
from aircraft.guidance.latency import as_it_was
from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.guidance.progress import RouteProgress, measures_itself
from aircraft.interface import GRAVITY_MPS2, STEP_RATE_HZ, AircraftState, Route
from aircraft.jsbsim_loading import REFERENCE_ALTITUDE_M
from aircraft.jsbsim_model import JsbsimModel
from aircraft.model_files import AircraftError
from aircraft.route import weave
from aircraft.start import Atmosphere, StartConditions

DOUBLET = (10.0, -10.0, 0.0)
RESTED_SHARE = 0.7
LEG_S = 10.0
TURN_S = 20.0
TURN_SHARE_TOLERANCE = 0.03
"""A steady turn whose rate is this close to that of a coordinated one counts as one: feedback makes up for the rest."""
BANK_STEP_DEG = 1.0
ROLL_IN_DEG = 30.0
KEPT_SPEED_SHARE = 0.03
KEPT_ALTITUDE_M = 2.0
KEPT_ROLL_DEG = 1.5
UPDATE_STEPS = STEP_RATE_HZ // UPDATE_RATE_HZ


def in_flight(frame: Airframe, speed: float, atmosphere: Atmosphere | None = None) -> JsbsimModel:
    """An aircraft in level flight northwards."""
    start = StartConditions(0.0, 0.0, REFERENCE_ALTITUDE_M, 0.0, speed)
    return JsbsimModel(frame, start, LocalPlane(45.0, 0.0), atmosphere)


def not_held(frame: Airframe, speed: float, banks_deg: Sequence[float] = DOUBLET) -> str | None:
    """Why the autopilot does not keep a speed through banks, one after the other; None if it does.

    Bank must have come to rest in the last seconds of each.
    """
    try:
        model = in_flight(frame, speed)
    except AircraftError as error:
        return str(error)
    ticks = round(LEG_S * model.step_rate_hz / UPDATE_STEPS)
    for bank_deg in banks_deg:
        model.command(math.radians(bank_deg), REFERENCE_ALTITUDE_M, speed)
        for tick in range(ticks):
            model.advance(UPDATE_STEPS)
            if fault := model.fault():
                return fault
            off_deg = math.degrees(model.state().roll_rad) - bank_deg
            if tick > RESTED_SHARE * ticks and abs(off_deg) > KEPT_ROLL_DEG:
                return f"bank off by {off_deg:.1f} deg"
        if drift := departure(model.state(), bank_deg, speed):
            return drift
    return None


def weaving_error_m(frame: Airframe, speed: float) -> float:
    """Largest cross-track error on a weave of lines and arcs at the radius of planning; infinite if lost."""
    limits = frame.guidance_limits(speed)
    law = PreviewLaw(PreviewConfig().resolved(limits), limits)
    return tracked(frame, speed, law, weave(performance(frame, speed).turn_radius_m))[0]


def tracked(
    frame: Airframe,
    speed: float,
    law: GuidanceLaw,
    route: Route,
    north_mps: float = 0.0,
    most_s: float = math.inf,
) -> tuple[float, float]:
    """How a law tracks a route in a wind to the north, in so much time at most.

    Returns:
        Largest cross-track error (m), infinite if lost, and the share of the time for which the bank was cut.
    """
    law.follow(route, 0.0)
    progress = None if measures_itself(law) else RouteProgress(route)
    model = in_flight(frame, speed, Atmosphere(wind_north_mps=north_mps))
    worst_m, cut, updates = 0.0, 0, 0
    past: deque[AircraftState] = deque()
    while True:
        state = as_it_was(past, model.state(), frame.files.latency_s)
        output = law.update(state)
        if model.fault() or state.time_s > most_s:
            return math.inf, 1.0
        if output.past_end:
            return worst_m, cut / max(updates, 1)
        if not math.isfinite(output.roll_command_rad + output.cross_track_m):
            raise ValueError(
                f"it asks for a roll of {output.roll_command_rad} rad, {output.cross_track_m} m beside its route; both "
                "must be finite"
            )
        beside_m = output.cross_track_m
        if progress is not None:  # a law that comes from elsewhere is not asked how well it flies
            beside_m = progress.nearest(state.east_m, state.north_m).cross_track_m
        worst_m = max(worst_m, abs(beside_m))
        cut, updates = cut + output.bank_saturated, updates + 1
        model.command(output.roll_command_rad, REFERENCE_ALTITUDE_M, speed)
        model.advance(UPDATE_STEPS)


def departure(state: AircraftState, bank_deg: float, speed: float) -> str | None:
    """What of a steady turn at a bank is not kept; None if all is."""
    off_deg = math.degrees(state.roll_rad) - bank_deg
    if abs(off_deg) > KEPT_ROLL_DEG:
        return f"bank off by {off_deg:.1f} deg"
    if abs(state.airspeed_mps - speed) > KEPT_SPEED_SHARE * speed:
        return f"airspeed {state.airspeed_mps:.1f} m/s instead of {speed:.1f}"
    if abs(state.up_m - REFERENCE_ALTITUDE_M) > KEPT_ALTITUDE_M:
        return f"altitude off by {state.up_m - REFERENCE_ALTITUDE_M:.1f} m"
    return None


def turn_rate_share(frame: Airframe, speed: float) -> float:
    """Turn rate in a steady turn at 30 degrees, or at the bank limit if that is less, over that of a coordinated turn.

    The mean of a left and a right turn, to 0.01; 1 within `TURN_SHARE_TOLERANCE` of it. A side force makes it less: the
    F-16's yaw damper has no washout, holds the nose back in a turn and so makes it slip.
    """
    shares = []
    for bank_deg in (min(ROLL_IN_DEG, frame.bank_limit_deg), -min(ROLL_IN_DEG, frame.bank_limit_deg)):
        model = in_flight(frame, speed)
        model.command(math.radians(bank_deg), REFERENCE_ALTITUDE_M, speed)
        model.advance(round(TURN_S * model.step_rate_hz))
        before = model.state()
        model.advance(model.step_rate_hz)
        after = model.state()
        turned_rad = math.remainder(after.course_rad - before.course_rad, math.tau)
        coordinated_radps = GRAVITY_MPS2 * math.tan(after.roll_rad) / after.groundspeed_mps
        shares.append(turned_rad / (after.time_s - before.time_s) / coordinated_radps)
    share = round(sum(shares) / len(shares), 2)
    return 1.0 if abs(share - 1.0) <= TURN_SHARE_TOLERANCE else share


def roll_in_s(frame: Airframe, speed: float) -> float:
    """Time from wings level to 90 % of 30 degrees, or of the bank limit if that is less, the command a step; to 0.01 s.

    Raises:
        AircraftError: it does not get there.
    """
    model = in_flight(frame, speed)
    bank = math.radians(min(ROLL_IN_DEG, frame.bank_limit_deg))
    model.command(bank, REFERENCE_ALTITUDE_M, speed)
    while model.state().roll_rad < 0.9 * bank:
        model.advance(1)
        if model.state().time_s > TURN_S:
            raise AircraftError(f"{frame.name} cannot be held: it does not roll to {ROLL_IN_DEG:g} degrees")
    return round(model.state().time_s, 2)


def steepest_level_bank_deg(frame: Airframe, speed: float) -> float:
    """Steepest bank up to the limit of an airframe at which a speed and the altitude are kept for 20 s."""

    def keeps(bank_deg: float) -> bool:
        try:
            model = in_flight(frame, speed)
        except AircraftError:
            return False
        model.command(math.radians(bank_deg), REFERENCE_ALTITUDE_M, speed)
        for _ in range(round(TURN_S * model.step_rate_hz / UPDATE_STEPS)):
            model.advance(UPDATE_STEPS)
            if model.fault():
                return False
        return departure(model.state(), bank_deg, speed) is None

    bad = frame.bank_limit_deg
    if keeps(bad):
        return bad
    good = 0.0
    while bad - good > BANK_STEP_DEG:
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if keeps(middle) else (good, middle)
    return math.floor(good)
