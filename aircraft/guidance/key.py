"""One key of a law's config: its default, what it is, its unit and its bounds."""

from __future__ import annotations

from dataclasses import field
from typing import Any


def key(
    default: object,
    doc: str,
    unit: str | None = None,
    *,
    minimum: float | None = None,
    above: float | None = None,
    maximum: float | None = None,
) -> Any:
    """A field of a frozen dataclass with the metadata that scenario files are checked with.

    A default of None depends on the aircraft; `doc` says what that comes from; a switch has no unit.
    """
    metadata = {"doc": doc, "unit": unit, "minimum": minimum, "above": above, "maximum": maximum}
    return field(
        default=default, metadata={name: value for name, value in metadata.items() if value is not None}
    )
