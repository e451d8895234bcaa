"""Observers, which are notified of what happens while a flight is flown."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.flight.record import AcceptedPlan, Track
from harness.mapping.scan import RangeScan

Progress = Callable[[float, float, str], None]
"""Called with simulated time (s), distance to go (m) and a word on the state."""

PROGRESS_EVERY_S = 5.0  # simulated time from one call of `Progress` to the next
NOMINAL = "nominal"  # the `ShieldState` while the shield flies the planner's path


class Caution(str):
    """The text of an event that should not happen, which a recording shows as a warning."""

    __slots__ = ()


class ShieldState(str):
    """The text of an event that tells what the shield flies from then on: nominal, or the backup and why."""

    __slots__ = ()


class Observer(Protocol):
    """Looks on while the loop runs; its own methods do nothing, and nothing that it does reaches the loop."""

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """Is called when a scan was taken."""
        return

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """Is called when a plan takes effect."""
        return

    def on_block(self, block: Track) -> None:
        """Is called with each block of some hundred more rows of the track."""
        return

    def on_event(self, time_s: float, text: str) -> None:
        """Is called with a line for the log; a `Caution` is of what should not happen."""
        return


@runtime_checkable
class RowObserver(Observer, Protocol):
    """Looks on at every row of the track as well, such as a pace that holds the flight back."""

    def on_row(self, state: AircraftState, steering: GuidanceOutput, plan_index: int) -> None:
        """Is called with each row: the true state, the latest steering, and the index of the plan in effect."""
        ...
