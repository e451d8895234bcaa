"""What looks on at every row of the track, and at whatever else it likes."""

from __future__ import annotations

from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.flight.record import AcceptedPlan, Track
from harness.mapping.scan import RangeScan


class Onlooker:
    """An observer of the loop that sees nothing; what is built on it sees what it overrides."""

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """A scan was taken."""

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """A plan takes effect."""

    def on_block(self, block: Track) -> None:
        """Some hundred more rows of the track."""

    def on_event(self, time_s: float, text: str) -> None:
        """Something worth a line in the log."""

    def on_row(self, state: AircraftState, steering: GuidanceOutput, plan_index: int) -> None:
        """One more row of the track."""
