"""Flies no faster than the wall clock, or so many times as fast."""

from __future__ import annotations

import time
from typing import Final

from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.flight.observer import Observer

_CAUGHT_UP_S: Final = 1.0
_NAP_S: Final = 0.05
"""Waits are cut into pieces of this length, between which Python takes signals."""


class Pace(Observer):
    """Holds a flight back to a speed. One that has fallen behind catches up by a second, and is late for the rest.

    Args:
        speed: simulated seconds a second; 1 is real time.
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._due_s: float | None = None
        self._flown_s = 0.0

    def on_row(self, state: AircraftState, steering: GuidanceOutput, plan_index: int) -> None:
        """Waits until it is time for a row of the track."""
        now = time.monotonic()
        if self._due_s is None:
            self._due_s, self._flown_s = now, state.time_s
        self._due_s = max(self._due_s + (state.time_s - self._flown_s) / self._speed, now - _CAUGHT_UP_S)
        self._flown_s = state.time_s
        while (left_s := self._due_s - time.monotonic()) > 0.0:
            time.sleep(min(left_s, _NAP_S))
