"""What has been measured of a model, kept in the user's cache folder; whatever is wrong there is made anew."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any


def cache_folder() -> Path:
    """`$XDG_CACHE_HOME/wayproof`, by default `~/.cache/wayproof` (XDG Base Directory Specification)."""
    home = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(home) if Path(home).is_absolute() else Path("~/.cache").expanduser()
    return base / "wayproof"


def cached(title: str, digest: str, measure: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The result of a measurement, from the cache if it is there.

    Both ways give the same values: JSON keeps every bit of a float. A cache that cannot be read or written
    costs time and nothing else.

    Args:
        title: what was measured of what, for the file's name.
        digest: of everything that the result depends on.
        measure: measures; its result consists of what JSON has.
    """
    file = cache_folder() / f"{title}-{digest[:16]}.json"
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        kept = json.loads(file.read_text("utf-8"))
        if kept["digest"] == digest and isinstance(kept["result"], dict):
            return dict(kept["result"])
    result: dict[str, Any] = json.loads(json.dumps(measure()))
    with suppress(OSError):
        _write(file, json.dumps({"digest": digest, "result": result}, indent=1))
    return result


def _write(file: Path, text: str) -> None:
    """All or nothing, so that processes which measure at the same time do not disturb each other."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=file.parent) as folder:
        new = Path(folder) / file.name
        new.write_text(text, "utf-8")
        os.replace(new, file)
