"""Texts for people: numbers with nouns, tallies, and foreign text made printable."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

_UNPRINTABLE: Final = re.compile(  # controls but tab and line end, marks of direction, halves of characters
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def counted(number: int, noun: str) -> str:
    """Returns a number and its noun, as `1 run` or `2 runs`."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def metres(length_m: float, unlike_m: float | None = None) -> str:
    """Returns a length with three digits or more, `0.25 m`, `1,234 m`: as many as tell it from an unlike one."""
    if unlike_m is not None and length_m != unlike_m and metres(length_m) == metres(unlike_m):
        digits = next(n for n in range(4, 20) if f"{length_m:.{n}g}" != f"{unlike_m:.{n}g}")
        return f"{length_m:.{digits}g} m"
    return f"{length_m:.3g} m" if abs(length_m) < 999.5 else f"{length_m:,.0f} m"


def tallied(every: Sequence[str], noun: str) -> str:
    """Returns each text once, with its count if above one: `wind drift (3 legs), roll rate`."""
    times = {text: every.count(text) for text in dict.fromkeys(every)}
    return ", ".join(f"{text} ({count} {noun})" if count > 1 else text for text, count in times.items())


def printable(text: str) -> str:
    r"""Text of others as a terminal may show it: a control character is spelt out, as `\x1b`; tabs and lines stay."""
    return _UNPRINTABLE.sub(lambda found: found.group().encode("unicode_escape").decode(), text)
