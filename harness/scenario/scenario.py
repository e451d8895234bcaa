"""Scenario files: a complete scenario, reading and writing it, and the same with some keys replaced.

The text becomes `ScenarioKeys`, as the file says; `resolve` fills in defaults and refuses keys that contradict.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from pydantic import ValidationError

from harness.files import strict_yaml
from harness.files.input_file import InputError
from harness.files.strict_yaml import COMMAND_LINE, IN_LOG, IN_PYTHON, Loc, Node, fault_line, loc_of, node_of
from harness.files.wording import counted
from harness.scenario.keys import ScenarioKeys
from harness.scenario.parts import with_own_keys
from harness.scenario.resolving import resolve
from harness.scenario.sections import GuidanceSpec, PartSpec, PlannerSpec, Section
from harness.scenario.shipped import scenario_path
from harness.scenario.validation import KeyFaults, known_keys, unknown_key

OWN_KEYS: Final[Mapping[Loc, Any]] = {("planner", "kind"): PlannerSpec, ("guidance", "kind"): GuidanceSpec}
"""Keys that name a kind with own keys in its section, and the section's type, which has the keys of all kinds."""


def overridden(root: Node, overrides: Sequence[tuple[str, str]]) -> Node:
    """A scenario's keys with some replaced, as `load_scenario` takes them; their faults name the command line."""
    for name, text in overrides:
        loc = loc_of(name, "command line")
        if not text.strip():
            raise InputError(f"command line: {name}: has no value; write {name}=VALUE")
        new = strict_yaml.parse(text, f"command line: {name}").plain()
        root = with_key(root, loc, node_of(new, COMMAND_LINE))
    return root


def with_key(root: Node, loc: Loc, new: Node) -> Node:
    """A scenario's keys with one replaced; a new kind of planner or guidance drops the own keys of the one before."""
    shared, section = OWN_KEYS.get(loc), root.at(loc[:1])
    if shared and section and isinstance(section.value, dict) and section.plain().get("kind") != new.value:
        common = {name: node for name, node in section.value.items() if name in shared.model_fields}
        root = strict_yaml.replaced(root, loc[:1], Node(common, section.line))
    return strict_yaml.replaced(root, loc, new)


class Given(NamedTuple):
    """The keys that a scenario was made of, by attribute, without derived defaults; and its file's folder, if any."""

    sections: Mapping[str, Any]
    folder: Path | None


def changed(given: Given, keys: Mapping[str, Any]) -> Node:
    """Returns the keys that a scenario was given with some changed; None takes one away, items counted as before."""
    if not isinstance(keys, Mapping) or not all(isinstance(name, str) for name in keys):
        raise InputError('with_: must be given a mapping of key paths, such as {"planner.clearance_m": 60}')
    root = node_of({key.removesuffix("_"): plain(value) for key, value in given.sections.items()}, IN_PYTHON)

    def turn(entry: tuple[Loc, Any]) -> tuple[int, ...]:
        loc, value = entry
        items = (1, -len(loc), -loc[-1]) if value is None and isinstance(loc[-1], int) else ()
        # What holds other keys drops them, so that it is set first: a section, then its kind, then the rest.
        return items or (0, 3 if loc in OWN_KEYS else 2 * len(loc))

    for loc, value in sorted(((loc_of(name, "with_"), value) for name, value in keys.items()), key=turn):
        new = node_of(plain(value), IN_PYTHON)
        root = strict_yaml.without(root, loc) if value is None else with_key(root, loc, new)
    return root


def _refuse_unknown(made: Scenario, loc: Loc) -> None:
    """Raises an InputError if a scenario with these kinds of planner and law has no key at `loc`."""
    for depth, step in enumerate(loc):
        part = getattr(made, str(loc[0]), None) if depth == 1 else None
        known = (*known_keys(ScenarioKeys, loc[:depth]), *(part.own if isinstance(part, PartSpec) else ()))
        if isinstance(step, str) and step not in known:
            raise InputError(fault_line("", IN_PYTHON, loc[: depth + 1], unknown_key(step, known)))


def plain(value: Any) -> Any:
    """Turns a value given in Python (section, numpy, path, mapping) into the plain value that YAML would give."""
    if isinstance(value, Section):
        return value.model_dump(by_alias=True, exclude_none=True, exclude_unset=True)
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return tuple(plain(each) for each in value)
    return str(value) if isinstance(value, Path) else value


class Scenario(ScenarioKeys):
    """One flight, completely described; flying it twice gives the same track bit for bit."""

    def with_(self, keys: Mapping[str, Any]) -> Scenario:
        """A copy with some keys changed, checked anew; defaults that follow from others are derived anew.

        A new `planner.kind` drops the own keys of the planner before. An InputError names the key that cannot be flown.

        Args:
            keys: values by key path, as `{"seed": 3, "obstacles[0].circle.radius_m": 50}`; plain values, numpy's, or
                sections. None stands for the default, and takes an item out of a list.
        """
        given: Given = self.__dict__["_given"]
        made = validated(changed(given, keys), "with_", given.folder)
        for name in [name for name, value in keys.items() if value is None]:
            _refuse_unknown(made, loc_of(name))
        return made

    def __repr__(self) -> str:
        """A line for people; `dump_scenario` gives all of it."""
        model, obstacles = Path(self.aircraft.model).name, counted(len(self.obstacles), "obstacle")
        return f"Scenario({self.name}: {self.planner.kind}, {model}, seed {self.seed}, {obstacles})"

    __str__ = __repr__


def load_scenario(path: str | Path, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """Reads a scenario file, every default filled in; a line of an InputError names file, line and key.

    Args:
        path: the file, or the name of a scenario that comes with wayproof, such as `paper_circles`.
        overrides: key paths and values as YAML, replaced before anything is checked: (`"sensor.range_m"`, `"5000"`).
    """
    path = scenario_path(str(path))
    return validated(overridden(strict_yaml.read(path), overrides), str(path), path.absolute().parent)


def parse_scenario(text: str, source: str = "scenario", as_flown: bool = False, folder: Path | None = None) -> Scenario:
    """Reads a scenario from YAML text; arguments and faults are those of `validated`."""
    return validated(strict_yaml.parse(text, source), source, folder, not as_flown, as_flown)


def scenario_of(keys: Mapping[str, Any], overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """A scenario from keys that follow from a flown log; their faults name the log, those of overrides the command."""
    return validated(overridden(node_of(plain(keys), IN_LOG), overrides), "the log")


def dump_scenario(scenario: Scenario) -> str:
    """The YAML text of a scenario, all defaults written out; it loads back to an equal one, bit for bit."""
    return strict_yaml.dump(scenario.model_dump(by_alias=True, exclude_none=True))


def packed(scenario: Scenario) -> bytes:
    """Compresses a complete scenario, to be kept or sent; `unpacked` takes a millisecond."""
    return zlib.compress(scenario.model_dump_json(by_alias=True).encode(), level=1)


def unpacked(compressed: bytes) -> Scenario:
    """Restores the scenario that `packed` compressed."""
    return scenario_from(json.loads(zlib.decompress(compressed)))


def scenario_schema() -> dict[str, Any]:
    """JSON Schema of the format, the own keys of every known planner and guidance law included."""
    schema = with_own_keys(ScenarioKeys.model_json_schema())
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def validated(
    root: Node, source: str, folder: Path | None = None, ends_checked: bool = True, as_flown: bool = False
) -> Scenario:
    """Makes a scenario of the keys of a file, every default filled in; an InputError calls it `source`.

    The folder of an aircraft, and files of obstacles, are sought in `folder` first. With `ends_checked` start and goal
    must keep the clearance from obstacles and lie in the area. One of a run folder (`as_flown`) is complete: a planner
    or guidance law that was given by a source file, or in Python, need not be here.
    """
    try:
        return scenario_from(root.plain(), folder, ends_checked, as_flown)
    except KeyFaults as error:
        raise error.in_file(root, source) from error


def scenario_from(
    plain: Any, folder: Path | None = None, ends_checked: bool = True, as_flown: bool = False
) -> Scenario:
    """Does as `validated` with plain values, as YAML gives them; KeyFaults say why they are no scenario."""
    try:
        keys = ScenarioKeys.model_validate(plain)
    except ValidationError as error:
        raise KeyFaults.of(error, ScenarioKeys) from error
    complete = resolve(keys, folder, ends_checked, as_flown)
    scenario = Scenario.model_construct(keys.model_fields_set, **dict(complete))
    given = {name: value for name, value in keys if name in keys.model_fields_set}
    object.__setattr__(scenario, "_given", Given(given, folder))
    return scenario
