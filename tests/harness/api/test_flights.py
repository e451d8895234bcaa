"""Flying from Python."""

import hashlib
import json
import math
import os
import pickle
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import harness
import wayproof
from aircraft.airframes import airframe
from harness.cli.app import main
from harness.scenario.kinds import GUIDANCE, PLANNER, guidance_kinds
from harness.scenario.performance import mission_of
from tests.harness.api.worlds import SCENARIO, Beeline, small, source_file
from tests.processes import python
from tests.refusals import refused

CONTRACT = (
    "time_s east_m north_m up_m course_deg heading_deg roll_deg pitch_deg airspeed_mps groundspeed_mps "
    "load_factor roll_command_deg cross_track_m clearance_m plan_index"
)
FURTHER = (
    "arc_length_m throttle altitude_above_ground_m actuator_limited_s vertical_actuator_limited_s elevator aileron "
    "rudder angle_of_attack_deg asked_airspeed_mps"
)


@pytest.fixture(scope="module")
def run() -> wayproof.FlightResult:
    return wayproof.fly(small())


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> wayproof.FlightResult:
    return wayproof.fly(small(), out=tmp_path_factory.mktemp("kept") / "run", recording=True)


def test_a_flight_has_its_outcome_figures_and_tables(run: wayproof.FlightResult) -> None:
    assert (run.outcome, run.folder, run.recording) == ("reached", None, None)
    assert run.reason.startswith("inside the goal circle")
    assert run.metrics.cross_track_m.p95 is not None
    assert 0.0 <= run.metrics.cross_track_m.p95 < 1.0
    assert run.metrics.trackability[0].trackable
    assert run.track.column_names == [*CONTRACT.split(), *FURTHER.split()]
    assert run.plans["plan_index"].to_pylist() == list(range(run.metrics.replans + 1))
    assert run.scenario == small()
    columns = ((run.track[name].to_numpy(), "<i8" if name == "plan_index" else "<f8") for name in CONTRACT.split())
    joined = b"".join(column.astype(kind).tobytes() for column, kind in columns)
    assert run.digest == run.metrics.digest == hashlib.sha256(joined).hexdigest()


def test_in_memory_and_into_a_folder_the_same_is_flown(run: wayproof.FlightResult, kept: wayproof.FlightResult) -> None:
    assert kept.digest == run.digest
    for name in run.track.column_names:
        np.testing.assert_array_equal(kept.track[name].to_numpy(), run.track[name].to_numpy())
    assert kept.folder is not None
    assert kept.metrics.to_dict() == json.loads((kept.folder / "metrics.json").read_text())
    assert kept.recording == kept.folder / "flight.rrd"
    again = wayproof.load_run(str(kept.folder))
    assert (again.digest, again.scenario, again.metrics) == (kept.digest, kept.scenario, kept.metrics)
    assert again.plans.equals(kept.plans)
    for thing in (run, kept, run.metrics, run.scenario, run.metrics.cross_track_m):
        assert len(repr(thing)) < 250
    assert repr(run) == "FlightResult(short: reached; rolling_window, aerosonde, seed 1)"


def test_figures_are_attributes_and_keys_and_cannot_be_changed(run: wayproof.FlightResult) -> None:
    metrics = run.metrics
    assert metrics.trackability[0].cause is None
    assert [*metrics["cross_track_m"]] == [*metrics.to_dict()["cross_track_m"]]
    assert metrics.navigation_error_m is None
    assert pickle.loads(pickle.dumps(metrics)) == metrics
    with pytest.raises(AttributeError, match="no figure 'cros_track_m'; there are outcome, "):
        _ = metrics.cros_track_m
    for change, *given in (("__setattr__", "outcome", "x"), ("update", {"outcome": "x"}), ("clear",)):
        with pytest.raises(AttributeError, match="cannot be changed"):
            getattr(metrics, change)(*given)


def test_a_figure_that_a_run_lacks_is_told(kept: wayproof.FlightResult, tmp_path: Path) -> None:
    assert kept.folder is not None
    folder = tmp_path / "run"
    shutil.copytree(kept.folder, folder)
    metrics = json.loads((folder / "metrics.json").read_text())
    del metrics["trackable"]
    (folder / "metrics.json").write_text(json.dumps(metrics))
    manifest = json.loads((folder / "manifest.json").read_text())
    del manifest["sha256"]["metrics.json"]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    said = re.escape(f"{folder / 'metrics.json'}: trackable: is missing; another version of")
    with pytest.raises(wayproof.InputError, match=said):
        wayproof.load_run(folder)


@pytest.mark.parametrize("how", ["class", "factory", "object", "no argument"])
def test_a_planner_is_given_as_an_object(how: str) -> None:
    class Ready(Beeline):
        def __init__(self) -> None:
            self.goal_m = small().mission.goal_m

    given = {
        "class": Beeline,
        "factory": lambda mission: Beeline(mission),
        "object": Ready(),
        "no argument": Ready,
    }[how]
    flown = wayproof.fly(small(), planner=given)
    assert flown.outcome == "reached"
    assert flown.metrics.replans == 0
    assert ":" in flown.scenario.planner.kind
    assert flown.plans["path"][0].as_py()[-1] == [1200.0, 1000.0]


class Around:
    """A law around the default one."""

    def __init__(self, limits: wayproof.GuidanceLimits) -> None:
        self.law = guidance_kinds()["preview"].law(limits)

    def follow(self, route: wayproof.Route, arc_length_m: float = 0.0) -> None:
        self.law.follow(route, arc_length_m)


@pytest.mark.flights
def test_a_guidance_law_is_given_as_a_class(
    run: wayproof.FlightResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Gentle(Around):
        """The default law at half the bank."""

        def update(self, state: wayproof.AircraftState) -> wayproof.GuidanceOutput:
            output = self.law.update(state)
            return output._replace(roll_command_rad=0.5 * output.roll_command_rad)

    assert wayproof.fly(small(), guidance="preview").digest == run.digest
    gentle = wayproof.fly(small(), guidance=Gentle, out=tmp_path / "run")
    assert gentle.outcome == "reached"
    assert gentle.digest != run.digest
    assert gentle.scenario.guidance.kind.endswith(":test_a_guidance_law_is_given_as_a_class.Gentle")
    assert "Gentle" in gentle.manifest["command"][0]
    limits = airframe("aerosonde").guidance_limits(25.0)
    again = wayproof.fly(small(), guidance=Gentle(limits))
    assert again.digest == wayproof.fly(small(), guidance=Gentle(limits)).digest == gentle.digest
    for given, said in (("nix", "guidance.kind: is 'nix'; must be one of preview"), (3, "of type int")):
        with pytest.raises(wayproof.InputError, match=said):
            wayproof.fly(small(), guidance=given)
    radius_m = mission_of(gentle.scenario).turn_radius_m
    # In another process, which has not been given the law.
    monkeypatch.setattr(GUIDANCE, "registered", {})
    back = wayproof.load_run(tmp_path / "run")
    assert (back.digest, back.scenario.guidance) == (gentle.digest, gentle.scenario.guidance)
    assert main(["report", str(tmp_path / "run")]) == 0
    assert back.manifest["turn_radius_m"] == radius_m > mission_of(small()).turn_radius_m
    assert f"turn radius R {radius_m:.1f} m" in (tmp_path / "run" / "report.html").read_text()
    assert main(["export", str(tmp_path / "run"), "--format", "plan", "--out", str(tmp_path / "a.plan")]) == 0
    with pytest.raises(wayproof.InputError, match=r"guidance\.kind: .*Gentle is not here; give it anew"):
        wayproof.fly(back.scenario)


@pytest.mark.flights
def test_a_law_that_is_defined_anew_is_measured_anew() -> None:
    def define(share: float) -> type:
        class Weak(Around):
            def update(self, state: wayproof.AircraftState) -> wayproof.GuidanceOutput:
                output = self.law.update(state)
                weak_rad = share * output.roll_command_rad
                return output._replace(roll_command_rad=weak_rad, cross_track_m=0.0)  # as if on its route

        return Weak

    first = wayproof.fly(small(), guidance=define(0.95))
    first_m = mission_of(first.scenario).tracking_error_m
    assert mission_of(wayproof.fly(small(), guidance=define(0.7)).scenario).tracking_error_m != first_m
    assert mission_of(first.scenario).tracking_error_m == first_m
    with pytest.raises(wayproof.InputError, match="does not track"):
        wayproof.fly(small(), guidance=define(0.0))
    with pytest.raises(wayproof.InputError, match="it asks for a roll of nan rad"):
        wayproof.fly(small(), guidance=define(math.nan))


def test_a_planner_from_a_file_flies_in_python_and_on_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    source = source_file(tmp_path)
    (tmp_path / "short.yaml").write_text(SCENARIO)
    flown = wayproof.fly(tmp_path / "short.yaml", planner=f"{source}:Beeline", out=tmp_path / "a")
    assert (flown.outcome, flown.scenario.planner.kind) == ("reached", "planner.py:Beeline")
    arguments = ["--planner", f"{source}:Beeline", "--no-recording", "--quiet"]
    assert main(["fly", str(tmp_path / "short.yaml"), *arguments, "--out", str(tmp_path / "b")]) == 0
    assert wayproof.load_run(tmp_path / "b").digest == flown.digest


@pytest.mark.flights
def test_a_run_of_a_planner_that_is_not_here_is_read_and_shown_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in the next process, which has not been given the planner."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    source, folder = source_file(tmp_path), tmp_path / "run"
    (tmp_path / "short.yaml").write_text(SCENARIO)
    flown = wayproof.fly(tmp_path / "short.yaml", planner=f"{source}:Beeline", out=folder)
    monkeypatch.setattr(PLANNER, "registered", {})
    back = wayproof.load_run(folder)
    assert (back.digest, back.scenario.planner.kind) == (flown.digest, "planner.py:Beeline")
    assert main(["report", str(folder)]) == 0
    for form in ("waypoints", "kml", "geojson", "plan"):
        assert main(["export", str(folder), "--format", form, "--out", str(tmp_path / f"a.{form}")]) == 0
    with pytest.raises(wayproof.PlannerError, match=r"the planner planner.py:Beeline is not here; give it"):
        wayproof.fly(back.scenario)
    assert wayproof.fly(back.scenario, planner=f"{source}:Beeline").digest == flown.digest


def test_a_scenario_file_never_runs_code(tmp_path: Path) -> None:
    source = source_file(tmp_path)
    source.write_text("raise SystemExit(3)\n")
    (tmp_path / "short.yaml").write_text(SCENARIO + f"planner: {{kind: '{source}:Beeline'}}\n")
    said = refused("fly", tmp_path / "short.yaml")
    assert "planner.kind" in said
    assert "--planner" in said


def test_faults_have_the_text_of_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text(SCENARIO.replace("goal_m: [1200, 1000]", "goal_m: [1000, 1700]"))
    for command, call in (
        (["fly", str(broken)], lambda: wayproof.fly(str(broken))),
        (["fly", "no_such"], lambda: wayproof.load_scenario("no_such")),
        (["report", str(tmp_path)], lambda: wayproof.load_run(tmp_path)),
    ):
        assert main(command) == 2
        with pytest.raises(wayproof.InputError) as raised:
            call()
        assert f"{raised.value}\n" == capsys.readouterr().err
        assert isinstance(raised.value, ValueError)
    assert [each.name for each in tmp_path.iterdir()] == ["broken.yaml"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (3, "this is of type int"),
        ("nix", "must be one of rolling_window"),
        ("nix.py:Beeline", "no such file"),
        ("no_such_module:Beeline", "there is no module no_such_module"),
        ("math:nix", "math has no nix"),
        (lambda mission, gain: None, "must need the mission alone"),
    ],
)
def test_what_is_no_planner_is_refused(given: object, said: str) -> None:
    with pytest.raises(wayproof.InputError, match=said):
        wayproof.fly(small(), planner=given)


def test_a_planner_that_changes_the_working_directory_moves_no_run_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As research code does to find its weights: when it is made, or in flight."""
    (tmp_path / "elsewhere").mkdir()

    class Moves(Beeline):
        def plan(self, request: wayproof.PlanRequest) -> wayproof.Plan:
            os.chdir(tmp_path / "elsewhere")
            return super().plan(request)

    def moved(mission: wayproof.Mission) -> Beeline:
        os.chdir(tmp_path / "elsewhere")
        return Beeline(mission)

    for planner in (Moves, moved):
        monkeypatch.chdir(tmp_path)
        assert wayproof.fly(small(), planner=planner, out="run").track.num_rows > 1
        assert {each.name for each in tmp_path.iterdir()} == {"elsewhere", "run"}
        assert not any((tmp_path / "elsewhere").iterdir())
        shutil.rmtree(tmp_path / "run")


def test_a_factory_that_makes_no_planner_is_told() -> None:
    with pytest.raises(wayproof.PlannerError, match="has no method plan"):
        wayproof.fly(small(), planner=lambda mission: mission)


def test_the_names_are_those_of_harness() -> None:
    assert dir(wayproof) == sorted(harness.__all__)
    for name in harness.__all__:
        assert getattr(wayproof, name) is getattr(harness, name)
    for module in (harness, wayproof):
        with pytest.raises(AttributeError):
            _ = module.no_such_name


def test_importing_it_loads_nothing_heavy() -> None:
    code = (
        "import sys, wayproof; heavy = {'numpy', 'pydantic', 'numba', 'pyarrow', 'rerun', 'harness'} & {*sys.modules};"
        "sys.exit(', '.join(heavy) or 0)"
    )
    done = python("-c", code)
    assert (done.returncode, done.stderr) == (0, "")
