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
from harness.watching.relay import RelayProcess


@dataclass(frozen=True)
class Onlookers:
    """Who looks on.

    Attributes:
        viewer: address of a rerun viewer that is running, as rerun+http://127.0.0.1:9876/proxy.
        speed: simulated seconds a second that are not exceeded; None: as fast as it goes.
        viewer_gone: is told if the viewer goes away before the end.
    """

    viewer: str
    speed: float | None = None
    viewer_gone: Callable[[], None] = lambda: None


def fly_watched(
    scenario: Scenario, out: Path, recording: bool, progress: Progress | None, onlookers: Onlookers
) -> dict[str, Any]:
    """The same as `fly_to_folder`, and with the same result and errors, whoever looks on."""
    observers: list[Observer] = [] if onlookers.speed is None else [Pace(onlookers.speed)]
    with ExitStack() as stack:
        relay = RelayProcess(onlookers.viewer_gone)
        stack.callback(relay.end)
        live = LiveLog(relay, onlookers.viewer)

        def make(scenario: Scenario) -> Loop:
            loop = make_loop(scenario)
            scene = scene_of(scenario, loop, dump_scenario(scenario))
            live.begin(loop, scene, f"{scene.name}, live")
            return loop

        figures = fly_to_folder(scenario, out, recording, progress, make=make, watching=[live, *observers])
        live.close(figures, run_properties(scenario, figures))
    return figures
