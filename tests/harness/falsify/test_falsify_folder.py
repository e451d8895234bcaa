"""The folder of a search for the breaking point: one search at a time, an earlier one kept until the next has ended."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import pytest

from aircraft.airframes import AircraftError
from harness.cli.app import main
from harness.falsify.folder import FALSIFIED, INDEX, TRIALS
from harness.files.errors import RunFolderError
from harness.files.strict_yaml import InputError
from harness.scenario.scenario import Scenario
from tests.harness.breaking import broken, stand_in


def test_a_folder_with_other_things_is_refused(to_break: Path) -> None:
    (to_break.parent / "out").mkdir()
    (to_break.parent / "out" / "mine.txt").touch()
    with pytest.raises(RunFolderError, match="not empty and not a search"):
        broken(to_break, ("mission.time_limit_s", 300.0, 200.0))
    assert [path.name for path in (to_break.parent / "out").iterdir()] == ["mine.txt"]


def content(folder: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for each in folder.iterdir()}


@pytest.mark.parametrize("flights", [0, 1, 6])
def test_a_condition_that_cannot_be_flown_leaves_everything_as_it_was(to_break: Path, flights: int) -> None:
    def refuses(scenario: Scenario) -> dict[str, Any]:
        if next(begun) >= flights:
            raise AircraftError("cannot be trimmed")
        return stand_in()

    begun = itertools.count()
    with pytest.raises(InputError, match="cannot fly this condition: cannot be trimmed"):
        broken(to_break, ("sensor.dropout", 0.0, 1.0), flown=refuses, out=to_break.parent / "new" / "out")
    assert [each.name for each in to_break.parent.iterdir()] == ["straight.yaml"]

    broken(
        to_break, ("mission.time_limit_s", 300.0, 20.0), ("aircraft.airspeed_mps", 28.0, 18.0), conditions=3
    )
    earlier = content(to_break.parent / "out")
    assert {FALSIFIED, INDEX, TRIALS} == earlier.keys()
    begun = itertools.count()
    with pytest.raises(InputError, match="cannot fly this condition: cannot be trimmed"):
        broken(to_break, ("sensor.dropout", 0.0, 1.0), flown=refuses)
    assert content(to_break.parent / "out") == earlier


@pytest.mark.flights
def test_an_earlier_search_stays_until_the_new_one_has_ended(to_break: Path) -> None:
    def looks(scenario: Scenario) -> dict[str, Any]:
        found = content(to_break.parent / "out")
        during.append({name: found[name] for name in earlier})
        flights.append(found[f"{TRIALS}.partial"].count(b"\n") - 1)
        return stand_in()

    during: list[dict[str, bytes]] = []
    flights: list[int] = []
    broken(to_break, ("mission.time_limit_s", 300.0, 20.0))
    earlier = content(to_break.parent / "out")
    result = broken(to_break, ("sensor.dropout", 0.0, 1.0), flown=looks)
    assert during == [earlier] * result.conditions
    assert flights == list(range(result.conditions))
    assert sorted(content(to_break.parent / "out")) == [TRIALS, INDEX]


@pytest.mark.flights
def test_what_a_killed_search_has_left_is_in_no_way(to_break: Path) -> None:
    (to_break.parent / "out").mkdir()
    (to_break.parent / "out" / f"{TRIALS}.partial").write_text("a killed process")
    assert broken(to_break, ("mission.time_limit_s", 300.0, 20.0)).settled
    assert f"{TRIALS}.partial" not in content(to_break.parent / "out")


@pytest.mark.flights
def test_two_searches_into_one_folder(to_break: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def second(scenario: Scenario) -> dict[str, Any]:
        vary = "mission.time_limit_s=300:20"
        assert main(["falsify", str(to_break), "--vary", vary, "--out", str(to_break.parent / "out")]) == 2
        said.append(capsys.readouterr().err)
        return stand_in()

    said: list[str] = []
    broken(to_break, ("sensor.dropout", 0.0, 1.0), flown=second, conditions=2)
    out = to_break.parent / "out"
    sentence = f"another wayproof is writing to {out}: wait until it has ended or choose another folder"
    assert said == [f"wayproof: {sentence}\n"] * 2
    assert json.loads((out / INDEX).read_text())["vary"][0]["key"] == "sensor.dropout"
    assert broken(to_break, ("mission.time_limit_s", 300.0, 20.0)).settled, "the lock ends with its holder"


def test_searches_over_other_keys_are_kept_apart(to_break: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(to_break.parent)
    for vary in (
        ("sensor.dropout=0:0.1",),
        ("sensor.dropout=0:0.1", "obstacles[0].circle.radius_m=100:101"),
    ):
        given = [item for each in vary for item in ("--vary", each)]
        assert main(["falsify", "straight.yaml", *given, "--runs", "2", "--json"]) == 0
    assert sorted(each.name for each in Path("runs/straight").iterdir()) == [
        "falsify-sensor.dropout",
        "falsify-sensor.dropout-obstacles.0.circle.radius_m",
    ]


def test_an_interrupt_leaves_the_flights_so_far(
    to_break: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from harness.cli import falsify as command

    flights = iter([stand_in(), stand_in("collision")])

    def interrupted(_: Scenario) -> dict[str, Any]:
        try:
            return next(flights)
        except StopIteration:
            raise KeyboardInterrupt from None

    monkeypatch.setattr(command, "_flown", interrupted)
    out = to_break.parent / "out"
    assert main(["falsify", str(to_break), "--vary", "sensor.dropout=0:1", "--out", str(out)]) == 130
    assert f"interrupted; the flights so far are in {out / TRIALS}" in capsys.readouterr().err
    assert len((out / TRIALS).read_text().splitlines()) == 3
    assert json.loads((out / INDEX).read_text())["complete"] is False

    flights = iter([])
    assert main(["falsify", str(to_break), "--vary", "sensor.dropout=0:0.5", "--out", str(out)]) == 130
    assert "interrupted; no flight had ended yet" in capsys.readouterr().err
    assert len((out / TRIALS).read_text().splitlines()) == 3, "those of the search before"
