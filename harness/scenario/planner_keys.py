"""A planner's own keys in a scenario: read off its config, checked, and resolved for the mission."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from functools import cache
from typing import TYPE_CHECKING, Any, get_type_hints

from pydantic import ValidationError, create_model

from harness.files.crash import PlannerError, sentence
from harness.files.printing import PrintingAside
from harness.scenario.sections import PlannerSpec, Section, key
from harness.scenario.validation import KeyFault, first_fault, unknown_key
from planner.compiled import compile_all
from planner.given import is_source
from planner.registry import PlannerKind, installed_kinds, planner_kinds

if TYPE_CHECKING:
    from planner.interface import Mission, Planner


def resolved(spec: PlannerSpec, mission: Mission) -> PlannerSpec:
    """The planner's section with its own keys checked and every default filled in.

    Raises:
        KeyFault: there is no such planner or key, or the keys contradict each other or the mission.
    """
    with PrintingAside():
        return _resolved(spec, mission)


def _resolved(spec: PlannerSpec, mission: Mission) -> PlannerSpec:
    kinds = planner_kinds()
    if spec.kind not in kinds:
        raise KeyFault(("planner", "kind"), _unknown(spec.kind, kinds))
    kind = kinds[spec.kind]
    known = tuple(field.name for field in fields(kind.config))
    for name in spec.own:
        if name not in known:
            raise KeyFault(("planner", name), unknown_key(name, (*PlannerSpec.model_fields, *known)))
    try:
        own = dict(_own_keys(kind).model_validate(spec.own))
    except ValidationError as error:
        fault = first_fault(error)
        raise KeyFault(("planner", *fault.loc), str(fault)) from error
    try:
        config = kind.config(**own).resolved(mission)
    except ValueError as error:
        blamed = [name for name in known if name in str(error)][:1]
        raise KeyFault(("planner", *blamed), str(error)) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise KeyFault(("planner", "kind"), f"cannot be configured: {sentence(error)}") from error
    return spec.model_copy(update={name: getattr(config, name) for name in known})


def _unknown(kind: str, kinds: Iterable[str]) -> str:
    if is_source(kind):
        return f"is {kind[:80]!r}, which no file may name: code is only run for --planner {kind[:80]}, or in Python"
    return f"is {kind[:40]!r}; must be one of {', '.join(kinds)}"


def planner_of(spec: PlannerSpec, mission: Mission) -> Planner:
    """The planner for one flight, from a section that `resolved` returned; nothing is left to compile in it.

    Raises:
        PlannerError: whatever its constructor raised.
    """
    compile_all()
    kind = planner_kinds()[spec.kind]
    try:
        with PrintingAside():
            return kind.make(kind.config(**spec.own), mission)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise PlannerError(f"the planner {spec.kind} cannot be made: {sentence(error)}") from error


def json_schema(common: dict[str, Any]) -> dict[str, Any]:
    """JSON Schema of the section: one choice for each planner kind.

    Args:
        common: the schema of `PlannerSpec`.
    """
    kinds = [_kind_schema(common, kind) for kind in installed_kinds().values()]
    return {"description": common["description"], "anyOf": kinds}


@cache
def _own_keys(kind: PlannerKind) -> type[Section]:
    """A planner's own keys as a section."""
    hints = get_type_hints(kind.config)
    keys: dict[str, Any] = {
        field.name: (
            hints[field.name],
            key(
                f"{field.metadata['doc']}.",
                unit=field.metadata.get("unit"),
                default=field.default,
                ge=field.metadata.get("minimum"),
                le=field.metadata.get("maximum"),
                gt=field.metadata.get("above"),
            ),
        )
        for field in fields(kind.config)
    }
    return create_model(f"{kind.kind} keys", __base__=Section, **keys)


def _kind_schema(common: dict[str, Any], kind: PlannerKind) -> dict[str, Any]:
    own = _own_keys(kind).model_json_schema()["properties"]
    default = common["properties"]["kind"]["default"]
    named = {**common["properties"]["kind"], "const": kind.kind}
    if kind.kind != default:
        del named["default"]
    return {
        "title": kind.kind,
        "description": kind.summary,
        "type": "object",
        "additionalProperties": False,
        "properties": {**common["properties"], "kind": named, **own},
        "required": [] if kind.kind == default else ["kind"],
    }
