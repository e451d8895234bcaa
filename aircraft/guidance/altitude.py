"""Vertical guidance: a profile of altitude and airspeed along a route, and the commands that fly it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.interface import AircraftState, FloatArray

LEAD_S = 1.0  # the slope is read this flying time ahead, which the climb takes to follow its command
CLIMB_AIRSPEED_SHARES = (0.95, 0.88)
"""At the first share of the commanded airspeed the fastest climb may be commanded, at the second none: in a turn the
engine has less power left for a climb."""
SPEED_CHANGE_PER_S = 0.02  # a commanded airspeed changes by no more than this share of itself a second


@dataclass(frozen=True, eq=False)
class VerticalProfile:
    """Altitude and airspeed along a route."""

    arc_length_m: FloatArray  # (k,) along the route, not falling
    altitude_m: FloatArray  # (k,) above mean sea level there; linear in between, level beyond the ends
    speed_from_m: FloatArray  # (j,) along the route, not falling; the first is 0
    airspeed_mps: FloatArray  # (j,) true airspeed from there on

    @property
    def level(self) -> bool:
        """Whether altitude and airspeed are the same all along."""
        return bool(np.ptp(self.altitude_m) == 0.0 and np.ptp(self.airspeed_mps) == 0.0)

    def altitudes(self, arc_length_m: FloatArray) -> FloatArray:
        """(n,) altitudes at places along the route."""
        return np.interp(arc_length_m, self.arc_length_m, self.altitude_m)

    def slopes(self, arc_length_m: FloatArray) -> FloatArray:
        """(n,) climb per distance at places along the route."""
        return self._slopes[np.searchsorted(self.arc_length_m, arc_length_m, side="right")]

    @cached_property
    def _slopes(self) -> FloatArray:
        step = np.diff(self.arc_length_m)
        slope = np.divide(np.diff(self.altitude_m), step, out=np.zeros_like(step), where=step > 0.0)
        return np.concatenate(([0.0], slope, [0.0]))

    def passed(self, arc_length_m: FloatArray, up_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n,) altitudes and slopes of a flight `up_m` high: since the row before, those furthest off and steepest."""
        wanted, slopes = self.altitudes(arc_length_m), self.slopes(arc_length_m)
        along = np.maximum.accumulate(arc_length_m)
        off_m = np.interp(self.arc_length_m, along, up_m) - self.altitude_m
        for knot, row in enumerate(np.searchsorted(along, self.arc_length_m[self.arc_length_m <= along[-1]])):
            if abs(off_m[knot]) > abs(up_m[row] - wanted[row]):
                wanted[row] = up_m[row] - off_m[knot]
            slopes[row] = max(slopes[row], self._slopes[knot + 1], key=abs)
        return wanted, slopes

    def airspeeds(self, arc_length_m: FloatArray) -> FloatArray:
        """(n,) airspeeds of the profile at places along the route."""
        at = np.searchsorted(self.speed_from_m, arc_length_m, side="right") - 1
        return self.airspeed_mps[np.maximum(at, 0)]


def flat(altitude_m: float, airspeed_mps: float) -> VerticalProfile:
    """A profile of one altitude and one airspeed."""
    nought = np.zeros(1)
    return VerticalProfile(nought, nought + altitude_m, nought, nought + airspeed_mps)


def slewed(airspeeds_mps: FloatArray, time_s: FloatArray, before_mps: float) -> FloatArray:
    """Limits the rate of change of (n,) airspeeds asked for at (n,) times, from a commanded `before_mps` on."""
    if (airspeeds_mps == before_mps).all():
        return airspeeds_mps
    commanded = np.empty(len(airspeeds_mps))
    speed, before = before_mps, float(time_s[0])
    for row, (wanted, now) in enumerate(zip(airspeeds_mps.tolist(), time_s.tolist(), strict=True)):
        change = SPEED_CHANGE_PER_S * speed * (now - before)
        speed += min(max(wanted - speed, -change), change)
        commanded[row], before = speed, now
    return commanded


Vertical = Callable[[AircraftState, float], tuple[float, float]]
"""(believed state, arc length along the route m) -> altitude above the sea (m) and true airspeed (m/s) to be held."""


class AltitudeGuidance:
    """Commands altitude and airspeed so that the inner loops fly a profile; works on the believed state.

    The inner loop climbs at its gain times the altitude error. The command is put where that gives the climb of the
    profile, plus what takes the present error back, within what the aircraft can climb and sink at its airspeed. A
    level profile is commanded as it is.
    """

    def __init__(
        self, profile: VerticalProfile, gain_1ps: float, limits: Callable[[float], tuple[float, float]]
    ) -> None:
        self._profile, self._gain, self._limits = profile, gain_1ps, limits
        self._airspeed_mps = float(profile.airspeed_mps[0])
        self._level = profile.level

    def command(self, state: AircraftState, arc_length_m: float) -> tuple[float, float]:
        """Altitude above mean sea level (m) and true airspeed (m/s) to be held until the next update."""
        if self._level:
            return float(self._profile.altitude_m[0]), self._airspeed_mps
        here, ahead = np.array(arc_length_m), np.array(arc_length_m + LEAD_S * state.groundspeed_mps)
        wanted = float(self._profile.airspeeds(here))
        change = SPEED_CHANGE_PER_S * self._airspeed_mps / UPDATE_RATE_HZ
        self._airspeed_mps += min(max(wanted - self._airspeed_mps, -change), change)
        altitude, slope = float(self._profile.altitudes(here)), float(self._profile.slopes(ahead))
        up, down = self._limits(self._airspeed_mps)
        most, none = CLIMB_AIRSPEED_SHARES
        up *= min(max((state.airspeed_mps / self._airspeed_mps - none) / (most - none), 0.0), 1.0)
        climb = self._gain * (altitude - state.up_m) + slope * state.groundspeed_mps
        climb = min(max(climb, -down), up)
        # The command is held, and the error shrinks by then: half an update on average.
        return state.up_m + climb * (1.0 / self._gain + 0.5 / UPDATE_RATE_HZ), self._airspeed_mps
