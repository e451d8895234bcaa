"""Tables and progress as a person sees them."""

from __future__ import annotations

from typing import Any

import pytest

from harness.cli.terminal import bench_rows, flight_rows, print_table, progress_bar

METRICS: dict[str, Any] = {
    "outcome": "collision",
    "reason": "hit obstacle [3] at 812.3 s, "
    + "and a reason that goes on for longer than a line of 80 columns",
    "flown_length_m": 94321.5,
    "planned_length_m": None,
    "flight_time_s": 3772.9,
    "min_clearance_m": -0.52,
    "clearance_violation_s": 0.0,
    "cross_track_m": {"rms": 0.04, "p95": 0.09, "max": 0.18},
    "altitude_error_m": {"rms": None, "p95": None, "max": None},
    "trackable": False,
    "trackability": [
        {"trackable": True, "cause": None},
        {"trackable": False, "cause": "wind drift"},
        {"trackable": False, "cause": "bank limit"},
        {"trackable": False, "cause": "wind drift"},
    ],
    "replans": 41,
    "compute_ms": {"p50": 0.2, "p99": 3.25, "max": 7.75},
    "timing": {"sim_s": 3772.9, "wall_s": 6.12, "realtime_factor": 616.5},
}


def test_the_table_of_a_flight_fits_80_columns_and_says_what_happened(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    print_table("a: b", flight_rows(METRICS))
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    assert "collision: hit obstacle [3] at 812.3 s" in shown
    assert "94,322 m, planned - m" in shown
    assert "no: 3 of 4 legs, wind drift (2 legs), bank limit" in shown
    assert "rms 0.04 / p95 0.09 / max 0.18 m" in shown
    assert "rms - / p95 - / max - m" in shown
    assert "\x1b" not in shown


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


def test_there_is_no_progress_where_nobody_looks(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    with progress_bar(1000.0) as report:
        assert report is None
    assert capsys.readouterr().err == ""


def test_progress_on_a_terminal_shows_time_and_distance_to_go(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "100")
    with progress_bar(1000.0) as report:
        assert report is not None
        report(120.0, 250.0, "cruise")
    said = capsys.readouterr()
    assert said.out == ""
    assert "250 m to go" in said.err
    assert "120 s" in said.err
    assert "cruise" in said.err


def test_the_table_of_a_bench_has_every_block() -> None:
    rows = bench_rows(
        {
            "rounds": 4,
            "steady": True,
            "closed_loop_ratio": 1.4321,
            "closed_loop_recording_ratio": 1.7,
            "planner_ms": {"p50": 0.1, "p99": 2.5, "max": 9.0},
            "blocks": {"dynamics": 0.75, "planner": 0.05},
        }
    )
    assert rows["closed loop"] == "1.432 of bare JSBSim"
    assert rows["planner"] == "p50 0.10 ms, p99 2.50 ms, max 9.00 ms"
    assert rows["rounds"] == "4, steady"
    assert rows["  dynamics"] == "75.0%"
    assert rows["  planner"] == "5.0%"
