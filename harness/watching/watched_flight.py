"""Flies a scenario into a run folder while a viewer follows, no faster than a given speed."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.flight.closed_loop import Loop
from harness.flight.observer import Observer, Progress
from harness.recording.properties import run_properties
from harness.run.scenario_flight import fly_to_folder, make_loop, scene_of
from harness.scenario.scenario import Scenario, dump_scenario
from harness.watching.live import LiveLog
from harness.watching.relay import END_TIMEOUT_S, RelayProcess

_MOST_BEHIND_S, _NAP_S = 1.0, 0.05
"""A late flight catches up at most this much; waits are cut into naps, between which Python takes signals."""


class Pace(Observer):
    """Holds a flight back to a speed (simulated over wall time). A late one catches up by at most a second."""

    def __init__(self, speed: float) -> None:
        self._speed, self._flown_s = speed, 0.0
        self._due_s: float | None = None

    def on_row(self, state: AircraftState, steering: GuidanceOutput, plan_index: int) -> None:
        """Waits until it is time for a row of the track."""
        now = time.monotonic()
        if self._due_s is None:
            self._due_s, self._flown_s = now, state.time_s
        self._due_s = max(self._due_s + (state.time_s - self._flown_s) / self._speed, now - _MOST_BEHIND_S)
        self._flown_s = state.time_s
        while (left_s := self._due_s - time.monotonic()) > 0.0:
            time.sleep(min(left_s, _NAP_S))


@dataclass(frozen=True)
class Viewing:
    """How a flight is shown while it is flown."""

    viewer: str  # address of a rerun viewer that is running, as rerun+http://127.0.0.1:9876/proxy
    speed: float | None = None  # simulated seconds a second that are not exceeded; None: as fast as it goes
    viewer_gone: Callable[[], None] = lambda: None  # called if the viewer goes away before the end


def fly_watched(
    scenario: Scenario, out: Path, recording: bool, progress: Progress | None, viewing: Viewing
) -> dict[str, Any]:
    """Flies as `fly_to_folder` does, with the same result and errors, and shows the flight meanwhile."""
    relay = RelayProcess(viewing.viewer_gone)
    live = LiveLog(relay, viewing.viewer)

    def make(scenario: Scenario) -> Loop:
        loop = make_loop(scenario)
        scene = scene_of(scenario, loop, dump_scenario(scenario))
        live.begin(loop, scene, f"{scene.name}, live")
        return loop

    paced = [] if viewing.speed is None else [Pace(viewing.speed)]
    figures: dict[str, Any] = {}
    try:
        figures = fly_to_folder(scenario, out, recording, progress, make=make, watching=[live, *paced])
        live.close(figures, run_properties(scenario, figures))
    finally:
        with suppress(KeyboardInterrupt):  # once the flight is over, Ctrl-C ends the viewer alone
            relay.end(END_TIMEOUT_S if figures else 0.0)
    return figures
