"""An airframe as values: what is known of it before it flies, and what its model shows when it is flown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from types import MappingProxyType
from typing import Any

from aircraft.actuators import Actuators
from aircraft.autopilot import Gains
from aircraft.guidance.interface import GuidanceLimits
from aircraft.interface import GRAVITY_MPS2
from aircraft.model_files import AircraftError, ModelFiles

PITCH_LIMITS_DEG = (-30.0, 30.0)
"""Lowest and highest pitch that the autopilot commands: PX4's defaults FW_P_LIM_MIN and FW_P_LIM_MAX."""
SPARE_BANK_DEG = 5.0  # a mission is not flown slower than where altitude is kept at cruise's bank less this
LEAST_AIRSPEED_SHARE = 0.97
"""Below this share of the lowest airspeed of level flight the autopilot gives up height for speed."""
FIGURES = (
    "bank_limit_deg",
    "roll_rate_dps",
    "stall_angle_deg",
    "least_lift",
    "most_lift",
    "roll_lag_s",
    "roll_delay_s",
    "guidance_bandwidth_radps",
    "turn_rate_share",
)
"""Attributes of `Airframe` that an entry of airframes.yaml may give, instead of what the survey measures."""


@dataclass(frozen=True)
class AutopilotKeys:
    """An aircraft's autopilot in a scenario: `aircraft.autopilot` and `navigation.latency_s`.

    A key of None is what the survey finds.
    """

    bank_limit_deg: float | None = None  # largest bank that guidance may command
    roll_rate_limit_degps: float | None = None  # fastest roll that is commanded
    roll_time_constant_s: float | None = None  # time constant of roll behind its command
    pitch_limits_deg: tuple[float, float] = PITCH_LIMITS_DEG
    least_airspeed_mps: float | None = None  # true; below it height goes before speed
    latency_s: float = 0.0  # age of the attitude, airspeed, height and climb that the autopilot works with

    def figures(self) -> dict[str, float]:
        """The keys given that replace measured `FIGURES`, by name."""
        named = {
            "bank_limit_deg": self.bank_limit_deg,
            "roll_rate_dps": self.roll_rate_limit_degps,
            "roll_lag_s": self.roll_time_constant_s,
        }
        return {name: value for name, value in named.items() if value is not None}

    def gains(self) -> dict[str, float]:
        """The gains that the keys given replace, by field of `Gains`."""
        rate, time_s = self.roll_rate_limit_degps, self.roll_time_constant_s
        replaced = {} if rate is None else {"roll_rate_limit": math.radians(rate)}
        return replaced if time_s is None else {**replaced, "roll": 1.0 / time_s}


DERIVED = AutopilotKeys()  # the autopilot as the survey derives it, without latency


@dataclass(frozen=True)
class AirframeEntry:
    """One entry of airframes.yaml: what is known of an airframe before it flies."""

    name: str  # as in `aircraft.model` of a scenario
    summary: str  # one line for lists
    cruise_mps: float | None = None  # default true airspeed; None: from the speeds that the model trims at
    verified: bool = False  # flown against the tracking figures of the tests
    figures: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}), hash=False)
    """Values of some `FIGURES`, by name; they replace what the survey measures."""
    gains: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}), hash=False)
    """Gains that replace derived ones, by field of `Gains`."""
    actuators: Actuators = field(default_factory=Actuators)
    autopilot: AutopilotKeys = DERIVED


@dataclass(frozen=True)
class Airframe:
    """One airframe, as flown."""

    name: str  # as in `aircraft.model` of a scenario; of a folder, that of its model
    summary: str
    files: ModelFiles
    mass_kg: float
    airspeed_range_mps: tuple[float, float]  # lowest and highest true airspeed of level flight near sea level
    cruise_mps: float  # default true airspeed
    bank_limit_deg: float  # largest bank that guidance may command
    roll_rate_dps: float  # fastest change of the roll command
    roll_in_s: float  # from wings level to 90 % of 30 degrees, or of the bank limit if less, at cruise
    stall_angle_deg: float  # angle of attack beyond which control counts as lost
    least_lift: float  # lift, over that of level flight at cruise there, to which pitch is commanded down
    most_lift: float  # and up
    roll_lag_s: float  # time constant of roll behind its command
    roll_delay_s: float  # further delay of roll behind its command
    guidance_bandwidth_radps: float  # natural frequency of the cross-track correction
    turn_rate_share: float  # turn rate in a steady turn over that of a coordinated one, g tan(bank) / V
    level_banks: tuple[tuple[float, float], ...]
    """True airspeeds (m/s, rising), and the steepest bank (deg) up to the limit that keeps speed and altitude."""
    weave_error_m: float  # largest cross-track error on a weave as planned, at cruise in calm air
    gains: Gains
    verified: bool
    autopilot: AutopilotKeys = DERIVED

    @staticmethod
    def of(entry: AirframeEntry, files: ModelFiles, measured: Mapping[str, Any]) -> Airframe:
        """Makes the airframe of an entry; `measured` holds what the survey found, by attribute, as read from JSON."""
        low, high = measured["airspeed_range_mps"]
        given = {
            "airspeed_range_mps": (low, high),
            "level_banks": tuple((speed, bank) for speed, bank in measured["level_banks"]),
            "gains": Gains(**measured["gains"]),
        }
        known = files.name, entry.summary, files
        return Airframe(*known, **{**measured, **given}, verified=entry.verified, autopilot=entry.autopilot)

    def digest(self) -> str:
        """SHA-256 of all that its flights depend on: the content of its files, and what it is flown with."""
        return sha256(f"{self.files.digest()}{replace(self, files=None)!r}".encode()).hexdigest()  # type: ignore[arg-type]

    @property
    def least_airspeed_mps(self) -> float:
        """Below this true airspeed the autopilot lets height go for speed."""
        given = self.autopilot.least_airspeed_mps
        return LEAST_AIRSPEED_SHARE * self.airspeed_range_mps[0] if given is None else given

    @property
    def slowest_turning_mps(self) -> float:
        """Slowest true airspeed that keeps altitude at a bank within `SPARE_BANK_DEG` of the steepest at cruise."""
        low, _ = self.airspeed_range_mps
        enough = self.level_bank_deg(self.cruise_mps) - SPARE_BANK_DEG
        speeds = (low + max(self.cruise_mps - low, 0.0) * number / 49.0 for number in range(50))
        return round(next(speed for speed in speeds if self.level_bank_deg(speed) >= enough), 1)

    def guidance_limits(self, airspeed_mps: float | None = None) -> GuidanceLimits:
        """The limits of a guidance law at a true airspeed; default: cruise."""
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
        """Steepest bank at which airspeed and altitude are kept, interpolated between the speeds flown, held beyond."""
        (before, bank), *rest = self.level_banks
        for speed, after in rest:
            if airspeed_mps <= speed:
                return bank + max(0.0, (airspeed_mps - before) / (speed - before)) * (after - bank)
            before, bank = speed, after
        return bank

    def check_airspeed(self, airspeed_mps: float) -> None:
        """Raises `AircraftError` if level flight at a true airspeed is not possible."""
        low, high = self.airspeed_range_mps
        if not low <= airspeed_mps <= high:
            raise AircraftError(
                f"{self.name} cannot hold {airspeed_mps:g} m/s; its level-flight range is {low:g} to {high:g} m/s"
            )
