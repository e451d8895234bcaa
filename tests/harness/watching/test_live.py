"""A viewer that follows a flight: rerun's own server stands in for it."""

import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from subprocess import DEVNULL, PIPE
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from harness.analysis.metrics import metrics
from harness.flight.closed_loop import fly
from harness.flight.observer import Observer
from harness.recording.log import RerunLog
from harness.recording.viewer import free_port
from harness.run.scenario_flight import flight_limits, fly_to_folder, make_loop, scene_of
from harness.watching import live
from harness.watching.live import LiveLog
from harness.watching.relay import END_TIMEOUT_S, Call, Opening, RelayProcess
from harness.watching.watched_flight import Viewing, fly_watched
from tests.closed_loop.small import small_world as world
from tests.point_mass import PointMass
from tests.refusals import refused
from wayproof import AircraftState, GuidanceOutput

SERVER = """
import sys, time
import rerun as rr
rec = rr.RecordingStream("server")
rec.set_sinks(rr.GrpcServerSink("127.0.0.1", int(sys.argv[1])))
print("up", flush=True)
sys.stdin.read()
"""
TREE = {"circle": {"center_m": [1500.0, 1600.0], "radius_m": 200.0}}
NEAR: dict[str, Any] = {"mission": {"goal_m": [2700.0, 2700.0]}}


@pytest.fixture
def server() -> Iterator[tuple[subprocess.Popen[str], str]]:
    port = free_port()
    command = [sys.executable, "-c", SERVER, str(port)]
    with subprocess.Popen(command, stdin=PIPE, stdout=PIPE, stderr=DEVNULL, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "up\n"
        yield process, f"127.0.0.1:{port}"
        process.kill()


class KillsAt(Observer):
    """Ends the viewer in mid-flight, and gives the news the time to arrive."""

    def __init__(self, process: subprocess.Popen[str], at_s: float) -> None:
        self._process, self._at_s = process, at_s

    def on_row(self, state: AircraftState, steering: GuidanceOutput, plan_index: int) -> None:
        if state.time_s >= self._at_s and self._process.poll() is None:
            self._process.kill()
            self._process.wait()
            time.sleep(0.5)


@pytest.mark.flights
def test_the_flight_is_the_same_whether_a_viewer_follows_or_is_killed(
    server: tuple[subprocess.Popen[str], str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    process, address = server
    scenario = world(TREE, **NEAR)
    alone = fly_to_folder(scenario, tmp_path / "alone", recording=False)
    told: list[str] = []
    asked = Viewing(f"rerun+http://{address}/proxy", viewer_gone=lambda: told.append("gone"))
    assert fly_watched(scenario, tmp_path / "followed", True, None, asked)["digest"] == alone["digest"]
    assert (tmp_path / "followed" / "flight.rrd").stat().st_size > 10_000
    assert told == []
    monkeypatch.setattr("harness.watching.watched_flight.Pace", lambda speed: KillsAt(process, 20.0))
    killed = fly_watched(scenario, tmp_path / "killed", True, None, Viewing(asked.viewer, 1.0, asked.viewer_gone))
    assert process.poll() is not None
    assert killed["digest"] == alone["digest"]
    assert (tmp_path / "killed" / "metrics.json").is_file()
    assert told == ["gone"]
    monkeypatch.setattr(RelayProcess, "end", lambda *_: signal.raise_signal(signal.SIGINT))
    assert fly_watched(scenario, tmp_path / "after", False, None, asked)["digest"] == alone["digest"]


def test_an_interrupted_flight_does_not_wait_for_its_viewer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.watching.relay.START_TIMEOUT_S", 0.1)
    told: list[str] = []
    relay = RelayProcess(lambda: told.append("gone"))
    relay.begin(Opening("rerun+http://127.0.0.1:1/proxy", None, "nobody there"))
    begun_s = time.monotonic()
    relay.end(0.0)
    assert time.monotonic() - begun_s < 0.5 * END_TIMEOUT_S
    assert told == []


class Kept(RelayProcess):
    """Takes what is handed over, and how often."""

    given_up = False

    def __init__(self) -> None:
        self.opening: Opening | None = None
        self.handed: list[list[Call]] = []

    def begin(self, opening: Opening) -> None:
        self.opening = pickle.loads(pickle.dumps(opening))

    def hand_over(self, calls: Sequence[Call]) -> None:
        self.handed.append(pickle.loads(pickle.dumps(list(calls))))


@pytest.mark.flights
def test_what_is_handed_over_is_the_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The calls, made on a file here: every row of the track and every plan is in it, as soon as it was flown."""
    monkeypatch.setattr(live, "HAND_OVER_S", 0.0)
    scenario, relay = world(TREE, mission={"goal_m": [2700.0, 2700.0], "time_limit_s": 40.0}), Kept()
    loop, log = make_loop(scenario, PointMass), LiveLog(relay, "rerun+http://127.0.0.1:1/proxy")
    log.begin(loop, scene_of(scenario, loop, ""), "handed over")
    flight = fly(loop, [log])
    log.close(metrics(flight, flight_limits(scenario)), {})
    calls = [call for each in relay.handed for call in each]
    blocks = [call.arguments[0] for call in calls if call.method == "on_block"]
    plans = [call.arguments[0] for call in calls if call.method == "on_plan"]
    assert {len(block) for block in blocks} == {1}
    for name in ("time_s", "clearance_m"):
        rows = np.concatenate([getattr(each, name) for each in blocks])
        np.testing.assert_array_equal(rows, getattr(flight.track, name))
    assert [each.time_s for each in plans] == [each.time_s for each in flight.plans]
    assert plans[0].plan.picture().guide_m.shape == (2, 2)
    assert calls[-1].method == "close"
    assert relay.opening is not None
    recording = RerunLog(tmp_path / "handed.rrd", relay.opening.scene, relay.opening.identity)
    for call in calls:
        getattr(recording, call.method)(*call.arguments)
    chunks = [
        chunk.to_record_batch()
        for chunk in RrdReader(str(tmp_path / "handed.rrd")).stream()
        if str(chunk.entity_path) == "/series/cross_track/flown" and not chunk.is_static
    ]
    assert sum(chunk.num_rows for chunk in chunks) == len(flight.track)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--speed", "2"], "--speed goes with --live"),
        (["--live", "--speed", "0"], "--speed is 0; must be above 0"),
        (["--web"], "--web goes with --live"),
        (["--live"], "there is no screen to open the viewer on"),
    ],
)
def test_what_makes_no_sense_is_refused_before_the_flight(
    arguments: list[str], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    for screen in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(screen, raising=False)
    said = refused("fly", "aerosonde_forest", *arguments, "--out", tmp_path / "run")
    assert sentence in said
    assert len(said.splitlines()) <= 2
    assert list(tmp_path.iterdir()) == []
