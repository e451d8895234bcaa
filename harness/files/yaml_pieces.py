"""Mappings with a long list as YAML text, made in little memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from harness.files.strict_yaml import dump

PIECE: Final = 1000
"""Longer lists are written in pieces of so many."""


def dump_in_pieces(value: Mapping[str, Any]) -> str:
    """The text that `dump` makes of a mapping; a long list in it is written piece by piece.

    What is made of a list on the way takes some 3 KB for each obstacle.
    """
    keys = list(value)
    here = next((i for i, key in enumerate(keys) if _is_long(value[key])), None)
    if here is None:
        return dump(dict(value))
    before, after = ({key: value[key] for key in part} for part in (keys[:here], keys[here + 1 :]))
    if not all(not part or any(map(_takes_lines, part.values())) for part in (before, after)):
        return dump(dict(value))  # alone they would be written in one line
    long = value[keys[here]]
    first, *more = (long[begin : begin + PIECE] for begin in range(0, len(long), PIECE))
    return "".join(dump(part) for part in (before, {keys[here]: first}, *more, after) if part)


def _is_long(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) > PIECE and all(map(_takes_lines, value))


def _takes_lines(value: Any) -> bool:
    """Whether what holds it is written over several lines."""
    return isinstance(value, dict | list | tuple)
