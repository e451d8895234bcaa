"""The interface of a guidance law: it takes a route, then at every update a state, and gives a roll command."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from aircraft.interface import AircraftState, Route

UPDATE_RATE_HZ = 10
"""Roll commands a second. Flown on the 14-turn courses of `harness.bench.tracking`, 20 a second track no better: the
command is held for half an update more, which the preview makes up for."""


@dataclass(frozen=True)
class GuidanceLimits:
    """What guidance may ask of an aircraft."""

    airspeed_mps: float  # true, that the autopilot holds
    max_airspeed_mps: float  # fastest level flight
    bank_limit_rad: float  # largest roll command
    roll_rate_radps: float  # fastest change of the roll command
    roll_lag_s: float  # time constant of roll behind its command; the command leads by it
    roll_delay_s: float  # further delay of roll: actuators, the roll mode
    bandwidth_radps: float  # natural frequency of the cross-track correction, at most 0.36 / roll_lag_s
    turn_rate_share: float = 1.0
    """Turn rate in a steady turn over that of a coordinated one, g tan(bank) / V; less for an aircraft that slips."""

    @property
    def slowest_roll_s(self) -> float:
        """Time constant of roll, s, at least bank limit / roll rate: with less a law swings from limit to limit."""
        return max(self.roll_lag_s + self.roll_delay_s, self.bank_limit_rad / self.roll_rate_radps)


class GuidanceOutput(NamedTuple):
    """One decision of a guidance law."""

    roll_command_rad: float  # held until the next update, positive right wing down
    cross_track_m: float  # distance from the route, positive to its right
    arc_length_m: float  # of the nearest point along the route; grows on in a loiter
    bank_saturated: bool  # the bank limit cut the command
    past_end: bool  # past the end of the route, straight on along its last tangent
    airspeed_mps: float = math.nan  # true, that the law asks for; NaN: that of the mission

    def airspeed_or(self, held_mps: float) -> float:
        """The airspeed to be commanded (m/s): what the law asks for, else what the mission holds."""
        return held_mps if math.isnan(self.airspeed_mps) else self.airspeed_mps


class GuidanceLaw(Protocol):
    """Follows a route, asked `UPDATE_RATE_HZ` times a second. One object serves one flight.

    It gets the believed state, which differs from the true state by the navigation errors. A law that asks for an
    airspeed may have `hold_airspeed(airspeed_mps)`: after each update it gets the one (true) that the mission holds.
    """

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route, whose nearest point is looked for from an arc length on; roll goes on from where it is."""

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Decides the roll command for the next update interval; RuntimeError if there is no route yet."""
