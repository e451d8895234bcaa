"""Tables and progress as a person sees them."""

import json
import re
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.cli.command_line import print_json
from harness.cli.flight_rows import flight_rows
from harness.cli.terminal import print_table, progress_bar, say, step_bar
from harness.files.wording import printable
from tests.refusals import refused

METRICS: dict[str, Any] = {
    "outcome": "collision",
    "reason": "hit obstacle [3] at 812.3 s, and a reason that goes on for longer than a line of 80 columns",
    "flown_length_m": 94321.5, "planned_length_m": None, "flight_time_s": 3772.9, "min_clearance_m": -0.52,
    "clearance_violation_s": 0.0, "cross_track_m": {"rms": 0.04, "p95": 0.09, "max": 0.18},
    "altitude_error_m": {"rms": None, "p95": None, "max": None}, "trackable": False,
    "trackability": [{"trackable": cause is None, "cause": cause}
                     for cause in (None, "wind drift", "bank limit", "wind drift")],
    "replans": 41, "compute_ms": {"p50": 0.2, "p99": 3.25, "max": 7.75},
    "timing": {"sim_s": 3772.9, "wall_s": 6.12, "realtime_factor": 616.5},
}  # fmt: skip


def test_the_table_of_a_flight_fits_80_columns_and_says_what_happened(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    print_table("a: b", flight_rows(METRICS))
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    for said in ("hit obstacle [3] at 812.3 s", "94,322 m, planned - m", "0.04 / p95 0.09 / max 0.18 m"):
        assert said in shown
    assert flight_rows({**METRICS, "min_clearance_m": None})["least clearance"] == "no obstacle"
    assert "no: 3 of 4 legs, wind drift (2 legs), bank limit" in shown
    assert "rms - / p95 - / max - m" in shown
    assert re.search(r"\n replans +41 *\n planner time +p99 \S+ / max \S+ ms a search *\n wall time ", shown)
    assert "\x1b" not in shown


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("rolling_window+shield", ["rolling_window+", " shield"]),
        ("improved_bug+shield\n vector_field", ["improved_bug+", " shield", " vector_field"]),
        ("[bold]campaign.yaml: slow[/]", ["campaign.yaml:", "slow"]),
        ("AwordLongerThanItsColumn", ["AwordLongerThan", "ItsColumn"]),
        ("wayproof_rolling_window", ["wayproof_", " rolling_", " window"]),
        ("bug2", ["bug2"]),
    ],
)
def test_a_long_name_in_a_table_goes_on_below_from_behind_its_plus_on(
    name: str, lines: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    figures = ("planner_failed", "104.6", "1.0003", "-0.0695", "0.34", "yes", "39.1", "25.7")
    heads = ("planner", "outcome", "km", "ratio", "clear m", "κ·R", "tracks", "tse max", "p99 ms")
    print_table("", [(name, *figures)], heads)
    shown = capsys.readouterr().out.splitlines()
    assert max(map(len, shown)) <= 80
    (first,) = (place for place, line in enumerate(shown) if "planner_failed" in line)
    assert [line.partition(figures[0])[0][1:].rstrip() for line in shown[first : first + len(lines)]] == lines
    assert shown[first + len(lines)].strip() == ""
    assert " ".join(shown[first].split()).endswith(" ".join(figures))


EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202egnp\r\x7f\ud800"
SPELT = r"\x1b]0;owned\x07\x1b[2J\x9b31m\u202egnp\r\x7f\ud800"


def test_control_characters_of_others_never_reach_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    assert printable(EVIL) == SPELT
    assert printable("na\u00efve \u2013 10 \u00b0\n\tb") == "na\u00efve \u2013 10 \u00b0\n\tb"
    print_table(EVIL, flight_rows({**METRICS, "reason": EVIL}))
    print_table(EVIL, [(EVIL, EVIL)], ("", EVIL))
    say(EVIL)
    say(EVIL, err=True)
    print_json({"reason": EVIL})
    said = capsys.readouterr()
    shown = said.out + said.err
    assert shown.count("owned") >= 7
    assert printable(shown) == shown
    assert json.loads(said.out[said.out.index("{") :]) == {"reason": EVIL}


@pytest.mark.parametrize(
    "arguments",
    [["fly", EVIL[:-1]], ["fly", "paper_circles", "--set", f"{EVIL[:-1]}=1"],
     ["fly", "paper_circles", "--planner", EVIL[:-1]], ["fly", "paper_circles", "--aircraft", EVIL[:-1]],
     ["check", f"{EVIL[:-1]}.csv", "--aircraft", "aerosonde"], ["report", EVIL[:-1]], ["validate", EVIL[:-1]],
     [EVIL[:-1]]],
)  # fmt: skip
def test_what_was_typed_in_is_said_without_control_characters(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    said = refused(*arguments)
    assert printable(said) == said != ""


def test_the_commands_speak_through_what_spells_control_characters_out() -> None:
    """`say` and `plain` know how."""
    for path in sorted((Path(__file__).parents[3] / "harness" / "cli").glob("*.py")):
        text = path.read_text(encoding="utf-8")
        assert ("typer.echo(" in text) == (path.name == "terminal.py"), path.name
        assert ("rich.markup" in text) == (path.name == "terminal.py"), path.name
        assert not re.search(r"(?<![\w.])print\(", text), path.name


def test_a_flight_without_a_plan_was_not_tracked() -> None:
    assert flight_rows({**METRICS, "trackability": []})["trackable"] == "no: no plan was flown"
    assert flight_rows({**METRICS, "trackable": True})["trackable"] == "yes"


@pytest.mark.parametrize(("no_color", "coloured"), [("", True), ("1", False)])
def test_no_color_is_respected(
    no_color: str, coloured: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("NO_COLOR", no_color)
    print_table("a: b", flight_rows(METRICS))
    assert ("\x1b[1;31m" in capsys.readouterr().out) is coloured


def test_without_a_terminal_progress_is_a_line_at_times(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # as a notebook sets it, also for what it reads from a pipe
    monkeypatch.setattr("harness.cli.terminal.LINE_EVERY_S", 0.01)
    with progress_bar(1000.0) as report:
        report(120.0, 250.0, "cruise")
        time.sleep(0.2)
    with step_bar() as step:
        step(2, 5, "forest")
        time.sleep(0.2)
    said = capsys.readouterr()
    assert said.out == ""
    assert re.search(r"^wayproof: 120 s flown, \d+ x real time, 250 m to go, cruise$", said.err, re.MULTILINE)
    assert "wayproof: 2 of 5: forest\n" in said.err


def test_progress_on_a_terminal_shows_time_and_distance_to_go(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "100")
    ticks = iter(range(50, 99, 10))
    monkeypatch.setattr("harness.cli.terminal.time", SimpleNamespace(monotonic=ticks.__next__))
    with progress_bar(1000.0) as report:
        report(0.0, 1000.0, "start")
        report(120.0, 250.0, "cruise")
    said = capsys.readouterr()
    assert said.out == ""
    assert "120 s flown, 12 x real time, 250 m to go, cruise" in said.err
    with progress_bar(1000.0) as report:
        report(180.0, -1.2, "end")
    assert " 0 m to go, end" in capsys.readouterr().err
