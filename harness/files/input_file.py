"""Reads a file that somebody gives, without trust: it may be a pipe, a device, huge, or no text at all."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO, Final

MAX_JSON_BYTES: Final = 16_000_000


class InputError(ValueError):
    """Input that cannot be used. Its text is what a person reads: one line a fault."""


_KINDS: Final = {
    **{stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"},
    **{stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"},
}


def read_text(path: Path, max_bytes: int, what: str) -> str:
    """The text of a regular file, UTF-8 without a byte order mark.

    An InputError says why it cannot be read, that it is larger than `max_bytes`, or no text. `what` says there what the
    file should be: "a scenario, in YAML".
    """
    return decoded(read_data(path, max_bytes, what), str(path), what)


def read_data(path: Path, max_bytes: int, what: str) -> bytes:
    """The bytes of a regular file; arguments and faults are those of `read_text`."""
    try:
        with open_regular(path) as file:
            data: bytes = file.read(max_bytes + 1)
    except InputError:
        raise
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file; give the path of a file") from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"{path}: cannot be read ({reason}); give the path of a file") from error
    if len(data) > max_bytes:
        raise InputError(f"{path}: is larger than {max_bytes // 10**6} MB; must be {what}")
    return data


def decoded(data: bytes, source: str, what: str) -> str:
    """The text that the bytes of a file are; arguments and faults are those of `read_text`."""
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
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    kind = stat.S_IFMT(os.fstat(descriptor).st_mode)
    if kind != stat.S_IFREG:
        os.close(descriptor)
        told = f"is {_KINDS.get(kind, 'something else')}, not a file; give the path of a file"
        raise InputError(f"{path}: {told}")
    return os.fdopen(descriptor, "rb")


def read_index(path: Path, schema: str, max_bytes: int = MAX_JSON_BYTES) -> dict[str, Any] | None:
    """A JSON file that one of our folders has, by its key `schema`; None where there is none, or something else."""
    try:
        index = json.loads(read_text(path, max_bytes, "an index, in JSON"))
    except (ValueError, RecursionError):
        return None
    return index if isinstance(index, dict) and index.get("schema") == schema else None
