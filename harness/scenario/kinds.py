"""Planners and guidance laws by name: built-in ones, those of other distributions, and those given to this process.

Another distribution adds one by an entry point that names a `PlannerKind` or a `GuidanceKind`. In Python a kind may be
given; a class or function that makes the part for one flight, from what it may know or from nothing; or the part.
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cache
from hashlib import sha256
from importlib.metadata import EntryPoints, entry_points
from pathlib import Path
from threading import Lock
from typing import Any

from aircraft.guidance.registry import BUILT_IN as LAWS
from aircraft.guidance.registry import GuidanceKind
from harness.files.errors import printing_aside, sentence
from harness.files.input_file import InputError
from harness.scenario.sections import SHIELDED
from planner.registry import BUILT_IN as PLANNERS
from planner.registry import PlannerKind

MOST_NUMBERED = 256  # names stay known: a program may give a planner for each of thousands of flights
_REGISTERING = Lock()
OF_FILE = "given_"  # beginning of the name of a module read from a file, which may be called planner.py
PLUGIN_REMEDY = "mend or uninstall that distribution"


class PluginError(ImportError):
    """A planner or law of another distribution cannot be loaded; the message says which, why, and what to do."""


@dataclass(eq=False)
class LoopPart:
    """A part of the loop that scenarios name, and that others may make."""

    noun: str
    kind: type[Any]
    built_in: tuple[Any, ...]
    group: str  # group of the entry points by which other distributions add kinds
    methods: tuple[str, ...]  # methods that an object must have to be such a part
    factory_parameter: str  # name of the one parameter that a function which makes such a part may have
    registered: dict[str, Any] = field(default_factory=dict)
    """Kinds by name that this process, and no other, knows."""
    givers: dict[str, object] = field(default_factory=dict)
    """By name, the object that a registered kind was made of."""
    numbers: dict[str, int] = field(default_factory=dict)  # of givers that wanted a name, where it is not one
    numbered: list[str] = field(default_factory=list)  # names with such a number, the oldest first

    def plugins(self) -> dict[str, tuple[Any, str | None]]:
        """Loads the kinds of other distributions: kind and owner (distribution, version) by name; or a PluginError."""
        found: dict[str, tuple[Any, str | None]] = {}
        for point in _entry_points(entry_points, self.group, tuple(sys.path)):
            owner = f"{point.dist.name} {point.dist.version}" if point.dist else None
            whose = f"({point.value}) of {owner or 'another distribution'}"
            text = f"the {self.noun} of entry point {point.name!r} {whose}"
            try:
                with printing_aside():
                    kind = point.load()
            except Exception as error:
                text += f" cannot be loaded: {sentence(error)}"
                raise PluginError(f"{text}; {PLUGIN_REMEDY}") from error
            if not isinstance(kind, self.kind):
                raise PluginError(f"{text} is no {self.kind.__name__}; {PLUGIN_REMEDY}")
            found.setdefault(kind.kind, (kind, owner))
        return found

    def installed(self) -> dict[str, Any]:
        """The kinds that every process finds, by name, built-in ones first."""
        built_in = {kind.kind: kind for kind in self.built_in}
        return {**built_in, **{name: kind for name, (kind, _) in self.plugins().items()}, **built_in}

    def known(self) -> dict[str, Any]:
        """All kinds by name: the installed ones, and those that this process has registered."""
        return {**self.installed(), **self.registered}

    def find(self, name: str) -> Any:
        """The kind of a name, or None. For a built-in one other distributions are not looked through, which is slow."""
        return next((kind for kind in self.built_in if kind.kind == name), None) or self.known().get(name)

    def register(self, kind: Any, giver: object = None) -> str:
        """Lets this process know a kind; returns its name, with a number where another object gave one of that name.

        A ValueError says that an installed kind has the name.
        """
        if kind.kind in self.installed():
            raise ValueError(f"there is a {self.noun} called {kind.kind} already; give this one another name")
        with _REGISTERING:
            name: str = kind.kind
            if giver is not None and self.givers.get(name, giver) is not giver:
                number = self.numbers[name] = self.numbers.get(name, 1) + 1
                name = f"{name}-{number}"
                self.numbered.append(name)
            self.registered[name], self.givers[name] = replace(kind, kind=name), giver
            for old in self.numbered[:-MOST_NUMBERED]:
                self.numbered.remove(old)
                self.registered.pop(old, None)
                del self.givers[old]
        return name

    def name_of(self, giver: object) -> str | None:
        """The name of the kind that was made of an object; None if it is not known."""
        return next((name for name in list(self.registered) if self.givers.get(name) is giver), None)

    def distribution_of(self, name: str) -> str | None:
        """Name and version of the other distribution that a kind comes from; None for any other kind."""
        built_in = any(kind.kind == name for kind in self.built_in)
        return None if built_in else self.plugins().get(name, (None, None))[1]


@cache
def _entry_points(find: Callable[..., EntryPoints], group: str, path: tuple[str, ...]) -> EntryPoints:
    """Finds entry points of other distributions, once: it takes as long as all else of reading a scenario."""
    return find(group=group)


PLANNER = LoopPart("planner", PlannerKind, PLANNERS, "wayproof.planners", ("plan(request)",), "mission")
LAW_METHODS = ("update(state)", "follow(route, arc_length_m)")  # a law must have both
GUIDANCE = LoopPart("guidance law", GuidanceKind, LAWS, "wayproof.guidance", LAW_METHODS, "limits")

planner_kinds: Callable[[], dict[str, PlannerKind]] = PLANNER.known
guidance_kinds: Callable[[], dict[str, GuidanceKind]] = GUIDANCE.known
Kind = PlannerKind | GuidanceKind


@dataclass(frozen=True)
class NoKeys:
    """The own keys of a part that has none."""

    def resolved(self, facts: object) -> NoKeys:
        """Returns the keys as they are: there is nothing to fill in."""
        return self


def is_source(name: str) -> bool:
    """Whether a name is FILE.py:NAME or MODULE:NAME, and not a kind."""
    return ":" in name


def source_words(planner: str | None, law: str | None) -> list[str]:
    """Returns the options of a command that name a planner and a law, where these are FILE.py:NAME or MODULE:NAME."""
    parts = {"--planner": planner, "--guidance": law}
    return [each for option, name in parts.items() if name and is_source(name) for each in (option, name)]


def imported_sources(*names: str | None) -> tuple[str, ...]:
    """Those names that are FILE.py:NAME or MODULE:NAME, without the shield's ending, for flying processes to import.

    Two files whose parts would have one name are an InputError.
    """
    found: dict[str, str] = {}
    for source in ((name or "").removesuffix(SHIELDED) for name in names):
        place, _, name = source.rpartition(":")
        other = found.setdefault(f"{Path(place).name}:{name}", source) if place else source
        if Path(other.rpartition(":")[0]).resolve() != Path(place).resolve():
            text = f"{other} and {source} would both be called {Path(place).name}:{name}; rename one of the files"
            raise InputError(f"wayproof: {text}")
    return tuple(found.values())


def source_digests(sources: Iterable[str]) -> dict[str, str]:
    """SHA-256, its first 16 digits, of the file of each source that was imported, by the name of its part."""
    found = {}
    for place, _, name in (source.rpartition(":") for source in sources):
        path = place if place.endswith(".py") else getattr(sys.modules.get(place), "__file__", None)
        if path is not None:
            found[f"{Path(place).name}:{name}"] = sha256(Path(path).read_bytes()).hexdigest()[:16]
    return found


def registered(given: object, part: LoopPart = PLANNER) -> str:
    """Registers what was given, or a source names; returns its name for scenarios. A ValueError says what is wrong."""
    if isinstance(given, str):
        source = given.removesuffix(SHIELDED) if part is PLANNER else given
        return registered_source(source, part) + given[len(source) :] if is_source(source) else given
    kind = kind_of(given, part)
    known = part.name_of(given) or (kind.kind if part.known().get(kind.kind) == kind else None)
    return known or part.register(kind, given)


def registered_source(source: str, part: LoopPart = PLANNER) -> str:
    """Imports what FILE.py:NAME or MODULE:NAME names and registers it under that name, without the file's folder."""
    place, _, name = source.rpartition(":")
    module = _import(place, source)
    if not name.isidentifier() or not hasattr(module, name):
        there = ", ".join(
            each
            for each, value in vars(module).items()
            if isinstance(value, Kind) or (callable(value) and getattr(value, "__module__", None) == module.__name__)
        )
        raise ValueError(f"{place} has no {name or 'name'}; it has {there or 'no class or function'}")
    return part.register(replace(kind_of(getattr(module, name), part), kind=f"{Path(place).name}:{name}"))


def kind_of(given: object, part: LoopPart = PLANNER) -> Kind:
    """Makes a kind of a class, a function or an object; a kind is returned as it is. Raises ValueError if none fits."""
    if isinstance(given, PlannerKind | GuidanceKind) and type(given) is part.kind:
        return given
    made: Callable[[Any, Any], Any] = lambda _keys, _facts: given  # noqa: E731
    if isinstance(given, type) or (callable(given) and not _has_methods(given, part)):
        made = _factory_of(given, part)
    elif not _has_methods(given, part):
        wanted = f"a kind, a class, a function or an object with the method {' and '.join(part.methods)}"
        raise ValueError(f"a {part.noun} must be {wanted}; this is of type {type(given).__name__}")
    summary = (inspect.getdoc(given) or f"a {part.noun} given in Python").splitlines()[0]
    kind: Kind = part.kind(_name_of(given), summary, NoKeys, made)
    return kind


def _has_methods(given: object, part: LoopPart) -> bool:
    return all(callable(getattr(given, each.partition("(")[0], None)) for each in part.methods)


def _name_of(given: Any) -> str:
    name: str = getattr(given, "__qualname__", type(given).__qualname__).replace("<locals>.", "")
    if (module := str(getattr(given, "__module__", "__main__"))).startswith(OF_FILE):
        return f"{module.removeprefix(OF_FILE)}.py:{name}"
    return name if module == "__main__" else f"{module}:{name}"


def _factory_of(given: Callable[..., Any], part: LoopPart) -> Callable[[Any, Any], Any]:
    """Returns a function that makes the part: it calls `given` with the mission or limits, if that takes them."""
    try:
        parameters = inspect.signature(given).parameters
    except (TypeError, ValueError):  # made in C: it does not say
        parameters = inspect.signature(lambda facts: facts).parameters
    plain = [each for each in parameters.values() if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)]
    if len(needed := [each.name for each in plain if each.default is each.empty]) > 1:
        text = f"{_name_of(given)} needs {', '.join(needed)}; must need the {part.factory_parameter} alone, or nothing"
        raise ValueError(text)

    def make(_keys: Any, facts: Any) -> Any:
        keys = {part.factory_parameter: facts} if part.factory_parameter in parameters and not needed else {}
        if not _has_methods(made := given(facts) if needed else given(**keys), part):
            lacks = f"which has no method {' and '.join(part.methods)}"
            raise TypeError(f"{_name_of(given)} makes one of type {type(made).__name__}, {lacks}")
        return made

    return make


def _import(place: str, source: str) -> Any:
    """Imports a .py file, or a module by its name; a ValueError, in which it is `source`, says why it cannot be."""
    path = Path(place)
    if path.suffix == ".py" and not path.is_file():
        raise ValueError(f"{place}: no such file; give FILE.py:NAME")
    try:
        with printing_aside():
            return _module_of_file(path.resolve()) if path.suffix == ".py" else importlib.import_module(place)
    except (Exception, SystemExit) as error:
        if isinstance(error, ModuleNotFoundError) and error.name in (place, place.partition(".")[0]):
            raise ValueError(f"{source}: there is no module {place}; give FILE.py:NAME or MODULE:NAME") from error
        raise ValueError(f"{place} cannot be imported: {sentence(error)}") from error


def _module_of_file(path: Path) -> Any:
    """Runs a source file and returns its module; appends the file's folder to `sys.path`."""
    name = OF_FILE + path.stem
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
