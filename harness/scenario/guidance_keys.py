"""The guidance section of a scenario: its law's own keys, the law for a flight, and how well it tracks."""

from __future__ import annotations

from dataclasses import fields
from functools import cache
from typing import TYPE_CHECKING, Any, Final

from aircraft.guidance.registry import GuidanceKind, guidance_kinds, installed_kinds
from harness.files.crash import sentence
from harness.files.printing import PrintingAside
from harness.scenario import own_keys
from harness.scenario.sections import AircraftSpec, GuidanceSpec
from harness.scenario.validation import KeyFault
from planner.compiled import begin_compiling
from planner.kernel_cache import seal
from planner.registry import planner_kinds

if TYPE_CHECKING:
    from aircraft.airframe import Airframe
    from aircraft.envelope import LawCard
    from aircraft.guidance.interface import GuidanceLaw, GuidanceLimits


def is_here(spec: GuidanceSpec) -> bool:
    """Whether the law is; of one that was given by a source file, or in Python, another process knows nothing."""
    return spec.kind in guidance_kinds()


def resolved(spec: GuidanceSpec, aircraft: AircraftSpec, as_flown: bool = False) -> GuidanceSpec:
    """The guidance section with its own keys checked and every default filled in.

    Args:
        spec: the section.
        aircraft: what flies, its airspeed filled in.
        as_flown: the section is of a run folder, where every default stands already; the law need not be here.

    Raises:
        KeyFault: there is no such law or key, or the keys contradict each other.
    """
    if as_flown and not is_here(spec):
        return spec
    with PrintingAside():
        kind = own_keys.named_kind("guidance", spec, guidance_kinds())
        config = own_keys.resolved_config(
            "guidance", spec, kind, GuidanceSpec.model_fields, limits_of(aircraft)
        )
        return spec.model_copy(update={each.name: getattr(config, each.name) for each in fields(kind.config)})


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
    """The airframe of a scenario, with its servos and its autopilot.

    Raises:
        AircraftError: there is none, or it cannot be flown.
    """
    from aircraft.actuators.actuator import Actuator, Actuators
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
    """The same, with a model that deviates from what figures, limits and gains are of.

    Raises:
        AircraftError: there is none, or it cannot be flown.
    """
    from dataclasses import replace

    from aircraft.deviation import Deviation

    frame = airframe_of(spec)
    if spec.deviation is None:
        return frame
    shares = {name: value or 0.0 for name, value in spec.deviation}
    return replace(frame, files=replace(frame.files, deviation=Deviation(**shares)))


def limits_of(aircraft: AircraftSpec) -> GuidanceLimits:
    """What guidance may ask of an aircraft that flies at its airspeed."""
    return airframe_of(aircraft).guidance_limits(aircraft.airspeed_mps)


def law_of(spec: GuidanceSpec, aircraft: AircraftSpec) -> GuidanceLaw:
    """The law for one flight, from a section that `resolved` returned."""
    seal()  # before the laws' machine code is loaded
    kind, config = _made_of(spec)
    limits = limits_of(aircraft)
    with PrintingAside():
        law = kind.make(config, limits)
    if spec.follow == "path":
        return law
    from aircraft.guidance.waypoints import waypoint_law

    return waypoint_law(law, spec.kind, config, limits, spec.acceptance_radius_m)


def card_of(spec: GuidanceSpec, aircraft: AircraftSpec) -> LawCard | None:
    """How the law tracks with the aircraft, flown unless that is known; None: as the aircraft's survey says.

    Args:
        spec: a section that `resolved` returned.
        aircraft: what flies, its airspeed filled in.

    Raises:
        KeyFault: the law does not track with this aircraft, or raised an exception.
    """
    from aircraft.airframes import AircraftError
    from aircraft.law_cards.cards import law_card

    kind, config = _made_of(spec)
    if spec.follow == "waypoints" and not getattr(config, "switch_by_passing", True):
        return None  # it flies to points: where it is beside the legs says nothing of how it tracks
    try:
        with PrintingAside():
            return law_card(
                airframe_of(aircraft),
                kind,
                config,
                aircraft.airspeed_mps,
                waypoints=spec.follow == "waypoints",
                acceptance_radius_m=spec.acceptance_radius_m,
            )
    except AircraftError as error:
        raise KeyFault(("guidance", "kind"), str(error)) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise KeyFault(("guidance", "kind"), f"{spec.kind}: it cannot be flown: {sentence(error)}") from error


def _made_of(spec: GuidanceSpec) -> tuple[GuidanceKind, Any]:
    if not is_here(spec):
        raise KeyFault(
            ("guidance", "kind"), f"{spec.kind} is not here; give it anew (guidance=, or --guidance)"
        )
    kind = guidance_kinds()[spec.kind]
    return kind, kind.config(**spec.own)


def json_schema(common: dict[str, Any]) -> dict[str, Any]:
    """JSON Schema of the section: one choice for each law.

    Args:
        common: the schema of `GuidanceSpec`.
    """
    return own_keys.json_schema(common, installed_kinds())
