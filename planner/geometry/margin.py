"""The distance that a path is planned to keep beyond the clearance."""

from __future__ import annotations

from typing import Final

from planner.interface import Mission

MARGIN_KEY: Final = {
    "doc": "planned distance beyond the clearance; "
    "default: 0.1 of the clearance, at least twice the tracking error",
    "unit": "m",
    "minimum": 0.0,
}
"""What is told of `margin_m` among the keys of a planner."""


def margin_of(mission: Mission) -> float:
    """Planned distance beyond the clearance where none is given (m)."""
    return max(0.1 * mission.clearance_m, 2.0 * mission.tracking_error_m)
