"""The parts of the loop that a scenario names: its aircraft, planner and guidance law, and these two's own keys."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import MISSING, fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Final, get_type_hints

from pydantic import Field, ValidationError, create_model

from aircraft.actuators import Actuator, Actuators
from aircraft.airframe import DERIVED, Airframe, AutopilotKeys
from aircraft.airframes import AircraftError, airframe, is_surveyed
from aircraft.guidance.registry import GuidanceKind
from harness.files.errors import PlannerError, printing_aside, sentence
from harness.scenario.kinds import GUIDANCE, PLANNER, Kind, LoopPart, is_source, planner_kinds
from harness.scenario.sections import MAX_COORDINATE_M, SHIELDED, Section
from harness.scenario.validation import KeyFault, KeyFaults, unknown_key
from planner.compiled import begin_compiling, compile_all
from planner.kernel_cache import seal
from planner.registry import PlannerKind
from planner.shield.shield import Shield

if TYPE_CHECKING:
    from aircraft.envelope import LawCard
    from aircraft.guidance.interface import GuidanceLaw, GuidanceLimits
    from harness.scenario.sections import AircraftSpec, GuidanceSpec, PartSpec, PlannerSpec
    from planner.interface import Mission, Planner

SURVEY_BYTES: Final = 11_000  # bytes of byte code that compile in the time of a survey, the law's included
_BOUNDS = (("ge", "minimum"), ("le", "maximum"), ("gt", "above"))  # argument of `Field`, key of the metadata


@cache
def _begin_compiling(model: str, *flown_with: Any) -> None:
    """Begins to compile the planners, which goes on beside a survey, if the aircraft has not been surveyed before."""
    with suppress(AircraftError):  # The survey says more of it.
        if not is_surveyed(model, *flown_with):
            seal()
            planner_kinds()  # What is imported is compiled.
            begin_compiling(SURVEY_BYTES)


def airframe_of(spec: AircraftSpec) -> Airframe:
    """The airframe of a scenario, with its servos and its autopilot; an AircraftError says why it cannot be flown."""
    servos, actuators, autopilot = spec.actuators, None, DERIVED
    if spec.autopilot is not None:
        own = spec.autopilot.model_dump()
        autopilot = AutopilotKeys(latency_s=own.pop("state_latency_s") or 0.0, **own)
    if servos is not None:
        actuators = Actuators.alike(Actuator(servos.lag_s, servos.rate_limit_degps, servos.deadband_deg))
    _begin_compiling(spec.model, actuators, autopilot)
    return airframe(spec.model, actuators, autopilot)


def flown_airframe(spec: AircraftSpec) -> Airframe:
    """Returns the airframe that is flown: its model has the deviations, its figures, limits and gains have not."""
    from aircraft.deviation import Deviation

    frame = airframe_of(spec)
    if spec.deviation is None:
        return frame
    return replace(frame, files=replace(frame.files, deviation=Deviation(**dict(spec.deviation))))


def limits_of(aircraft: AircraftSpec) -> GuidanceLimits:
    """Returns the limits of guidance for an aircraft at the airspeed of its section."""
    return airframe_of(aircraft).guidance_limits(aircraft.airspeed_mps)


@contextmanager
def _code_of_others(fault: Callable[[str], Exception]) -> Iterator[None]:
    """In this block what is printed goes to standard error, and what is raised becomes a fault with its sentence."""
    try:
        with printing_aside():
            yield
    except (KeyboardInterrupt, KeyFault):
        raise
    except BaseException as error:
        raise fault(sentence(error)) from error


def resolved_planner(spec: PlannerSpec, mission: Mission, as_flown: bool = False) -> PlannerSpec:
    """Checks the planner's section and fills in defaults; that of a run folder (`as_flown`) need not be known here."""
    if as_flown and PLANNER.find(spec.kind) is None:
        return spec
    kind = _find_kind("planner", spec, PLANNER)
    chosen = getattr(spec, "shield", None) or ("none" if kind.bare is None else "loiter")
    return spec.model_copy(update={"shield": chosen, **_resolved_keys("planner", spec, kind, mission)})


def resolved_guidance(spec: GuidanceSpec, aircraft: AircraftSpec) -> GuidanceSpec:
    """Checks the guidance section and fills in its defaults; the aircraft's airspeed must be filled in."""
    kind = _find_kind("guidance", spec, GUIDANCE)
    return spec.model_copy(update=_resolved_keys("guidance", spec, kind, limits_of(aircraft)))


def planner_of(spec: PlannerSpec, mission: Mission) -> Planner:
    """The planner for one flight, compiled; a PlannerError says what its constructor raised, or that it is not here."""
    compile_all()
    kind: PlannerKind | None = PLANNER.find(spec.kind)
    if kind is None:
        raise PlannerError(f"the planner {spec.kind} is not here; give it anew (planner=, or --planner)")
    with _code_of_others(lambda text: PlannerError(f"the planner {spec.kind} cannot be made: {text}")):
        if spec.shield == "none":
            return (kind.bare or kind.make)(kind.config(**spec.own), replace(mission))
        made = kind.make(kind.config(**spec.own), replace(mission))  # what it writes there nobody else reads
        return made if kind.bare is not None else Shield(made, mission)


def law_of(spec: GuidanceSpec, aircraft: AircraftSpec) -> GuidanceLaw:
    """The law for one flight, along paths or to waypoints, from a section that `resolved_guidance` returned."""
    seal()  # before the laws' machine code is loaded
    kind, config = _kind_and_config(spec)
    limits = limits_of(aircraft)
    with printing_aside():
        law = kind.make(config, limits)
    if spec.follow == "path":
        return law
    from aircraft.guidance.waypoints import waypoint_law

    return waypoint_law(law, spec.kind, config, limits, spec.acceptance_radius_m)


def card_of(spec: GuidanceSpec, aircraft: AircraftSpec) -> LawCard | None:
    """Returns how the law tracks with the aircraft, flown once to learn it; None: as the aircraft's survey says."""
    from aircraft.guidance.waypoints import by_passing
    from aircraft.law_cards import law_card

    kind, config = _kind_and_config(spec)
    waypoints = spec.follow == "waypoints"
    at = "guidance", "acceptance_radius_m" if waypoints and spec.acceptance_radius_m else "kind"
    with _code_of_others(lambda text: KeyFault((at[0], "kind"), f"{spec.kind}: it cannot be flown: {text}")):
        if waypoints and not by_passing(config):  # where it is beside the legs says nothing of how it tracks
            kind.make(config, limits_of(aircraft))
            return None
        try:
            frame, speed_mps = airframe_of(aircraft), aircraft.airspeed_mps
            return law_card(frame, kind, config, speed_mps, waypoints, spec.acceptance_radius_m, seal)
        except AircraftError as error:
            raise KeyFault(at, f"must be another: {error}") from error


def _kind_and_config(spec: GuidanceSpec) -> tuple[GuidanceKind, Any]:
    if (kind := GUIDANCE.find(spec.kind)) is None:
        raise KeyFault(("guidance", "kind"), f"{spec.kind} is not here; give it anew (guidance=, or --guidance)")
    return kind, kind.config(**spec.own)


def _find_kind(section: str, spec: PartSpec, part: LoopPart) -> Any:
    """Looks up the kind that a section names; raises a KeyFault if there is none."""
    if (kind := part.find(spec.kind)) is not None:
        return kind
    known = ", ".join(kind for kind in part.known() if kind not in PLANNER.registered | GUIDANCE.registered)
    text = f"is {spec.kind[:40]!r}; must be one of {known}"
    if is_source(spec.kind):
        name = spec.kind[:80]
        text = f"is {name!r}, which no file may name: code is only run for --{section} {name}, or in Python"
    raise KeyFault((section, "kind"), text)


def _resolved_keys(section: str, spec: PartSpec, kind: Kind, facts: Any) -> dict[str, Any]:
    """Checks the own keys of a kind and fills in their defaults; `facts` is the mission or the guidance limits."""
    with _code_of_others(lambda text: KeyFault((section, "kind"), f"cannot be configured: {text}")):
        keys, shared = _keys_section(kind), type(spec).model_fields
        known = keys.model_fields
        for name in [each for each in shared if each in known]:
            raise KeyFault((section, "kind"), f"{spec.kind}: its key {name} is one of all kinds; rename it")
        for name in [each for each in spec.own if each not in known]:
            raise KeyFault((section, name), unknown_key(name, (*shared, *known)))
        own = _check_keys(section, keys, spec.own)
        try:
            config = kind.config(**own).resolved(facts)
        except ValueError as error:
            other = re.match(r"(\w+)\.(\w+) (is .*)", str(error), re.DOTALL)  # as `sensor.range_m is ...`
            own_key = [name for name in known if name in str(error)][:1]
            loc, text = (other.groups()[:2], other[3]) if other else ((section, *own_key), str(error))
            raise KeyFault(loc, text) from error
        return _check_keys(section, keys, {name: getattr(config, name) for name in known})


def _check_keys(section: str, keys: type[Section], own: dict[str, Any]) -> dict[str, Any]:
    """The own keys of a kind, those left out at their defaults; a KeyFault if one is not what its section allows."""
    try:
        return dict(keys.model_validate(own))
    except ValidationError as error:
        loc, problem = KeyFaults.of(error, keys).every[0]
        raise KeyFault((section, *loc), problem) from error


@cache
def _keys_section(kind: Kind) -> type[Section]:
    hints = get_type_hints(kind.config)
    keys: dict[str, Any] = {}
    for each in fields(kind.config):
        described: dict[str, Any] = {name: each.metadata.get(key) for name, key in _BOUNDS}
        if each.name.endswith("_m") and described["le"] is None:
            described["le"] = MAX_COORDINATE_M
        default = {} if each.default is MISSING else {"default": each.default}
        described |= {**default, "description": f"{each.metadata.get('doc', each.name)}."}
        keys[each.name] = (hints[each.name], Field(**described))
    return create_model(f"{kind.kind} keys", __base__=Section, **keys)


def with_own_keys(schema: dict[str, Any]) -> dict[str, Any]:
    """Adds to a scenario's JSON Schema a choice for each kind of planner and guidance law, with its own keys."""
    for name, spec, part in (("planner", "PlannerSpec", PLANNER), ("guidance", "GuidanceSpec", GUIDANCE)):
        shared = schema["$defs"].pop(spec)
        choices = [_choice(shared, kind) for kind in part.installed().values()]
        schema["properties"][name] = {"description": shared["description"], "anyOf": choices}
    return schema


def _choice(shared: dict[str, Any], kind: Kind) -> dict[str, Any]:
    own = _keys_section(kind).model_json_schema()["properties"]
    names = [kind.kind, kind.kind + SHIELDED] if isinstance(kind, PlannerKind) else [kind.kind]
    named = {**shared["properties"]["kind"], "enum": names}
    if not (usual := kind.kind == named["default"]):
        del named["default"]
    entry = {"title": kind.kind, "description": kind.summary, "type": "object", "additionalProperties": False}
    keys = {**shared["properties"], "kind": named, **own}
    return {**entry, "properties": keys, "required": [] if usual else ["kind"]}
