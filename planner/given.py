"""Planners that somebody hands over in Python or by the name of a source file, and not by an entry point.

What may be given: a `PlannerKind`; a class or function that makes the planner of one flight, from the mission or from
nothing; or a planner itself, an object with the method `plan(request)`, which then has to know its goal.
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from planner.interface import Mission, Planner
from planner.registry import PlannerKind, planner_kinds, register

Maker = Callable[[Any, Mission], Planner]


@dataclass(frozen=True)
class NoKeys:
    """The keys of a planner that has none of its own."""

    def resolved(self, mission: Mission) -> NoKeys:
        """Itself."""
        return self


def is_source(name: str) -> bool:
    """Whether a planner's name is FILE.py:NAME or MODULE:NAME, and not a kind."""
    return ":" in name


def registered(given: object) -> str:
    """Registers what was given, unless it has been; returns the name by which scenarios of this process know it.

    Args:
        given: what the module says; or a kind, or FILE.py:NAME or MODULE:NAME, as text.

    Raises:
        ValueError: it is none of these, or what it names cannot be imported; one sentence.
    """
    if isinstance(given, str):
        if is_source(given):
            return registered_source(given)
        return given
    kind = kind_of(given)
    if planner_kinds().get(kind.kind) != kind:
        register(kind)
    return kind.kind


def registered_source(source: str) -> str:
    """Imports what FILE.py:NAME or MODULE:NAME names and registers it under that name, without the file's folder.

    Raises:
        ValueError: there is no such file, module or object, it cannot be imported, or it is no planner.
    """
    place, _, name = source.rpartition(":")
    module = _file(Path(place)) if place.endswith(".py") else _module(place, source)
    if not name.isidentifier() or not hasattr(module, name):
        there = [each for each, value in vars(module).items() if _is_own(value, module)]
        raise ValueError(
            f"{place} has no {name or 'name'}; it has {', '.join(there) or 'no class or function'}"
        )
    kind = replace(kind_of(getattr(module, name)), kind=f"{Path(place).name}:{name}")
    register(kind)
    return kind.kind


def kind_of(given: object) -> PlannerKind:
    """What was given, as the registry has it.

    Raises:
        ValueError: it is not what this module says.
    """
    if isinstance(given, PlannerKind):
        return given
    if isinstance(given, type) or (callable(given) and not _plans(given)):
        return PlannerKind(_name(given), _summary(given), NoKeys, _maker(given))
    if _plans(given):
        return PlannerKind(
            _name(type(given)), _summary(given), NoKeys, lambda _keys, _mission: cast(Planner, given)
        )
    raise ValueError(
        f"a planner must be a kind, a class, a function or an object with the method plan(request); this is a "
        f"{type(given).__name__}"
    )


def _plans(given: object) -> bool:
    return callable(getattr(given, "plan", None))


def _name(given: Any) -> str:
    name: str = getattr(given, "__qualname__", type(given).__qualname__).replace("<locals>.", "")
    module = getattr(given, "__module__", "__main__")
    return name if module == "__main__" else f"{module}:{name}"


def _summary(given: object) -> str:
    return (inspect.getdoc(given) or "a planner given in Python").splitlines()[0]


def _maker(given: Callable[..., Any]) -> Maker:
    """Calls what was given with the mission, where it takes one; else with nothing."""
    try:
        parameters = inspect.signature(given).parameters
    except (TypeError, ValueError):  # made in C: it does not say
        parameters = inspect.signature(lambda mission: mission).parameters
    needed = [
        each.name
        for each in parameters.values()
        if each.default is each.empty and each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)
    ]
    if len(needed) > 1:
        raise ValueError(f"{_name(given)} needs {', '.join(needed)}; must need the mission alone, or nothing")

    def make(_keys: Any, mission: Mission) -> Planner:
        made = given(mission) if needed else given(mission=mission) if "mission" in parameters else given()
        if not _plans(made):
            raise TypeError(
                f"{_name(given)} makes a {type(made).__name__}, which has no method plan(request)"
            )
        return cast(Planner, made)

    return make


def _file(path: Path) -> Any:
    """The module of a source file; what lies beside the file can be imported by it."""
    if not path.is_file():
        raise ValueError(f"{path}: no such file; give FILE.py:NAME")
    # A name of its own: the file may be called planner.py.
    name = f"given_planner_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    assert spec is not None
    assert spec.loader is not None
    folder = str(path.resolve().parent)
    if folder not in sys.path:
        sys.path.append(folder)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with redirect_stdout(sys.stderr):
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise ValueError(_not_imported(str(path), error)) from error
    return module


def _module(name: str, source: str) -> Any:
    try:
        with redirect_stdout(sys.stderr):
            return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name.partition(".")[0] and error.name != name:
            raise ValueError(_not_imported(name, error)) from error
        raise ValueError(f"{source}: there is no module {name}; give FILE.py:NAME or MODULE:NAME") from error
    except (Exception, SystemExit) as error:
        raise ValueError(_not_imported(name, error)) from error


def _not_imported(what: str, error: BaseException) -> str:
    return f"{what} cannot be imported: {type(error).__name__}: {' '.join(str(error).split())}"


def _is_own(value: object, module: Any) -> bool:
    """Whether a module's class or function was made there."""
    return isinstance(value, PlannerKind) or (
        callable(value) and getattr(value, "__module__", None) == module.__name__
    )
