"""What an agent observes: the last scan that has become available, and the aircraft's own state as it believes it."""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from aircraft.interface import AircraftState
from harness.flight.observer import Observer
from harness.mapping.scan import RangeScan
from planner.interface import Mission

Floats = NDArray[np.float32]

STATE: Final = (
    "goal distance over the diagonal of the area",
    "cosine of the goal's bearing from the course",
    "sine of it, positive to the right",
    "east over the width of the area, from its western bound",
    "north over the height of the area, from its southern bound",
    "cosine of the course",
    "sine of the course",
    "bank over the bank limit, positive to the right",
    "ground speed over twice the airspeed of the mission",
)
"""What each number of `state` is."""
LEAST: Final = np.array([0, -1, -1, 0, 0, -1, -1, -1, 0], dtype=np.float32)
MOST: Final = np.ones(len(STATE), dtype=np.float32)


class ScanKeeper(Observer):
    """An observer of the loop that keeps the last scan which has become available."""

    def __init__(self) -> None:
        self._coming: deque[RangeScan] = deque()
        self._last: RangeScan | None = None

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """Keeps a scan."""
        self._coming.append(scan)

    def forget(self) -> None:
        """Begins anew, for the next flight."""
        self._coming.clear()
        self._last = None

    def ranges(self, time_s: float, beams: int) -> Floats:
        """(beams,) the nearest return of neighbouring beams over the sensing range, clockwise; 1: there was none.

        Args:
            time_s: now.
            beams: how many there are; each is the least of as many rays as go into one.
        """
        while self._coming and self._coming[0].available_s <= time_s + 1e-9:
            self._last = self._coming.popleft()
        if self._last is None:
            return np.ones(beams, dtype=np.float32)
        shares = np.minimum(self._last.ranges_m / self._last.max_range_m, 1.0)
        first = np.arange(beams) * len(shares) // beams
        return np.clip(np.minimum.reduceat(shares, first), 0.0, 1.0).astype(np.float32)


def state_of(state: AircraftState, mission: Mission, bank_limit_rad: float) -> Floats:
    """The numbers of `STATE`.

    Args:
        state: what the aircraft believes.
        mission: goal, bounds and airspeed.
        bank_limit_rad: of the aircraft.
    """
    xmin, ymin, xmax, ymax = mission.bounds_m
    east, north = mission.goal_m[0] - state.east_m, mission.goal_m[1] - state.north_m
    bearing = math.atan2(east, north) - state.course_rad
    values = (
        math.hypot(east, north) / math.hypot(xmax - xmin, ymax - ymin),
        math.cos(bearing),
        math.sin(bearing),
        (state.east_m - xmin) / (xmax - xmin),
        (state.north_m - ymin) / (ymax - ymin),
        math.cos(state.course_rad),
        math.sin(state.course_rad),
        state.roll_rad / bank_limit_rad,
        state.groundspeed_mps / (2.0 * mission.speed_mps),
    )
    return np.clip(np.array(values, dtype=np.float32), LEAST, MOST)
