"""A scenario's keys with some replaced: on the command line, by a campaign, or in Python."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from harness.files import strict_yaml
from harness.files.strict_yaml import COMMAND_LINE, IN_PYTHON, InputError, Loc, Node, loc_of, node_of
from harness.scenario.sections import GuidanceSpec, PlannerSpec, Section

OWN_KEYS: Final[Mapping[Loc, type[Section]]] = {
    ("planner", "kind"): PlannerSpec,
    ("guidance", "kind"): GuidanceSpec,
}
"""Kinds whose own keys stand in a section, and the section's type, which has the keys of all kinds."""


def overridden(root: Node, overrides: Sequence[tuple[str, str]]) -> Node:
    """A scenario's keys with some replaced, as `load_scenario` takes them.

    An InputError says that one is not a key path, has no value or leads nowhere.
    """
    for name, text in overrides:
        loc = _loc(name, "command line")
        if not text.strip():
            raise InputError(f"command line: {name}: has no value; write {name}=VALUE")
        root = with_key(root, loc, strict_yaml.parse(text, f"command line: {name}").moved(COMMAND_LINE))
    return root


def with_key(root: Node, loc: Loc, new: Node) -> Node:
    """A scenario's keys with one replaced; a new kind of planner or guidance drops the own keys of the one before.

    An InputError says that there is no such key, as far as it can be told without the scenario's types.
    """
    shared, section = OWN_KEYS.get(loc), root.at(loc[:1])
    if shared and section and isinstance(section.value, dict) and section.plain().get("kind") != new.value:
        common = {name: node for name, node in section.value.items() if name in shared.model_fields}
        root = strict_yaml.replaced(root, loc[:1], Node(common, section.line))
    return strict_yaml.replaced(root, loc, new)


class Given(NamedTuple):
    """What a scenario was made of, before any default was derived or any file expanded."""

    sections: Mapping[str, Any]
    """The keys that were given, by their attributes; sections without the defaults that follow from others."""
    folder: Path | None
    """Of the scenario file; None where there was none."""


def changed(given: Given, keys: Mapping[str, Any]) -> Node:
    """The keys that a scenario was given, and no default, with some changed; None takes a key away.

    An InputError says that it is no mapping, or one is not a key path, or leads nowhere.
    """
    if not isinstance(keys, Mapping) or not all(isinstance(name, str) for name in keys):
        raise InputError('with_: must be given a mapping of key paths, such as {"planner.clearance_m": 60}')
    plain = {name.removesuffix("_"): _plain(value) for name, value in given.sections.items()}
    root = node_of(plain, IN_PYTHON)
    for name, value in keys.items():
        loc, new = _loc(name, "with_"), node_of(_plain(value), IN_PYTHON)
        root = strict_yaml.without(root, loc) if value is None else with_key(root, loc, new)
    return root


def _loc(name: str, where: str) -> Loc:
    try:
        return loc_of(name)
    except ValueError as error:
        raise InputError(f"{where}: {error}") from error


def _plain(value: Any) -> Any:
    """What somebody gives in Python, as YAML has it."""
    if isinstance(value, Section):
        return value.model_dump(by_alias=True, exclude_none=True, exclude_unset=True)
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(name): _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return tuple(_plain(each) for each in value)
    return str(value) if isinstance(value, Path) else value
