"""Keeps measurements of models in the user's cache folder; whatever is wrong there is measured anew."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

MAX_BYTES = 10_000_000  # no more than this is read of a cache file; a sound one has a few thousand bytes
Card = TypeVar("Card")


def cache_folder() -> Path:
    """`$XDG_CACHE_HOME/wayproof`, by default `~/.cache/wayproof` (XDG Base Directory Specification)."""
    home = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(home) if Path(home).is_absolute() else Path("~/.cache").expanduser()) / "wayproof"


def cached(
    title: str, digest: str, measure: Callable[[], dict[str, Any]], read: Callable[[dict[str, Any]], Card]
) -> Card:
    """Returns what `read` makes of a measurement's result, taken from the cache or else measured now.

    Both ways give the same values: JSON keeps every bit of a float. A cache that cannot be read or written, or whose
    numbers are not those that were measured (its SHA-256 tells), costs time and nothing else. The title is for the
    file's name, the digest of all that the result depends on.
    """
    file = _cache_file(title, digest)
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        with file.open("rb") as opened:
            stored = json.loads(opened.read(MAX_BYTES))
        if stored["digest"] == digest and stored["sha256"] == _sha256(stored["result"]):
            return read(stored["result"])
    result: dict[str, Any] = json.loads(json.dumps(measure()))
    with suppress(OSError):
        _write(file, json.dumps({"digest": digest, "sha256": _sha256(result), "result": result}, indent=1))
    return read(result)


def _sha256(result: dict[str, Any]) -> str:
    """SHA-256 of a result, which shows whether a number of it was edited."""
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()


def is_cached(title: str, digest: str) -> bool:
    """Tells whether the cache has a file for a measurement, which `cached` takes if it is sound."""
    return _cache_file(title, digest).is_file()


def _cache_file(title: str, digest: str) -> Path:
    return cache_folder() / f"{title}-{digest[:16]}.json"


def _write(file: Path, text: str) -> None:
    """Writes a file whole or not at all, so that processes that measure at the same time do not disturb each other."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=file.parent) as folder:
        new = Path(folder) / file.name
        new.write_text(text, "utf-8")
        os.replace(new, file)
