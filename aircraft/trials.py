"""Flights that measure an aircraft: banks held, turns, roll, routes tracked.

Each begins trimmed, 300 m above the sea. Speeds are true airspeeds.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from aircraft.airframe import Airframe
from aircraft.envelope import performance
from aircraft.frames import LocalPlane
from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLaw, GuidanceOutput
from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.guidance.progress import RouteProgress, measures_itself
from aircraft.interface import GRAVITY_MPS2, STEP_RATE_HZ, AircraftState, Route, delayed_state
from aircraft.jsbsim_loading import REFERENCE_ALTITUDE_M
from aircraft.jsbsim_model import JsbsimModel
from aircraft.model_files import AircraftError
from aircraft.route import weave
from aircraft.start import Atmosphere, StartConditions

DOUBLET_DEG = (10.0, -10.0, 0.0)
"""Banks that an aircraft must hold, one after the other, for a speed to count as held."""
HELD_BANK_S, SETTLED_SHARE = 10.0, 0.7
"""Each of these banks is flown for this time, and must have settled after this share of it."""
TRIAL_TURN_S = 20.0  # a turn is flown for this long before it is judged; a roll into one must end within it
TURN_SHARE_TOLERANCE = 0.03
"""A steady turn whose rate is this close to that of a coordinated one counts as one: feedback makes up for the rest."""
BANK_STEP_DEG = 1.0  # the steepest bank in level flight is found to this
ROLL_IN_DEG = 30.0  # turn rate and time to roll in are measured at this bank, or the bank limit if less
KEPT_SPEED_SHARE, KEPT_ALTITUDE_M, KEPT_ROLL_DEG = 0.03, 2.0, 1.5
"""A steady turn is kept if airspeed, altitude and roll are off by no more than these."""
UPDATE_STEPS = STEP_RATE_HZ // UPDATE_RATE_HZ  # steps of the flight model between two updates of guidance


def in_flight(
    frame: Airframe,
    speed: float,
    atmosphere: Atmosphere | None = None,
    start: tuple[float, float] = (0.0, 0.0),
    course_rad: float = 0.0,
    altitude_m: float = REFERENCE_ALTITUDE_M,
) -> JsbsimModel:
    """Starts an aircraft in level flight, by default northwards from (0, 0) in calm air."""
    begins = StartConditions(*start, altitude_m, course_rad, speed)
    return JsbsimModel(frame, begins, LocalPlane(45.0, 0.0), atmosphere)


def not_held(frame: Airframe, speed: float, banks_deg: Sequence[float] = DOUBLET_DEG) -> str | None:
    """Says why the autopilot does not hold a speed through banks, one after the other; None if it does.

    Bank must have come to rest in the last seconds of each.
    """
    try:
        model = in_flight(frame, speed)
        for bank_deg in banks_deg:
            model.command(math.radians(bank_deg), REFERENCE_ALTITUDE_M, speed)
            states = flown(model, HELD_BANK_S)
            for state in states[round(SETTLED_SHARE * len(states)) + 1 :]:
                if abs(off_deg := math.degrees(state.roll_rad) - bank_deg) > KEPT_ROLL_DEG:
                    return f"bank off by {off_deg:.1f} deg"
            if drift := turn_fault(states[-1], bank_deg, speed):
                return drift
    except AircraftError as error:
        return str(error)
    return None


def flown(model: JsbsimModel, seconds: float) -> list[AircraftState]:
    """Flies on under the last command and returns the state at every update; AircraftError says how control is lost."""
    states = []
    for _ in range(round(seconds * model.step_rate_hz / UPDATE_STEPS)):
        model.advance(UPDATE_STEPS)
        states.append(model.state())
        if fault := model.fault():
            raise AircraftError(fault)
    return states


def weaving_error_m(frame: Airframe, speed: float) -> float:
    """Largest cross-track error on a weave of lines and arcs at the radius of planning; infinite if lost."""
    limits = frame.guidance_limits(speed)
    law = PreviewLaw(PreviewConfig().resolved(limits), limits)
    return tracked(frame, speed, law, weave(performance(frame, speed).turn_radius_m)).most_m


@dataclass(frozen=True)
class Tracked:
    """How a route was tracked."""

    cross_m: list[float]  # cross-track error at each update, at least 0
    altitude_m: list[float]  # altitude error at each update, at least 0
    cut_share: float  # share of the updates in which the bank limit cut the command
    lost: str | None  # why the end was not reached

    @property
    def most_m(self) -> float:
        """Largest cross-track error; infinite if the end was not reached."""
        return math.inf if self.lost else max(self.cross_m, default=0.0)


def tracked(
    frame: Airframe,
    speed: float,
    law: GuidanceLaw,
    route: Route,
    atmosphere: Atmosphere | None = None,
    most_s: float = math.inf,
) -> Tracked:
    """Flies a law along a route from its start, for at most `most_s`.

    Raises AircraftError if the aircraft cannot start in this air, ValueError if the law asks for what is not finite.
    """
    law.follow(route, 0.0)
    progress = None if measures_itself(law) else RouteProgress(route)
    east, north, ahead_east, ahead_north = route.segments[0, :4].tolist()
    model = in_flight(frame, speed, atmosphere, (east, north), math.atan2(ahead_east, ahead_north))
    cross, altitude, cut, lost = list[float](), list[float](), 0, None
    past: deque[AircraftState] = deque()
    while lost is None:
        state = delayed_state(past, model.state(), frame.files.latency_s)
        if not isinstance(output := law.update(state), GuidanceOutput):
            raise TypeError(f"update(state) gave {output!r:.80}; must give a GuidanceOutput")
        beside_m, past_end = output.cross_track_m, output.past_end
        if progress is not None:  # a law that comes from elsewhere is not asked how well or how far it flies
            place = progress.nearest(state.east_m, state.north_m)
            beside_m, past_end = place.off_m, place.past_end
        lost = model.fault() or ("it takes too long" if state.time_s > most_s else None)
        if lost or past_end:
            break
        if not math.isfinite(output.roll_command_rad + output.cross_track_m):
            raise ValueError(
                f"it asks for a roll of {output.roll_command_rad} rad, {output.cross_track_m} m beside its route; both "
                "must be finite"
            )
        cross.append(abs(beside_m))
        altitude.append(abs(state.up_m - REFERENCE_ALTITUDE_M))
        cut += output.bank_saturated
        model.command(output.roll_command_rad, REFERENCE_ALTITUDE_M, output.airspeed_or(speed))
        model.advance(UPDATE_STEPS)
    after = f"control is lost after {state.time_s:.0f} s: {lost}" if lost else None
    return Tracked(cross, altitude, cut / max(len(cross), 1), after)


def turn_fault(
    state: AircraftState, bank_deg: float, speed: float, altitude_m: float = REFERENCE_ALTITUDE_M
) -> str | None:
    """Says what a steady turn does not keep: its bank, airspeed or altitude; None if it keeps all."""
    if abs(off_deg := math.degrees(state.roll_rad) - bank_deg) > KEPT_ROLL_DEG:
        return f"bank off by {off_deg:.1f} deg"
    if abs(state.airspeed_mps - speed) > KEPT_SPEED_SHARE * speed:
        return f"airspeed {state.airspeed_mps:.1f} m/s instead of {speed:.1f}"
    if abs(state.up_m - altitude_m) > KEPT_ALTITUDE_M:
        return f"altitude off by {state.up_m - altitude_m:.1f} m"
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
        model.advance(round(TRIAL_TURN_S * model.step_rate_hz))
        before = model.state()
        model.advance(model.step_rate_hz)
        after = model.state()
        turned_rad = math.remainder(after.course_rad - before.course_rad, math.tau)
        coordinated_radps = GRAVITY_MPS2 * math.tan(after.roll_rad) / after.groundspeed_mps
        shares.append(turned_rad / (after.time_s - before.time_s) / coordinated_radps)
    share = round(sum(shares) / len(shares), 2)
    return 1.0 if abs(share - 1.0) <= TURN_SHARE_TOLERANCE else share


def roll_in_s(frame: Airframe, speed: float) -> float:
    """Time from level to 90 % of 30 degrees of bank, or of the limit if less, to 0.01 s; AircraftError if never."""
    model = in_flight(frame, speed)
    bank = math.radians(min(ROLL_IN_DEG, frame.bank_limit_deg))
    model.command(bank, REFERENCE_ALTITUDE_M, speed)
    while model.state().roll_rad < 0.9 * bank:
        model.advance(1)
        if model.state().time_s > TRIAL_TURN_S:
            raise AircraftError(f"{frame.name} cannot be held: it does not roll to {ROLL_IN_DEG:g} degrees")
    return round(model.state().time_s, 2)


@lru_cache(maxsize=64)
def steepest_level_bank_deg(frame: Airframe, speed: float, altitude_m: float = REFERENCE_ALTITUDE_M) -> float:
    """Steepest bank up to the limit of an airframe at which a speed and the altitude are kept for 20 s.

    Elsewhere than at the survey's altitude it must be kept to the other side after that, too.
    """

    def keeps(bank_deg: float) -> bool:
        try:
            model = in_flight(frame, speed, altitude_m=altitude_m)
            for each_deg in (bank_deg, -bank_deg)[: 1 + (altitude_m != REFERENCE_ALTITUDE_M)]:
                model.command(math.radians(each_deg), altitude_m, speed)
                if turn_fault(flown(model, TRIAL_TURN_S)[-1], each_deg, speed, altitude_m):
                    return False
            return True
        except AircraftError:
            return False

    found = farthest(keeps, 0.0, frame.bank_limit_deg, BANK_STEP_DEG)
    return found if found == frame.bank_limit_deg else math.floor(found)


def farthest(keeps: Callable[[float], bool], good: float, end: float, tolerance: float) -> float:
    """The value furthest from `good` towards `end` that `keeps` accepts, by bisection, to a tolerance.

    `good` is known to be accepted.
    """
    if keeps(end):
        return end
    while abs(end - good) > tolerance:
        middle = 0.5 * (good + end)
        good, end = (middle, end) if keeps(middle) else (good, middle)
    return good
