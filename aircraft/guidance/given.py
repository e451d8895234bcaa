"""Guidance laws that somebody hands over in Python, and not by an entry point.

What may be given: a `GuidanceKind`; a class or function that makes the law of one flight, from the `GuidanceLimits` or
from nothing; or a law itself, an object with the methods `follow(route, arc_length_m)` and `update(state)`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

from aircraft.guidance.interface import GuidanceLaw, GuidanceLimits
from aircraft.guidance.registry import GuidanceKind, guidance_kinds, register


@dataclass(frozen=True)
class NoKeys:
    """The keys of a law that has none of its own."""

    def resolved(self, limits: GuidanceLimits) -> NoKeys:
        """Itself."""
        return self


def registered(given: object) -> str:
    """Registers what was given, unless it has been; returns the name by which scenarios of this process know it.

    Args:
        given: what the module says; or the name of a kind.

    Raises:
        ValueError: it is none of these; one sentence.
    """
    if isinstance(given, str):
        return given
    kind = kind_of(given)
    if guidance_kinds().get(kind.kind) != kind:
        register(kind)
    return kind.kind


def kind_of(given: object) -> GuidanceKind:
    """What was given, as the registry has it.

    Raises:
        ValueError: it is not what this module says.
    """
    if isinstance(given, GuidanceKind):
        return given
    if isinstance(given, type) or (callable(given) and not _steers(given)):
        return GuidanceKind(_name(given), _summary(given), NoKeys, _maker(given))
    if _steers(given):
        return GuidanceKind(
            _name(type(given)), _summary(given), NoKeys, lambda _keys, _limits: cast(GuidanceLaw, given)
        )
    raise ValueError(
        f"a guidance law must be a kind, a class, a function or an object with the methods follow(route, arc_length_m) "
        f"and update(state); this is a {type(given).__name__}"
    )


def _steers(given: object) -> bool:
    return callable(getattr(given, "follow", None)) and callable(getattr(given, "update", None))


def _name(given: Any) -> str:
    name = getattr(given, "__qualname__", type(given).__qualname__).replace("<locals>.", "")
    return f"{getattr(given, '__module__', '__main__')}:{name}"


def _summary(given: object) -> str:
    return (inspect.getdoc(given) or "a guidance law given in Python").splitlines()[0]


def _maker(given: Callable[..., Any]) -> Callable[[Any, GuidanceLimits], GuidanceLaw]:
    """Calls what was given with the limits, where it takes one argument; else with nothing."""
    needed = [
        each.name
        for each in inspect.signature(given).parameters.values()
        if each.default is each.empty and each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)
    ]
    if len(needed) > 1:
        raise ValueError(f"{_name(given)} needs {', '.join(needed)}; must need the limits alone, or nothing")

    def make(_keys: Any, limits: GuidanceLimits) -> GuidanceLaw:
        made = given(limits) if needed else given()
        if not _steers(made):
            raise TypeError(f"{_name(given)} makes a {type(made).__name__}, which does not follow and update")
        return cast(GuidanceLaw, made)

    return make
