"""Plain values as YAML text that `harness.strict_yaml` reads back."""

from __future__ import annotations

from typing import Any, Final

import yaml

from harness.strict_yaml import value_of

# Writes text in quotes wherever a YAML 1.2 reader would take it for something else, and no aliases: those are refused.
_Dumper: Any = type(
    "_Dumper",
    (yaml.CSafeDumper if yaml.__with_libyaml__ else yaml.SafeDumper,),
    {"ignore_aliases": lambda _dumper, _value: True},
)


PIECE: Final = 1000
"""Longer lists are written in pieces of so many."""
_LISTS: Final = (list, tuple)


def _represent_text(dumper: Any, text: str) -> yaml.ScalarNode:
    style = None if isinstance(value_of(text), str) else "'"
    node: yaml.ScalarNode = dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)
    return node


_Dumper.add_representer(str, _represent_text)
_Dumper.add_representer(tuple, _Dumper.represent_list)


def dump(value: Any) -> str:
    """Plain values as YAML text that `strict_yaml.parse` reads back to the same values, floats to the last bit.

    A long list of a mapping is written piece by piece, to the same text: what is made of it on the way takes 3 KB each.
    """
    long = _long_list(value)
    if long is None:
        return _dumped(value)
    keys = list(value)
    here = keys.index(long)
    before, after = ({key: value[key] for key in part} for part in (keys[:here], keys[here + 1 :]))
    first, *more = (value[long][begin : begin + PIECE] for begin in range(0, len(value[long]), PIECE))
    parts = [before, {long: first}, *more, after]
    return "".join(_dumped(part) for part in parts if part)


def _long_list(value: Any) -> str | None:
    """The key of a list in a mapping that can be written piece by piece: each piece takes lines of its own."""
    if not isinstance(value, dict):
        return None
    for here, (key, inner) in enumerate(value.items()):
        if isinstance(inner, _LISTS) and len(inner) > PIECE and all(map(_takes_lines, inner)):
            others = list(value.values())
            whole = all(
                not part or any(map(_takes_lines, part)) for part in (others[:here], others[here + 1 :])
            )
            return str(key) if whole else None
    return None


def _takes_lines(value: Any) -> bool:
    """Whether what holds it is written over several lines."""
    return isinstance(value, (dict, *_LISTS))


def _dumped(value: Any) -> str:
    text = yaml.dump(
        value, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True
    )
    return str(text)
