"""Airframes by name: what airframes.yaml says of them, and what their models show when they are flown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from functools import cache, lru_cache, partial
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from aircraft.airframe import FIGURES, Airframe, Entry
from aircraft.autopilot import Gains
from aircraft.card_cache import cached, figure, is_kept
from aircraft.model_files import AircraftError as AircraftError
from aircraft.model_files import ModelFiles, model_files


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

    return cached(_title(found), found.digest(), surveyed, partial(_of_survey, entry, found))


def is_surveyed(name: str) -> bool:
    """Whether an aircraft's figures are kept, so that `airframe` need not fly it for them.

    Args:
        name: as `airframe` takes it.

    Raises:
        AircraftError: there is none.
    """
    found = model_files(name)
    return is_kept(_title(found), found.digest())


def _title(found: ModelFiles) -> str:
    return f"{found.name}-airframe"


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
