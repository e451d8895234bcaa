"""The own keys of a kind of planner or guidance law: read off its config and checked."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, Protocol, TypeVar, get_type_hints

from pydantic import ValidationError, create_model

from harness.files.crash import sentence
from harness.scenario.given import is_source
from harness.scenario.sections import Section, key
from harness.scenario.validation import KeyFault, first_fault, unknown_key


class Kind(Protocol):
    """What a registry has by name: `planner.registry.PlannerKind`, `aircraft.guidance.registry.GuidanceKind`."""

    @property
    def kind(self) -> str:
        """The name."""
        ...

    @property
    def summary(self) -> str:
        """One line."""
        ...

    @property
    def config(self) -> type[Any]:
        """Frozen dataclass of the own keys."""
        ...


class OwnKeys(Protocol):
    """A section that has keys of a kind beside those that all kinds share."""

    @property
    def kind(self) -> str:
        """The kind's name."""
        ...

    @property
    def own(self) -> dict[str, Any]:
        """The keys that are not shared."""
        ...


AnyKind = TypeVar("AnyKind", bound=Kind)


def named_kind(section: str, spec: OwnKeys, kinds: Mapping[str, AnyKind]) -> AnyKind:
    """The kind that a section names.

    Raises:
        KeyFault: there is none of that name.
    """
    if spec.kind not in kinds and is_source(spec.kind):
        name = spec.kind[:80]
        raise KeyFault(
            (section, "kind"),
            f"is {name!r}, which no file may name: code is only run for --{section} {name}, or in Python",
        )
    if spec.kind not in kinds:
        raise KeyFault((section, "kind"), f"is {spec.kind[:40]!r}; must be one of {', '.join(kinds)}")
    return kinds[spec.kind]


def resolved_config(section: str, spec: OwnKeys, kind: Kind, shared: Mapping[str, Any], about: Any) -> Any:
    """The config of a kind with its keys checked and every default filled in.

    Args:
        section: its name in a scenario.
        spec: the section.
        kind: the kind that it names.
        shared: keys that all kinds share.
        about: what defaults depend on, as `config.resolved` takes it.

    Raises:
        KeyFault: there is no such key, or the keys contradict each other or what they are about.
    """
    known = tuple(field.name for field in fields(kind.config))
    for name in spec.own:
        if name not in known:
            raise KeyFault((section, name), unknown_key(name, (*shared, *known)))
    try:
        own = dict(keys_section(kind).model_validate(spec.own))
    except ValidationError as error:
        fault = first_fault(error)
        raise KeyFault((section, *fault.loc), str(fault)) from error
    try:
        return kind.config(**own).resolved(about)
    except ValueError as error:
        raise _blamed(section, known, str(error)) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise KeyFault((section, "kind"), f"cannot be configured: {sentence(error)}") from error


def _blamed(section: str, known: Sequence[str], text: str) -> KeyFault:
    """What a config says, as a fault of the key that it names: `sensor.range_m is ...`, or one of its own."""
    other = re.match(r"(\w+)\.(\w+) (is .*)", text, re.DOTALL)
    if other is not None:
        return KeyFault((other[1], other[2]), other[3])
    return KeyFault((section, *[name for name in known if name in text][:1]), text)


def json_schema(common: dict[str, Any], kinds: Mapping[str, Kind]) -> dict[str, Any]:
    """JSON Schema of a section: one choice for each kind.

    Args:
        common: the schema of the keys that all kinds share.
        kinds: the kinds, by name.
    """
    choices = [_kind_schema(common, kind) for kind in kinds.values()]
    return {"description": common["description"], "anyOf": choices}


def keys_section(kind: Kind) -> type[Section]:
    """The own keys of a kind as a section."""
    if kind.config not in _sections:
        _sections[kind.config] = _keys_section(kind.kind, kind.config)
    return _sections[kind.config]


_sections: dict[type[Any], type[Section]] = {}


def _keys_section(name: str, config: type[Any]) -> type[Section]:
    hints = get_type_hints(config)
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
        for field in fields(config)
    }
    return create_model(f"{name} keys", __base__=Section, **keys)


def _kind_schema(common: dict[str, Any], kind: Kind) -> dict[str, Any]:
    own = keys_section(kind).model_json_schema()["properties"]
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
