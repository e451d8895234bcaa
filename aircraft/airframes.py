"""The known airframes: what airframes.yaml says of them, and what their models show when they are flown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache, lru_cache, partial
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from aircraft.autopilot import Gains
from aircraft.card_cache import cached, figure
from aircraft.guidance import GuidanceLimits
from aircraft.model_files import AircraftError as AircraftError
from aircraft.model_files import ModelFiles, model_files


@dataclass(frozen=True)
class Entry:
    """One entry of airframes.yaml: what is known of an airframe before it flies.

    Attributes:
        name: as in `aircraft.model` of a scenario.
        summary: one line for lists.
        cruise_mps: default true airspeed; None: from the speeds at which the model can be trimmed.
        verified: flown against the tracking figures of the tests.
        figures: attributes of `Airframe` that replace what the survey makes of the model.
        gains: gains of the autopilot that replace derived ones, by field of `Gains`.
    """

    name: str
    summary: str
    cruise_mps: float | None = None
    verified: bool = False
    figures: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}), hash=False)
    gains: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}), hash=False)


FIGURES = (
    "bank_limit_deg",
    "roll_rate_dps",
    "stall_angle_deg",
    "roll_lag_s",
    "roll_delay_s",
    "guidance_bandwidth_radps",
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
        level_banks: (true airspeed m/s, bank deg) pairs, airspeed rising: the steepest bank up to the limit at
            which speed and altitude are kept.
        weave_error_m: largest cross-track error on a weave of lines and arcs as planned, at cruise in calm air.
        gains: of the autopilot.
        verified: flown against the tracking figures of the tests.
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
    level_banks: tuple[tuple[float, float], ...]
    weave_error_m: float
    gains: Gains
    verified: bool

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


def aircraft_names() -> tuple[str, ...]:
    """Names of the airframe table, in its order."""
    return tuple(_table())


@lru_cache(maxsize=64)
def airframe(name: str) -> Airframe:
    """The airframe of a name or folder, surveyed by flying it unless that has been done before.

    Args:
        name: a name of `aircraft_names`, of another aircraft of the JSBSim wheel, or a folder that holds a
            JSBSim model.

    Raises:
        AircraftError: there is none, or it cannot be loaded, trimmed or held; the message says which.
    """
    try:
        found = model_files(name)
    except AircraftError as error:
        known = ", ".join(aircraft_names())
        raise AircraftError(f"{error}; known are: {known}, or a folder with a JSBSim model") from None
    entry = _table().get(name) or Entry(found.name, f"JSBSim model of {found.model.parent}")

    def surveyed() -> dict[str, Any]:
        from aircraft.survey import survey

        return survey(entry, found)

    return cached(f"{found.name}-airframe", found.digest(), surveyed, partial(_of_survey, entry, found))


def _of_survey(entry: Entry, found: ModelFiles, measured: Mapping[str, Any]) -> Airframe:
    """The airframe that a survey measured.

    Raises:
        KeyError, TypeError, ValueError: it is no survey.
    """
    banks = tuple((figure(speed), figure(bank)) for speed, bank in measured["level_banks"])
    low, high = map(figure, measured["airspeed_range_mps"])
    figures = {key: figure(measured[key]) for key in _MEASURED}
    gains = Gains(**{name: figure(gain, -math.inf) for name, gain in measured["gains"].items()})
    speeds = [speed for speed, _ in banks]
    if not (low <= high and speeds and speeds == sorted(speeds) and figures["mass_kg"] > 0.0):
        raise ValueError("speeds out of order, or no mass")
    return Airframe(
        name=found.name,
        summary=entry.summary,
        files=found,
        airspeed_range_mps=(low, high),
        level_banks=banks,
        gains=gains,
        verified=entry.verified,
        **figures,
    )


_MEASURED = ("mass_kg", "cruise_mps", "roll_in_s", "weave_error_m", *FIGURES)


@cache
def _table() -> Mapping[str, Entry]:
    return MappingProxyType(parse_airframes(files("aircraft").joinpath("airframes.yaml").read_text("utf-8")))


def parse_airframes(text: str) -> dict[str, Entry]:
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
    return {str(name): _entry(str(name), keys) for name, keys in table.items()}


def _entry(name: str, keys: object) -> Entry:
    if not isinstance(keys, dict):
        raise ValueError(f"{name}: must be a mapping")
    if unknown := sorted(set(keys) - {"summary", "cruise_mps", "verified", "gains", *FIGURES}):
        raise ValueError(f"{name}: unknown key {unknown[0]!r}")
    if missing := sorted({"summary", "cruise_mps", "verified"} - set(keys)):
        raise ValueError(f"{name}: missing key {missing[0]!r}")
    if not isinstance(keys["verified"], bool):
        raise ValueError(f"{name}.verified: must be true or false")
    gains = keys.get("gains", {})
    if not isinstance(gains, dict):
        raise ValueError(f"{name}.gains: must be a mapping")
    if unknown := sorted(set(gains) - {f.name for f in fields(Gains)}):
        raise ValueError(f"{name}.gains: unknown gain {unknown[0]!r}")
    for gain, value in gains.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ValueError(f"{name}.gains.{gain}: must be a finite number; got {value!r}")
    for key in ("cruise_mps", *FIGURES):
        value = keys.get(key, 1.0)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
            raise ValueError(f"{name}.{key}: must be a positive number; got {value!r}")
    return Entry(
        name=name,
        summary=str(keys["summary"]),
        cruise_mps=float(keys["cruise_mps"]),
        verified=keys["verified"],
        figures=MappingProxyType({key: float(keys[key]) for key in FIGURES if key in keys}),
        gains=MappingProxyType({key: float(value) for key, value in gains.items()}),
    )
