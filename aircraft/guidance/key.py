"""One key of a law's config: its default, what it is, its unit and its bounds."""

from __future__ import annotations

from dataclasses import field
from typing import Any


def key(default: object, doc: str, unit: str | None = None, **bounds: float) -> Any:
    """A field of a frozen dataclass with the metadata that scenario files are checked with.

    A default of None depends on the aircraft; `doc` says what that comes from; a switch has no unit. Bounds are
    `minimum`, `above` and `maximum`.
    """
    return field(default=default, metadata={"doc": doc} | ({"unit": unit} if unit else {}) | bounds)
