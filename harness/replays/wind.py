"""The wind of a flown flight, fitted to its speed over the ground and its airspeed, without a heading.

Least squares of | ground velocity - wind | = airspeed (Gauss-Newton). Where no airspeed is known, one for all rows is
fitted with the wind. The aircraft must turn: in straight flight only the wind along the way shows.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from harness.files.input_file import InputError
from harness.flight.record import FloatArray
from harness.replays.flown import FlownFlight

LEAST_TURN_DEG = 90.0  # a wind is fitted only where the courses span at least this angle
WINDOW_S, WINDOW_EVERY_S = 20.0, 10.0
"""Winds that change are fitted to windows of this length, at this spacing: about half a lap of a small square."""


@dataclass(frozen=True)
class FittedWind:
    """A fitted wind, by the components towards east and north."""

    east_mps: float
    north_mps: float
    residual_mps: float  # root mean square of what is left of the airspeed
    time_s: float = 0.0  # middle of the window; 0 for a whole flight
    airspeed_mps: float = math.nan  # airspeed fitted with the wind, where none is known

    @property
    def speed_mps(self) -> float:
        """Speed of the wind."""
        return math.hypot(self.east_mps, self.north_mps)

    @property
    def from_deg(self) -> float:
        """Direction that the wind blows from, clockwise from north."""
        return math.degrees(math.atan2(-self.east_mps, -self.north_mps)) % 360.0

    def figures(self) -> dict[str, float]:
        """Returns the wind for `replay.json`."""
        return {"speed_mps": self.speed_mps, "from_deg": self.from_deg, "residual_mps": self.residual_mps}


def true_over_indicated(altitude_m: float) -> float:
    """Ratio of true to indicated airspeed in the standard atmosphere (ISO 2533), up to 11 km."""
    return float((1.0 - 0.0065 / 288.15 * min(altitude_m, 11_000.0)) ** (0.5 - 0.5 * 5.25588))


def fit_wind(flight: FlownFlight, time_s: float = 0.0, airspeed: FloatArray | None = None) -> FittedWind:
    """Fits one wind to a flight, or raises InputError if it hardly turns; `airspeed` (n,) replaces the flight's own."""
    velocity = np.array((flight["ve_mps"], flight["vn_mps"]))
    airspeed = flight.airspeed_mps if airspeed is None else airspeed
    known = np.isfinite(velocity).all(axis=0) & (True if airspeed is None else np.isfinite(airspeed))
    velocity = velocity[:, known]
    course = np.unwrap(np.arctan2(*velocity))
    if not course.size or math.degrees(np.ptp(course)) < LEAST_TURN_DEG:
        raise InputError(f"{flight.source}: turns by under {LEAST_TURN_DEG:g} deg; the wind cannot be told")
    wind, common = np.zeros(2), float(np.hypot(*velocity).mean())
    for _ in range(50):
        through = velocity - wind[:, None]
        speed = np.maximum(np.hypot(*through), 1e-6)
        left = speed - (common if airspeed is None else airspeed[known])
        slopes = np.column_stack((*(-through / speed), -np.ones(len(speed))))
        change = np.zeros(3)
        columns = slice(3 if airspeed is None else 2)
        change[columns] = np.linalg.lstsq(slopes[:, columns], -left, rcond=None)[0]
        wind, common = wind + change[:2], common + float(change[2])
        if float(np.abs(change).max()) < 1e-9:
            break
    if np.hypot(*wind) > (common if airspeed is None else airspeed[known].max()):
        raise InputError(f"{flight.source}: the wind cannot be told: the fit has one above the airspeed")
    return FittedWind(float(wind[0]), float(wind[1]), float(np.sqrt(np.mean(left**2))), time_s, common)


def fit_windows(flight: FlownFlight, whole: FittedWind) -> list[FittedWind]:
    """Fits winds to windows one after the other, leaving out those in which the aircraft turns too little.

    The airspeed of the whole flight's wind stands for one that was not measured.
    """
    times: FloatArray = flight["time_s"] - flight["time_s"][0]
    airspeed = np.full_like(times, whole.airspeed_mps) if flight.airspeed_mps is None else flight.airspeed_mps
    found = []
    for middle_s in np.arange(0.0, times[-1] + WINDOW_EVERY_S, WINDOW_EVERY_S).tolist():
        rows = np.flatnonzero(np.abs(times - middle_s) <= 0.5 * WINDOW_S)
        if len(rows) >= 3 and times[rows[-1]] - times[rows[0]] >= 0.5 * WINDOW_S - 1.0:
            with suppress(InputError):
                found.append(fit_wind(flight.rows(rows), middle_s, airspeed[rows]))
    return found
