"""The command line: what it prints where, and its exit status."""

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from harness.cli.app import main
from harness.cli.replacing import given_by
from harness.scenario import scenario
from harness.scenario.environment import Turbulence
from tests.harness.cli.test_terminal import METRICS
from tests.processes import ROOT, python
from tests.refusals import refused

CAMPAIGN = ROOT / "scenarios" / "campaigns" / "forest_planners.yaml"
SCENARIO = ROOT / "scenarios" / "paper_circles.yaml"
SLOW = {"jsbsim", "numba", "rerun", "shapely", "pyarrow", "pydantic", "matplotlib", "numpy", "scipy", "yaml"}
COMMANDS = ["fly", "check", "compare", "falsify", "validate", "schema", "list", "view", "report", "export"]
COMMANDS += ["bench", "envelope", "world", "sweep", "certify", "replay"]


def wayproof(*arguments: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return python("-m", "harness", *arguments, folder=folder, environment=environment)


def test_help_lists_the_commands_and_fits_80_columns(tmp_path: Path) -> None:
    shown = wayproof("--help", folder=tmp_path, COLUMNS="80", NO_COLOR="1")
    assert shown.returncode == 0
    assert all(f"│ {command} " in shown.stdout for command in COMMANDS)
    assert max(map(len, shown.stdout.splitlines())) <= 80
    assert "\x1b" not in shown.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_has_an_example_fills_80_columns_and_breaks_no_word(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main([command, "--help"]) == 0
    shown = capsys.readouterr().out
    (example,) = re.findall(r"For example: wayproof (.*)", shown)
    assert example.split()[0] == command
    assert "<bool>" not in shown
    assert "…" not in shown
    prose = [line.strip() for line in shown.partition("╭")[0].splitlines()]
    pairs = [(line, after.split()[0]) for line, after in pairwise(prose) if line and after]
    assert [line for line, word in pairs if len(f"{line} {word}") <= 78] == []
    assert re.findall(r"<[^>\n]*?(?:  |$)", shown, re.MULTILINE) == [], "a list of choices is cut"
    options = "--planner --aircraft --seed --set --out --no-recording --view --quiet --json --live --speed"
    assert command != "fly" or [option for option in options.split() if f" {option} " not in shown] == []


def test_the_shell_completes_commands(tmp_path: Path) -> None:
    completing = {"_WAYPROOF_COMPLETE": "complete_bash", "COMP_WORDS": "wayproof be", "COMP_CWORD": "1"}
    assert wayproof(folder=tmp_path, **completing).stdout.split() == ["bench"]


@pytest.mark.parametrize(
    ("words", "slow"),
    [
        (["--help"], SLOW),
        pytest.param(["validate", "paper_circles"], {"jsbsim", "numba", "rerun", "pyarrow"}, marks=pytest.mark.flights),
    ],
)
def test_what_flies_nothing_imports_nothing_slow(words: list[str], slow: set[str], tmp_path: Path) -> None:
    code = f"""
import sys
from harness.cli.app import main
from harness.cli.replacing import given_by
assert main({words!r}) == 0
print(sorted({slow!r} & set(sys.modules)), file=sys.stderr)
"""
    main(["validate", "paper_circles"])  # flies the aircraft, once
    assert python("-c", code, folder=tmp_path, check=True).stderr == "[]\n"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("flight", "No such command 'flight'. Did you mean 'list'? (see wayproof --help)"),
        ("fly", "SCENARIO"),
        ("fly paper_circles --sed 3", "No such option: --sed"),
        ("fly paper_circles --seed three", "--seed"),
        ("fly paper_circles --seed -3", "command line: seed: is -3; must be at least 0"),
        ("fly paper_circles --planner astar", "command line: planner.kind: is 'astar'"),
        ("fly paper_circles --aircraft kite", "command line: aircraft.model: "),
        ("fly paper_circles --aircraft T38", "T38 cannot hold 25 m/s"),
        ("fly paper_circles --aircraft SGS", "SGS cannot be trimmed for level flight at any speed"),
        ("fly paper_circles --set seed", "'seed' is not KEY.PATH=VALUE"),
        ("fly paper_circles --set sensor.rnge_m=3", "did you mean range_m?"),
        ("fly paper_circles --seed 5 --set seed=4", "seed=4 beside an option that gives seed as 5; leave"),
        ("fly paper_circles --wind 3,90 --set environment.wind.speed_mps=8",
            "speed_mps=8 beside an option that gives environment.wind.speed_mps as 3.0; leave one of them out"),
        ("compare paper_circles --planners bug2 --guidance l1 --set guidance.kind=npfg",
            'npfg beside an option that gives guidance.kind as "l1"; leave one of them out'),
        ("falsify paper_circles --vary seed=1:2 --planner bug2 --set planner={}",
            'planner={} beside an option that gives planner.kind as "bug2"'),
        ("fly paper_circles --view --no-recording", "nothing to view with --no-recording"),
        ("fly paper_circle", "no such file; give a scenario file or one of aerosonde_forest"),
        ("fly one two", "two"),
        ("schema campaigns", "Invalid value for 'FORMAT': 'campaigns' is not one of 'scenario', 'campaign'."),
        ("fly paper_circles --set seed=3 --set seed=4", "seed=4 replaces seed=3, which stands before it"),
        ("fly paper_circles --set planner.k=3 --set planner.kind=bug2", "bug2 drops planner.k=3, which"),
        ("certify paper_circles --set guidance.k=3 --vary guidance.kind=l1,npfg", "guidance.k is given a value too, 3"),
        ("check line.csv", "Missing option '--aircraft': one of aerosonde, "),
        ("list birds", "'birds' is not one of planners, aircraft, guidance, scenarios, worlds, campaigns, m"),
        ("list", "(see wayproof list --help)"),
        (f"sweep {SCENARIO}", f"{SCENARIO}: this is a scenario: use `wayproof fly {SCENARIO}`"),
        ("fly paper_circles --set sensor.range_m=100", "command line: sensor.range_m: is 100, too short"),
        ("validate", "FILE"),
        ("fly paper_circles --seed 3 --seed 4", "--seed is given 2 times; give it once (see"),
        ("view no-such-run", "no-such-run"),
        ("report no-such-run", "no-such-run: no such folder; give a run folder"),
        ("bench nowhere.yaml", "nowhere.yaml: no such file"),
        ("fly forest_planners", "this is a campaign: use `wayproof sweep forest_planners`"),
        (f"fly {CAMPAIGN}", f"this is a campaign: use `wayproof sweep {CAMPAIGN}`"),
    ],
)  # fmt: skip
def test_bad_usage_is_one_line_and_writes_nothing(
    words: str, sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = refused(*words.split())
    assert sentence in said
    assert len(said.splitlines()) <= 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("given", "model"), [("severe", "milspec"), ("tustin:severe", "tustin"), ("milspec:severe", "milspec")]
)
def test_turbulence_keeps_the_scenarios_model_unless_it_names_one(given: str, model: str) -> None:
    replaced = given_by(turbulence=given, wind="5,270", settings=["environment.wind.speed_mps=5"])
    found = scenario.load_scenario("one_of_everything", replaced.keys).environment
    assert found.turbulence == Turbulence(model=model, intensity="severe")  # type: ignore[arg-type]
    assert (found.wind.speed_mps, found.wind.from_deg) == (5.0, 270.0)  # type: ignore[union-attr]


def test_a_campaign_is_viewed_alone(tmp_path: Path) -> None:
    (tmp_path / "campaign.json").write_text("{}")
    said = f"{tmp_path}: the folder of a campaign is opened alone; its runs are in {tmp_path / 'runs'}\n"
    assert refused("view", tmp_path / "runs" / "3", tmp_path) == said


@pytest.mark.parametrize("arguments", [["--debug", "fly", "nope"], ["fly", "nope", "--debug"]])
def test_debug_shows_where_and_ends_as_without(arguments: list[str]) -> None:
    said = refused(*arguments)
    assert said.startswith("Traceback (most recent call last):")
    assert said.splitlines()[-1].startswith("nope: ")


def test_an_error_of_our_own_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def broken() -> dict[str, Any]:
        raise ZeroDivisionError("first line\nsecond line")

    monkeypatch.setattr(scenario, "scenario_schema", broken)
    assert main(["schema"]) == 1
    told = "wayproof: internal error, ZeroDivisionError: first line second line; --debug shows where\n"
    assert capsys.readouterr().err == told
    assert main(["schema", "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_a_reader_that_goes_away_is_no_error(tmp_path: Path) -> None:
    run = subprocess.run(
        ["bash", "-c", f"'{sys.executable}' -m harness schema | head -c 10"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout == '{\n  "$schem'[:10]
    assert run.stderr == ""


@pytest.mark.parametrize(
    ("arguments", "status"), [(["list", "planners"], 0), (["validate", "paper_circles", "{bad}"], 2)]
)
def test_a_reader_that_has_gone_changes_no_status(
    arguments: list[str], status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("name: bad\n")
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w", buffering=1) as nobody_reads:
        monkeypatch.setattr("sys.stdout", nobody_reads)
        assert main([each.format(bad=bad) for each in arguments]) == status
        assert sys.stdout is nobody_reads


def test_validate_goes_on_after_a_bad_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("name: bad\n")
    assert main(["validate", str(bad), "paper_circles", "enclosed_start/enclosed-start-005"]) == 2
    said = capsys.readouterr()
    assert said.out.startswith("paper_circles: paper_circles, 10 obstacles: valid\nenclosed_start/")
    assert said.out.endswith(" 10 obstacles wholly outside area.bounds_m, the first at [-3995.9, 16740.1]\n")
    assert said.err.startswith(f"{bad}:1: schema: is missing")


def test_schema_prints_the_json_schema(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "scenario"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == scenario.scenario_schema()
    assert printed["$defs"]["Sensor"]["properties"]["range_m"]["exclusiveMinimum"] == 0


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("wayproof")


@dataclass
class Pilot:
    """Stands in for the flying itself: takes note of what `fly` asks for and ends as told."""

    outcome: str | BaseException = "reached"
    asked: list[tuple[scenario.Scenario, Path, bool]] = field(default_factory=list)

    def fly_to_folder(self, flown: scenario.Scenario, out: Path, recording: bool, progress: object) -> dict[str, Any]:
        self.asked.append((flown, out, recording))
        if isinstance(self.outcome, BaseException):
            raise self.outcome
        return {**METRICS, "outcome": self.outcome}


@pytest.fixture
def pilot(monkeypatch: pytest.MonkeyPatch) -> Pilot:
    stand_in = Pilot()
    module = ModuleType("harness.run.scenario_flight")
    module.__dict__["fly_to_folder"] = stand_in.fly_to_folder
    monkeypatch.setitem(sys.modules, "harness.run.scenario_flight", module)
    return stand_in


@pytest.mark.parametrize(
    ("outcome", "status"),
    [("reached", 0), ("unreachable", 3)]
    + [(name, 1) for name in ("collision", "out_of_bounds", "timeout", "lost_control", "planner_failed")],
)
def test_exit_status_of_fly_follows_the_outcome(
    outcome: str, status: int, pilot: Pilot, capsys: pytest.CaptureFixture[str]
) -> None:
    pilot.outcome = outcome
    assert main(["fly", "paper_circles"]) == status
    said = capsys.readouterr()
    assert outcome in said.out
    assert said.out.splitlines()[-1] == "run folder: runs/paper_circles/rolling_window-aerosonde-1"
    assert said.err == ""


def test_runs_that_differ_in_settings_have_folders_of_their_own(pilot: Pilot, tmp_path: Path) -> None:
    def folder(*options: str) -> str:
        assert main(["fly", "paper_circles", "--quiet", *options]) == 0
        return str(pilot.asked[-1][1])

    plain = "runs/paper_circles/rolling_window-aerosonde-1"
    assert folder() == folder() == plain
    calm = folder("--set", "environment.wind.speed_mps=0")
    windy = folder("--set", "environment.wind.speed_mps=8")
    assert re.fullmatch(re.escape(plain) + "-[0-9a-f]{8}", windy)
    assert len({plain, calm, windy}) == 3
    assert folder("--set", "environment.wind.speed_mps= 8") == windy, "a re-run replaces its own"
    dots, brackets = (f"obstacles{index}.circle.radius_m=500" for index in (".0", "[0]"))
    assert folder("--set", dots) == folder("--set", brackets)
    assert folder("--seed", "9") == folder("--set", "seed=9") == plain[:-1] + "9"
    assert folder("--set", "planner.kind=bug2") == "runs/paper_circles/bug2-aerosonde-1"
    assert folder("--set", "sensor.rays=90", "--out", str(tmp_path)) == str(tmp_path)


@pytest.mark.parametrize("complete", [None, True, False])
def test_an_interrupted_flight_exits_130_and_tells_of_the_folder_as_it_is(
    complete: bool | None,
    pilot: Pilot,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    if complete is not None:
        Path("here").mkdir()
        Path("here/manifest.json").write_text(json.dumps({"schema": "wayproof/run/1", "complete": complete}))
    pilot.outcome = KeyboardInterrupt()
    assert main(["fly", "paper_circles", "--out", "here"]) == 130
    left = "the run in here is marked incomplete" if complete is False else "nothing was written"
    assert capsys.readouterr() == ("", f"wayproof: interrupted; {left}\n")
    assert Path("here").exists() is (complete is not None)
