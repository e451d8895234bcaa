"""Flies a scenario into a run folder while others look on: a viewer, a ground station, the clock."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from aircraft.frames import LocalPlane
from harness.flight.closed_loop import Loop
from harness.flight.observer import Observer, Progress
from harness.recording.properties import run_properties
from harness.run.scenario_flight import fly_to_folder, make_loop, scene_of
from harness.scenario.scenario import Scenario, dump_scenario
from harness.watching.address import Address
from harness.watching.live import LiveLog
from harness.watching.mavlink import EarthPosition, GroundStationLink
from harness.watching.pace import Pace
from harness.watching.relay_process import RelayProcess


@dataclass(frozen=True)
class Onlookers:
    """Who looks on.

    Attributes:
        viewer: address of a rerun viewer that is running, as rerun+http://127.0.0.1:9876/proxy.
        ground_station: where one listens for MAVLink.
        speed: simulated seconds a second that are not exceeded; None: as fast as it goes.
        viewer_gone: is told if the viewer goes away before the end.
    """

    viewer: str | None = None
    ground_station: Address | None = None
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
        InputError: pymavlink is needed and not installed, or nothing can be sent to the ground station.
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
        link = GroundStationLink(asked.ground_station) if asked.ground_station else None
        if link is not None:
            observers.append(link)
            stack.callback(link.close)
        if asked.speed is not None:
            observers.append(Pace(asked.speed))

        def make(scenario: Scenario) -> Loop:
            loop = make_loop(scenario)
            if link is not None:
                link.begin(_place(scenario, loop), lambda: loop.navigator.has_fix)
            if live is not None:
                scene = scene_of(scenario, loop, dump_scenario(scenario))
                live.begin(loop, scene, f"{scene.name}, live")
            return loop

        figures = fly_to_folder(scenario, out, recording, progress, make=make, watching=observers)
        if live is not None:
            live.close(figures, run_properties(scenario, figures))
    return figures


def _place(scenario: Scenario, loop: Loop) -> EarthPosition:
    """Where a flight is on earth; its ground is mean sea level where it is not known."""
    origin, heights = scenario.area.origin, loop.world.ground_heights
    east, north = scenario.mission.start_m
    ground_m = math.nan if heights is None else float(heights(np.array([east]), np.array([north]))[0])
    plane = LocalPlane(origin.latitude_deg, origin.longitude_deg)
    return EarthPosition(plane, (east, north), ground_m if math.isfinite(ground_m) else 0.0)
