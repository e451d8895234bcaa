"""Opens world files without trust: bounded in size, depth and what they unpack to."""

from __future__ import annotations

import codecs
import gc
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from xml.parsers import expat

from harness.files.input_file import InputError, open_regular
from harness.world_files.parts import WorldFileError

MAX_BYTES: Final = 400_000_000
"""Largest file that is read in pieces, or whose numbers take little more room than its bytes."""
MAX_TREE_BYTES: Final = 64_000_000
"""Largest JSON or text file that is read whole: it takes about ten times its size in memory."""
UTF_16: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
"""Byte order marks of UTF-16, which editors on Windows write."""


@contextmanager
def uncollected() -> Iterator[None]:
    """Switches the garbage collector off: it takes most of the time of reading a large file and finds nothing."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def read_bytes(path: Path, most: int = MAX_BYTES, first: int | None = None) -> bytes:
    """The bytes of a regular file.

    Args:
        path: the file.
        most: a larger file is refused.
        first: only so many bytes are read, whatever the size of the file.

    Raises:
        WorldFileError: it cannot be read or is too large.
    """
    try:
        with open_regular(path) as file:
            data: bytes = file.read(most + 1 if first is None else first)
    except InputError as error:
        raise WorldFileError(str(error).removeprefix(f"{path}: ")) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise WorldFileError(f"cannot be read ({reason}); give the path of a file") from error
    if len(data) > most:
        raise WorldFileError(f"is larger than {most // 10**6} MB; cut the area of interest out of it first")
    return data


def check_file(path: Path, most: int = MAX_BYTES) -> None:
    """Raises WorldFileError unless a path is a regular file of at most `most` bytes, before a library opens it."""
    read_bytes(path, first=1)
    if path.stat().st_size > most:
        raise WorldFileError(f"is larger than {most // 10**6} MB; cut the area of interest out of it first")


def text_of(data: bytes) -> str:
    """Bytes as text: UTF-8, UTF-16 with a byte order mark, or Latin-1 as older airspace files are."""
    if data.startswith(UTF_16):
        return data.decode("utf-16", "replace")
    if b"\0" in data:
        raise WorldFileError("is not a text file; give a file of one of the kinds that are known")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def json_of(path: Path, lines: bool = False) -> Any:
    """The content of a JSON file; numbers that are not finite are refused.

    Args:
        path: of the file.
        lines: the file may be a sequence of JSON texts, one a line; a list of them is returned, even of one.

    Raises:
        WorldFileError: it is too large or is not JSON.
    """

    def refuse(word: str) -> float:
        raise WorldFileError(f"has the number {word}; must have finite numbers only")

    try:
        text = text_of(read_bytes(path, MAX_TREE_BYTES))
        first, _, more = text.lstrip().partition("\n")
        if lines and first.rstrip().endswith("}") and more.lstrip().startswith("{"):
            return [json.loads(line, parse_constant=refuse) for line in text.splitlines() if line.strip()]
        whole = json.loads(text, parse_constant=refuse)
        return [whole] if lines else whole
    except (RecursionError, MemoryError) as error:
        raise WorldFileError("is nested too deeply; must be a map") from error
    except ValueError as error:
        if isinstance(error, WorldFileError):
            raise
        line = getattr(error, "lineno", 1)
        raise WorldFileError(f"is not whole JSON (line {line}); it may be torn: get it again") from error


def check_xml(data: bytes) -> None:
    """Raises WorldFileError unless a text is whole XML without entities, a few lines of which unpack to gigabytes."""
    parser = expat.ParserCreate()
    parser.EntityDeclHandler = _no_entities
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise WorldFileError(
            f"is not whole XML (line {error.lineno}); it may be torn: get it again"
        ) from error


def _no_entities(*_: object) -> None:
    raise WorldFileError("declares XML entities; must be plain XML")
