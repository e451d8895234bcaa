"""Planner kinds by name: the built-in ones and those of other distributions.

Another distribution adds a planner by an entry point in the group `wayproof.planners` that names a
`PlannerKind`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any

from planner import rolling_window
from planner.interface import Mission, Planner

GROUP = "wayproof.planners"


@dataclass(frozen=True)
class PlannerKind:
    """A planner that scenarios may name.

    Attributes:
        kind: the name, as in `planner.kind` of a scenario.
        summary: one line for `wayproof list planners`.
        config: frozen dataclass of the planner's own keys. Each field has a default and the metadata `doc` (a
            sentence), `unit`, and `minimum` / `maximum` or `above` where there is such a bound. A default of
            None is derived: `config.resolved(mission)` returns the config with no None left and raises
            ValueError, with a sentence, where keys contradict each other.
        make: the planner for one flight, from a resolved config.
    """

    kind: str
    summary: str
    config: type[Any]
    make: Callable[[Any, Mission], Planner]


BUILT_IN = (
    PlannerKind(
        kind="rolling_window",
        summary="improved BUG: rolling window, fan sectors, n-best multi-step search, route optimisation",
        config=rolling_window.RollingWindowConfig,
        make=rolling_window.RollingWindow,
    ),
)


def planner_kinds() -> dict[str, PlannerKind]:
    """All planner kinds by name, built-in ones first."""
    kinds = {kind.kind: kind for kind in BUILT_IN}
    for point in entry_points(group=GROUP):
        outside = point.load()
        if not isinstance(outside, PlannerKind):
            raise TypeError(f"entry point {point.name!r} ({point.value}) is not a PlannerKind")
        kinds.setdefault(outside.kind, outside)
    return kinds
