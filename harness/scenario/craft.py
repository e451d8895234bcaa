"""The aircraft of a scenario: its airframe as guidance and autopilot know it, and as it is flown."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Final

from harness.scenario.kinds import planner_kinds
from harness.scenario.sections import AircraftSpec
from planner.compiled import begin_compiling
from planner.kernel_cache import seal

if TYPE_CHECKING:
    from aircraft.airframe import Airframe
    from aircraft.guidance.interface import GuidanceLimits

SURVEY_BYTES: Final = 11_000
"""To survey an aircraft takes about as long as to compile so much byte code, the guidance law's compiling included."""


@cache
def _prepare(model: str) -> None:
    """Has the planners compiled while an aircraft is surveyed that has not been before, as on a new machine."""
    from aircraft.airframes import AircraftError, is_surveyed

    try:
        surveyed = is_surveyed(model)
    except AircraftError:
        return  # The survey says more of it.
    if not surveyed:
        seal()
        planner_kinds()  # What is imported is compiled.
        begin_compiling(SURVEY_BYTES)


def airframe_of(spec: AircraftSpec) -> Airframe:
    """The airframe of a scenario, with its servos and its autopilot; an AircraftError says why it cannot be flown."""
    from aircraft.actuators import Actuator, Actuators
    from aircraft.airframe import DERIVED, AutopilotKeys
    from aircraft.airframes import airframe

    _prepare(spec.model)
    servos, autopilot = spec.actuators, DERIVED
    if spec.autopilot is not None:
        own = spec.autopilot.model_dump()
        autopilot = AutopilotKeys(latency_s=own.pop("state_latency_s") or 0.0, **own)
    if servos is None:
        return airframe(spec.model) if autopilot == DERIVED else airframe(spec.model, None, autopilot)
    actuator = Actuator(servos.lag_s, servos.rate_limit_degps, servos.deadband_deg)
    return airframe(spec.model, Actuators.alike(actuator), autopilot)


def flown_airframe(spec: AircraftSpec) -> Airframe:
    """The same, with a model that deviates from what figures, limits and gains are of."""
    from aircraft.deviation import Deviation

    frame = airframe_of(spec)
    if spec.deviation is None:
        return frame
    shares = {name: value or 0.0 for name, value in spec.deviation}
    return replace(frame, files=replace(frame.files, deviation=Deviation(**shares)))


def limits_of(aircraft: AircraftSpec) -> GuidanceLimits:
    """What guidance may ask of an aircraft that flies at its airspeed."""
    return airframe_of(aircraft).guidance_limits(aircraft.airspeed_mps)
