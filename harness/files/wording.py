"""Numbers in sentences."""

from __future__ import annotations

from collections.abc import Sequence


def counted(number: int, noun: str) -> str:
    """A number and what it counts, as `1 run` or `2 runs`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def tallied(every: Sequence[str], noun: str) -> str:
    """Texts, each once, with how often it comes if that is more than once: `wind drift (3 legs), roll rate`."""
    times = {text: every.count(text) for text in dict.fromkeys(every)}
    return ", ".join(f"{text} ({count} {noun})" if count > 1 else text for text, count in times.items())
