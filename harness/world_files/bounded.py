"""Opens world files without trust: bounded in size, depth and what they unpack to."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from harness.files.input_file import InputError, parsed_json, read_data

MAX_BYTES: Final = 400_000_000  # limit for a file that is read in pieces or takes little more memory
MAX_TREE_BYTES: Final = 64_000_000  # limit for JSON or text, which takes about ten times its size in memory


def read_bytes(path: Path, most: int = MAX_BYTES, first: int | None = None) -> bytes:
    """Reads a regular file of at most `most` bytes, or only its first `first` bytes."""
    try:
        return read_data(path, most, "smaller: cut the area of interest out of it", first)
    except InputError as error:
        raise InputError(str(error).removeprefix(f"{path}: ")) from error


def text_of(data: bytes) -> str:
    """Decodes bytes as UTF-8, or else as Latin-1; raises InputError where they hold a zero byte."""
    if b"\0" in data:
        raise InputError("is not a text file; must be one, as UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def json_of(path: Path) -> Any:
    """Parses a JSON file, in which a key may come only once in a mapping."""
    return parsed_json(text_of(read_bytes(path, MAX_TREE_BYTES)), "")
