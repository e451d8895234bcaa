"""Flies a scenario into a run folder while a viewer follows, no faster than a given speed."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.flight.closed_loop import Loop
from harness.flight.observer import Observer, Progress
from harness.recording.properties import run_properties
from harness.run.scenario_flight import fly_to_folder, make_loop, scene_of
from harness.scenario.scenario import Scenario, dump_scenario
from harness.watching.live import LiveLog
from harness.watching.pace import Pace
from harness.watching.relay_process import RelayProcess


@dataclass(frozen=True)
class Onlookers:
    """Who looks on.

    Attributes:
        viewer: address of a rerun viewer that is running, as rerun+http://127.0.0.1:9876/proxy.
        speed: simulated seconds a second that are not exceeded; None: as fast as it goes.
        viewer_gone: is told if the viewer goes away before the end.
    """

    viewer: str | None = None
    speed: float | None = None
    viewer_gone: Callable[[], None] = lambda: None


def fly_watched(
    scenario: Scenario,
    out: Path,
    recording: bool,
    progress: Progress | None = None,
    onlookers: Onlookers | None = None,
) -> dict[str, Any]:
    """The same as `fly_to_folder`, and with the same result, whoever looks on.

    Args:
        scenario: a complete scenario.
        out: the run folder, made or written anew.
        recording: whether to write `flight.rrd`.
        progress: told of the flight as it goes on.
        onlookers: who looks on.

    Raises:
        AircraftError: the aircraft cannot be loaded or trimmed; nothing is written.
        RunFolderError: the folder holds something else or cannot be written.
        WriteError: it could not be written to the end, a full disk perhaps.
    """
    asked = onlookers or Onlookers()
    observers: list[Observer] = []
    with ExitStack() as stack:
        live = None
        if asked.viewer:
            relay = RelayProcess(asked.viewer_gone)
            stack.callback(relay.end)
            live = LiveLog(relay, asked.viewer)
            observers.append(live)
        if asked.speed is not None:
            observers.append(Pace(asked.speed))

        def make(scenario: Scenario) -> Loop:
            loop = make_loop(scenario)
            if live is not None:
                scene = scene_of(scenario, loop, dump_scenario(scenario))
                live.begin(loop, scene, f"{scene.name}, live")
            return loop

        figures = fly_to_folder(scenario, out, recording, progress, make=make, watching=observers)
        if live is not None:
            live.close(figures, run_properties(scenario, figures))
    return figures
