"""What may look on while a flight is flown."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from aircraft.interface import AircraftState
from harness.flight.record import AcceptedPlan, Track
from harness.mapping.scan import RangeScan

Progress = Callable[[float, float, str], None]
"""Called with simulated time (s), distance to go (m) and a word on the state."""

PROGRESS_EVERY_S = 5.0
"""Simulated time from one call of `Progress` to the next."""


class Observer(Protocol):
    """What may look on while the loop runs. Nothing that it does reaches the loop."""

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """A scan was taken."""
        ...

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """A plan takes effect."""
        ...

    def on_block(self, block: Track) -> None:
        """Some hundred more rows of the track."""
        ...

    def on_event(self, time_s: float, text: str) -> None:
        """Something worth a line in the log."""
        ...
