"""What was in force while a plan was flown, row by row, and what the plan asked for, in shares of it.

In calm air a turn of curvature k at the commanded airspeed V takes the bank atan(k V^2 / g). In wind the path over the
ground has that curvature, and the lift acts across the heading: the bank is atan(k Vg^2 / (g cos(drift))), Vg being the
groundspeed along the path and drift the angle from heading to course.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aircraft.guidance.altitude import slewed
from aircraft.interface import GRAVITY_MPS2
from harness.analysis.flight_limits import FlightLimits
from harness.analysis.smoothness import flown_lengths, planned_profile, turn_onto_plan_1pm, window_m
from harness.flight.record import AcceptedPlan, FloatArray, Track

WIND_AVERAGED_S = 20.0  # the wind is averaged over this time, s, so that it is no gust of turbulence
LEAST_WIND_MPS = 1.0  # a wind that seems to be less is taken for the sideslip of a turn in calm air


@dataclass(frozen=True, eq=False)
class InForce:
    """What was in force in each row of a track: true airspeed commanded, wind, limits of the bank.

    The wind (n, 2) is its velocity, east and north, averaged over `WIND_AVERAGED_S`; sideslip is taken to be zero.
    """

    commanded_mps: FloatArray
    wind_mps: FloatArray
    bank_limit_rad: float
    roll_rate_radps: float

    @classmethod
    def of(cls, track: Track, limits: FlightLimits, commanded_mps: FloatArray | None = None) -> InForce:
        """Returns what was in force on a track; the airspeed is the one given, or else of the limits, or flown.

        Where the guidance law asked for another, it is that, at the rate at which a mission's changes.
        """
        if commanded_mps is None:
            known = math.isfinite(limits.airspeed_mps)
            commanded_mps = np.full(len(track), limits.airspeed_mps) if known else track.airspeed_mps
        if np.isfinite(track.asked_airspeed_mps).any():
            of_law = np.where(np.isnan(track.asked_airspeed_mps), commanded_mps, track.asked_airspeed_mps)
            commanded_mps = slewed(of_law, track.time_s, float(commanded_mps[0]))
        wind_mps = np.zeros((len(track), 2)) if limits.no_wind else _wind_mps(track)
        return cls(commanded_mps, wind_mps, limits.bank_limit_rad, limits.roll_rate_radps)

    def part(self, first: int, stop: int) -> InForce:
        """Returns what was in force in the rows from `first` up to `stop`."""
        return replace(self, commanded_mps=self.commanded_mps[first:stop], wind_mps=self.wind_mps[first:stop])


def _wind_mps(track: Track) -> FloatArray:
    """(n, 2) the wind along a track, averaged, from groundspeed, course, airspeed and heading."""
    climb = np.gradient(track.up_m, track.time_s) if len(track) > 1 else np.zeros(len(track))
    level = np.sqrt(np.maximum(track.airspeed_mps**2 - climb**2, 0.0))
    wind = track.groundspeed_mps * np.exp(1j * np.radians(track.course_deg))
    wind -= level * np.exp(1j * np.radians(track.heading_deg))
    rows = 1 if len(track) < 2 else max(round(WIND_AVERAGED_S / float(np.median(np.diff(track.time_s)))), 1)
    rows = min(rows, len(track))
    mean = np.convolve(wind, np.ones(rows), "same") / np.convolve(np.ones(len(track)), np.ones(rows), "same")
    mean[np.abs(mean) < LEAST_WIND_MPS] = 0.0
    return np.column_stack((mean.imag, mean.real))


@dataclass(frozen=True)
class Demand:
    """What turns of a plan ask for, over what was in force there; above 1 the aircraft cannot do it.

    The largest lateral acceleration, in calm air and in the wind there, over g tan(bank limit); the largest roll rate
    over its limit.
    """

    calm: float
    windy: float
    roll_rate: float


def demand(lead: Track, plans: Sequence[AcceptedPlan], force: InForce) -> Demand:
    """Returns what was planned for some rows of a track, and for the window after them, asks for.

    The curvature is the change of the plan's direction over a window of about one second, as long as it takes to roll.
    """
    window = window_m(lead)
    reach = lead.arc_length_m.copy()
    reach[-1] += window  # an aircraft that overshoots a corner stays at its station
    length, curvature = planned_profile(replace(lead, arc_length_m=reach), plans, window)
    joint = np.append(0.0, np.cumsum(length))
    turned = np.append(0.0, np.cumsum(curvature * length))
    span = max(min(window, float(joint[-1])), 1e-3)
    ahead = np.where(np.diff(lead.plan_index) == 0, np.diff(lead.arc_length_m), flown_lengths(lead))
    passed = np.append(0.0, np.cumsum(np.maximum(np.nan_to_num(ahead), 0.0)))
    at = np.sort(np.concatenate((joint - 0.5 * span, joint + 0.5 * span, passed)))
    bend = (np.interp(at + 0.5 * span, joint, turned) - np.interp(at - 0.5 * span, joint, turned)) / span
    row = np.clip(np.searchsorted(passed, at, side="right") - 1, 0, len(lead) - 1)
    at = np.append(at, at[-1])
    bend = np.append(bend, turn_onto_plan_1pm(lead, plans, window))
    return _demand_at(force, bend, at, np.append(row, 0), np.radians(lead.course_deg))


def _demand_at(force: InForce, bend: FloatArray, at_m: FloatArray, row: FloatArray, course_rad: FloatArray) -> Demand:
    """Returns the demand of curvatures (1/m) at places of a plan and rows of a track; the last has no roll rate."""
    speed, wind, course = force.commanded_mps[row], force.wind_mps[row], course_rad[row]
    along = wind[:, 0] * np.sin(course) + wind[:, 1] * np.cos(course)
    across = wind[:, 0] * np.cos(course) - wind[:, 1] * np.sin(course)
    headway = np.sqrt(np.maximum(speed**2 - across**2, 1.0))
    needs = bend * (along + headway) ** 2 * speed / (GRAVITY_MPS2 * headway)
    steepest = math.tan(force.bank_limit_rad)
    calm = np.abs(bend) * speed**2 / (GRAVITY_MPS2 * steepest)
    bank = np.arctan(bend * speed**2 / GRAVITY_MPS2)[:-1]
    apart = np.diff(at_m[:-1])
    rate = np.divide(np.abs(np.diff(bank)), apart, out=np.zeros_like(apart), where=apart > 1e-6) * speed[:-2]
    return Demand(
        calm=float(calm.max()),
        windy=float(np.abs(needs).max() / steepest),
        roll_rate=float(rate.max(initial=0.0)) / force.roll_rate_radps,
    )
