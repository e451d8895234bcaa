"""Reads a file that somebody gives, without trust: it may be a pipe, a device, huge, or no text at all."""

from __future__ import annotations

import codecs
import json
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO, Final

MAX_JSON_BYTES: Final = 16_000_000


class InputError(ValueError):
    """Input that cannot be used. Its text is what a person reads: one line a fault."""


_KINDS: Final = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def read_text(path: Path, max_bytes: int, what: str, utf_16: bool = False) -> str:
    """The text of a regular file, without a byte order mark.

    `what` says what the file should be, for faults: "a scenario, in YAML". With `utf_16`, UTF-16 that says so is taken,
    too: Windows' editors write it.

    Raises:
        InputError: it cannot be opened, is not a regular file, is larger than `max_bytes` or is not UTF-8 text.
    """
    return decoded(read_data(path, max_bytes, what), str(path), what, utf_16)


def read_data(path: Path, max_bytes: int, what: str) -> bytes:
    """The bytes of a regular file; arguments and faults are those of `read_text`."""
    try:
        with open_regular(path) as file:
            data: bytes = file.read(max_bytes + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        if isinstance(error, FileNotFoundError):
            raise InputError(f"{path}: no such file; give the path of a file") from error
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"{path}: cannot be read ({reason}); give the path of a file") from error
    if len(data) > max_bytes:
        raise InputError(f"{path}: is larger than {max_bytes // 10**6} MB; must be {what}")
    return data


def decoded(data: bytes, source: str, what: str, utf_16: bool = False) -> str:
    """The text that the bytes of a file are; arguments and faults are those of `read_text`."""
    if utf_16 and data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        data = data.decode("utf-16", "replace").encode()
    if b"\0" in data:
        raise InputError(f"{source}: is not a text file; must be {what}, as UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{source}:{line}: byte 0x{data[error.start]:02x} is not UTF-8; save the file as UTF-8"
        ) from error


def open_regular(path: Path) -> BinaryIO:
    """Opens a regular file for reading, without ever waiting for who writes a pipe.

    Raises:
        InputError: it is not a regular file.
        OSError: it cannot be opened.
    """
    file: BinaryIO = open(path, "rb", opener=_at_once)  # noqa: SIM115 - handed on
    kind = stat.S_IFMT(os.fstat(file.fileno()).st_mode)
    if kind != stat.S_IFREG:
        file.close()
        shown = _KINDS.get(kind, "something else")
        raise InputError(f"{path}: is {shown}, not a file; give the path of a file")
    return file


def read_index(path: Path, schema: str, max_bytes: int = MAX_JSON_BYTES) -> dict[str, Any] | None:
    """A JSON file that one of our folders has, by its key `schema`; None where there is none, or something else."""
    try:
        index = json.loads(read_text(path, max_bytes, "an index, in JSON"))
    except (ValueError, RecursionError):
        return None
    return index if isinstance(index, dict) and index.get("schema") == schema else None


def _at_once(path: str, flags: int) -> int:
    """Opens a file; opening a pipe that nobody writes to would wait for ever."""
    return os.open(path, flags | os.O_NONBLOCK)
