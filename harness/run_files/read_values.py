"""Values of files that somebody gives: JSON without traps, finite numbers, text that a line can show."""

from __future__ import annotations

import json
import math
from typing import Any, NoReturn

from harness.files.input_file import InputError


def parsed_json(text: str, source: str) -> Any:
    """What a JSON text holds; a fault of it names the file.

    Raises:
        InputError: it is not JSON, has a key twice in one place, or a number that is not finite.
    """

    def refuse(name: str) -> NoReturn:
        raise InputError(f"{source}: has the number {name}; must be finite")

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [name for name, _ in pairs]
            again = next(name for name in names if names.count(name) > 1)
            raise InputError(f"{source}: has the key {shown(again)!r} twice in one place; must have it once")
        return found

    try:
        return json.loads(text, parse_constant=refuse, object_pairs_hook=once)
    except json.JSONDecodeError as error:
        raise InputError(f"{source}:{error.lineno}: is not JSON ({error.msg})") from error
    except RecursionError as error:
        raise InputError(f"{source}: is nested too deeply; must be a path") from error
    except InputError:
        raise
    except ValueError as error:  # what Python says of a number of thousands of digits
        raise InputError(f"{source}: has a number that is too long; must be a path") from error


def finite(value: Any, where: str) -> float:
    """A finite number, from JSON or from text."""
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        told = "missing, or null" if value is None else repr(shown(str(value)))
        raise InputError(f"{where}: is {told}; must be a finite number")
    return number


def whole(value: Any, where: str) -> int:
    """A whole number, from JSON or from text."""
    number = finite(value, where)
    if number != int(number):
        raise InputError(f"{where}: is {number:g}; must be a whole number")
    return int(number)


def shown(text: str) -> str:
    """A text as a line can show it."""
    short = text if len(text) <= 80 else f"{text[:77]}..."
    return short if short.isprintable() else ascii(short)
