"""Airframes by name: their entries in airframes.yaml, and the figures that surveys of their models measure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache, lru_cache, partial
from hashlib import sha256
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from aircraft.actuators import Actuator, Actuators, NormActuator
from aircraft.airframe import DERIVED, Airframe, AirframeEntry, AutopilotKeys
from aircraft.card_cache import cached, is_cached
from aircraft.envelope import LEAST_BANK_DEG
from aircraft.model_files import AircraftError as AircraftError
from aircraft.model_files import ModelFiles, Stamp, folder_stamp, model_files

PROVEN_TO_M = 1000.0  # altitude above the sea up to which banks are those of the survey


def aircraft_names() -> tuple[str, ...]:
    """Names of the airframe table, in its order."""
    return tuple(_table())


def airframe(name: str, actuators: Actuators | None = None, autopilot: AutopilotKeys = DERIVED) -> Airframe:
    """The airframe of a name or folder, surveyed by flying it unless the cache has its survey.

    The name is of `aircraft_names`, of another aircraft of the JSBSim wheel, or a folder that holds a JSBSim model.
    Servos of None are those of the airframe table, or none.

    Raises AircraftError where there is none, or it cannot be loaded, trimmed or held; the message says which.
    """
    return _airframe(name, actuators, autopilot, folder_stamp(name))


@lru_cache(maxsize=64)
def _airframe(name: str, actuators: Actuators | None, autopilot: AutopilotKeys, _: Stamp) -> Airframe:
    entry, found, files = _describe(name, actuators, autopilot)

    def run_survey() -> dict[str, Any]:
        from aircraft.survey import survey

        return survey(entry, found)

    return cached(*files, run_survey, partial(Airframe.of, entry, found))


def is_surveyed(name: str, actuators: Actuators | None = None, autopilot: AutopilotKeys = DERIVED) -> bool:
    """Tells whether the cache has an aircraft's survey, so that `airframe` need not fly; AircraftError: no such one."""
    return is_cached(*_describe(name, actuators, autopilot)[2])


def level_bank_deg(frame: Airframe, airspeed_mps: float, altitude_m: float) -> float:
    """Steepest bank (deg) at which airspeed and altitude are kept: the survey's, or flown where that proves nothing."""
    if altitude_m <= PROVEN_TO_M:
        return frame.level_bank_deg(airspeed_mps)
    from aircraft.trials import steepest_level_bank_deg

    return steepest_level_bank_deg(frame, airspeed_mps, altitude_m)


def kept_radii(frame: Airframe, altitude_m: float, airspeed_mps: float) -> float:
    """Radius of the steepest turn that keeps airspeed and altitude, over that of one at the bank limit, at least 1."""
    kept_deg = max(level_bank_deg(frame, airspeed_mps, altitude_m), LEAST_BANK_DEG)
    return max(math.tan(math.radians(frame.bank_limit_deg)) / math.tan(math.radians(kept_deg)), 1.0)


def turn_fault(frame: Airframe, airspeed_mps: float, altitude_m: float) -> str | None:
    """Returns why the aircraft cannot turn at an altitude; None if it can."""
    if (bank_deg := level_bank_deg(frame, airspeed_mps, altitude_m)) >= LEAST_BANK_DEG:
        return None
    kept = f"{frame.name} keeps {airspeed_mps:g} m/s and its altitude there only up to {bank_deg:g} degrees of bank"
    return f"{kept}, and {LEAST_BANK_DEG:g} are needed to turn"


def _describe(
    name: str, actuators: Actuators | None, autopilot: AutopilotKeys
) -> tuple[AirframeEntry, ModelFiles, tuple[str, str]]:
    """What is known of an airframe before it flies, its model with the servos, and the title and digest of its survey.

    The digest is SHA-256 of all that a survey depends on: the model's files, and what is known of it.
    """
    try:
        found = model_files(name)
    except AircraftError as error:
        known = ", ".join(aircraft_names())
        raise AircraftError(f"{error}; known are: {known}, or a folder with a JSBSim model") from None
    entry = _table().get(name) or AirframeEntry(found.name, f"JSBSim model of {found.model.parent}")
    if real := (entry.actuators if actuators is None else actuators).real:
        found = replace(found, actuators=_normalise(found, real))
    entry = replace(
        entry,
        figures={**entry.figures, **autopilot.figures()},
        gains={**entry.gains, **autopilot.gains()},
        autopilot=autopilot,
    )
    found = replace(found, latency_s=autopilot.latency_s)
    known = repr((entry.cruise_mps, sorted(entry.figures.items()), sorted(entry.gains.items()), autopilot))
    return entry, found, (f"{found.name}-airframe", sha256((found.digest() + known).encode()).hexdigest())


@lru_cache(maxsize=64)
def surface_travels(found: ModelFiles) -> Mapping[str, float]:
    """Degrees that each surface of a model moves for a command of 1, by control; 0 where the model does not show it."""

    def measure() -> dict[str, float]:
        from aircraft.jsbsim_loading import surface_travel_deg  # loads JSBSim

        return surface_travel_deg(found)

    travels = cached(f"{found.name}-travel", found.digest(), measure, dict)
    own = (path for path in found.model.parent.rglob("*.xml") if path.is_file())
    texts = [path.read_text("utf-8", errors="replace") for path in own]
    known = [name for name in travels if travels[name] or any(f"fcs/{name}" in text for text in texts)]
    return {name: travels[name] for name in known}  # a flying wing has no rudder


def _normalise(found: ModelFiles, real: Mapping[str, Actuator]) -> tuple[tuple[str, NormActuator], ...]:
    """Actuators in degrees in units of the command, by how far surfaces move; AircraftError if not shown."""
    travels = surface_travels(found)
    for control, actuator in real.items():
        if travels.get(control) == 0.0 and (actuator.rate_limit_degps is not None or actuator.deadband_deg):
            raise AircraftError(
                f"{found.name}: its model does not show how far the {control} moves, so a rate limit or a deadband in "
                "degrees means nothing; leave both out"
            )
    return tuple((name, each.of_command(travels[name] or 1.0)) for name, each in real.items() if name in travels)


@cache
def _table() -> Mapping[str, AirframeEntry]:
    import yaml

    loader = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
    table = loader(files("aircraft").joinpath("airframes.yaml").read_text("utf-8")).get_single_data()
    return MappingProxyType({name: _entry(name, **keys) for name, keys in table.items()})


def _entry(
    name: str,
    summary: str,
    cruise_mps: float,
    verified: bool,
    gains: Mapping[str, float] = MappingProxyType({}),
    actuators: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
    **figures: float,
) -> AirframeEntry:
    servos = Actuators(**{control: Actuator(**keys) for control, keys in actuators.items()})
    return AirframeEntry(name, summary, cruise_mps, verified, figures, gains, servos)
