"""What `wayproof list` prints."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Any

import pytest

from aircraft import airframes
from harness.cli.app import main
from harness.scenario import kinds as registry
from harness.scenario import shipped
from harness.scenario.kinds import guidance_kinds, planner_kinds
from tests.refusals import refused


@pytest.mark.parametrize(
    ("what", "named"), [("scenarios", shipped.shipped_scenarios), ("campaigns", shipped.shipped_campaigns)]
)
def test_shipped_files_are_listed_and_rows_go_on_below_themselves_in_a_narrow_terminal(
    what: str,
    named: Callable[[], Mapping[str, Path]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["list", what]) == 0
    piped = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in piped] == list(named())
    assert all(len(line.split()) > 3 for line in piped)
    assert any(len(line) > 80 for line in piped)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(["list", what]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert max(map(len, shown)) <= 80
    assert " ".join(shown).split() == " ".join(piped).split()


def test_planners_and_guidance_are_listed_with_keys_and_defaults(capsys: pytest.CaptureFixture[str]) -> None:
    some = {
        "guidance": "  period_s = 17 s: period of the track error's decay (NAVL1_PERIOD)",
        "planners": "  steps = 16: N, how many steps the search looks ahead",
    }
    every: dict[str, Mapping[str, Any]] = {"guidance": guidance_kinds(), "planners": planner_kinds()}
    for what, kinds in every.items():
        assert main(["list", what]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert [line.partition(": ")[0] for line in lines if line[0] != " "] == list(kinds)
        told = [line.split()[0] for line in lines if line.startswith("  ") and " = " in line]
        assert told[0] == fields(next(iter(kinds.values())).config)[0].name
        assert len(told) == sum(len(fields(kind.config)) for kind in kinds.values())
        assert some[what] in lines
        assert all(len(line) <= 80 for line in lines)


@pytest.mark.flights
def test_aircraft_are_listed_with_their_figures(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(airframes, "aircraft_names", lambda: ("aerosonde", "c172p", "SGS"))
    assert main(["list", "aircraft"]) == 0
    heading, aerosonde, cessna, glider = capsys.readouterr().out.splitlines()
    assert heading.split()[0] == "name"
    assert aerosonde.split()[:6] == ["aerosonde", "11", "17.4-32.3", "25", "110", "yes"]
    assert cessna.split()[:2] == ["c172p", "853"]
    assert glider.startswith("SGS           cannot be flown: SGS cannot be trimmed for level flight")


def test_what_cannot_be_loaded_of_another_distribution_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("absent", "math:no_planner", registry.PLANNER.group)
    monkeypatch.setattr(registry, "entry_points", lambda group: EntryPoints([point]))
    said = refused("list", "planners")
    assert said.startswith("wayproof: the planner of entry point 'absent' (math:no_planner) of another")
    assert "AttributeError" in said
    assert said.count("\n") == 1
