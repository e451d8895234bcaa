"""One key of a planner's config: its default, what it is, its unit and its bounds."""

from __future__ import annotations

from dataclasses import field
from typing import Any


def key(default: object, doc: str, unit: str = "1", **bounds: float) -> Any:
    """A field of a frozen dataclass with the metadata of `PlannerKind.config`; bounds: minimum, maximum, above."""
    told = {"doc": doc} if isinstance(default, str) else {"doc": doc, "unit": unit}
    return field(default=default, metadata={**told, **bounds})


def margin_key() -> Any:
    """The key `margin_m`, which most planners have."""
    told = "planned distance beyond the clearance; default: 0.1 of the clearance, at least twice the tracking error"
    return key(None, told, "m", minimum=0.0)
