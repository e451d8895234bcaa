"""Planners and guidance laws by name: built-in ones, those of other distributions, and those given to this process.

Another distribution adds one by an entry point in the group `wayproof.planners` or `wayproof.guidance` that names a
`PlannerKind` or a `GuidanceKind`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Any

from aircraft.guidance.registry import BUILT_IN as LAWS
from aircraft.guidance.registry import GuidanceKind
from planner.registry import BUILT_IN as PLANNERS
from planner.registry import PlannerKind


class PluginError(ImportError):
    """What another distribution adds cannot be loaded; the message says which, why, and what to do."""


@dataclass(eq=False)
class LoopPart:
    """A part of the loop that scenarios name, and that others may make."""

    noun: str
    kind: type[Any]
    """Class of the entries under which its implementations are registered."""
    built_in: tuple[Any, ...]
    group: str
    """Group of the entry points by which other distributions add kinds."""
    methods: tuple[str, ...]
    """Methods that an object must have to be such a part."""
    factory_parameter: str
    """Name of the one parameter that a function which makes such a part may have."""
    registered: dict[str, Any] = field(default_factory=dict)
    """The kinds that this process, and no other, knows by name."""

    def installed(self) -> dict[str, Any]:
        """The kinds that every process finds, by name, built-in ones first; a PluginError says which cannot be had."""
        kinds = {kind.kind: kind for kind in self.built_in}
        for point in _outside(entry_points, self.group, tuple(sys.path)):
            outside = self._loaded(point)
            kinds.setdefault(outside.kind, outside)
        return kinds

    def known(self) -> dict[str, Any]:
        """All kinds by name: the installed ones, and those that this process has registered."""
        return {**self.installed(), **self.registered}

    def register(self, kind: Any) -> None:
        """Lets this process know a kind by its name; one registered under the same name before is replaced.

        A ValueError says that a built-in kind, or one of another distribution, has the name.
        """
        if kind.kind in self.installed():
            raise ValueError(f"there is a {self.noun} called {kind.kind} already; give this one another name")
        self.registered[kind.kind] = kind

    def distribution_of(self, name: str) -> str | None:
        """Name and version of the other distribution that a kind comes from; None for a built-in one."""
        if name not in (kind.kind for kind in self.built_in):
            for point in _outside(entry_points, self.group, tuple(sys.path)):
                if point.dist is not None and self._loaded(point).kind == name:
                    return f"{point.dist.name} {point.dist.version}"
        return None

    def _loaded(self, point: EntryPoint) -> Any:
        """What an entry point of another distribution names."""
        owner = f"{point.dist.name} {point.dist.version}" if point.dist else "another distribution"
        told = f"the {self.noun} of entry point {point.name!r} ({point.value}) of {owner}"
        remedy = "mend or uninstall that distribution"
        try:
            with redirect_stdout(sys.stderr):
                outside = point.load()
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise PluginError(f"{told} cannot be loaded: {reason}; {remedy}") from error
        if not isinstance(outside, self.kind):
            raise PluginError(f"{told} is no {self.kind.__name__}; {remedy}")
        return outside


@cache
def _outside(find: Callable[..., EntryPoints], group: str, path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Entry points of other distributions; to look for them takes as long as all else of reading a scenario."""
    return tuple(find(group=group))


PLANNER = LoopPart("planner", PlannerKind, PLANNERS, "wayproof.planners", ("plan(request)",), "mission")
LAW = ("update(state)", "follow(route, arc_length_m)")
GUIDANCE = LoopPart("guidance law", GuidanceKind, LAWS, "wayproof.guidance", LAW, "limits")


def planner_kinds() -> dict[str, PlannerKind]:
    """All planners by name."""
    return PLANNER.known()


def guidance_kinds() -> dict[str, GuidanceKind]:
    """All guidance laws by name."""
    return GUIDANCE.known()
