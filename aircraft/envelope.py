"""What planning must know of an aircraft: turn radius, roll-in time, tracking error."""

from __future__ import annotations

import math

from aircraft.airframe import Airframe
from aircraft.interface import GRAVITY_MPS2, Performance
from aircraft.model_files import AircraftError

BANK_RESERVE_DEG = {None: 15.0, "light": 17.0, "moderate": 20.0, "severe": 25.0}
"""Bank kept back from the limit for corrections: 9 degrees is the least that does not saturate in calm air or
steady wind, and the rest is margin; moderate turbulence uses up 15 to 20."""

TRACKING_FACTOR = {None: 1.0, "light": 1.5, "moderate": 3.0, "severe": 6.0}
"""Cross-track error that is hardly ever exceeded, in units of (turn acceleration) * (roll lag)^2. That is the
scale of the bump at an arc-line joint; what was flown stays below half of it in calm air, and the factors for
turbulence leave as much. An aircraft that was seen to do worse is taken for what it was seen to do."""

WEAVE_FACTOR = 1.5
"""Cross-track error that is hardly ever exceeded in calm air, in units of the largest on the survey's weave."""

ROLL_IN_LIMIT_S = 1.5
"""A turn takes no more time than this to roll into: what rolls slowly turns wide, or it would be off the path
where curvature steps."""

LEAST_BANK_DEG = 5.0
"""An aircraft that can bank less at an airspeed is not planned for there."""


def performance(
    airframe: Airframe,
    airspeed_mps: float,
    wind_mps: float = 0.0,
    turbulence: str | None = None,
    gust_mps: float = 0.0,
) -> Performance:
    """Planning figures at one airspeed.

    The radius follows from the coordinated turn at the fastest groundspeed, downwind, with bank in reserve:
    R = (Va + W)^2 / (g tan(bank)), the bank being the limit less the reserve and no steeper than what the aircraft
    was seen to keep its speed and altitude at. Below it the bank saturates and tracking fails abruptly.

    Args:
        airframe: the aircraft.
        airspeed_mps: true airspeed.
        wind_mps: speed of the steady wind.
        turbulence: None, "light", "moderate" or "severe".
        gust_mps: speed of a gust front on top of the wind; it may be faster than the aircraft.

    Raises:
        AircraftError: if the airframe cannot hold the airspeed or cannot make way against the wind.
        ValueError: if `wind_mps` or `gust_mps` is negative or not finite, or `turbulence` is none of the above.
    """
    airframe.check_airspeed(airspeed_mps)
    if not 0.0 <= wind_mps < math.inf:
        raise ValueError(f"wind_mps must be a finite number of at least 0; got {wind_mps:g}")
    if not 0.0 <= gust_mps < math.inf:
        raise ValueError(f"gust_mps must be a finite number of at least 0; got {gust_mps:g}")
    if turbulence not in BANK_RESERVE_DEG:
        raise ValueError(f"turbulence must be light, moderate, severe or None; got {turbulence!r}")
    if wind_mps >= airspeed_mps:
        raise AircraftError(
            f"{airframe.name} at {airspeed_mps:g} m/s cannot make way against a wind of {wind_mps:g} m/s"
        )
    rolled_deg = airframe.roll_rate_dps * ROLL_IN_LIMIT_S
    level_deg = airframe.level_bank_deg(airspeed_mps)
    if level_deg < LEAST_BANK_DEG:
        raise AircraftError(
            f"{airframe.name} cannot turn at {airspeed_mps:g} m/s: it keeps speed and altitude only up to "
            f"{level_deg:.1f} degrees of bank, and {LEAST_BANK_DEG:g} are needed"
        )
    bank = math.radians(min(airframe.bank_limit_deg - BANK_RESERVE_DEG[turbulence], level_deg, rolled_deg))
    fastest = airspeed_mps + wind_mps + gust_mps
    acceleration = GRAVITY_MPS2 * math.tan(bank)
    return Performance(
        airspeed_mps=airspeed_mps,
        turn_radius_m=fastest * fastest / acceleration,
        roll_in_s=airframe.roll_in_s,
        tracking_error_m=TRACKING_FACTOR[turbulence]
        * max(acceleration * airframe.roll_lag_s**2, WEAVE_FACTOR * airframe.weave_error_m),
    )
