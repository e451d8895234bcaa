"""How fast an aircraft climbs and sinks at a speed it holds, measured by flying it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from aircraft.airframe import Airframe
from aircraft.card_cache import cached
from aircraft.frames import LocalPlane
from aircraft.jsbsim_loading import REFERENCE_ALTITUDE_M
from aircraft.jsbsim_model import JsbsimModel
from aircraft.model_files import AircraftError
from aircraft.start import StartConditions
from aircraft.trials import KEPT_SPEED_SHARE, farthest, flown

STEEPEST_RATE_SHARE = 0.4  # no climb or sink rate beyond this share of the airspeed (24 degrees) is tried
SETTLING_S, JUDGED_S = 15.0, 10.0  # a trial settles for the first time and is judged over the second
KEPT_RATE_SHARE = 0.05
"""A rate counts as held if the mean rate flown is short of it by at most this share of it."""
TOLERANCE = 0.02  # the steepest rate that is held is found to this share of the steepest that is tried
FULL_THROTTLE, IDLE_THROTTLE = 0.99, 0.01  # the mean throttle of a climb, and of a descent, stay within
SPEEDS_FLOWN, OFF_THE_STALL = 5, 1.05
"""Rates are measured at so many airspeeds, evenly over the range of level flight, and at its lowest times a factor."""


@dataclass(frozen=True)
class ClimbRates:
    """The fastest climb and descent of an aircraft, interpolated linearly between the airspeeds flown."""

    airspeeds_mps: tuple[float, ...]  # true, that were flown, rising
    climb_mps: tuple[float, ...]  # the fastest at each, airspeed held and the throttle not quite full
    descent_mps: tuple[float, ...]  # likewise with the throttle not quite idle; positive

    def at(self, airspeed_mps: float) -> tuple[float, float]:
        """Fastest climb and fastest descent at an airspeed, both positive."""
        at, speeds = airspeed_mps, self.airspeeds_mps
        return float(np.interp(at, speeds, self.climb_mps)), float(np.interp(at, speeds, self.descent_mps))


def climb_rates(frame: Airframe) -> ClimbRates:
    """Rates near sea level, wings level, measured or from the cache; AircraftError if it cannot fly a speed."""

    def measure() -> dict[str, Any]:
        low, high = frame.airspeed_range_mps
        every = np.append(np.linspace(low, high, SPEEDS_FLOWN), OFF_THE_STALL * low)
        speeds = np.unique(every.round(1).clip(low, high)).tolist()
        rates = {"climb_mps": 1.0, "descent_mps": -1.0}
        flown = {name: [fastest_mps(frame, speed, side) for speed in speeds] for name, side in rates.items()}
        return {"airspeeds_mps": speeds, **flown}

    def read(result: dict[str, Any]) -> ClimbRates:
        return ClimbRates(**{name: tuple(column) for name, column in result.items()})

    return cached(f"{frame.name}-climb", frame.digest(), measure, read)


def fastest_mps(frame: Airframe, airspeed_mps: float, side: float) -> float:
    """Finds the fastest climb (`side` 1) or descent (-1) at which an airspeed is held: m/s, at least 0."""
    most_mps = STEEPEST_RATE_SHARE * airspeed_mps
    held = farthest(lambda rate: holds(frame, airspeed_mps, side * rate), 0.0, most_mps, TOLERANCE * most_mps)
    return round(held, 3)


def holds(frame: Airframe, airspeed_mps: float, rate_mps: float) -> bool:
    """Tells whether an aircraft climbs (sinks where negative) at a rate and keeps its airspeed, if it flies at all."""
    altitude = REFERENCE_ALTITUDE_M + max(-rate_mps, 0.0) * (SETTLING_S + JUDGED_S)
    start = StartConditions(0.0, 0.0, altitude, 0.0, airspeed_mps)
    try:
        model = JsbsimModel(frame, start, LocalPlane(45.0, 0.0), climb_limit_mps=abs(rate_mps))
        model.command(0.0, altitude + math.copysign(1e5, rate_mps), airspeed_mps)
        judged = [each for each in flown(model, SETTLING_S + JUDGED_S) if each.time_s > SETTLING_S]
    except AircraftError:
        return False
    climb, speed, throttle = np.array([(s.velocity_up_mps, s.airspeed_mps, s.throttle) for s in judged]).T
    return bool(
        climb.mean() / rate_mps >= 1.0 - KEPT_RATE_SHARE
        and abs(speed - airspeed_mps).max() <= KEPT_SPEED_SHARE * airspeed_mps
        and (throttle.mean() < FULL_THROTTLE if rate_mps > 0.0 else throttle.mean() > IDLE_THROTTLE)
    )
