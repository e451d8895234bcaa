"""The envelope card of an aircraft: what it can do, measured by flying it in JSBSim.

Mass, speeds and banks are of the aircraft's survey, which planning uses; pages fly turns and courses at airspeeds and
winds. They are kept by the content of model and package.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from aircraft.airframe import Airframe
from aircraft.airframes import AircraftError, airframe
from aircraft.card_cache import cached
from aircraft.climb import climb_rates
from aircraft.envelope import performance
from aircraft.guidance.margins import law_margins
from aircraft.interface import GRAVITY_MPS2
from aircraft.jsbsim_loading import REFERENCE_ALTITUDE_M
from aircraft.start import Atmosphere
from aircraft.trials import UPDATE_STEPS, farthest, in_flight, roll_in_s
from harness.bench.tracking import course, fly_course
from harness.scenario.kinds import GUIDANCE
from planner.kernel_cache import seal

BANKS_DEG: Final = (10.0, 20.0, 30.0, 40.0, 45.0)  # banks of measured turns, beside the bank limit
ROLL_IN_AND_SETTLE_S: Final = 10.0  # a turn is flown for this time before it is measured
MEASURED_TURN_S: Final = 30.0  # a turn is measured for this time
COURSE_SEED: Final = 1  # seed of the course on which radii are tried
COURSE_TURNS: Final = 8  # number of turns of that course
RADIUS_TOLERANCE: Final = 0.02  # precision of the tightest tracked radius, over that at the bank limit
DEFAULT_WIND_SHARE: Final = 0.3  # wind in which radii are tried besides calm, as a share of the airspeed
CARD_FORMAT: Final = 2  # number raised whenever cards get other content, so that older ones are made anew


def envelope_card(
    name: str,
    airspeeds_mps: Sequence[float] = (),
    winds_mps: Sequence[float] = (),
    report: Callable[[int, int, str], None] | None = None,
) -> dict[str, Any]:
    """The card of an aircraft, flown unless that has been done before.

    Beside figures of the survey `laws` has the `gain` and `delay_s` that each law bears on a straight line (see
    `aircraft.guidance.margins`), and `at` a page for each airspeed: `climb_mps` and `descent_mps` (see
    `aircraft.climb`), `turns` (see `flown_turn`) and `tracked` (see `tightest`).

    Raises AircraftError where there is none, or it cannot fly at one of the airspeeds or in one of the winds.
    """
    seal()
    frame = airframe(name)
    speeds = tuple(airspeeds_mps) or (frame.cruise_mps,)
    for speed in speeds:
        for wind in (0.0, *winds_mps):
            performance(frame, speed, wind)
    digest = frame.digest()
    pages = []
    for count, speed in enumerate(speeds):
        winds = sorted({0.0, *(winds_mps or (round(DEFAULT_WIND_SHARE * speed, 2),))})
        if report is not None:
            report(count, len(speeds), f"{frame.name} at {speed:g} m/s")
        title = f"{frame.name}-envelope-{CARD_FORMAT}-{speed:g}-{'-'.join(f'{wind:g}' for wind in winds)}"
        pages.append(cached(title, digest, partial(_measure_at, frame, speed, winds), dict))
    limits = frame.guidance_limits()
    names = ("mass_kg", "cruise_mps", "bank_limit_deg", "roll_rate_dps", "verified")
    return {
        "aircraft": frame.name,
        **{name: getattr(frame, name) for name in names},
        "airspeed_range_mps": list(frame.airspeed_range_mps),
        "laws": {name: law_margins(kind, limits)._asdict() for name, kind in GUIDANCE.installed().items()},
        "at": pages,
    }


def _measure_at(frame: Airframe, speed: float, winds: Sequence[float]) -> dict[str, Any]:
    banks = (*(bank for bank in BANKS_DEG if bank < frame.bank_limit_deg), frame.bank_limit_deg)
    climb, descent = climb_rates(frame).at(speed)
    return {
        "airspeed_mps": speed,
        "roll_in_s": roll_in_s(frame, speed),
        "level_bank_deg": frame.level_bank_deg(speed),
        "climb_mps": climb,
        "descent_mps": descent,
        "turns": [flown_turn(frame, speed, bank) for bank in banks],
        "tracked": [tightest(frame, speed, wind) for wind in winds],
    }


def flown_turn(frame: Airframe, speed: float, bank_deg: float) -> dict[str, float | None]:
    """One turn at a bank, after 10 s of rolling in and settling, for 30 s.

    `radius_m` is path length over change of course, None if control is lost on the way, `altitude_lost_m` and
    `airspeed_lost_mps` the most below what was commanded from the roll-in on.
    """
    model = in_flight(frame, speed)
    model.command(math.radians(bank_deg), REFERENCE_ALTITUDE_M, speed)
    length = turned = 0.0
    states = [model.state()]
    while states[-1].time_s < ROLL_IN_AND_SETTLE_S + MEASURED_TURN_S:
        model.advance(UPDATE_STEPS)
        if model.fault():
            turned = math.nan
            break
        before, state = states[-1], model.state()
        states.append(state)
        if before.time_s >= ROLL_IN_AND_SETTLE_S:
            length += state.groundspeed_mps * (state.time_s - before.time_s)
            turned += math.remainder(state.course_rad - before.course_rad, math.tau)
    return {
        "bank_deg": bank_deg,
        "radius_m": None if math.isnan(turned) else length / turned,
        "load_factor": max([1.0, *(each.load_factor for each in states[1:])]),
        "altitude_lost_m": max([0.0, *(REFERENCE_ALTITUDE_M - each.up_m for each in states[1:])]),
        "airspeed_lost_mps": max([0.0, *(speed - each.airspeed_mps for each in states[1:])]),
    }


def tightest(frame: Airframe, speed: float, wind_mps: float) -> dict[str, float | None]:
    """The tightest radius of which a course of 8 turns is tracked in a wind, the bank never cut; None if none is.

    Tracked means within the error that planning allows for. The search goes, to 2 %, from the radius of planning to
    that at the bank limit in calm air.
    """
    planned = performance(frame, speed, wind_mps)
    air = Atmosphere(wind_east_mps=wind_mps)

    def tracks(radius_m: float) -> bool:
        try:
            flown = fly_course(frame, speed, air, course(COURSE_SEED, radius_m, COURSE_TURNS))
        except (AircraftError, ArithmeticError):
            return False
        return flown.bank_saturation == 0.0 and flown.cross_track_max_m <= planned.tracking_error_m

    least_m = 0.9 * speed**2 / (GRAVITY_MPS2 * math.tan(math.radians(frame.bank_limit_deg)))
    planned_m, found = planned.turn_radius_m, None
    if tracks(planned_m):
        found = farthest(tracks, planned_m, least_m, RADIUS_TOLERANCE * least_m)
    return {"wind_mps": wind_mps, "planned_radius_m": planned_m, "tightest_radius_m": found}
