"""The READMEs' commands and examples, run as they are written."""

import json
import os
import re
import shlex
import shutil
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from harness.run_files.run_folder import load_run
from tests.longer import longer
from tests.processes import FRONT_DOOR, ROOT, python

ROOMS = ("planner", "aircraft", "harness", "scenarios")
READMES = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in (
        ROOT / "README.md",
        *(each for room in ROOMS for each in sorted((ROOT / room).rglob("*.md"))),
    )
}
README = READMES["README.md"]
CAMPAIGNS, FALSIFY = READMES["harness/campaign/README.md"], READMES["harness/falsify/README.md"]
SET_UP = "python3 -m venv .venv && .venv/bin/pip install -q --no-compile -c constraints.txt "
MOST_LINES = 250
FLY, TESTS = (line for line in README.splitlines() if line.startswith(SET_UP))


def said(done: subprocess.CompletedProcess[str]) -> list[str]:
    """Lines on standard error, but for those of progress, which come where a flight takes long."""
    return [
        line
        for line in done.stderr.splitlines()
        if not re.match(r"wayproof: (\d+ of \d+|begun|starting up|\d+ s flown)", line)
    ]


def blocks(language: str, readme: str = README) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", readme, re.MULTILINE | re.DOTALL)


COMMANDS = [
    line
    for readme in READMES.values()
    for block in blocks("sh", readme)
    for line in block.splitlines()
    if line.startswith("wayproof ")
]


def wayproof(arguments: str, folder: Path, *, path: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Runs the command in a folder as a person would, the packages taken from `path`."""
    return python("-m", "harness", *shlex.split(arguments), folder=folder, path=(path, ROOT, FRONT_DOOR))


def test_the_first_command_flies_the_papers_scenario_and_prints_what_readme_shows(tmp_path: Path) -> None:
    arguments = FLY.removeprefix(f"{SET_UP}-e . && .venv/bin/wayproof ")
    assert arguments == "fly scenarios/paper_circles.yaml --conditions typical"
    flown = wayproof(arguments, tmp_path)
    assert (flown.returncode, said(flown)) == (0, [])
    (shown,) = (block for block in blocks("text") if "run folder:" in block)
    names = [line[:20].strip() for line in shown.splitlines()]
    assert [line[:20].strip() for line in flown.stdout.splitlines()] == names
    folder = shown.splitlines()[-1].removeprefix("run folder: ")
    assert load_run(tmp_path / folder).metrics["outcome"] == "reached"
    assert (tmp_path / folder / "flight.rrd").stat().st_size < 25e6, "an hour's flight"
    assert f"`wayproof view {folder}`" in README


def test_the_second_command_runs_these_tests_and_is_what_ci_runs() -> None:
    assert f"{SET_UP}-e '.[dev]' && .venv/bin/pytest -n 2" == TESTS
    ci = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "tests=$(grep -m1 '^python3 -m venv .*pytest' README.md)" in ci
    assert 'bash -c "$tests"' in ci
    contributing = (ROOT / ".github" / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert "| `pytest -n 2 -m flights` |" in contributing
    assert os.access(ROOT / ".ci" / "run", os.X_OK)


def marked(command: str) -> Any:
    """A command shown; the figures of all aircraft take a minute of flights, of three they are listed elsewhere."""
    if command == "wayproof list aircraft":
        return pytest.param(command, marks=pytest.mark.slow)
    quick = ("--help", "list scenarios", "list planners", "schema", "validate scenarios/paper_circles.yaml")
    return command if command.removeprefix("wayproof ") in quick else longer([command])[0]


@pytest.mark.parametrize("command", [marked(command) for command in COMMANDS])
def test_a_command_shown_ends_well(command: str, tmp_path: Path) -> None:
    shown = wayproof(command.removeprefix("wayproof "), tmp_path)
    assert shown.returncode == 0, shown.stderr


@pytest.mark.flights
def test_the_tour_can_be_gone_in_order(tmp_path: Path) -> None:
    (tour,) = blocks("bash")
    commands = [line.partition("#")[0].removeprefix("wayproof ").split() for line in tour.splitlines()]
    assert [command[0] for command in commands] == ["fly", "view", "report", "compare", "view"]
    for command, *arguments in commands:
        if command == "view":
            assert [(tmp_path / run / "flight.rrd").is_file() for run in arguments] == [True] * len(arguments)
        else:
            done = wayproof(shlex.join([command, *arguments]), tmp_path)
            assert done.returncode == 0, done.stderr
    for page in ("aerosonde_forest/rolling_window-aerosonde-1", "comparison"):
        assert (tmp_path / "runs" / page / "report.html").is_file()


@pytest.mark.flights
def test_ones_own_scenario_is_flown_and_a_mistake_in_it_refused_as_shown(tmp_path: Path) -> None:
    (text,) = blocks("yaml")
    (tmp_path / "my_world.yaml").write_text(text)
    assert wayproof("fly my_world.yaml --no-recording --quiet", tmp_path).returncode == 0

    spoilt = text.replace("goal_m: [7500, 3000]", "goal_m: [3500, 3400]")
    assert spoilt != text
    (tmp_path / "my_world.yaml").write_text(spoilt)
    refused = wayproof("fly my_world.yaml", tmp_path)
    assert refused.returncode == 2
    assert refused.stderr in blocks("text")


@pytest.mark.flights
def test_ones_own_campaign_is_flown_and_a_row_of_it_flown_again(tmp_path: Path) -> None:
    (scenario,), (campaign,) = blocks("yaml"), blocks("yml", CAMPAIGNS)
    (tmp_path / "my_world.yaml").write_text(scenario)
    (tmp_path / "my_campaign.yaml").write_text(campaign)
    assert "`wayproof sweep my_campaign.yaml`" in CAMPAIGNS
    flown = wayproof("sweep my_campaign.yaml", tmp_path)
    assert (flown.returncode, said(flown)) == (0, [])
    assert flown.stdout.startswith("my_campaign: 12 runs")
    again = "fly --from runs/my_campaign/results.parquet --run 7"
    assert f"`wayproof {again}`" in CAMPAIGNS
    metrics = json.loads(wayproof(f"{again} --no-recording --json", tmp_path).stdout)
    rows = pq.read_table(tmp_path / "runs/my_campaign/results.parquet").to_pylist()
    assert metrics["digest"] == rows[7]["digest"]
    assert [name for name in ("case", "cross_track_m.p95", "length_ratio") if name not in rows[7]] == []


@pytest.mark.flights
def test_a_path_is_checked_as_shown_and_the_same_mission_planned_is_trackable(tmp_path: Path) -> None:
    (text,), (scenario,) = blocks("csv"), blocks("yaml")
    (tmp_path / "my_path.csv").write_text(text)
    (tmp_path / "my_world.yaml").write_text(scenario)
    checked = wayproof("check my_path.csv --aircraft aerosonde --no-recording", tmp_path)
    assert (checked.returncode, said(checked)) == (1, [])
    (shown,) = (block for block in blocks("text") if block.startswith("my_path.csv"))
    names = [line[:20].strip() for line in shown.splitlines()]
    assert [line[:20].strip() for line in checked.stdout.splitlines()][: len(names)] == names
    assert "no: turn radius too tight (2 legs)" in checked.stdout

    assert wayproof("fly my_world.yaml --no-recording --quiet", tmp_path).returncode == 0
    run = "runs/my_world/rolling_window-aerosonde-1"
    assert load_run(tmp_path / run).metrics["trackable"] is True
    for command in (
        f"export {run} --what planned --format geojson --out planned.geojson",
        "check planned.geojson --aircraft aerosonde",
    ):
        assert f"`wayproof {command}`" in README
        assert wayproof(command, tmp_path).returncode == 0


@pytest.mark.flights
def test_the_breaking_point_is_found_as_shown(tmp_path: Path) -> None:
    (command,) = re.findall(r"`wayproof (falsify aerosonde_forest [^`]+)`", FALSIFY)
    (shown,) = (block for block in blocks("text", FALSIFY) if "mildest found" in block)
    searched = wayproof(command.replace("--runs 24", "--runs 8"), tmp_path)
    assert (searched.returncode, said(searched)) == (0, [])
    names = [line[:29].strip() for line in shown.splitlines()[2:5]]
    assert [line[:29].strip() for line in searched.stdout.splitlines()[2:5]] == names
    again, last = shown.splitlines()[-2:]
    assert again in searched.stdout.splitlines()
    assert searched.stdout.splitlines()[-1].startswith(last.partition("=")[0])
    flown = wayproof(f"{again.removeprefix('again: wayproof ')} --no-recording --json --out again", tmp_path)
    assert flown.returncode == 1
    folder = (tmp_path / again.removeprefix("again: wayproof fly ")).parent
    found = json.loads((folder / "falsify.json").read_text())["found"]
    assert json.loads(flown.stdout)["digest"] == found["figures"]["digest"]


@pytest.mark.flights
def test_ones_own_planner_in_a_file_is_flown_on_the_command_line_and_in_python(tmp_path: Path) -> None:
    planner, script = blocks("python")
    (scenario,) = blocks("yaml")
    (tmp_path / "my_planner.py").write_text(planner)
    (tmp_path / "my_world.yaml").write_text(scenario)
    command = "fly my_world.yaml --planner my_planner.py:Sidestep"
    assert f"`wayproof {command}`" in README
    flown = wayproof(f"{command} --no-recording --json", tmp_path)
    assert (flown.returncode, said(flown)) == (0, [])
    first = json.loads(flown.stdout)
    assert first["outcome"] == "reached"
    done = python("-c", script, folder=tmp_path)
    assert (done.returncode, said(done)) == (0, [])
    assert done.stdout.splitlines()[0] == f"reached {first['reason']}"
    (again,) = load_run(tmp_path / "runs" / "windy").manifest["command"]
    assert again.startswith("wayproof.fly('my_world', planner='rolling_window', ")


@pytest.mark.flights
def test_ones_own_law_in_a_file_is_compared_on_the_command_line_and_in_python(tmp_path: Path) -> None:
    (law,) = (each for each in blocks("python", READMES["aircraft/README.md"]) if "LAW = " in each)
    (tmp_path / "my_law.py").write_text(law)
    (scenario,) = blocks("yaml")
    (tmp_path / "my_world.yaml").write_text(scenario)
    laws = "preview,my_law.py:LAW"
    flown = wayproof(
        f"compare my_world.yaml --planners rolling_window --guidance {laws} --no-recording --json", tmp_path
    )
    assert (flown.returncode, said(flown)) == (0, [])
    rows = json.loads(flown.stdout)["rows"]
    assert [row["outcome"] for row in rows] == ["reached", "reached"]
    assert rows[0]["total_system_error_max_m"] < rows[1]["total_system_error_max_m"]
    call = f"compare('my_world.yaml', ['rolling_window'], 'in_python', guidance={laws.split(',')})"
    done = python("-c", f"import wayproof\nprint(wayproof.{call}.table.to_pylist())", folder=tmp_path)
    assert (done.returncode, said(done)) == (0, [])
    assert repr(rows[1]["total_system_error_max_m"]) in done.stdout


@pytest.mark.flights
@pytest.mark.parametrize(
    "name", [longer([name])[0] if name == "harness/learning/README.md" else name for name in READMES]
)
def test_python_shown_runs(name: str, tmp_path: Path) -> None:
    shown = blocks("python", READMES[name]) if name not in ("README.md", "planner/README.md") else []
    # Each with names of its own, in one process: to import and load all of it takes longer than to run them.
    code = "\n".join(f"exec({block!r}, {{'__name__': '__main__'}})" for block in shown)
    if shown:
        done = python("-c", code, folder=tmp_path)
        assert (done.returncode, said(done)) == (0, [])


@pytest.mark.flights
def test_ones_own_planner_as_a_distribution_is_found_and_flown(tmp_path: Path) -> None:
    text = READMES["planner/README.md"]
    (planner,), (project,), (scenario,) = blocks("python", text), blocks("toml", text), blocks("yaml")
    (tmp_path / "straight_on.py").write_text(planner)
    (tmp_path / "pyproject.toml").write_text(project)
    (tmp_path / "my_world.yaml").write_text(scenario)
    build = f"import hatchling.build; hatchling.build.build_wheel({str(tmp_path)!r})"
    python("-c", build, folder=tmp_path, check=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")

    run = tmp_path / "run"
    listed = wayproof("list planners", run.parent, path=tmp_path / "installed")
    assert "straight_on: straight on along its first course" in listed.stdout.splitlines()
    fly = f"fly my_world.yaml --planner straight_on --set planner.beyond_m=700 --out {run}"
    flown = wayproof(f"{fly} --no-recording --quiet", tmp_path, path=tmp_path / "installed")
    assert (flown.returncode, said(flown)) == (1, [])
    read = load_run(run)
    assert read.metrics["outcome"] == "collision"
    assert [plan.length_m for plan in read.plans] == [pytest.approx(7700.0)]


def test_the_scenarios_named_are_those_there_are() -> None:
    for path in (ROOT / "scenarios").glob("*.yaml"):
        assert f"`{path.stem}`" in READMES["scenarios/README.md"]


@pytest.mark.parametrize("name", READMES)
def test_files_and_pictures_named_are_there(name: str) -> None:
    text, folder = READMES[name], (ROOT / name).parent
    links = re.findall(r"\]\(([^)]+)\)", text)
    near = [link.partition("#")[0] for link in links if not link.startswith(("https://", "#"))]
    named = re.findall(r"`((?:planner|aircraft|harness|scenarios|tests)/[\w./]+)`", text)
    assert [link for link in near if not (folder / link).exists()] == []
    assert [path for path in named if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("name", READMES)
def test_links_lead_to_headings(name: str) -> None:
    folder = (ROOT / name).parent
    for link in re.findall(r"\]\(([^)]*#[^)]+)\)", READMES[name]):
        if not link.startswith("https://"):
            path, _, anchor = link.partition("#")
            target = READMES[str((folder / path).resolve().relative_to(ROOT)) if path else name]
            headings = re.findall(r"^#+ (.+)$", target, re.MULTILINE)
            assert anchor in {re.sub(r"[^\w -]", "", each.lower()).strip().replace(" ", "-") for each in headings}


def test_every_picture_is_shown_and_small() -> None:
    pictures = list((ROOT / ".pictures").iterdir())
    assert [each.name for each in pictures if each.stat().st_size >= 150 * 1024] == []
    shown = {Path(path).name for text in READMES.values() for path in re.findall(r"\.pictures/([^)]+)\)", text)}
    assert {each.name for each in pictures} == shown


def test_the_top_readme_is_short_and_leads_to_all_others() -> None:
    """In two steps at most, but for the licences of worlds."""
    assert len(README.splitlines()) <= MOST_LINES
    first = {name for name in READMES if f"]({name}" in README}
    second = {name for name in READMES for by in first if f"]({os.path.relpath(name, Path(by).parent)}" in READMES[by]}
    assert set(READMES) - first - second - {"README.md", "scenarios/worlds/LICENCES.md"} == set()
    assert "`git clone <this repository>`" in README


@pytest.mark.slow
def test_both_commands_run_as_written_in_a_fresh_copy(tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    leave = shutil.ignore_patterns(".git", ".venv", "runs", "__pycache__", ".*_cache", ".hypothesis")
    shutil.copytree(ROOT, copy, ignore=leave)
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    usual: dict[str, Any] = {"cwd": copy, "capture_output": True, "text": True, "timeout": 600}
    flown = subprocess.run(["bash", "-c", FLY], env=plain, check=False, **usual)
    assert flown.returncode == 0, flown.stderr
    assert "reached: inside the goal circle" in flown.stdout
    counted = plain | {"PYTEST_ADDOPTS": "--collect-only -q"}
    collected = subprocess.run(["bash", "-c", TESTS], env=counted, check=False, **usual)
    assert collected.returncode == 0, collected.stdout + collected.stderr
    assert "tests/test_readme.py::" in collected.stdout
