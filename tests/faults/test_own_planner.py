"""A planner of another distribution, in a process of its own, that prints, exits or hangs."""

import json
import os
import re
import signal
from pathlib import Path

import pytest

from harness.cli.app import main
from harness.run_files.run_folder import load_run
from tests.faults.command import CAMPAIGN_FILES, ROOT, distribution, run, start, wait_until

PLUGIN = '''
import atexit
import ctypes
import os
import sys
from pathlib import Path

from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.guidance.registry import GuidanceKind
from planner.interface import Plan, PlanStatus
from planner.rolling_window.planner import RollingWindow

print("on being imported")
libc = ctypes.CDLL(None)


class Talks(RollingWindow):
    """Prints in every way that there is."""

    def __init__(self, config, mission):
        print("on being made")
        atexit.register(print, "on leaving")
        super().__init__(config, mission)

    def plan(self, request):
        if request.flown is None:
            print("from Python")
            os.write(1, b"past Python\\n")
            libc.puts(b"from C")
            os.system("echo from a process of its own")
        return super().plan(request)


class Law(PreviewLaw):
    def update(self, state):
        print("from a law")
        return super().update(state)


LAW = GuidanceKind("law", "one that prints", PreviewConfig, Law)


class Hangs(RollingWindow):
    def plan(self, request):
        Path("hanging").touch()
        while True:
            pass


class Unspeakable(Exception):
    def __str__(self):
        sys.exit(0)


class Exits(RollingWindow):
    def plan(self, request):
        raise Unspeakable


class Gone(RollingWindow):
    def plan(self, request):
        os._exit(0)
'''
RAISES = """\
from planner.interface import Plan, PlanStatus

class Bug:
    def plan(self, request):
        return self.later(request.time_s)

    def later(self, time_s):
        if time_s > 3.0:
            raise ValueError("oops")
        return Plan(PlanStatus.NO_PATH, "not yet")
"""
CAMPAIGN = """\
schema: wayproof/campaign/1
name: short
seed: 5
scenarios: [short.yaml]
planners: [gone, rolling_window]
"""


@pytest.fixture
def place(tmp_path: Path) -> Path:
    distribution(tmp_path / "site", "own_plugin", PLUGIN, "talks", "hangs", "exits", "gone")
    (tmp_path / "short.yaml").write_text(CAMPAIGN_FILES["short.yaml"])
    (tmp_path / "campaign.yaml").write_text(CAMPAIGN)
    return tmp_path


def own_path(place: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{place / 'site'}"}


def ran(place: Path, *arguments: str) -> tuple[int, str, str]:
    return run(place, *arguments, env=own_path(place))


def flown(place: Path, kind: str, *arguments: str) -> tuple[int, str, str]:
    return ran(place, "fly", "short.yaml", "--planner", kind, "--out", "run", "--no-recording", *arguments)


@pytest.mark.flights
def test_nothing_that_a_planner_or_a_law_prints_gets_into_the_result(place: Path) -> None:
    status, out, err = flown(place, "talks", "--json", "--guidance", "own_plugin:LAW")
    assert (status, json.loads(out)["outcome"]) == (0, "reached"), err
    ways = "on being imported,on being made,from Python,past Python,from C,a process of its own,a law,on leaving"
    assert [way for way in ways.split(",") if f"{way}\n" not in err] == []


@pytest.mark.flights
def test_an_error_that_exits_when_it_is_told_is_a_planner_that_failed(place: Path) -> None:
    status, _, _ = flown(place, "exits", "--quiet")
    assert status == 1
    run = load_run(place / "run")
    assert run.metrics["outcome"] == "planner_failed"
    line = PLUGIN[: PLUGIN.index("raise Unspeakable")].count("\n") + 1
    told = f"the planner raised Unspeakable: it cannot be told what (own_plugin.py:{line})"
    assert run.metrics["reason"] == told


@pytest.mark.slow
def test_a_sweep_survives_a_planner_that_ends_its_process(place: Path) -> None:
    status, out, err = ran(place, "sweep", "campaign.yaml", "--workers", "1", "--out", "out", "--json")
    assert status == 1, err
    assert json.loads(out)["outcomes"] == {"reached": 1}, "a killed process leaves no row: it is flown again"


@pytest.mark.flights
def test_a_run_of_a_campaign_with_an_own_planner_flies_again_as_it_is_told(place: Path) -> None:
    (place / "bug.py").write_text(RAISES)
    status, out, err = ran(place, "sweep", "campaign.yaml", "--planners", "bug.py:Bug", "--out", "out")
    assert status == 0, err
    (again,) = [line for line in out.splitlines() if line.startswith("again: ")]
    command = "wayproof fly --from out/results.parquet --run 0 --planner bug.py:Bug"
    assert again == f"again: {command}"
    assert f"Flown again: {command}\n" in re.sub("<[^>]*>", "", (place / "out" / "summary.html").read_text())
    status, out, err = ran(place, *command.split()[1:], "--no-recording", "--out", "run")
    assert status == 1, err
    assert "digest: as the campaign flew it" in out
    assert load_run(place / "run").metrics["reason"] == "the planner raised ValueError: oops (bug.py:9)"
    (place / "bug.py").write_text(RAISES.replace("ValueError", "1 / 0 #").replace("> 3.0", "> 6.0"))
    status, _, err = ran(place, *command.split()[1:], "--no-recording", "--quiet", "--out", "run")
    assert status == 1
    assert "run 0 was flown otherwise" in err


def test_it_is_said_how_an_own_planner_is_named(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (place / "campaign.yaml").write_text(CAMPAIGN.replace("gone", "'other.py:Bug'"))
    assert main(["sweep", str(place / "campaign.yaml")]) == 2
    assert "planners[0]: is 'other.py:Bug', which no file may name: give" in (told := capsys.readouterr().err)
    assert "--planners other.py:Bug,..., which replaces all of `planners`" in told
    assert main(["fly", str(place / "short.yaml"), "--planner", "other.py"]) == 2
    assert "or FILE.py:NAME as other.py:NAME" in " ".join(capsys.readouterr().err.split())


@pytest.mark.flights
@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ("fly short.yaml --planner hangs --no-recording", "the run in out is marked incomplete"),
        ("compare short.yaml --planners hangs --no-recording", "the comparison in out is marked"),
        ("sweep hangs.yaml --workers 1", "what is done is in out, --resume goes on"),
    ],
    ids=["fly", "compare", "sweep"],
)
def test_one_interrupt_ends_a_planner_that_hangs(arguments: str, told: str, place: Path) -> None:
    (place / "hangs.yaml").write_text(CAMPAIGN.replace("[gone, rolling_window]", "[hangs]"))
    process = start(place, *arguments.split(), "--out", "out", env=own_path(place))
    wait_until((place / "hanging").exists, process)
    process.send_signal(signal.SIGINT)
    try:
        _, err = process.communicate(timeout=30)
    finally:
        process.kill()
    assert process.returncode == 130
    assert f"wayproof: interrupted; {told}" in err
