"""An airframe as values: what is known of it before it flies, and what its model shows when it is flown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from aircraft.actuators.actuator import Actuators
from aircraft.autopilot import Gains
from aircraft.guidance.interface import GuidanceLimits
from aircraft.interface import GRAVITY_MPS2
from aircraft.model_files import AircraftError, ModelFiles

PITCH_LIMITS_DEG = (-30.0, 30.0)
"""Pitch that the autopilot commands at the least and at most: PX4's defaults FW_P_LIM_MIN and FW_P_LIM_MAX."""

LEAST_SHARE = 0.97
"""Share of the lowest airspeed of level flight below which the autopilot lets height go for speed."""


@dataclass(frozen=True)
class AutopilotKeys:
    """What a scenario says of an aircraft's autopilot, `aircraft.autopilot` and `navigation.latency_s`.

    Attributes:
        bank_limit_deg: largest bank that guidance may command; None: of the survey.
        roll_rate_limit_degps: fastest roll that is commanded; None: of the survey.
        roll_time_constant_s: of roll behind its command; None: of the survey.
        pitch_limits_deg: least and largest pitch that is commanded.
        least_airspeed_mps: below this true airspeed height goes before speed; None: `LEAST_SHARE` of the lowest of
            level flight.
        latency_s: age of the attitude, airspeed, height and climb that the autopilot works with.
    """

    bank_limit_deg: float | None = None
    roll_rate_limit_degps: float | None = None
    roll_time_constant_s: float | None = None
    pitch_limits_deg: tuple[float, float] = PITCH_LIMITS_DEG
    least_airspeed_mps: float | None = None
    latency_s: float = 0.0

    def figures(self) -> dict[str, float]:
        """What replaces figures of `FIGURES` that the survey would find."""
        named = {
            "bank_limit_deg": self.bank_limit_deg,
            "roll_rate_dps": self.roll_rate_limit_degps,
            "roll_lag_s": self.roll_time_constant_s,
        }
        return {name: value for name, value in named.items() if value is not None}

    def gains(self) -> dict[str, float]:
        """What replaces derived gains."""
        replaced = {}
        if self.roll_rate_limit_degps is not None:
            replaced["roll_rate_limit"] = math.radians(self.roll_rate_limit_degps)
        if self.roll_time_constant_s is not None:
            replaced["roll"] = 1.0 / self.roll_time_constant_s
        return replaced


DERIVED = AutopilotKeys()
"""The autopilot as the survey derives it, without latency."""


@dataclass(frozen=True)
class AirframeEntry:
    """One entry of airframes.yaml: what is known of an airframe before it flies.

    Attributes:
        name: as in `aircraft.model` of a scenario.
        summary: one line for lists.
        cruise_mps: default true airspeed; None: from the speeds at which the model can be trimmed.
        verified: flown against the tracking figures of the tests.
        figures: attributes of `Airframe` that replace what the survey makes of the model.
        gains: gains of the autopilot that replace derived ones, by field of `Gains`.
        actuators: its servos.
        autopilot: what a scenario says of its autopilot.
    """

    name: str
    summary: str
    cruise_mps: float | None = None
    verified: bool = False
    figures: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}), hash=False)
    gains: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}), hash=False)
    actuators: Actuators = field(default_factory=Actuators)
    autopilot: AutopilotKeys = DERIVED


FIGURES = (
    "bank_limit_deg",
    "roll_rate_dps",
    "stall_angle_deg",
    "roll_lag_s",
    "roll_delay_s",
    "guidance_bandwidth_radps",
    "turn_rate_share",
)
"""Attributes of `Airframe` that an entry may replace."""


@dataclass(frozen=True)
class Airframe:
    """One airframe, as flown.

    Attributes:
        name: as in `aircraft.model` of a scenario; of a folder, that of its model.
        summary: one line for lists.
        files: the JSBSim model.
        mass_kg: as flown.
        airspeed_range_mps: lowest and highest true airspeed of level flight, near sea level.
        cruise_mps: default true airspeed.
        bank_limit_deg: largest bank the guidance may command.
        roll_rate_dps: fastest change of the roll command.
        roll_in_s: time from wings level to 90 % of 30 degrees, or of the bank limit if that is less,
            the command a step, at cruise.
        stall_angle_deg: angle of attack beyond which control counts as lost.
        roll_lag_s: time constant of roll behind its command.
        roll_delay_s: further delay of roll behind its command.
        guidance_bandwidth_radps: natural frequency of the cross-track correction.
        turn_rate_share: turn rate in a steady turn over that of a coordinated one, g tan(bank) / V.
        level_banks: (true airspeed m/s, bank deg) pairs, airspeed rising: the steepest bank up to the limit at
            which speed and altitude are kept.
        weave_error_m: largest cross-track error on a weave of lines and arcs as planned, at cruise in calm air.
        gains: of the autopilot.
        verified: flown against the tracking figures of the tests.
        autopilot: what a scenario says of its autopilot.
    """

    name: str
    summary: str
    files: ModelFiles
    mass_kg: float
    airspeed_range_mps: tuple[float, float]
    cruise_mps: float
    bank_limit_deg: float
    roll_rate_dps: float
    roll_in_s: float
    stall_angle_deg: float
    roll_lag_s: float
    roll_delay_s: float
    guidance_bandwidth_radps: float
    turn_rate_share: float
    level_banks: tuple[tuple[float, float], ...]
    weave_error_m: float
    gains: Gains
    verified: bool
    autopilot: AutopilotKeys = DERIVED

    @property
    def least_airspeed_mps(self) -> float:
        """Below this true airspeed the autopilot lets height go for speed."""
        given = self.autopilot.least_airspeed_mps
        return LEAST_SHARE * self.airspeed_range_mps[0] if given is None else given

    def guidance_limits(self, airspeed_mps: float | None = None) -> GuidanceLimits:
        """What a guidance law may ask of it at a true airspeed; default: cruise."""
        return GuidanceLimits(
            airspeed_mps=self.cruise_mps if airspeed_mps is None else airspeed_mps,
            max_airspeed_mps=self.airspeed_range_mps[1],
            bank_limit_rad=math.radians(self.bank_limit_deg),
            roll_rate_radps=math.radians(self.roll_rate_dps),
            roll_lag_s=self.roll_lag_s,
            roll_delay_s=self.roll_delay_s,
            bandwidth_radps=self.guidance_bandwidth_radps,
            turn_rate_share=self.turn_rate_share,
        )

    def least_radius_m(self, airspeed_mps: float) -> float:
        """Radius of a steady turn at the bank limit at a true airspeed, in calm air."""
        lateral_mps2 = GRAVITY_MPS2 * math.tan(math.radians(self.bank_limit_deg))
        return airspeed_mps * airspeed_mps / (lateral_mps2 * self.turn_rate_share)

    def level_bank_deg(self, airspeed_mps: float) -> float:
        """Steepest bank at which an airspeed and the altitude are kept, between the speeds flown linear."""
        (before, bank), *rest = self.level_banks
        for speed, after in rest:
            if airspeed_mps <= speed:
                share = max(0.0, (airspeed_mps - before) / (speed - before))
                return bank + share * (after - bank)
            before, bank = speed, after
        return bank

    def check_airspeed(self, airspeed_mps: float) -> None:
        """Raises `AircraftError` if level flight at a true airspeed is not possible."""
        low, high = self.airspeed_range_mps
        if not low <= airspeed_mps <= high:
            raise AircraftError(
                f"{self.name} cannot hold {airspeed_mps:g} m/s; "
                f"its level-flight range is {low:g} to {high:g} m/s"
            )
