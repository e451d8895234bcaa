"""A flight in the rerun viewer while it is flown."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.flight.observer import Observer
from harness.flight.record import AcceptedPlan
from harness.flight.track_log import TrackLog
from harness.mapping.scan import RangeScan
from harness.watching.relay import Call, Opening, RelayProcess

if TYPE_CHECKING:
    from harness.flight.closed_loop import Loop
    from harness.recording.blueprint import Scene

HAND_OVER_S: Final = 0.1
"""Wall time after which rows, scans and plans are handed over: half of the 0.2 s that `LiveLog` promises."""


class LiveLog(Observer):
    """Sends a flight to a viewer that is running, at least five times a second of wall time; `begin` comes first.

    `url` is the viewer's address, as rerun+http://127.0.0.1:9876/proxy. A viewer that fails does not stop the flight.
    """

    def __init__(self, relay: RelayProcess, url: str) -> None:
        self._relay, self._url = relay, url
        self._calls: list[Call] = []
        self._moving: Callable[[], Any] = tuple
        self._track: TrackLog | None = None
        self._handed_s = 0.0

    def begin(self, loop: Loop, scene: Scene, identity: str) -> None:
        """Shows the world before the flight of a loop, under the identity of a recording."""
        self._moving = lambda: tuple(loop.seen.moving)
        # Rows since the last hand-over: the flight's own blocks come too seldom.
        keep_rows = [lambda rows: self._calls.append(Call("on_block", (rows,)))]
        self._track = TrackLog(loop.world.clearance, keep_rows, ground=loop.world.ground_heights)
        self._relay.begin(Opening(self._url, scene, identity))

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """Keeps a scan until it is handed over."""
        self._calls.append(Call("on_scan", (scan, state), self._moving()))

    def on_plan(self, accepted: AcceptedPlan, state: AircraftState) -> None:
        """Keeps a plan, its picture drawn at once, until it is handed over."""
        picture = accepted.plan.picture
        drawn = None if picture is None else partial(replace, picture())
        shown = replace(accepted, plan=replace(accepted.plan, picture=drawn))
        self._calls.append(Call("on_plan", (shown, state)))

    def on_event(self, time_s: float, text: str) -> None:
        """Keeps an event until it is handed over."""
        self._calls.append(Call("on_event", (time_s, text)))

    def on_row(self, state: AircraftState, steering: GuidanceOutput, plan_index: int) -> None:
        """Adds a row of the track, and hands over what is kept when it is time."""
        assert self._track is not None
        self._track.add(state, steering, plan_index)
        if (now := time.monotonic()) - self._handed_s >= HAND_OVER_S:
            self._handed_s = now
            self._hand_over()

    def close(self, metrics: Mapping[str, Any], run: Mapping[str, Any]) -> None:
        """Shows the content of `metrics.json` and the typed figures of the run."""
        self._hand_over()
        self._calls.append(Call("close", (dict(metrics), dict(run))))
        self._hand_over()

    def _hand_over(self) -> None:
        if self._track is not None:
            self._track.flush_rows()
        if self._calls:
            self._relay.hand_over(self._calls)
            self._calls = []
