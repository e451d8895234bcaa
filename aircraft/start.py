"""How a flight begins: start conditions and the air."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from aircraft.interface import FOOT_M, FloatArray

TURBULENCE_W20_FPS = {"light": 25.0, "moderate": 50.0, "severe": 75.0}
"""Wind at 20 ft of MIL-F-8785C: 15, 30 and 45 knots."""


@dataclass(frozen=True)
class VerticalGusts:
    """Discrete vertical gusts one after the other, upwards and downwards in turn, each 1 - cosine (CS 25.341)."""

    speed_mps: float  # of a gust at its strongest
    duration_s: float  # of one gust
    every_s: float  # from the beginning of one to that of the next
    start_s: float = 0.0  # time at which the first gust, upwards, begins

    def up_mps(self, time_s: FloatArray) -> FloatArray:
        """(n,) speeds (m/s) at which the air rises at n times."""
        number, since_s = np.divmod(time_s - self.start_s, self.every_s)
        gusty = (number >= 0) & (since_s < self.duration_s)
        rise = [0.5 - 0.5 * math.cos(math.tau * each / self.duration_s) for each in since_s[gusty].tolist()]
        up_mps = np.zeros(len(time_s))
        up_mps[gusty] = np.where(number[gusty] % 2, -1.0, 1.0) * self.speed_mps * rise
        return up_mps


DRYDEN_HEIGHTS_FT = (10.0, 1000.0)
"""Heights over ground between which Dryden's low-altitude model holds; outside, the nearer end counts."""


class DrydenGusts:
    """Turbulence over true ground: Dryden's spectra with the low-altitude sizes of MIL-F-8785C, section 3.7.3.

    JSBSim's own takes the height above the sea for that over ground. u is a process of first order; v and w have
    Dryden's transverse spectrum: sqrt(1/2) (sqrt(3) y1 + (1 - sqrt(3)) y2), y2 being y1 once more through its lag.
    """

    def __init__(self, intensity: str, seed: int) -> None:
        self._vertical_mps = 0.1 * TURBULENCE_W20_FPS[intensity] * FOOT_M
        self._rng = np.random.default_rng(seed)
        self._first = self._rng.standard_normal(3).tolist()
        self._second = [0.5 * each for each in self._first]

    def sizes(self, height_m: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Standard deviations (m/s) and scale lengths (m) of the gusts ahead, to the side and down at a height."""
        low, high = DRYDEN_HEIGHTS_FT
        height_ft = min(max(height_m / FOOT_M, low), high)
        shape = 0.177 + 0.000823 * height_ft
        level_mps, level_m = self._vertical_mps / shape**0.4, FOOT_M * height_ft / shape**1.2
        return (level_mps, level_mps, self._vertical_mps), (level_m, level_m, FOOT_M * height_ft)

    def step(self, height_m: float, airspeed_mps: float, seconds: float) -> tuple[float, float, float]:
        """Moves the turbulence on by `seconds` and returns the gusts ahead, to the right and down (m/s)."""
        sigmas, lengths = self.sizes(height_m)
        found = []
        for axis, noise in enumerate(self._rng.standard_normal(3).tolist()):
            decay = math.exp(-seconds * airspeed_mps / lengths[axis])
            before = self._first[axis]
            self._first[axis] = decay * before + math.sqrt(1.0 - decay * decay) * noise
            self._second[axis] = decay * self._second[axis] + (1.0 - decay) * before
            unit = self._first[axis]
            if axis:
                unit = math.sqrt(0.5) * (math.sqrt(3.0) * unit + (1.0 - math.sqrt(3.0)) * self._second[axis])
            found.append(sigmas[axis] * unit)
        return found[0], found[1], found[2]


ROUGHNESS_M = 0.15 * FOOT_M
"""Roughness length of the wind profile: 0.15 ft, MIL-F-8785C section 3.7.3.4 for flight near the ground."""
PROFILE_HEIGHTS_M = (3 * FOOT_M, 1000 * FOOT_M)
"""Heights over ground between which the profile of MIL-F-8785C holds; outside, the nearer end counts."""


@functools.lru_cache(maxsize=16)  # a flight asks at every step, and reads its height only now and then
def profile_share(height_m: float, measured_at_m: float) -> float:
    """Wind speed at a height over ground over that at another: ln(h / z0) / ln(h_measured / z0), MIL-F-8785C."""
    low, high = PROFILE_HEIGHTS_M
    h, reference = (min(max(each, low), high) for each in (height_m, measured_at_m))
    return math.log(h / ROUGHNESS_M) / math.log(reference / ROUGHNESS_M)


@dataclass(frozen=True)
class Atmosphere:
    """Wind, gusts and turbulence."""

    wind_east_mps: float = 0.0  # at time 0 in the local plane, the direction it blows towards
    wind_north_mps: float = 0.0
    turbulence: str | None = None  # tustin or milspec
    intensity: str | None = None  # light, moderate or severe; None exactly if `turbulence` is
    seed: int = 0  # of the turbulence, 0 to 2^31 - 1
    changes: tuple[tuple[float, float, float], ...] = ()
    """(time s, east m/s, north m/s), time rising from above 0: the wind goes over linearly, and stays as the last."""
    measured_at_m: float | None = None
    """Height over ground at which a wind with the profile of `profile_share` was measured; None: no profile."""
    vertical_gusts: VerticalGusts | None = None

    @property
    def wind_mps(self) -> float:
        """Largest speed of the wind at any time, at the height that it was measured at."""
        winds = [(self.wind_east_mps, self.wind_north_mps), *(row[1:] for row in self.changes)]
        return max(math.hypot(*wind) for wind in winds)

    def winds(self, time_s: FloatArray) -> FloatArray:
        """(n, 3) wind east, north and up (m/s) at n times where it was measured, turbulence left out."""
        legs = np.array([(0.0, self.wind_east_mps, self.wind_north_mps), *self.changes, (math.inf, 0.0, 0.0)])
        before = legs[:-1, 0].searchsorted(time_s, side="right") - 1
        legs[-1, 1:] = legs[-2, 1:]
        (before_s, *old), (after_s, *new) = legs[before].T, legs[before + 1].T
        share = (time_s - before_s) / (after_s - before_s)
        up = np.zeros(len(time_s)) if self.vertical_gusts is None else self.vertical_gusts.up_mps(time_s)
        return np.column_stack([*(a + share * (b - a) for a, b in zip(old, new, strict=True)), up])

    def share_at(self, height_m: float) -> float:
        """Speed of the wind at a height over ground over that where it was measured."""
        return 1.0 if self.measured_at_m is None else profile_share(height_m, self.measured_at_m)

    def start_wind(self, height_m: float) -> tuple[float, float]:
        """East and north of the wind (m/s) at time 0 and a height over ground, turbulence left out."""
        share = self.share_at(height_m)
        return share * self.wind_east_mps, share * self.wind_north_mps


@dataclass(frozen=True)
class StartConditions:
    """Straight level flight in the local plane."""

    east_m: float
    north_m: float
    altitude_m: float  # above mean sea level
    course_rad: float  # over the ground, clockwise from the plane's north
    airspeed_mps: float  # true

    def heading_rad(self, atmosphere: Atmosphere) -> float:
        """Heading (rad) that makes the course good in a wind (the wind triangle); ValueError if none does."""
        cosine, sine = math.cos(self.course_rad), math.sin(self.course_rad)
        across = atmosphere.wind_east_mps * cosine - atmosphere.wind_north_mps * sine
        if abs(across) >= self.airspeed_mps:
            wind = f"a wind of {abs(across):g} m/s across the course"
            raise ValueError(f"{wind} cannot be held at {self.airspeed_mps:g} m/s")
        return self.course_rad - math.asin(across / self.airspeed_mps)
