"""The command `check`, with real flights of a few minutes."""

import json
import math
import shlex
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from rerun.chunk import RrdReader

from harness.cli.app import main
from harness.recording.overlay import frame_of
from harness.run_files.run_folder import load_run
from tests.harness.conftest import Checked
from tests.harness.run.given import written
from tests.refusals import refused
from tests.scenarios import scenario_of
from wayproof import InputError, check

STRIP = "x_m,y_m\n0,0\n0,2000\n60,2000\n60,0\n"
"""Two corners 60 m apart: too tight for an Aerosonde."""
CIRCUIT = "x_m,y_m\n0,0\n0,2000\n1500,2000\n1500,0\n0,0\n"


@pytest.fixture
def strip(tmp_path: Path) -> Path:
    return written(tmp_path / "Strip 1.csv", STRIP)


def test_a_corner_too_tight_is_found_named_and_shown_in_80_columns(
    strip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert main(["check", str(strip), "--aircraft", "aerosonde", "--out", str(out)]) == 1
    said = capsys.readouterr()
    assert said.err == ""
    *table, folder = said.out.splitlines()
    assert table[2].startswith(" flown as given        no: ")
    assert max(map(len, table)) <= 80
    assert folder == f"run folder: {out}"
    assert "no: turn radius too tight" in said.out
    assert "waypoint 2" in said.out
    assert " path                  4 points, 4,060 m, rounded " in said.out
    run = load_run(out)
    assert (out / "flight.rrd").stat().st_size > 10_000
    assert run.metrics["trackable"] is False
    assert len(run.plans) == 1
    assert run.plans[0].waypoints_m.tolist() == [[0.0, 0.0], [0.0, 2000.0], [60.0, 2000.0], [60.0, 0.0]]
    told = run.metrics["check"]
    assert told["given"]["heading_change_deg"] == pytest.approx(180.0)
    assert [corner["waypoint"] for corner in told["corners"]] == [1, 2]
    assert main(["report", str(out)]) == 0
    page = (out / "report.html").read_text()
    assert "strip-1: path as given, aerosonde" in page
    for corner in told["corners"]:
        assert f"<td>{corner['flown_cut_m']:.0f}</td><td>{corner['allowed_cut_m']:.0f}</td>" in page
    assert page.index(told["verdict"]) < page.index("at the end of the path")
    assert "for a planner to fly" in page
    assert "clairvoyant" not in page
    scenario = scenario_of(run.scenario_yaml)
    assert scenario.name == "strip-1"
    assert (scenario.mission.start_m, scenario.mission.goal_m) == ((0.0, 0.0), (60.0, 2000.0))


def test_a_circuit_is_flown_to_its_end_and_is_trackable(tmp_path: Path, checked: Checked) -> None:
    options = ["--corner-m", "120", "--wind", "6,200", "--turbulence", "light"]
    status, said = checked(written(tmp_path / "circuit.csv", CIRCUIT), *options)
    assert status == 0
    assert said == json.loads((tmp_path / "run" / "metrics.json").read_text())
    assert said["outcome"] == "reached"
    assert 6500.0 < said["planned_length_m"] < 7000.0
    assert [round(corner["turn_deg"]) for corner in said["check"]["corners"]] == [-90, -90, -90]
    assert said["smoothness"]["flown"]["heading_change_deg"] > 250.0
    assert not (tmp_path / "run" / "flight.rrd").exists()


def test_an_end_that_is_passed_far_off_is_not_reached(tmp_path: Path, checked: Checked) -> None:
    path = written(tmp_path / "path.csv", "x_m,y_m\n0,0\n2400,0\n1900,500\n3000,700\n7000,0\n")
    status, said = checked(path, "--aircraft", "T38")
    track = load_run(tmp_path / "run").track
    assert math.dist((track.east_m[-1], track.north_m[-1]), (7000.0, 0.0)) > 1000.0
    assert (status, said["outcome"], said["trackable"]) == (1, "timeout", False)
    assert "the end of the path" in said["reason"]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ("--aircraft concorde", "command line: aircraft.model: unknown aircraft 'concorde'"),
        ("--airspeed-mps 90", "aircraft.airspeed_mps: aerosonde cannot hold 90"),
        ("--airspeed-mps 3 --wind 8,270", "aircraft.airspeed_mps: aerosonde cannot hold 3"),
        ("--wind 8", "'8' is not SPEED,FROM such as 8,270"),
        ("--wind 24,0", "environment.wind.speed_mps: is 24; must be below 0.9"),
        ("--wind 15,0 --set environment.wind.measured_at_m=10", "is 15, and up to 24.4692 at the mission's"),
        ("--turbulence mild", "'light', 'moderate' or 'severe'"),
        ("--altitude-m 4", "mission.altitude_m: is 4; must be at least 5"),
        (
            "--altitude-m 400 --set mission.altitude_m=450",
            "mission.altitude_m: is 450 beside --altitude-m 400",
        ),
        ("--tolerance-m 0", "trackability.cross_track_m: is 0; must be greater"),
        ("--set trackability.load_facter=2", "did you mean load_factor?"),
        ("--aircraft c172p --airspeed-mps 60 --altitude-m 9000", "cannot be trimmed"),
        ("--corner-m inf", "--corner-m: is inf; must be at least 0, and finite"),
        ("--set planner.kind=bug2", "planner.kind: has no effect on a given path; leave it out"),
        ('--set planner={"kind":"bug2"}', "planner.kind: has no effect on a given path"),
        ("--set sensor.range_m=500", "sensor.range_m: has no effect on a given path; leave it out"),
        ("--set mission.goal_m=[0,9]", "command line: mission.goal_m: has no effect on a given path"),
    ],
)
def test_bad_input_is_refused_before_anything_is_flown(
    options: str, sentence: str, strip: Path, tmp_path: Path
) -> None:
    aircraft = [] if "--aircraft" in options else ["--aircraft", "aerosonde"]
    said = refused("check", strip, *aircraft, *options.split(), "--out", tmp_path / "run")
    assert len(said.splitlines()) <= 2
    assert sentence in said
    assert not (tmp_path / "run").exists()


@pytest.fixture
def straight(tmp_path: Path) -> Path:
    return written(tmp_path / "straight.csv", "x_m,y_m\n0,0\n0,1500\n")


CIRCLE = "obstacles=[{circle: {center_m: [100, 800], radius_m: 150}}]"


def test_an_aircraft_that_flies_through_a_circle_is_told_so_everywhere(
    straight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--aircraft", "aerosonde", "--no-recording", "--out", str(tmp_path / "run"), "--set", CIRCLE]
    assert main(["check", str(straight), *options]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "no: touches obstacles[0] at 28 s, by 50 m" in said
    assert "least clearance -50 m" in said
    found = load_run(tmp_path / "run").metrics
    assert (found["contact"], found["trackable"], found["outcome"]) == (True, False, "collision")
    assert found["min_clearance_m"] == pytest.approx(-50.0, abs=0.5)
    assert main(["report", str(tmp_path / "run")]) == 0
    page = (tmp_path / "run" / "report.html").read_text()
    assert "no: touches obstacles[0] at 28 s, by 50 m" in page
    assert "obstacles[0] (obstacle)" in page


def test_what_keeps_off_obstacles_and_bounds_is_flown_as_given(straight: Path, checked: Checked) -> None:
    beside = CIRCLE.replace("[100, 800]", "[200, 800]")
    bounds = "area.bounds_m=[-400, -100, 400, 1600]"
    status, metrics = checked(straight, "--set", beside, "--set", bounds)
    assert (status, metrics["contact"], metrics["clearance_violation_s"]) == (0, False, 0.0)
    assert metrics["min_clearance_m"] == pytest.approx(50.0, abs=0.5)
    assert metrics["deviation_from_given_m"]["max"] < 1.0
    wanted = checked(straight, "--set", beside, "--clearance-m", "80")[1]  # within 230 m of the centre
    assert wanted["clearance_violation_s"] == pytest.approx(2 * math.sqrt(230**2 - 200**2) / 25, abs=0.1)
    status, metrics = checked(straight, "--set", bounds.replace("1600", "1200"))
    (left,) = metrics["breaches"]
    assert (status, left["name"]) == (1, "area.bounds_m")


def test_a_world_is_a_scenario_whose_start_may_lie_anywhere(straight: Path, tmp_path: Path, checked: Checked) -> None:
    text = (
        "schema: wayproof/scenario/1\nname: w\narea: {bounds_m: [-2000, -2000, 2000, 3000]}\n"
        f"{CIRCLE.replace('=', ': ')}\nmission: {{start_m: [-900, 0], goal_m: [-900, 1500], altitude_m: 700}}\n"
        "environment: {wind: {speed_mps: 4, from_deg: 90}}\n"
    )
    world = written(tmp_path / "world.yaml", text)
    status, metrics = checked(straight, "--scenario", str(world))
    assert (status, [each["name"] for each in metrics["contacts"]]) == (1, ["obstacles[0]"])
    scenario = scenario_of(load_run(tmp_path / "run").scenario_yaml)
    assert (scenario.mission.altitude_m, scenario.mission.start_m) == (700.0, (0.0, 0.0))
    assert scenario.environment.wind is not None
    inside = "obstacles[0].circle.center_m=[0, 100]"
    status, metrics = checked(straight, "--scenario", str(world), "--set", inside)
    assert (status, metrics["contacts"][0]["start_s"]) == (1, 0.0)
    written(world, text.replace("speed_mps: 4", "speed_mps: 24"))  # too strong for 25 m/s
    assert checked(straight, "--scenario", str(world), "--airspeed-mps", "30")[1]["contact"]


@pytest.mark.parametrize("off_m", [20.0, 3000.0])
def test_a_path_may_begin_outside_the_area(off_m: float, straight: Path, checked: Checked) -> None:
    status, metrics = checked(straight, "--set", f"area.bounds_m=[-400, {off_m}, 400, 5000]")
    (left,) = metrics["breaches"]
    assert (status, metrics["outcome"]) == (1, "reached")
    assert (left["start_s"], left["time_s"] < 1.0) == (0.0, True)
    assert left["depth_m"] == pytest.approx(off_m, abs=0.1)
    assert metrics["check"]["verdict"] == f"no: leaves area.bounds_m at 0 s, by {off_m:,.0f} m"
    assert metrics["deviation_from_given_m"]["max"] < 1.0


def mission(*fences: dict[str, Any], acceptance_m: float = 0.0, firmware: int = 12) -> str:
    item = {"type": "SimpleItem", "command": 16, "frame": 0}
    items = [
        {**item, "doJumpId": number, "params": [0, acceptance_m, 0, None, *place, 500]}
        for number, place in enumerate([(47.0, 8.0), (47.012, 8.0), (47.012, 8.016)], start=1)
    ]
    fence = {f"{kind}s": [each for each in fences if kind in each] for kind in ("circle", "polygon")}
    home = {"plannedHomePosition": [47.0, 8.0, 400], "firmwareType": firmware}
    return json.dumps({"fileType": "Plan", "mission": {"items": items, **home}, "geoFence": fence})


ACROSS: dict[str, Any] = {
    "inclusion": False,
    "polygon": [[47.005, 7.99], [47.007, 7.99], [47.007, 8.01], [47.005, 8.01]],
}
AROUND: dict[str, Any] = {"inclusion": True, "circle": {"center": [47.006, 8.008], "radius": 3000}}


@pytest.mark.parametrize(
    ("fences", "told"),
    [
        ([AROUND], []),
        ([ACROSS], ["geoFence.polygons[0]"]),
        ([{**AROUND, "circle": {"center": [47.0, 8.0], "radius": 1000}}], ["geoFence.circles[0]"]),
    ],
)
def test_the_fences_of_a_mission_are_kept(
    fences: list[dict[str, Any]], told: list[str], tmp_path: Path, checked: Checked
) -> None:
    status, metrics = checked(written(tmp_path / "m.plan", mission(*fences)), "--clearance-m", "80")
    assert (status, [each["name"] for each in metrics["breaches"]]) == (1 if told else 0, told)
    assert metrics["check"]["ok"] is not bool(told)
    assert (metrics["min_clearance_m"] < 80.0) is bool(told)
    if fences == [ACROSS]:  # 0.002 degrees of latitude across, and 80 m on both sides of it
        assert metrics["clearance_violation_s"] == pytest.approx((0.002 * 111_176 + 2 * 80) / 25, abs=0.15)


@pytest.mark.parametrize(
    ("acceptance_m", "options", "status", "allowed_m"),
    [(0.0, (), 0, 90.0), (50.0, (), 0, 50.0), (50.0, ("--corner-m", "5"), 1, 5.0)],
)
def test_a_mission_may_cut_corners_by_its_acceptance_radius(
    acceptance_m: float,
    options: tuple[str, ...],
    status: int,
    allowed_m: float,
    tmp_path: Path,
    checked: Checked,
) -> None:
    ended, metrics = checked(written(tmp_path / "mission.plan", mission(acceptance_m=acceptance_m)), *options)
    (corner,) = metrics["check"]["corners"]
    assert (ended, corner["allowed_cut_m"], corner["kept"]) == (status, allowed_m, status == 0)


def test_a_polygon_across_a_line_is_no_fence_and_told(tmp_path: Path, checked: Checked) -> None:
    ring = [[longitude, latitude] for latitude, longitude in ACROSS["polygon"]]
    shapes = [
        {"type": "LineString", "coordinates": [[8.0, 47.0], [8.0, 47.012]]},
        {"type": "Polygon", "coordinates": [[*ring, ring[0]]]},
        {"type": "Point", "coordinates": [8.0, 47.0]},
    ]
    features = [{"type": "Feature", "properties": {}, "geometry": shape} for shape in shapes]
    text = json.dumps({"type": "FeatureCollection", "features": features})
    status, metrics = checked(written(tmp_path / "line.geojson", text))
    assert (status, metrics["breaches"]) == (0, [])
    told = [f"1 {each} beside the path passed over" for each in ("Polygon", "Point")]
    assert metrics["check"]["notes"] == told


def test_from_python_a_path_is_an_array_or_a_file(straight: Path) -> None:
    checked = check([(0.0, 0.0), (0.0, 1500.0)])
    told: Any = checked.metrics.check
    assert (told.ok, told.verdict) == (True, "yes: flown as drawn, within 10 m; 0% of a limit used at most")
    assert checked.digest == check(straight).digest
    strip = check(np.array([(0, 0), (0, 1000), (60, 1000), (60, 0)])).metrics.check
    assert (strip and strip.ok) is False
    with pytest.raises(InputError, match=r"path: has the shape \(2,\); must be \(n, 2\)"):
        check([1.0, 2.0])  # type: ignore[list-item]


@pytest.mark.flights
def test_days_beside_a_check_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three of three: with confidence 0.95 at least the cube root of 0.05 (Clopper and Pearson)."""
    path = written(tmp_path / "line.csv", "x_m,y_m\n0,0\n1500,0\n")
    run = ["check", str(path), "--aircraft", "aerosonde", "--conditions", "typical", "--quiet"]
    assert main([*run, "--days", "3", "--out", str(tmp_path / "run")]) == 0
    certificate = json.loads((tmp_path / "run" / "days" / "certificate.json").read_text())
    assert (certificate["runs"], certificate["held"]) == (3, 3)
    assert certificate["probability_lower"] == pytest.approx(0.05 ** (1 / 3), rel=1e-4)
    tracks = (tmp_path / "run" / "days" / "band.json").read_text()
    edges = {side: np.array(json.loads(tracks)[f"{side}_m"]) for side in ("left", "right")}
    assert (edges["left"][:, 1] >= edges["right"][:, 1]).all(), "the path leads east"
    assert (abs(edges["left"] - edges["right"]) < 20.0).all(), "each day is as given: within 10 m"
    chunks = RrdReader(str(tmp_path / "run" / "flight.rrd")).stream().to_chunks()
    assert {"/plan/band", "/world/band", "/plan/whole_track"} <= {chunk.entity_path for chunk in chunks}
    assert not any("search" in chunk.entity_path for chunk in chunks), "nothing was searched"
    shown_m = frame_of(chunks, tmp_path).bounds_m
    assert shown_m == pytest.approx((-300, -300, 1800, 300), abs=100), "the path, and room to turn back"
    assert main(["report", str(tmp_path / "run")]) == 0
    assert "where 95 % of 3 days fly" in (tmp_path / "run" / "report.html").read_text()
    for end_m, more, left in ((1500, [], 3), (1400, ["--days", "1"], 1), (1300, [], None)):  # edited
        path.write_text(f"x_m,y_m\n0,0\n{end_m},0\n")
        assert main([*run, *more, "--out", str(tmp_path / "run")]) == 0
        kept = tmp_path / "run" / "days" / "certificate.json"
        assert (json.loads(kept.read_text())["runs"] if kept.exists() else None) == left
    with patch("harness.certification.certification.certify", side_effect=OSError(28, "full")):
        assert main([*run, "--days", "1", "--out", str(tmp_path / "run")]) == 1
    assert capsys.readouterr().err.endswith(f"{kept.parent}, the same check goes on\n")


@pytest.mark.flights
@pytest.mark.parametrize("command", ["check", "certify"])
def test_a_failing_day_is_flown_again_by_the_command_of_its_manifest(command: str, tmp_path: Path) -> None:
    """With a guidance law of one's own, which the processes that fly and the command have to import."""
    path, law = tmp_path / "line.csv", tmp_path / "law.py"
    path.write_text("x_m,y_m\n0,0\n1500,0\n")
    law.write_text("from aircraft.guidance.registry import BUILT_IN\nLAW = BUILT_IN[-1]\n")
    run = [command, str(path), "--aircraft", "aerosonde", "--conditions", "typical", "--quiet", "--seed", "9"]
    run += ["--guidance", f"{law}:LAW", "--set", "trackability.cross_track_m=0.1"]
    run += ["--set", "aircraft.autopilot.bank_limit_deg=40", "--out", str(tmp_path / "run")]
    own = ["--altitude-m", "700", "--days", "1"] if command == "check" else ["--runs", "1"]
    assert main([*run, *own]) == 1
    (day,) = (tmp_path / "run").glob("**/runs/0")
    (again,) = json.loads((day / "manifest.json").read_text())["command"]
    assert main([*shlex.split(again)[1:], "--no-recording", "--out", str(tmp_path / "again")]) == 1
    assert load_run(tmp_path / "again").metrics["digest"] == load_run(day).metrics["digest"]
