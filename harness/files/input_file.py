"""Reads files that somebody gives, and values in them, without trust: it may be a pipe, huge, or no text."""

from __future__ import annotations

import json
import math
import os
import re
import stat
from pathlib import Path
from typing import Any, Final, NoReturn

MAX_JSON_BYTES: Final = 16_000_000  # a larger JSON file is refused
_JSON_TOKEN: Final = re.compile(r'("(?:[^"\\]|\\.)*")\s*:|"(?:[^"\\]|\\.)*"|[{}]|NaN|-?Infinity')


class InputError(ValueError):
    """Input that cannot be used. Its text is what a person reads: one line a fault."""


def read_text(path: Path, max_bytes: int, what: str) -> str:
    """Reads a regular file as UTF-8; an InputError says why it cannot be read, and `what` the file should be."""
    return decoded(read_data(path, max_bytes, what), str(path), what)


def read_data(path: Path, max_bytes: int, what: str, first: int | None = None) -> bytes:
    """Reads the bytes of a regular file, or only its first ones; arguments and faults are those of `read_text`."""
    try:
        # Opened so, a pipe is not waited for.
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise InputError(f"{path}: is a pipe or a device, not a file; give the path of a file")
            if path.stat().st_size > max_bytes:
                raise InputError(f"{path}: is larger than {max_bytes // 10**6} MB; must be {what}")
            return file.read(max_bytes if first is None else first)
    except InputError:
        raise
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file; give the path of a file") from error
    except IsADirectoryError as error:
        raise InputError(f"{path}: is a folder, not a file; give the path of a file") from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"{path}: cannot be read ({reason}); give the path of a file") from error


def decoded(data: bytes, source: str, what: str) -> str:
    """Decodes the bytes of a file as UTF-8; arguments and faults are those of `read_text`."""
    if b"\0" in data:
        found = "UTF-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "not a text file"
        raise InputError(f"{source}: is {found}; must be {what}, as UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        found = f"{source}:{line}: byte 0x{data[error.start]:02x} is not UTF-8; save the file as UTF-8"
        raise InputError(found) from error


def read_index(path: Path, schema: str, max_bytes: int = MAX_JSON_BYTES) -> dict[str, Any] | None:
    """Reads the JSON index of one of our folders, which has the key `schema`; None where there is no such index."""
    try:
        index = json.loads(read_text(path, max_bytes, "an index, in JSON"))
    except (ValueError, RecursionError):
        return None
    return index if isinstance(index, dict) and index.get("schema") == schema else None


def parsed_json(text: str, source: str) -> Any:
    """Parses JSON; a key may come only once in a mapping. `source`, or nothing, begins an InputError."""

    def fault(sentence: str, line: int | None = None) -> InputError:
        where = source if line is None else f"{source}:{line}" if source else f"line {line}"
        return InputError(f"{where}: {sentence}" if where else sentence)

    def refuse(name: str) -> NoReturn:
        begin = next(token.start() for token in _JSON_TOKEN.finditer(text) if token[0] == name)
        raise fault(f"has the number {name}; must be finite", text.count("\n", 0, begin) + 1)

    def single(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(found := dict(pairs)) < len(pairs):
            key, line, first = _key_twice(text)
            raise fault(f"has the key {shown(key)!r} twice in one place, first in line {first}; keep one", line)
        return found

    try:
        return json.loads(text, parse_constant=refuse, object_pairs_hook=single)
    except json.JSONDecodeError as error:
        raise fault(f"is not whole JSON ({error.msg}); it may be torn", error.lineno) from error
    except (RecursionError, MemoryError) as error:
        raise fault("is nested too deeply; must be flatter") from error
    except InputError:
        raise
    except ValueError as error:  # what Python says of a number of thousands of digits
        raise fault("has a number that is too long; must be shorter") from error


def _key_twice(text: str) -> tuple[str, int, int]:
    """Returns the first key of a JSON that comes again in its mapping, its line, and that where it came first."""
    opened: list[dict[str, int]] = []
    for token in _JSON_TOKEN.finditer(text):
        if token[0] == "{":
            opened.append({})
        elif token[0] == "}":
            opened.pop()
        elif token[1]:
            key, at = json.loads(token[1]), token.start()
            if key in opened[-1]:
                return key, *(text.count("\n", 0, each) + 1 for each in (at, opened[-1][key]))
            opened[-1][key] = at
    raise AssertionError("no key comes twice")


def finite(value: Any, where: str, text: bool = False) -> float:
    """Returns a finite number of JSON, or as `text` from other files; an InputError on anything else, true too."""
    is_text = isinstance(value, str)
    fits = is_text and value.strip().isascii() and "_" not in value if text else type(value) in (int, float)
    try:
        number = float(value) if fits else math.nan
    except (ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        found = "missing, or null" if value is None else repr(shown(str(value)))
        quoted = " without quotes" if is_text and not text else ""
        raise InputError(f"{where}: is {found}; must be a finite number{quoted}")
    return number


def whole(value: Any, where: str, text: bool = False) -> int:
    """Returns a whole number, as `finite` does."""
    number = finite(value, where, text)
    if number != int(number):
        raise InputError(f"{where}: is {number:g}; must be a whole number")
    return int(number)


def numbers(value: Any, where: str, form: str, lengths: tuple[int, ...]) -> list[float]:
    """Returns a list of finite numbers, of one of the `lengths`; `form` tells in an InputError how it should look."""
    if not isinstance(value, list) or len(value) not in lengths:
        raise InputError(f"{where}: must be {form}")
    return [finite(each, f"{where}[{number}]") for number, each in enumerate(value)]


def listed(value: Any, where: str, of: str = "") -> list[Any]:
    """Returns the value if it is a list; `of` tells in an InputError what it should hold."""
    if not isinstance(value, list):
        raise InputError(f"{where}: must be a list{of}")
    return value


def shown(text: str) -> str:
    """Shortens a text and escapes it, so that a line can show it."""
    short = text if len(text) <= 80 else f"{text[:77]}..."
    return short if short.isprintable() else ascii(short)
