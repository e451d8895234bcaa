"""What planning must know of an aircraft: turn radius, roll-in time, tracking error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from aircraft.airframe import Airframe
from aircraft.interface import GRAVITY_MPS2, Performance
from aircraft.model_files import AircraftError

BANK_RESERVE_DEG = {None: 15.0, "light": 17.0, "moderate": 20.0, "severe": 25.0}
"""Bank (deg) kept in reserve below the limit for corrections, by turbulence: 9 degrees is the least that does not
saturate in calm air or steady wind, and the rest is margin; moderate turbulence uses up 15 to 20."""

HOLD_RESERVE_DEG = {None: 5.0, "light": 5.0, "moderate": 10.0, "severe": 15.0}
"""Bank (deg) kept in reserve below the limit in a full turn held in wind. Five Aerosonde flights each in wind of 8 and
12 m/s kept within 0.3 m in light turbulence with 5 degrees, within 0.5 m in moderate turbulence with 10. With 5
and 7 degrees in moderate turbulence the aircraft was up to 7 m and 3 m off."""

CALM_HOLD_RESERVE_DEG = 10.0
"""Bank (deg) kept in reserve in a full turn in calm air: with 5 a J3Cub that came from a weave was off it by 22 m."""

SPACED_RESERVE_DEG = {None: 7.0, "light": 7.0, "moderate": 12.0, "severe": 17.0}
"""Bank (deg) kept in reserve below the limit in wind, in a turn with a straight before and after it to roll on.
Random courses of the Aerosonde in wind of 8 and 12 m/s were kept within 0.15 m without turbulence, 0.6 m in moderate
and 0.8 m in severe turbulence; those of J3Cub and c172p in wind of 30 % within 0.5 m. The bank was never cut."""

TRACKING_FACTOR = {None: 1.0, "light": 1.5, "moderate": 3.0, "severe": 6.0}
"""Cross-track error that is hardly ever exceeded, in units of (turn acceleration) * (roll lag)^2, by turbulence. It is
the scale of the bump at an arc-line joint; what was flown stays below half of it in calm air, and the factors for
turbulence leave as much. An aircraft that was seen to do worse is taken for what it was seen to do."""

WEAVE_FACTOR = 1.5
"""Cross-track error that is hardly ever exceeded in calm air, in units of the largest on the survey's weave."""

ROLL_IN_LIMIT_S = 1.5  # planned turns take at most this long to roll into: a slow roller has wider ones

STRONGEST_WIND_SHARE = 0.9  # strongest wind that is planned for, as a share of the airspeed

LEAST_BANK_DEG = 5.0
"""An aircraft that can bank less at an airspeed is not planned for there. A turn may use this much of a bank limit, or
half of a limit below twice this. Courses so planned were kept by Aerosonde and J3Cub under limits of 8 to 15 degrees
within 0.04 m in calm air and 1.2 m in severe turbulence and wind of 40 %, under one of 5 degrees within 3.5 m."""


@dataclass(frozen=True)
class WindPoint:
    """How a guidance law tracks a weave in one wind."""

    wind_share: float  # speed of the wind over the airspeed
    radius_factor: float  # turns this much wider than the aircraft needs are tracked well
    error_m: float  # largest cross-track error on them


@dataclass(frozen=True)
class LawCard:
    """How a guidance law tracks with one aircraft, see `aircraft.law_cards`."""

    kind: str
    points: tuple[WindPoint, ...]  # in calm air first, then in ever stronger wind

    def at(self, wind_share: float) -> tuple[float, float]:
        """Radius factor and cross-track error (m) in a wind, interpolated linearly between the winds flown.

        Beyond the strongest wind that was flown the error is taken to double until `STRONGEST_WIND_SHARE`.
        """
        shares = [point.wind_share for point in self.points]
        factor = float(np.interp(wind_share, shares, [point.radius_factor for point in self.points]))
        error_m = float(np.interp(wind_share, shares, [point.error_m for point in self.points]))
        beyond = max(wind_share - shares[-1], 0.0) / (STRONGEST_WIND_SHARE - shares[-1])
        return factor, error_m * (1.0 + beyond)


def performance(
    airframe: Airframe,
    airspeed_mps: float,
    wind_mps: float = 0.0,
    turbulence: str | None = None,
    law: LawCard | None = None,
) -> Performance:
    """Planning figures at a true airspeed in a steady wind, at least 0, and turbulence (light, moderate, severe, None).

    The radius follows from the coordinated turn at the fastest groundspeed, downwind, with bank in reserve:
    R = (Va + W)^2 / (g tan(bank)), the bank being the limit less the reserve and no steeper than what the aircraft
    was seen to keep its speed and altitude at. Below it the bank saturates and tracking fails abruptly. A hold is flown
    with less in reserve (`HOLD_RESERVE_DEG`, in calm air `CALM_HOLD_RESERVE_DEG`), and so are turns with a straight to
    roll between them (`SPACED_RESERVE_DEG`), which are no tighter than in calm air. Without a law's card it is that of
    `preview`, which the survey was flown with.

    Raises AircraftError if the airframe cannot hold the airspeed or cannot make way against the wind.
    """
    airframe.check_airspeed(airspeed_mps)
    if wind_mps >= airspeed_mps:
        at = f"{airframe.name} at {airspeed_mps:g} m/s"
        raise AircraftError(f"{at} cannot make way against a wind of {wind_mps:g} m/s")
    rolled_deg = airframe.roll_rate_dps * ROLL_IN_LIMIT_S
    if (level_deg := airframe.level_bank_deg(airspeed_mps)) < LEAST_BANK_DEG:
        raise AircraftError(
            f"{airframe.name} cannot turn at {airspeed_mps:g} m/s: it keeps speed and altitude only up to "
            f"{level_deg:.1f} degrees of bank, and {LEAST_BANK_DEG:g} are needed"
        )
    limit_deg, most_deg = airframe.bank_limit_deg, min(level_deg, rolled_deg)
    least_deg = min(LEAST_BANK_DEG, 0.5 * limit_deg)

    def turning(reserve_deg: float) -> float:
        """Acceleration of a level turn, g tan(bank), with this much bank in reserve, or less under a small limit."""
        return GRAVITY_MPS2 * math.tan(math.radians(min(max(limit_deg - reserve_deg, least_deg), most_deg)))

    acceleration, spaced = turning(BANK_RESERVE_DEG[turbulence]), turning(SPACED_RESERVE_DEG[turbulence])
    holding, calm = turning(HOLD_RESERVE_DEG[turbulence]), turning(CALM_HOLD_RESERVE_DEG)
    fastest = airspeed_mps + wind_mps
    radius_m = fastest * fastest / acceleration
    hold_radius_m = min(max(fastest * fastest / holding, airspeed_mps * airspeed_mps / calm), radius_m)
    spaced_radius_m = min(max(fastest * fastest / spaced, airspeed_mps * airspeed_mps / acceleration), radius_m)
    error_m = TRACKING_FACTOR[turbulence] * max(
        acceleration * airframe.roll_lag_s**2, WEAVE_FACTOR * airframe.weave_error_m
    )
    if law is not None:
        factor, weave_error_m = law.at(wind_mps / airspeed_mps)
        radius_m, hold_radius_m = factor * radius_m, factor * hold_radius_m
        spaced_radius_m = radius_m  # the card is of such turns
        error_m += WEAVE_FACTOR * weave_error_m
    return Performance(airspeed_mps, radius_m, airframe.roll_in_s, error_m, hold_radius_m, spaced_radius_m)
