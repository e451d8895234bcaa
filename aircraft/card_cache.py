"""What has been measured of a model, kept in the user's cache folder; whatever is wrong there is made anew."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

MAX_BYTES = 10_000_000
"""A cache file has a few thousand bytes; of one that has more no more than this is read."""
Card = TypeVar("Card")


def cache_folder() -> Path:
    """`$XDG_CACHE_HOME/wayproof`, by default `~/.cache/wayproof` (XDG Base Directory Specification)."""
    home = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(home) if Path(home).is_absolute() else Path("~/.cache").expanduser()
    return base / "wayproof"


def cached(
    title: str, digest: str, measure: Callable[[], dict[str, Any]], read: Callable[[dict[str, Any]], Card]
) -> Card:
    """What is read from the result of a measurement, which comes from the cache if it is there.

    Both ways give the same values: JSON keeps every bit of a float. A cache that cannot be read or written, or whose
    numbers are not those that were measured (its SHA-256 tells), costs time and nothing else. The title is for the
    file's name, the digest of all that the result depends on.
    """
    file = _file(title, digest)
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        with file.open("rb") as opened:
            kept = json.loads(opened.read(MAX_BYTES))
        if kept["digest"] == digest and kept["sha256"] == _sha256(kept["result"]):
            return read(kept["result"])
    result: dict[str, Any] = json.loads(json.dumps(measure()))
    with suppress(OSError):
        _write(file, json.dumps({"digest": digest, "sha256": _sha256(result), "result": result}, indent=1))
    return read(result)


def _sha256(result: dict[str, Any]) -> str:
    """Of what was measured, so that no number of it is edited unseen."""
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()


def is_kept(title: str, digest: str) -> bool:
    """Whether the cache has something of a measurement, which `cached` then takes if it is sound."""
    return _file(title, digest).is_file()


def _file(title: str, digest: str) -> Path:
    return cache_folder() / f"{title}-{digest[:16]}.json"


def _write(file: Path, text: str) -> None:
    """All or nothing, so that processes which measure at the same time do not disturb each other."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=file.parent) as folder:
        new = Path(folder) / file.name
        new.write_text(text, "utf-8")
        os.replace(new, file)
