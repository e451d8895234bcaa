"""Faults of a scenario as sentences with file, line and key path."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from harness.files.strict_yaml import InputError, Loc, Node, fault_line

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError
    from pydantic_core import ErrorDetails

MAX_FAULTS: Final = 2  # an error on a file has at most this many lines; the last counts what is left out
MOST_WHOLE: Final = 2**53  # larger whole numbers, either way, are refused: a float has all below
NAME_PATTERN: Final = r"^[a-z0-9._-]*[a-z0-9_-][a-z0-9._-]*$"  # pattern of a name that a folder may have

_PATTERNS: Final = {NAME_PATTERN: "have only a-z, 0-9, '.', '_' and '-', and not only dots"}
_SENTENCES: Final = {  # by the type of pydantic's error, with what it tells of it
    "missing": "is missing; it is required",
    "literal_error": "is {shown}; must be {expected}",
    "too_long": "has {actual_length} items; must have {max_length}",
    "too_short": "has {actual_length} items; must have at least {min_length}",
    "string_too_short": "is empty text; must be a name",
    "int_type": "is {shown}; must be a whole number",
    "float_type": "is {shown}; must be a number",
    "string_type": "is {shown}; must be text; put it in quotes",
    "bool_type": "is {shown}; must be true or false",
    **dict.fromkeys(("tuple_type", "list_type"), "is {shown}; must be a list"),
    **dict.fromkeys(("model_type", "dict_type"), "is {shown}; must be a mapping `key: value`"),
    "greater_than": "is {shown}; must be greater than {gt:.12g}",
    "greater_than_equal": "is {shown}; must be at least {ge:.12g}",
    "multiple_of": "is {shown}; must be a multiple of {multiple_of:g}",
    "less_than": "is {shown}; must be less than {lt:.12g}",
    "less_than_equal": "is {shown}; must be at most {le:.12g}",
}


class KeyFaults(ValueError):
    """Faults of the keys of a file: `every` has the key and the sentence of each."""

    def __init__(self, every: Sequence[tuple[Loc, str]]) -> None:
        super().__init__("; ".join(text for _, text in every))
        self.every = tuple(every)

    @classmethod
    def of(cls, error: ValidationError, model: type[BaseModel]) -> KeyFaults:
        """Turns pydantic's errors on the keys of a `model` into faults."""
        every = error.errors(include_url=False)
        missing = [each for each in every if each["type"] == "missing"]
        short = {each["loc"][:-1]: each for each in missing if isinstance(each["loc"][-1], int)}
        found: list[tuple[Loc, str]] = []
        for details in every:
            if details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]:
                continue  # only too few of its items are right
            loc, cause = details["loc"], details.get("ctx", {}).get("error")
            last = short.get(loc[:-1]) if details["type"] == "missing" else None
            if last is not None:  # numbers of a list that is too short
                given, wanted = str([*last["input"]])[:80], int(last["loc"][-1]) + 1
                found.append((loc[:-1], f"is {given}; must have {wanted} numbers"))
            elif isinstance(cause, KeyFault):
                found.append(((*loc, *cause.loc), str(cause)))
            else:
                known = known_keys(model, loc[:-1]) if details["type"] == "extra_forbidden" else ()
                found.append((loc, _sentence(details, known)))
        return cls(found)

    def in_file(self, root: Node, source: str) -> InputError:
        """Makes an error of the faults, with file, line and key, of at most `MAX_FAULTS` lines."""
        return in_lines([fault_line(source, root.line_of(at), at, text) for at, text in self.every], source)


class KeyFault(KeyFaults):
    """The key at `loc` contradicts others."""

    def __init__(self, loc: Loc, sentence: str) -> None:
        super().__init__([(loc, sentence)])
        self.loc = loc


def in_lines(every: Sequence[str], source: str) -> InputError:
    """Faults of a file as one error, each once, at most `MAX_FAULTS` lines."""
    if len(lines := list(dict.fromkeys(every))) > MAX_FAULTS:
        lines[MAX_FAULTS - 1 :] = [f"{source}: and {len(lines) - MAX_FAULTS + 1} more"]
    return InputError("\n".join(lines))


def known_keys(model: type[BaseModel], loc: Loc) -> tuple[str, ...]:
    """Keys of the section at `loc`, as they are spelt in a file; none where there is no section."""
    schema = model.model_json_schema()
    part: Mapping[str, Any] = schema
    for step in loc:
        inner = part.get("properties", {}).get(step) or part.get("additionalProperties")
        inner = part.get("items") if isinstance(step, int) else inner
        part = inner if isinstance(inner, dict) else {}
        for choice in part.get("anyOf", [part]):
            if "$ref" in choice:
                part = schema["$defs"][choice["$ref"].rpartition("/")[2]]
    return tuple(part.get("properties", ()))


def _sentence(details: ErrorDetails, known: tuple[str, ...]) -> str:
    """Makes the sentence that says what is wrong with a value, and what would be right."""
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    if kind == "value_error":
        return str(context["error"])
    if kind == "extra_forbidden":
        return unknown_key(str(details["loc"][-1]), known)
    if kind == "finite_number" or (isinstance(value, float) and not math.isfinite(value)):
        return f"is {value}; must be a finite number"
    if kind == "int_type" and isinstance(value, float):
        wanted = "without a point" if abs(value) < MOST_WHOLE else f"of at most {MOST_WHOLE}"
        return f"is {value!r}; must be a whole number {wanted}"
    if kind == "string_pattern_mismatch":
        return f"is {shown(value)}; must {_PATTERNS.get(context['pattern'], 'match ' + context['pattern'])}"
    if kind in _SENTENCES:
        return _SENTENCES[kind].format(shown=shown(value), **context)
    return f"is {shown(value)}: {details['msg'][0].lower()}{details['msg'][1:]}"


def unknown_key(name: str, known: tuple[str, ...]) -> str:
    """Returns the sentence on a key that does not exist, with the known one that is nearest."""
    meant = "".join(f"did you mean {each}? " for each in difflib.get_close_matches(name, known, n=1))
    return f"unknown key; {meant}known here: {', '.join(known)}"


def shown(value: Any) -> str:
    """Returns a value as a sentence shows it: lists and mappings by their kind, long texts cut."""
    if value is None:
        return "empty"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, (tuple, list)):
        return f"a list of {len(value)}"
    if isinstance(value, str):
        return f"the text {value!r}" if len(value) <= 40 else f"the text {value[:37]!r}..."
    return f"{value:.12g}" if isinstance(value, float) else f"{value}"
