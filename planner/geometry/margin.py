"""The distance that a path is planned to keep beyond the clearance."""

from __future__ import annotations

from planner.interface import Mission

TOLERATED_SHARE, TOLERATED_ERRORS = 0.1, 2.0


def tolerance_m(clearance_m: float, tracking_error_m: float) -> float:
    """How far a flight may be off its path: a tenth of the clearance, or twice the tracking error where that is more.

    Planners keep as much beyond the clearance, and the verdict allows as much, where neither is given (m).

    Args:
        clearance_m: wanted from every obstacle.
        tracking_error_m: that the aircraft showed in tight turns.
    """
    return max(TOLERATED_SHARE * clearance_m, TOLERATED_ERRORS * tracking_error_m)


def margin_of(mission: Mission) -> float:
    """Planned distance beyond the clearance where none is given (m)."""
    return tolerance_m(mission.clearance_m, mission.tracking_error_m)
