"""Values of JSON and text files that somebody gives; a fault names the place in the file."""

from __future__ import annotations

import json
import math
from typing import Any, NoReturn

from harness.files.input_file import InputError


def parsed_json(text: str, source: str, once: bool = True) -> Any:
    """What a JSON text holds.

    An InputError, which begins with `source`, the file or nothing, says that it is not JSON, has a number that is not
    finite, or where `once` a key twice in one place.
    """

    def fault(sentence: str, line: int | None = None) -> InputError:
        where = source if line is None else f"{source}:{line}" if source else f"line {line}"
        return InputError(f"{where}: {sentence}" if where else sentence)

    def refuse(name: str) -> NoReturn:
        raise fault(f"has the number {name}; must be finite")

    def single(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [name for name, _ in pairs]
            again = next(name for name in names if names.count(name) > 1)
            raise fault(f"has the key {shown(again)!r} twice in one place; must have it once")
        return found

    try:
        return json.loads(text, parse_constant=refuse, object_pairs_hook=single if once else None)
    except json.JSONDecodeError as error:
        raise fault(f"is not whole JSON ({error.msg}); it may be torn", error.lineno) from error
    except (RecursionError, MemoryError) as error:
        raise fault("is nested too deeply; must be flatter") from error
    except InputError:
        raise
    except ValueError as error:  # what Python says of a number of thousands of digits
        raise fault("has a number that is too long; must be shorter") from error


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


def numbers(value: Any, where: str, form: str, lengths: tuple[int, ...]) -> list[float]:
    """A list of finite numbers of one of some lengths; `form` says how it should look."""
    if not isinstance(value, list) or len(value) not in lengths:
        raise InputError(f"{where}: must be {form}")
    return [finite(each, f"{where}[{number}]") for number, each in enumerate(value)]


def listed(value: Any, where: str, of: str = "") -> list[Any]:
    """A list; `of` says what it should hold."""
    if not isinstance(value, list):
        raise InputError(f"{where}: must be a list{of}")
    return value


def shown(text: str) -> str:
    """A text as a line can show it."""
    short = text if len(text) <= 80 else f"{text[:77]}..."
    return short if short.isprintable() else ascii(short)
