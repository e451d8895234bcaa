"""A planner's own keys in a scenario: checked, and resolved for the mission."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from harness.files.crash import PlannerError, sentence
from harness.files.printing import PrintingAside
from harness.scenario import own_keys
from harness.scenario.planner_section import PlannerSpec
from planner.compiled import compile_all
from planner.registry import installed_kinds, planner_kinds
from planner.shield.shield import Shield

if TYPE_CHECKING:
    from planner.interface import Mission, Planner


def resolved(spec: PlannerSpec, mission: Mission, as_flown: bool = False) -> PlannerSpec:
    """The planner's section with its own keys checked and every default filled in.

    Args:
        spec: the section.
        mission: what the planner is told.
        as_flown: the section is of a run folder, where every default stands already; a planner that was given by a
            source file, or in Python, need not be here.

    Raises:
        KeyFault: there is no such planner or key, or the keys contradict each other or the mission.
    """
    if as_flown and spec.kind not in planner_kinds():
        return spec
    with PrintingAside():
        kind = own_keys.named_kind("planner", spec, planner_kinds())
        config = own_keys.resolved_config("planner", spec, kind, PlannerSpec.model_fields, mission)
        chosen = getattr(spec, "shield", None) or ("none" if kind.bare is None else "loiter")
        own = {each.name: getattr(config, each.name) for each in fields(kind.config)}
        return spec.model_copy(update={"shield": chosen, **own})


def planner_of(spec: PlannerSpec, mission: Mission) -> Planner:
    """The planner for one flight, from a section that `resolved` returned; nothing is left to compile in it.

    Raises:
        PlannerError: whatever its constructor raised; or the run of its scenario was read back, and it is not here.
    """
    compile_all()
    kind = planner_kinds().get(spec.kind)
    if kind is None:
        raise PlannerError(f"the planner {spec.kind} is not here; give it anew (planner=, or --planner)")
    try:
        with PrintingAside():
            if spec.shield == "none":
                return (kind.bare or kind.make)(kind.config(**spec.own), mission)
            planner = kind.make(kind.config(**spec.own), mission)
            return planner if kind.bare is not None else Shield(planner, mission)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise PlannerError(f"the planner {spec.kind} cannot be made: {sentence(error)}") from error


def json_schema(common: dict[str, Any]) -> dict[str, Any]:
    """JSON Schema of the section: one choice for each planner kind.

    Args:
        common: the schema of `PlannerSpec`.
    """
    return own_keys.json_schema(common, installed_kinds())
