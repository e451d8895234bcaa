"""The known airframes: facts that hold before the first flight, read from airframes.yaml."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from aircraft.autopilot import Gains
from aircraft.guidance import GuidanceLimits


class AircraftError(ValueError):
    """An aircraft that cannot be flown as asked; the message is a sentence for the user."""


@dataclass(frozen=True)
class Airframe:
    """One airframe.

    Attributes:
        name: as in `aircraft.model` of a scenario.
        summary: one line for lists.
        mass_kg: as flown.
        airspeed_range_mps: lowest and highest true airspeed of level flight, near sea level.
        cruise_mps: default true airspeed.
        bank_limit_deg: largest bank the guidance may command.
        roll_rate_dps: fastest change of the roll command.
        roll_in_s: time from level to 90 % of 30 degrees, the command a step.
        stall_angle_deg: angle of attack beyond which control counts as lost.
        roll_lag_s: time constant of roll behind its command.
        roll_delay_s: further delay of roll behind its command.
        guidance_bandwidth_radps: natural frequency of the cross-track correction.
        verified: flown against the tracking figures of the tests.
        gains: gains of the autopilot that replace derived ones, by field of `Gains`.
    """

    name: str
    summary: str
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
    verified: bool
    gains: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}), hash=False)

    @property
    def guidance_limits(self) -> GuidanceLimits:
        """Limits for `PathFollower`."""
        return GuidanceLimits(
            bank_limit_rad=math.radians(self.bank_limit_deg),
            roll_rate_radps=math.radians(self.roll_rate_dps),
            roll_lag_s=self.roll_lag_s,
            roll_delay_s=self.roll_delay_s,
            bandwidth_radps=self.guidance_bandwidth_radps,
        )

    def check_airspeed(self, airspeed_mps: float) -> None:
        """Raises `AircraftError` if level flight at a true airspeed is not possible."""
        low, high = self.airspeed_range_mps
        if not low <= airspeed_mps <= high:
            raise AircraftError(
                f"{self.name} cannot hold {airspeed_mps:g} m/s; "
                f"its level-flight range is {low:g} to {high:g} m/s"
            )


def aircraft_names() -> tuple[str, ...]:
    """Names that `airframe` knows, in the order of the table."""
    return tuple(_table())


def airframe(name: str) -> Airframe:
    """The airframe of a name.

    Raises:
        AircraftError: if there is none; the message lists the known names.
    """
    try:
        return _table()[name]
    except KeyError:
        known = ", ".join(aircraft_names())
        raise AircraftError(f"unknown aircraft {name!r}; known are: {known}") from None


@cache
def _table() -> Mapping[str, Airframe]:
    return MappingProxyType(parse_airframes(files("aircraft").joinpath("airframes.yaml").read_text("utf-8")))


def parse_airframes(text: str) -> dict[str, Airframe]:
    """Reads an airframe table.

    Args:
        text: YAML in the form of airframes.yaml.

    Raises:
        ValueError: if a key is unknown, missing, repeated or not of its type, or a figure is out of order;
            the message names the airframe and the key.
    """
    import yaml

    class Loader(yaml.SafeLoader):
        """Refuses a key that is given twice."""

        def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
            seen: set[str] = set()
            for key, _ in node.value:
                if key.value in seen:
                    raise ValueError(f"line {key.start_mark.line + 1}: {key.value!r} is given twice")
                seen.add(key.value)
            return super().construct_mapping(node, deep)

    table = yaml.load(text, Loader)
    if not isinstance(table, dict):
        raise ValueError("the airframe table must map names to airframes")
    return {str(name): _airframe(str(name), keys) for name, keys in table.items()}


def _airframe(name: str, keys: object) -> Airframe:
    if not isinstance(keys, dict):
        raise ValueError(f"{name}: must be a mapping")
    wanted = {f.name for f in fields(Airframe)} - {"name"}
    if unknown := sorted(set(keys) - wanted):
        raise ValueError(f"{name}: unknown key {unknown[0]!r}")
    if missing := sorted(wanted - {"gains"} - set(keys)):
        raise ValueError(f"{name}: missing key {missing[0]!r}")
    if not isinstance(keys["verified"], bool):
        raise ValueError(f"{name}.verified: must be true or false")
    speeds = keys["airspeed_range_mps"]
    if not isinstance(speeds, list) or len(speeds) != 2:
        raise ValueError(f"{name}.airspeed_range_mps: must be [lowest, highest]")
    gains = keys.get("gains", {})
    if not isinstance(gains, dict):
        raise ValueError(f"{name}.gains: must be a mapping")
    if unknown := sorted(set(gains) - {f.name for f in fields(Gains)}):
        raise ValueError(f"{name}.gains: unknown gain {unknown[0]!r}")

    for gain, value in gains.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ValueError(f"{name}.gains.{gain}: must be a finite number; got {value!r}")

    def positive(key: str, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
            raise ValueError(f"{name}.{key}: must be a positive number; got {value!r}")
        return float(value)

    low, high = (positive("airspeed_range_mps", speed) for speed in speeds)
    cruise = positive("cruise_mps", keys["cruise_mps"])
    if not low <= cruise <= high:
        raise ValueError(
            f"{name}.cruise_mps: must lie in airspeed_range_mps [{low:g}, {high:g}]; got {cruise:g}"
        )
    numbers = {
        key: positive(key, keys[key])
        for key in (
            "mass_kg",
            "bank_limit_deg",
            "roll_rate_dps",
            "roll_in_s",
            "stall_angle_deg",
            "roll_lag_s",
            "roll_delay_s",
            "guidance_bandwidth_radps",
        )
    }
    return Airframe(
        name=name,
        summary=str(keys["summary"]),
        airspeed_range_mps=(low, high),
        cruise_mps=cruise,
        verified=keys["verified"],
        gains=MappingProxyType({key: float(value) for key, value in gains.items()}),
        **numbers,
    )
