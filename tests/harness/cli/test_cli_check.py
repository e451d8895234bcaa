"""The command `check`, with real flights of a few minutes."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from harness.cli.app import main
from harness.run_files.run_folder import load_run
from harness.scenario.scenario import parse_scenario

STRIP = "x_m,y_m\n0,0\n0,2000\n60,2000\n60,0\n"
"""Two corners 60 m apart: too tight for an Aerosonde."""
CIRCUIT = "x_m,y_m\n0,0\n0,2000\n1500,2000\n1500,0\n0,0\n"


@pytest.fixture
def strip(tmp_path: Path) -> Path:
    path = tmp_path / "Strip 1.csv"
    path.write_text(STRIP)
    return path


def test_a_corner_too_tight_is_found_named_and_shown_in_80_columns(
    strip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert main(["check", str(strip), "--aircraft", "aerosonde", "--out", str(out)]) == 1
    said = capsys.readouterr()
    assert said.err == ""
    *table, folder = said.out.splitlines()
    assert max(map(len, table)) <= 80
    assert folder == f"run folder: {out}"
    assert "no: turn radius too tight" in said.out
    assert "waypoint 2" in said.out
    run = load_run(out)
    assert (out / "flight.rrd").stat().st_size > 10_000
    assert run.metrics["trackable"] is False
    assert len(run.plans) == 1
    assert run.plans[0].waypoints_m.tolist() == [[0.0, 0.0], [0.0, 2000.0], [60.0, 2000.0], [60.0, 0.0]]
    check = run.metrics["check"]
    assert check["given"]["heading_change_deg"] == pytest.approx(180.0)
    assert check["given"]["angle_over_length_radpm"] == pytest.approx(math.pi / 4060.0)
    assert [corner["waypoint"] for corner in check["corners"]] == [1, 2]
    assert main(["report", str(out)]) == 0
    page = (out / "report.html").read_text()
    assert "strip-1: path as given, aerosonde" in page
    for corner in check["corners"]:
        assert f"<td>{corner['flown_cut_m']:.0f}</td><td>{corner['allowed_cut_m']:.0f}</td>" in page
    assert "for a planner to fly" in page
    scenario = parse_scenario(run.scenario_yaml)
    assert scenario.name == "strip-1"
    assert (scenario.mission.start_m, scenario.mission.goal_m) == ((0.0, 0.0), (60.0, 2000.0))


def test_a_circuit_is_flown_to_its_end_and_is_trackable(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "circuit.csv"
    path.write_text(CIRCUIT)
    options = ["--aircraft", "aerosonde", "--no-recording", "--out", str(tmp_path / "run")]
    assert main(["check", str(path), *options, "--wind", "6,200", "--turbulence", "light", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == json.loads((tmp_path / "run" / "metrics.json").read_text())
    assert said["outcome"] == "reached"
    assert 6500.0 < said["planned_length_m"] < 7000.0
    assert [round(corner["turn_deg"]) for corner in said["check"]["corners"]] == [-90, -90, -90]
    assert said["smoothness"]["flown"]["heading_change_deg"] > 250.0
    assert not (tmp_path / "run" / "flight.rrd").exists()


def test_an_end_that_is_passed_far_off_is_not_reached(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "path.csv"
    path.write_text("x_m,y_m\n0,0\n2400,0\n1900,500\n3000,700\n7000,0\n")
    options = ["--aircraft", "T38", "--no-recording", "--out", str(tmp_path / "run")]
    assert main(["check", str(path), *options, "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    track = load_run(tmp_path / "run").track
    off_m = math.dist((track.east_m[-1], track.north_m[-1]), (7000.0, 0.0))
    assert off_m > 1000.0
    assert (said["outcome"], said["trackable"]) == ("timeout", False)
    assert "passed the end of the path" in said["reason"]


def test_the_same_check_gives_the_same_digest(strip: Path, tmp_path: Path) -> None:
    options = ["--aircraft", "aerosonde", "--turbulence", "milspec:moderate", "--no-recording", "--quiet"]
    for folder, seed in (("a", "5"), ("b", "5"), ("c", "6")):
        main(["check", str(strip), *options, "--seed", seed, "--out", str(tmp_path / folder)])
    first, again, other = (load_run(tmp_path / name).metrics["digest"] for name in "abc")
    assert first == again != other


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--aircraft", "concorde"], "command line: aircraft.model: unknown aircraft 'concorde'"),
        (
            ["--aircraft", "aerosonde", "--airspeed-mps", "90"],
            "aircraft.airspeed_mps: aerosonde cannot hold 90",
        ),
        (["--aircraft", "aerosonde", "--wind", "8"], "'8' is not SPEED,FROM such as 8,270"),
        (
            ["--aircraft", "aerosonde", "--wind", "24,0"],
            "environment.wind.speed_mps: is 24; must be below 0.9",
        ),
        (["--aircraft", "aerosonde", "--turbulence", "mild"], "'light', 'moderate' or 'severe'"),
        (["--aircraft", "aerosonde", "--altitude-m", "5"], "mission.altitude_m: is 5; must be at least 50"),
        (
            ["--aircraft", "aerosonde", "--tolerance-m", "0"],
            "trackability.cross_track_m: is 0; must be greater",
        ),
        (["--aircraft", "aerosonde", "--set", "trackability.load_facter=2"], "did you mean load_factor?"),
        (["--aircraft", "c172p", "--airspeed-mps", "60", "--altitude-m", "9000"], "cannot be trimmed"),
        ([], "Missing option"),
    ],
)
def test_bad_input_is_refused_before_anything_is_flown(
    options: list[str], sentence: str, strip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(strip), *options, "--out", str(tmp_path / "run")]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) <= 2
    assert sentence in said.err
    assert not (tmp_path / "run").exists()
