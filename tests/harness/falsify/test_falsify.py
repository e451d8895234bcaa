"""The breaking point of flights whose end is known, and what the command leaves behind."""

import itertools
import json
import re
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.cli.app import main
from harness.cli.falsify import breaking_rows, last_line
from harness.falsify.breaking_point import FALSIFIED, INDEX, number_text, scenario_at, vary_of
from harness.run.scenario_flight import fly_and_measure
from tests.examples import examples
from tests.harness.breaking import WAY_M, broken, stand_in
from tests.harness.campaign.test_campaign_journal import content
from tests.refusals import refused
from wayproof import AircraftError, InputError, Scenario, load_scenario


@pytest.mark.flights
def test_the_time_that_is_too_short_is_found(to_break: Path) -> None:
    result = broken(to_break, ("mission.time_limit_s", 300.0, 20.0), tolerance=0.005)
    assert (result.verdict, result.settled) == ("found", True)
    assert result.found is not None
    assert result.passes is not None
    needed_s = WAY_M / 25.0
    assert needed_s - 280 * 0.005 - 0.5 <= result.found.values[0] <= needed_s <= result.passes[0] + 0.5
    assert result.found.figures["outcome"] == "timeout"
    value = number_text(result.found.values[0])
    told = f", the mildest found in {result.conditions} conditions"
    assert last_line(result) == f"falsified: mission.time_limit_s={value}{told}"

    index = json.loads((to_break.parent / "out" / INDEX).read_text())
    limits_s = [trial["values"][0] for trial in index["trials"]]
    assert len(limits_s) == result.conditions == len(result.trials)
    assert limits_s[0] == 300.0
    ended = [(trial["values"][0] - needed_s, trial["failed"]) for trial in index["trials"]]
    assert all(failed == (over_s < 0.0) for over_s, failed in ended if abs(over_s) > 0.5)
    assert (index["complete"], index["found"]["figures"]["digest"]) == (True, result.found.figures["digest"])

    again = load_scenario(to_break.parent / "out" / FALSIFIED)
    assert again.mission.time_limit_s == result.found.values[0]
    assert fly_and_measure(again)["digest"] == result.found.figures["digest"]


@pytest.mark.flights
def test_two_keys_get_harder_together(to_break: Path) -> None:
    keys = ("mission.time_limit_s", 100.0, 40.0), ("aircraft.airspeed_mps", 28.0, 18.0)
    result = broken(to_break, *keys, tolerance=0.02)
    assert result.found is not None
    assert result.settled
    # The way takes as long as the limit where 1400 / (28 - 10 u) = 100 - 60 u.
    mildest = next(s / 1e4 for s in range(10001) if WAY_M / (28 - s / 1e3) >= 100 - 60 * s / 1e4)
    assert result.displacement == pytest.approx(mildest, abs=0.03)
    assert result.found.values == pytest.approx((100 - 60 * mildest, 28 - 10 * mildest), abs=2.0)


def test_nothing_fails_and_it_is_said(to_break: Path) -> None:
    result = broken(to_break, ("mission.time_limit_s", 300.0, 200.0), conditions=3)
    assert (result.verdict, result.found, result.conditions) == ("not_found", None, 2)
    assert "1 equal step of 100.00%" in breaking_rows(result)["scan"]
    assert last_line(result) == "not falsified: nothing failed in 2 flights"
    assert breaking_rows(result)["mildest found"] == "none: every condition tried was reached"
    assert sorted(path.name for path in (to_break.parent / "out").iterdir()) == [INDEX]


def test_it_fails_already_at_the_mild_end(to_break: Path) -> None:
    result = broken(to_break, ("mission.time_limit_s", 30.0, 20.0))
    assert (result.verdict, result.conditions) == ("fails_at_the_mild_end", 1)
    assert load_scenario(to_break.parent / "out" / FALSIFIED).mission.time_limit_s == 30.0
    assert "already at the mild end" in last_line(result)
    assert breaking_rows(result)["tried"] == "1 condition"


def test_another_claim_is_broken_where_it_is_asked_for(to_break: Path) -> None:
    def shaky(scenario: Scenario) -> dict[str, Any]:
        noise = scenario.sensor.range_noise_m
        return stand_in(trackable=noise < 3.0, min_clearance_m=9900.0, cross_track_m={"max": noise})

    noise = ("sensor.range_noise_m", 0.0, 8.0)
    assert broken(to_break, noise, flown=shaky).verdict == "not_found"
    result = broken(to_break, noise, flown=shaky, claim="trackable")
    assert result.found is not None
    assert 3.0 <= result.found.values[0] <= 3.08
    assert breaking_rows(result)["how it failed"].startswith("not every leg was tracked; reached: ")


def test_a_crash_is_a_failure(to_break: Path) -> None:
    def crashes(scenario: Scenario) -> dict[str, Any]:
        if scenario.sensor.range_noise_m > 0.0:
            raise ZeroDivisionError("in the\nplanner")
        return stand_in()

    result = broken(to_break, ("sensor.range_noise_m", 0.0, 8.0), flown=crashes)
    assert result.found is not None
    assert breaking_rows(result)["how it failed"] == "error: ZeroDivisionError: in the planner, seed 4"


@pytest.mark.flights
@given(st.floats(0.3, 7.7))
@settings(max_examples=examples(10), suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_value_that_is_printed_fails_when_it_is_typed_in(to_break: Path, edge: float) -> None:
    def over(scenario: Scenario) -> dict[str, Any]:
        return stand_in("collision" if scenario.sensor.range_noise_m >= edge else "reached")

    for tolerance in (0.01, 0.0007):
        result = broken(to_break, ("sensor.range_noise_m", 0.0, 8.0), flown=over, tolerance=tolerance)
        printed = last_line(result).removeprefix("falsified: sensor.range_noise_m=").split(",")[0]
        assert float(printed) >= edge, "not the edge rounded down"
        assert float(printed) - edge <= 8.0 * tolerance
        assert len(printed) <= 7, "and not sixteen digits"
        assert float(breaking_rows(result)["passes below"].removeprefix("at ")) < edge


def test_whole_numbers_stay_whole(to_break: Path) -> None:
    def coarse(scenario: Scenario) -> dict[str, Any]:
        return stand_in("collision" if scenario.sensor.rays < 47 else "reached")

    result = broken(to_break, ("sensor.rays", 90.0, 10.0), flown=coarse, tolerance=0.001)
    assert result.found is not None
    assert (result.found.values, result.passes) == ((46,), (47,))
    assert result.displacement == 44 / 80, "not where between 46 and 47 it was looked for"
    assert len({each.values for each in result.trials}) == len(result.trials), "each number is tried once"
    assert load_scenario(to_break.parent / "out" / FALSIFIED).sensor.rays == 46


def test_a_direction_is_varied_about_north(to_break: Path) -> None:
    def headwind(scenario: Scenario) -> dict[str, Any]:
        return stand_in("collision" if 10.0 <= scenario.mission.course_deg < 300.0 else "reached")

    result = broken(to_break, ("mission.course_deg", 300.0, 420.0), flown=headwind)
    assert result.displacement == pytest.approx(70.0 / 120.0, abs=0.01)
    assert 10.0 <= load_scenario(to_break.parent / "out" / FALSIFIED).mission.course_deg <= 11.2


def test_a_key_inside_a_list_can_be_varied(to_break: Path) -> None:
    load = partial(load_scenario, to_break)
    vary = vary_of(load, [("obstacles.0.circle.radius_m", 100.0, 500.0)])
    assert vary[0].key == "obstacles[0].circle.radius_m"
    assert not vary[0].whole
    circle = scenario_at(load, vary, (vary[0].value(0.5),)).obstacles[0].circle
    assert circle is not None
    assert circle.radius_m == 300.0


def test_the_command_leaves_a_scenario_that_fails_again_with_the_same_digest(
    to_break: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(to_break.parent)
    given = ["straight.yaml", "--vary", "mission.time_limit_s=90:30", "--planner", "rolling_window"]
    assert main(["falsify", *given, "--seed", "9", "--tolerance", "0.1", "--runs", "9"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    (folder,) = Path("runs/straight").iterdir()
    assert re.fullmatch(r"falsify-mission\.time_limit_s-[0-9a-f]{8}", folder.name)
    assert f"again: wayproof fly {folder}/falsified.yaml" in said.out.replace("\n", "")
    assert max(len(line) for line in said.out.splitlines() if not line.startswith("again: ")) <= 80
    found = json.loads((folder / "falsify.json").read_text())
    (value,) = found["found"]["values"]
    told = f"the mildest found in {found['conditions']} conditions"
    assert said.out.splitlines()[-1] == f"falsified: mission.time_limit_s={value}, {told}"
    assert WAY_M / 25.0 - 10.0 < value < WAY_M / 25.0 + 3.0
    assert main(["fly", str(folder / "falsified.yaml"), "--no-recording", "--json", "--out", "again"]) == 1
    metrics_again = json.loads(capsys.readouterr().out)
    assert metrics_again["outcome"] == found["found"]["figures"]["outcome"] == "timeout"
    assert metrics_again["digest"] == found["found"]["figures"]["digest"]

    assert main(["falsify", *given, "--runs", "2", "--json", "--set", "mission.goal_radius_m=60"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert (printed["verdict"], printed["conditions"], printed["settled"]) == ("found", 2, False)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "--vary"),
        (["--vary", "mission.time_limit_s"], "'mission.time_limit_s' is not KEY.PATH=LO:HI with two numbers"),
        (["--vary", "mission[goal_m].0=0:1", "--set", "mission.goal_m[0]=5"],
            "mission.goal_m[0] is given a value too, 5; give one of them"),
        (["--vary", "mission.goal_m[0]=0:1", "--vary", "mission.goal_m.0=0:1"],
            "--vary mission.goal_m[0]: is given twice"),
        (["--vary", "sensor..rays=0:1"], "--vary: 'sensor..rays' is not a key path"),
        (["--vary", "seed=1:5"], "a seed is no condition; --seed gives another"),
        (["--vary", "sensor.dropout=0:0"], "both ends are 0; give two, as sensor.dropout=0:1"),
        (["--vary", "sensor.dropout=0:2"], "command line: sensor.dropout: is 2; must be at most 1"),
        (["--vary", "sensor.dropuot=0:1"],
            "command line: sensor.dropuot: unknown key; did you mean dropout?"),
        (["--vary", "sensor.rate_hz=4:1"], "which does not divide 120 Hz"),
        (["--vary", "planner.kind=0:1"], "planner.kind: is 0; must be text"),
        (["--vary", "sensor.dropout=0:1", "--tolerance", "0"], "is 0; must be between 0 and 1"),
        (["--vary", "sensor.dropout=0:1", "--runs", "1"], "--runs"),
        (["--vary", "sensor.dropout=0:1", "--claim", "later"], "--claim"),
    ],
)  # fmt: skip
def test_bad_usage_is_one_line_and_writes_nothing(
    arguments: list[str], sentence: str, to_break: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(to_break.parent)
    said = refused("falsify", "straight.yaml", *arguments)
    assert sentence in said
    assert len(said.splitlines()) <= 2
    assert [path.name for path in to_break.parent.iterdir()] == ["straight.yaml"]


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

    broken(to_break, ("mission.time_limit_s", 300.0, 20.0), conditions=3)
    earlier = content(to_break.parent / "out")
    assert {FALSIFIED, INDEX} == earlier.keys()
    begun = itertools.count()
    with pytest.raises(InputError, match="cannot fly this condition: cannot be trimmed"):
        broken(to_break, ("sensor.dropout", 0.0, 1.0), flown=refuses)
    assert content(to_break.parent / "out") == earlier


def test_an_interrupt_leaves_everything_as_it_was(
    to_break: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    begun = itertools.count()

    def interrupted(*_: object) -> dict[str, Any]:
        if next(begun) == 2:
            raise KeyboardInterrupt
        return stand_in()

    for name, stand in (("make_loop", id), ("fly", id), ("metrics", interrupted)):
        monkeypatch.setattr(f"harness.run.scenario_flight.{name}", stand)
    out = to_break.parent / "out"
    words = ["falsify", str(to_break), "--vary", "sensor.dropout=0:1", "--quiet", "--out", str(out)]
    assert main(words) == 130
    assert "interrupted; nothing was written" in capsys.readouterr().err
    assert not out.exists()
