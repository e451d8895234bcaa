"""YAML as this project reads it: a strict subset, and a line number for every value.

Plain scalars are resolved by the core schema of YAML 1.2 (https://yaml.org/spec/1.2.2/#103-core-schema): `1e3` is a
number; `on` and `1_000` are text. Duplicate keys, anchors, aliases, merge keys, tags and a second document are errors.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import yaml

from harness.files.input_file import InputError as InputError
from harness.files.input_file import read_text
from harness.files.wording import counted

MAX_BYTES: Final = 32_000_000  # a larger file is refused
MAX_VALUES: Final = 3_000_000  # more in a file are refused; 100,000 obstacles with four corners have fewer
MAX_DEPTH: Final = 20  # a file whose values are nested deeper is refused
MAX_KEYS: Final = 1000  # a mapping of more keys is refused
MAX_KEY_LENGTH: Final = 100  # a key of more letters is refused
COMMAND_LINE: Final = 0  # the `line` of a value that came from the command line
IN_PYTHON: Final = -1  # the `line` of a value that was given in Python, to `Scenario.with_`
IN_PATH: Final = -2  # the `line` of a value that follows from a given path
IN_LOG: Final = -3  # the `line` of a value that follows from a flown log
SOURCES: Final = {COMMAND_LINE: "command line", IN_PYTHON: "with_", IN_PATH: "the path", IN_LOG: "the log"}

Scalar: TypeAlias = str | int | float | bool | None
Loc: TypeAlias = tuple[str | int, ...]

_LOADER: Final = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
_CONSTANTS: Final[dict[str, bool | None]] = {  # plain scalars that are null, true or false
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INT: Final = re.compile(r"[-+]?[0-9]{1,18}")
_OCTAL_OR_HEX: Final = re.compile(r"0o[0-7]{1,18}|0x[0-9a-fA-F]{1,15}")
_FLOAT: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE: Final = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_TAB_BEFORE: Final = re.compile(r"[ ?:-]*\t")  # a line that is indented with a tab
_UNPRINTABLE: Final = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True, slots=True)
class Node:
    """A scalar, a dict of nodes by key, or a tuple of nodes, with the line of its key, or in a list its own line."""

    value: Scalar | dict[str, Node] | tuple[Node, ...]
    line: int

    def plain(self) -> Any:
        """Returns the value without lines: dicts, tuples and scalars."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, tuple):
            return tuple(node.plain() for node in self.value)
        return self.value

    def at(self, loc: Loc) -> Node | None:
        """Returns the node at `loc`; None where there is none."""
        inner = self.inner(loc[0]) if loc else self
        return inner.at(loc[1:]) if loc and inner else inner

    def line_of(self, loc: Loc) -> int:
        """Returns the line of the value at `loc`, or of the innermost one on the way to it that exists."""
        inner = self.inner(loc[0]) if loc else None
        return inner.line_of(loc[1:]) if inner else self.line

    def inner(self, step: str | int) -> Node | None:
        """Returns the node that a mapping has under a key, or a list at an index; None where there is none."""
        if isinstance(self.value, dict):
            return self.value.get(str(step)) if isinstance(step, str) else None
        if isinstance(self.value, tuple) and isinstance(step, int) and step < len(self.value):
            return self.value[step]
        return None


def node_of(plain: Any, line: int) -> Node:
    """Makes a node of plain values, every part of it at `line`."""
    if isinstance(plain, dict):
        return Node({key: node_of(value, line) for key, value in plain.items()}, line)
    if isinstance(plain, (list, tuple)):
        return Node(tuple(node_of(value, line) for value in plain), line)
    return Node(plain, line)


def key_path(loc: Loc) -> str:
    """Spells `("obstacles", 2, "circle")` as `obstacles[2].circle`."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in loc).lstrip(".")


def loc_of(path: str, source: str = "") -> Loc:
    """Reads `obstacles[2].circle` as `("obstacles", 2, "circle")`; `source` begins the InputError for another text."""
    steps = path.replace("[", ".").replace("]", "").split(".")
    if not all(steps) or not all(map(_is_key, steps)) or len(steps) > MAX_DEPTH:
        reason = f"{path[:60]!r} is not a key path; write it as sensor.range_m"
        raise InputError(f"{source}: {reason}" if source else reason)
    return tuple(int(step) if step.isdecimal() else step for step in steps)


def as_spelt(path: str) -> str:
    """Spells a key path as messages and tables do: `obstacles.2.circle` as `obstacles[2].circle`."""
    return key_path(loc_of(path))


def fault_line(source: str, line: int, loc: Loc, sentence: str) -> str:
    """Returns a fault as a line for people: `file:line: key.path: sentence`."""
    return ": ".join(filter(None, (SOURCES.get(line, f"{source}:{line}"), key_path(loc), sentence)))


def read(path: Path) -> Node:
    """Reads one YAML file; an InputError says why it cannot be opened, is too large, no UTF-8 or not strict YAML."""
    return parse(read_text(path, MAX_BYTES, "a scenario, in YAML"), str(path))


def parse(text: str, source: str) -> Node:
    """Parses one YAML document; faults, InputErrors, name it by `source`, usually the path."""
    if match := _UNPRINTABLE.search(text):
        line = text.count("\n", 0, match.start()) + 1
        raise InputError(f"{source}:{line}: has the control character 0x{ord(match[0]):02x}; must be plain text")
    return _Composer(text, source).document()


def value_of(text: str) -> Scalar:
    """Returns the value that a plain (unquoted) scalar stands for."""
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if _INT.fullmatch(text):
        return int(text)
    if _OCTAL_OR_HEX.fullmatch(text):
        return int(text, 0)
    if _FLOAT.fullmatch(text):
        return float(text)
    return float(text.replace(".", "")) if _NOT_FINITE.fullmatch(text) else text


class _Composer:
    """Builds nodes from the events of one document."""

    def __init__(self, text: str, source: str) -> None:
        self.text, self.source, self.values = text, source, 0
        self.events: Iterator[yaml.Event] = yaml.parse(text, Loader=_LOADER)

    def document(self) -> Node:
        self.next(())
        if isinstance(event := self.next(()), yaml.StreamEndEvent):
            comments = sum(line.lstrip().startswith("#") for line in self.text.splitlines())
            what = f"has no key, only {counted(comments, 'line')} of comments" if comments else "is empty"
            raise InputError(f"{self.source}:1: {what}; must be a mapping that begins with `schema:`")
        node = self.node(self.next(()), (), 1)
        self.next(())
        if not isinstance(event := self.next(()), yaml.StreamEndEvent):
            raise self.fault(event, (), "a second document begins here; must be one document a file")
        return node

    def fault(self, event: yaml.Event, loc: Loc, sentence: str) -> InputError:
        return InputError(fault_line(self.source, _line(event), loc, sentence))

    def next(self, loc: Loc) -> yaml.Event:
        """Returns the next event; `loc` tells the place in case the text is broken."""
        try:
            return next(self.events)
        except yaml.MarkedYAMLError as error:
            opened = (error.context or "").startswith(("while parsing a flow", "while scanning a quoted"))
            mark = error.context_mark if opened and error.context_mark else error.problem_mark
            lines = self.text.split("\n")
            line = min(mark.line + 1, len(lines)) if mark else 1
            if _TAB_BEFORE.match(lines[line - 1]):  # it is not known to which key the line belongs
                raise InputError(f"{self.source}:{line}: has a tab; indent with spaces") from error
            sentence = f"is not YAML ({error.problem}); check indentation, colons, brackets and quotes"
            raise InputError(fault_line(self.source, line, loc, sentence)) from error

    def node(self, event: yaml.Event, loc: Loc, line: int) -> Node:
        self.check_bare(event, loc)
        self.values += 1
        if self.values > MAX_VALUES:
            raise self.fault(event, loc[:3], f"is value {MAX_VALUES + 1} of the file; must be fewer")
        if len(loc) > MAX_DEPTH:
            raise self.fault(event, loc[:3], f"is nested deeper than {MAX_DEPTH} levels; must be flatter")
        if isinstance(event, yaml.MappingStartEvent):
            return Node(self.mapping(loc), line)
        if isinstance(event, yaml.SequenceStartEvent):
            return Node(self.sequence(loc), line)
        assert isinstance(event, yaml.ScalarEvent)
        return Node(value_of(event.value) if event.implicit[0] else event.value, line)

    def check_bare(self, event: yaml.Event, loc: Loc) -> None:
        """Refuses aliases, anchors and tags."""
        if isinstance(event, yaml.AliasEvent):
            raise self.fault(event, loc, f"is the alias *{event.anchor:.40}; write the value out")
        if isinstance(event, yaml.NodeEvent) and event.anchor is not None:
            raise self.fault(event, loc, f"has the anchor &{event.anchor:.40}; write every value out")
        if isinstance(event, (yaml.ScalarEvent, yaml.CollectionStartEvent)) and event.tag is not None:
            raise self.fault(event, loc, f"has the tag {event.tag:.60}; write the plain value")

    def mapping(self, loc: Loc) -> dict[str, Node]:
        nodes: dict[str, Node] = {}
        while not isinstance(event := self.next(loc), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                raise self.fault(event, loc, "has a key that is not plain text; must be `key: value`")
            if not _is_key(key := str(event.value)):
                rule = f"a key must be printable and at most {MAX_KEY_LENGTH} characters long"
                raise self.fault(event, loc, f"has the key {key[:40]!r}; {rule}")
            self.check_bare(event, (*loc, key))
            if key == "<<":
                raise self.fault(event, loc, "has the merge key <<; write the keys out")
            if key in nodes:
                raise self.fault(event, (*loc, key), f"is given twice, first in line {nodes[key].line}; keep one")
            if len(nodes) == MAX_KEYS:
                raise self.fault(event, loc, f"has more than {MAX_KEYS} keys; must have fewer")
            nodes[key] = self.node(self.next((*loc, key)), (*loc, key), _line(event))
        return nodes

    def sequence(self, loc: Loc) -> tuple[Node, ...]:
        nodes: list[Node] = []
        while not isinstance(event := self.next((*loc, len(nodes))), yaml.SequenceEndEvent):
            nodes.append(self.node(event, (*loc, len(nodes)), _line(event)))
        return tuple(nodes)


def _line(event: yaml.Event) -> int:
    return event.start_mark.line + 1 if event.start_mark else 1


def _is_key(text: str) -> bool:
    return len(text) <= MAX_KEY_LENGTH and text.isprintable()


def replaced(node: Node, loc: Loc, new: Node, depth: int = 0) -> Node:
    """Returns a copy of `node` with `new` at `loc` behind `depth` steps; InputError where `loc` leads nowhere."""
    if depth == len(loc):
        return new
    step, value, where = loc[depth], node.value, min(new.line, COMMAND_LINE)
    if isinstance(value, tuple) and isinstance(step, int):
        if step >= len(value):
            sentence = f"does not exist; there are {len(value)}, counted from 0"
            raise InputError(fault_line("", where, loc[: depth + 1], sentence))
        inner = replaced(value[step], loc, new, depth + 1)
        return Node((*value[:step], inner, *value[step + 1 :]), node.line)
    if (value is None or isinstance(value, dict)) and isinstance(step, str):
        entries = value or {}
        inner = replaced(entries.get(step, Node({}, where)), loc, new, depth + 1)
        return Node({**entries, step: inner}, node.line)
    raise InputError(fault_line("", where, loc[: depth + 1], "no such key; see `wayproof schema`"))


def without(node: Node, loc: Loc) -> Node:
    """Returns a copy of `node` without what is at `loc`; the same if nothing is; InputError if `loc` leads nowhere."""
    replaced(node, loc, Node(None, IN_PYTHON))
    *way, last = loc
    parent = node.at(tuple(way))
    if parent is None or parent.inner(last) is None:
        return node
    left: Any = parent.value
    if isinstance(left, tuple):
        left = tuple(each for index, each in enumerate(left) if index != last)
    else:
        left = {key: each for key, each in left.items() if key != last}
    return replaced(node, tuple(way), Node(left, parent.line))


# Writes text in quotes wherever a YAML 1.2 reader would take it for something else, and no aliases: those are refused.
_Dumper: Any = type(
    "_Dumper",
    (yaml.CSafeDumper if yaml.__with_libyaml__ else yaml.SafeDumper,),
    {"ignore_aliases": lambda _dumper, _value: True},
)


def _represent_text(dumper: Any, text: str) -> Any:
    style = None if isinstance(value_of(text), str) else "'"
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _represent_text)
_Dumper.add_representer(tuple, _Dumper.represent_list)


def dump(value: Any) -> str:
    """Writes plain values as YAML text that `parse` reads back to the same values, floats to the last bit."""
    how: Any = {"sort_keys": False, "default_flow_style": None, "width": 110, "allow_unicode": True}
    return str(yaml.dump(value, Dumper=_Dumper, **how))
