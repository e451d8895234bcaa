"""Planners and guidance laws that are handed over in Python or by the name of a source file, not by an entry point.

What may be given: a kind (`PlannerKind`, `GuidanceKind`); a class or function that makes the part for one flight, from
what it may know (a planner from the mission, a law from the limits of the aircraft) or from nothing; or the part
itself, an object with the part's methods.
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from aircraft.guidance.registry import GuidanceKind
from harness.scenario.kinds import PLANNER, LoopPart
from planner.registry import PlannerKind

Kind = PlannerKind | GuidanceKind


@dataclass(frozen=True)
class NoKeys:
    """The own keys of a part that has none."""

    def resolved(self, told: object) -> NoKeys:
        """Itself."""
        return self


def is_source(name: str) -> bool:
    """Whether a name is FILE.py:NAME or MODULE:NAME, and not a kind."""
    return ":" in name


def own_words(planner: str | None, law: str | None) -> list[str]:
    """Words of a command that name a planner and a guidance law that no file may name."""
    parts = {"--planner": planner, "--guidance": law}
    return [word for option, name in parts.items() if name and is_source(name) for word in (option, name)]


def registered(given: object, part: LoopPart = PLANNER) -> str:
    """Registers what was given, unless it has been; returns the name by which scenarios of this process know it.

    As text it is a kind that is known, or FILE.py:NAME or MODULE:NAME. A ValueError, one sentence, says why it is none
    of these, or cannot be imported.
    """
    if isinstance(given, str):
        return registered_source(given, part) if is_source(given) else given
    try:
        kind = _same_kind_of(given, part)
    except TypeError:  # it cannot be hashed
        kind = kind_of(given, part)
    if part.known().get(kind.kind) != kind:
        part.register(kind)
    return kind.kind


def registered_source(source: str, part: LoopPart = PLANNER) -> str:
    """Imports what FILE.py:NAME or MODULE:NAME names and registers it under that name, without the file's folder.

    A ValueError says that there is no such file, module or object, why it cannot be imported, or is no such part.
    """
    place, _, name = source.rpartition(":")
    module = _imported(place, source)
    if not name.isidentifier() or not hasattr(module, name):
        there = ", ".join(each for each, value in vars(module).items() if _is_own(value, module))
        raise ValueError(f"{place} has no {name or 'name'}; it has {there or 'no class or function'}")
    kind = replace(kind_of(getattr(module, name), part), kind=f"{Path(place).name}:{name}")
    part.register(kind)
    return kind.kind


def kind_of(given: object, part: LoopPart = PLANNER) -> Kind:
    """What was given, as the registry of its part has it; a ValueError says why it is not what this module says."""
    if isinstance(given, PlannerKind | GuidanceKind) and type(given) is part.kind:
        return given
    made: Callable[[Any, Any], Any] = lambda _keys, _told: given  # noqa: E731
    if isinstance(given, type) or (callable(given) and not _is_part(given, part)):
        made = _maker(given, part)
    elif not _is_part(given, part):
        raise ValueError(
            f"a {part.noun} must be a kind, a class, a function or an object with the method "
            f"{' and '.join(part.methods)}; this is a {type(given).__name__}"
        )
    summary = (inspect.getdoc(given) or f"a {part.noun} given in Python").splitlines()[0]
    kind: Kind = part.kind(_name(given), summary, NoKeys, made)
    return kind


_same_kind_of = lru_cache(maxsize=64)(kind_of)
"""The same kind for the same object: what was measured of it holds on."""


def _is_part(given: object, part: LoopPart) -> bool:
    return all(callable(getattr(given, each.partition("(")[0], None)) for each in part.methods)


def _name(given: Any) -> str:
    name: str = getattr(given, "__qualname__", type(given).__qualname__).replace("<locals>.", "")
    module = getattr(given, "__module__", "__main__")
    return name if module == "__main__" else f"{module}:{name}"


def _maker(given: Callable[..., Any], part: LoopPart) -> Callable[[Any, Any], Any]:
    """Calls what was given with what it may know, where it takes that; else with nothing."""
    try:
        parameters = inspect.signature(given).parameters
    except (TypeError, ValueError):  # made in C: it does not say
        parameters = inspect.signature(lambda told: told).parameters
    plain = [each for each in parameters.values() if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)]
    needed = [each.name for each in plain if each.default is each.empty]
    if len(needed) > 1:
        told = f"{_name(given)} needs {', '.join(needed)}; must need the {part.factory_parameter} alone, or nothing"
        raise ValueError(told)

    def make(_keys: Any, told: Any) -> Any:
        keys = {part.factory_parameter: told} if part.factory_parameter in parameters and not needed else {}
        made = given(told) if needed else given(**keys)
        if not _is_part(made, part):
            lacks = f"which has no method {' and '.join(part.methods)}"
            raise TypeError(f"{_name(given)} makes a {type(made).__name__}, {lacks}")
        return made

    return make


def _imported(place: str, source: str) -> Any:
    """The module that a place names: a file, beside which lies what it imports, or a module by its name."""
    path = Path(place)
    if path.suffix == ".py" and not path.is_file():
        raise ValueError(f"{place}: no such file; give FILE.py:NAME")
    try:
        with redirect_stdout(sys.stderr):
            return _executed(path.resolve()) if path.suffix == ".py" else importlib.import_module(place)
    except (Exception, SystemExit) as error:
        if isinstance(error, ModuleNotFoundError) and error.name in (place, place.partition(".")[0]):
            told = f"{source}: there is no module {place}; give FILE.py:NAME or MODULE:NAME"
            raise ValueError(told) from error
        told = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise ValueError(f"{place} cannot be imported: {told}") from error


def _executed(path: Path) -> Any:
    """The module of a source file."""
    name = f"given_{path.stem}"  # a name of its own: the file may be called planner.py
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _is_own(value: object, module: Any) -> bool:
    """Whether a module's class or function was made there."""
    return isinstance(value, PlannerKind | GuidanceKind) or (
        callable(value) and getattr(value, "__module__", None) == module.__name__
    )
