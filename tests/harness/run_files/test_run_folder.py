import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.analysis.flight_limits import FlightLimits
from harness.analysis.metrics import metrics
from harness.files.errors import RunFolderError
from harness.flight.record import AcceptedPlan, Flight, Outcome, digest
from harness.run_files.run_folder import METRICS, PLANS, TRACK, RunFolder, load_run, recording_of
from tests.harness.conftest import CIRCLE_PLAN, STRAIGHT_PLAN
from tests.harness.conftest import track as make_track

REPOSITORY = Path(__file__).parents[3]
REFEREE = REPOSITORY.parent / "shared" / "tools" / "referee.py"
LIMITS = FlightLimits(300.0, 200.0, 0.78, 110.0)
SCENARIO = """\
schema: wayproof/scenario/1
name: straight
area: {bounds_m: [-1000, -1000, 10000, 10000]}
obstacles:
  - circle: {center_m: [600, 1250], radius_m: 100}
mission: {start_m: [0, 0], goal_m: [0, 2500], goal_radius_m: 50, altitude_m: 300}
aircraft: {model: aerosonde}
planner: {kind: rolling_window, clearance_m: 200}
"""


def fly_straight(plan: AcceptedPlan) -> Flight:
    """100 s north from (0, 0), past a circle at 500 m, to the goal."""
    track = make_track(1001, clearance_m=np.hypot(600.0, np.arange(1001) * 2.5 - 1250.0) - 100.0)
    return Flight(track, (plan,), Outcome.REACHED, "inside the goal's circle", (2.5, 3.5), 100.0, 0.2)


def write_run(folder: Path, flight: Flight) -> dict[str, object]:
    figures = metrics(flight, LIMITS)
    with RunFolder.create(folder, SCENARIO, ["wayproof", "fly"]) as run:
        run.finish(flight.track, flight.plans, figures)
    return figures


def test_run_reads_back_as_written(tmp_path: Path) -> None:
    flight = fly_straight(CIRCLE_PLAN)
    figures = write_run(tmp_path / "a" / "run", flight)
    run = load_run(tmp_path / "a" / "run")
    assert run.scenario_yaml == SCENARIO
    assert run.metrics == figures
    assert digest(run.track) == figures["digest"]
    np.testing.assert_array_equal(run.track.arc_length_m, flight.track.arc_length_m)
    named = "python wayproof jsbsim numba numpy shapely rerun-sdk pyarrow"
    assert set(run.manifest["versions"]) >= set(named.split())
    assert run.manifest["command"] == ["wayproof", "fly"]
    (row,) = run.plans
    assert (row.plan_index, row.time_s, row.status, row.compute_ms) == (0, 0.0, "found", 2.5)
    np.testing.assert_allclose(np.hypot(*row.path_m.T), 500.0)
    assert row.length_m == pytest.approx(2 * np.pi * 500.0)
    assert row.max_curvature_1pm == pytest.approx(1 / 500.0)
    np.testing.assert_array_equal(row.waypoints_m, [[500.0, 0.0]])
    assert not list((tmp_path / "a" / "run").glob("*.partial"))


def test_run_without_a_plan(tmp_path: Path) -> None:
    track = make_track(20, plan_index=-1, cross_track_m=np.nan, arc_length_m=np.nan)
    write_run(tmp_path, Flight(track, (), Outcome.PLANNER_FAILED, "no plan", (), 2.0, 0.1))
    run = load_run(tmp_path)
    assert run.plans == ()
    assert run.metrics["cross_track_m"] == {"rms": None, "p95": None, "max": None}


@pytest.mark.skipif(not REFEREE.exists(), reason=f"needs {REFEREE.name}, which is not in this repository")
def test_referee_finds_no_fault(tmp_path: Path) -> None:
    write_run(tmp_path, fly_straight(STRAIGHT_PLAN))
    done = subprocess.run(
        [sys.executable, str(REFEREE), "--json", str(tmp_path)], capture_output=True, text=True, check=False
    )
    verdict = json.loads(done.stdout)
    assert verdict["faults"] == []
    assert verdict["truth"] == "reached"
    assert done.returncode == 0


def test_a_path_that_is_no_place_for_a_run_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    for path, told in (
        (tmp_path, "not empty and not a run folder"),
        (tmp_path / "run\udcff", "its name must be printable"),
        (tmp_path / "thesis.tex", "is a file"),
        (tmp_path / "thesis.tex" / "below", "cannot write the run folder"),
    ):
        with pytest.raises(RunFolderError, match=told):
            RunFolder.create(path, SCENARIO, [])
    assert [entry.name for entry in tmp_path.iterdir()] == ["thesis.tex"]


def test_former_run_is_removed_and_nothing_else(tmp_path: Path) -> None:
    write_run(tmp_path, fly_straight(STRAIGHT_PLAN))
    (tmp_path / "flight.rrd").write_text("old")
    (tmp_path / "notes.txt").write_text("mine")
    RunFolder.create(tmp_path, SCENARIO, [])
    assert set(os.listdir(tmp_path)) == {"manifest.json", "notes.txt", "scenario.yaml"}
    with pytest.raises(RunFolderError, match="incomplete"):
        load_run(tmp_path)


@pytest.mark.parametrize("last", [TRACK, PLANS, METRICS, "manifest.json"])
def test_process_killed_while_finishing_leaves_no_complete_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, last: str
) -> None:
    """Dies instead of putting each file in its place, one after the other."""
    replace = os.replace

    def die_at(source: Path, target: Path) -> None:
        if target.name == last and (last != "manifest.json" or (tmp_path / METRICS).exists()):
            raise SystemExit(137)
        replace(source, target)

    monkeypatch.setattr("harness.run_files.run_folder.os.replace", die_at)
    with pytest.raises(SystemExit):
        write_run(tmp_path, fly_straight(STRAIGHT_PLAN))
    with pytest.raises(RunFolderError, match="incomplete"):
        load_run(tmp_path)


def test_metric_that_json_cannot_hold_leaves_the_run_incomplete(tmp_path: Path) -> None:
    with (
        RunFolder.create(tmp_path, SCENARIO, []) as run,
        pytest.raises(ValueError, match="not JSON compliant"),
    ):
        run.finish(make_track(50), [], {"min_clearance_m": float("inf")})
    with pytest.raises(RunFolderError, match="incomplete"):
        load_run(tmp_path)


def test_missing_and_damaged_runs_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match="is not a run folder"):
        load_run(tmp_path)
    write_run(tmp_path, fly_straight(STRAIGHT_PLAN))
    (tmp_path / TRACK).write_bytes(b"PAR1")
    with pytest.raises(RunFolderError, match="is damaged"):
        load_run(tmp_path)


@pytest.mark.parametrize("read", [load_run, recording_of])
def test_a_folder_not_there_is_said_to_be_missing(tmp_path: Path, read: Callable[[Path], object]) -> None:
    with pytest.raises(RunFolderError, match="gone: no such folder; give a run folder"):
        read(tmp_path / "gone")
