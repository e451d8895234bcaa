"""The law `preview`: path curvature seen ahead of the roll lag, and a second-order correction of the cross-track error.

    a = kappa Vg^2 - 2 zeta omega e_dot - omega^2 e,    phi = atan(a / (s g cos(chi - psi)))

with a, e positive to the right of the path (the curvature kappa is therefore taken positive to the right here), chi the
course, psi the heading and s the share of its coordinated turn rate that the aircraft reaches. Curvature is that where
the aircraft will be when it has rolled, averaged over the time that rolling into a turn takes, so that line and arc
join without a bump; clothoids in their place gained 1 cm for the Aerosonde (aircraft/MEASURED.md). The roll command
leads by the time constant of the roll loop, so that roll itself follows the law.
Far off the path the approach slows down as sqrt(2 a e), and its speed is taken up at sqrt(2 j v), so that bank and roll
rate are enough to join without a swing (ArduPilot's `sqrt_controller`).
Wind enters through the ground velocity alone, except where it is stronger than the aircraft: then the wind is estimated
as ground velocity less air velocity, and `aircraft.kernels.air_direction` says where to head.

Sources: R. W. Beard and T. W. McLain, "Small Unmanned Aircraft", chapter 9 (coordinated turn in wind), and PX4's npfg
for the same use of ground and air velocity. The arithmetic is in `aircraft.kernels.preview_update`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLimits, GuidanceOutput
from aircraft.guidance.key import key
from aircraft.guidance.progress import place_on_rows, route_rows
from aircraft.interface import GRAVITY_MPS2, AircraftState, FloatArray, Route

TURNING_SHARE, ROLLING_SHARE = 0.5, 0.7
"""Shares of the bank limit's acceleration, and of its change by roll, that an approach from far off counts on. With
these the fleet settles soonest, after one roll to either side; with all of both it swings two or three times."""
TYPICAL_BANK_RAD = math.radians(30.0)  # a step of curvature is blended over the time of rolling this far


@dataclass(frozen=True)
class PreviewConfig:
    """Keys of `guidance.kind: preview`."""

    bandwidth_radps: float | None = key(
        None, "natural frequency of the cross-track correction; default: the aircraft's", "rad/s", above=0.0
    )
    damping: float = key(0.9, "damping ratio of the cross-track correction", "1", above=0.0)

    def resolved(self, limits: GuidanceLimits) -> PreviewConfig:
        """The config with every default filled in."""
        return self if self.bandwidth_radps else replace(self, bandwidth_radps=limits.bandwidth_radps)


class PreviewLaw:
    """Follows a route by the curvature ahead. Implements `GuidanceLaw`."""

    def __init__(self, config: PreviewConfig, limits: GuidanceLimits) -> None:
        from aircraft import kernels  # half a second

        update_s = 1.0 / UPDATE_RATE_HZ
        self._gains = np.zeros(1, kernels.PREVIEW_GAINS)
        self._gains["bandwidth_radps"] = config.bandwidth_radps
        self._gains["damping"] = config.damping
        self._gains["bank_limit_rad"] = limits.bank_limit_rad
        self._gains["roll_step_rad"] = limits.roll_rate_radps / UPDATE_RATE_HZ
        self._gains["turn_rate_share"] = limits.turn_rate_share
        self._gains["roll_lag_updates"] = limits.roll_lag_s * UPDATE_RATE_HZ
        # The held command acts on average half an update late.
        self._gains["delay_s"] = limits.roll_delay_s + 0.5 * update_s
        self._gains["blend_s"] = max(TYPICAL_BANK_RAD / limits.roll_rate_radps, update_s)
        self._gains["turning_mps2"] = TURNING_SHARE * GRAVITY_MPS2 * math.tan(limits.bank_limit_rad)
        self._gains["rolling_mps3"] = ROLLING_SHARE * GRAVITY_MPS2 * limits.roll_rate_radps
        self._memory = np.zeros(1, kernels.PREVIEW_MEMORY)
        self._rows: FloatArray | None = None

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route; the roll command goes on from where it is."""
        first, self._rows = self._rows is None, route_rows(route)
        self._memory["row"], self._memory["along_m"] = place_on_rows(self._rows, arc_length_m)
        if first:
            from aircraft import kernels

            types = self._rows, self._gains, self._memory, (math.nan, math.nan), (math.nan, math.nan)
            self._update = kernels.for_types_of(kernels.preview_update, *types, math.nan, math.nan)

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Decides the roll command for the next update interval."""
        if self._rows is None:
            raise RuntimeError("follow() a route before update()")
        decided = self._update(
            self._rows,
            self._gains,
            self._memory,
            (state.east_m, state.north_m),
            (state.velocity_east_mps, state.velocity_north_mps),
            state.heading_rad,
            state.airspeed_mps,
        )
        return tuple.__new__(GuidanceOutput, (*decided, math.nan))  # without an airspeed; faster than by name


def bandwidth_of_delay_margin(margin_s: float, delay_s: float) -> float:
    """Bandwidth (rad/s) at which the cross-track correction has a delay margin of `margin_s`.

    The open loop of the cross-track error is (2 zeta omega s + omega^2) / s^2, roll made up for by the lead of the
    command. Its gain is 1 at omega_c = omega sqrt(2 zeta^2 + sqrt(4 zeta^4 + 1)), its phase margin there is
    atan(2 zeta omega_c / omega), and the delay that takes it up is that over omega_c. `delay_s` is that of roll and of
    the state, without that of the held command.
    """
    damping = PreviewConfig.damping
    crossing = math.sqrt(2.0 * damping**2 + math.sqrt(4.0 * damping**4 + 1.0))
    return math.atan(2.0 * damping * crossing) / crossing / (margin_s + delay_s + 0.5 / UPDATE_RATE_HZ)
