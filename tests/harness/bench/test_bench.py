"""The bench: what it measures, and that its figures are those of the flight that it flew."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import harness.bench.costs
from harness.bench.costs import bench, block_shares, watched
from harness.bench.stopwatch import Stopwatch
from harness.cli.bench import bench_rows
from harness.flight.closed_loop import fly
from harness.flight.record import digest
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import Scenario, parse_scenario

SHORT = """\
schema: wayproof/scenario/1
name: short
area: {bounds_m: [0, 0, 20000, 20000]}
mission: {start_m: [5000, 5000], goal_m: [5000, 8000], goal_radius_m: 200}
obstacles:
  - circle: {center_m: [5300, 6400], radius_m: 300}
sensor: {range_m: 4000, rays: 360, rate_hz: 2}
environment:
  wind: {speed_mps: 4.0, from_deg: 270}
"""
BLOCKS = {"dynamics", "guidance", "sensor", "map", "planner", "record", "loop", "recording"}


def scenario() -> Scenario:
    return parse_scenario(SHORT)


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """One bench, with its temporary files where they can be counted, and what it told of its progress."""
    told: list[tuple[float, float, str]] = []
    folder = tmp_path_factory.mktemp("temporary")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tempfile.tempdir", str(folder))
        measured = bench(scenario(), lambda *report: told.append(report))
    return {**measured, "told": told, "left": list(folder.iterdir())}


@pytest.mark.flights
def test_ratios_are_of_the_costs_that_it_gives(result: dict[str, Any]) -> None:
    cpu = result["cpu_s"]
    for name in ("closed_loop", "closed_loop_recording"):
        assert result[f"{name}_ratio"] == pytest.approx(cpu[name]["flight"] / cpu[name]["bare"])
    assert result["bare_step_us"] == pytest.approx(1e6 * cpu["closed_loop"]["bare"] / result["steps"])
    outside_s = cpu["closed_loop"]["flight"] - cpu["closed_loop"]["bare"]
    assert result["outside_us"] == pytest.approx(1e6 * outside_s / (result["sim_s"] * 10.0))


@pytest.mark.flights
def test_the_bare_run_takes_as_long_as_the_flight_at_its_step_rate(result: dict[str, Any]) -> None:
    assert result["outcome"] == "reached"
    assert (result["step_rate_hz"], result["bare_rate_hz"]) == (60, 60)
    assert result["steps"] == round(60 * result["sim_s"])
    assert 2600 < 25 * result["sim_s"] < 4000


@pytest.mark.flights
def test_the_loop_costs_more_than_bare_steps_and_the_recording_more_than_none(
    result: dict[str, Any],
) -> None:
    assert 1.0 < result["closed_loop_ratio"] < result["closed_loop_recording_ratio"]


@pytest.mark.flights
def test_every_block_has_its_share(result: dict[str, Any]) -> None:
    assert set(result["blocks"]) == BLOCKS
    assert sum(result["blocks"].values()) == pytest.approx(1.0)
    assert min(result["blocks"].values()) > 0.0


@pytest.mark.flights
def test_search_times_are_in_order(result: dict[str, Any]) -> None:
    planner = result["planner_ms"]
    assert 0.0 < planner["p50"] <= planner["p99"] <= planner["max"]


@pytest.mark.flights
def test_can_be_printed(result: dict[str, Any]) -> None:
    rows = bench_rows(result)
    assert {name.strip() for name in rows} >= BLOCKS


@pytest.mark.flights
def test_leaves_no_file_behind(result: dict[str, Any]) -> None:
    assert result["left"] == []


@pytest.mark.flights
def test_tells_of_every_round(result: dict[str, Any]) -> None:
    states, rounds = [state for _, _, state in result["told"]], result["rounds"]
    assert states[-rounds:] == [f"round {number}" for number in range(1, rounds + 1)]
    assert len(states) > rounds >= 3


def test_the_bare_model_follows_the_flight_in_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    flown: list[int] = []

    def advance(steps: int) -> None:
        flown.append(steps)
        plain(steps)

    monkeypatch.setattr(harness.bench.costs, "TURN_S", 10.0)
    bare = harness.bench.costs._Bare(scenario())
    plain = bare._model.advance
    monkeypatch.setattr(bare._model, "advance", advance)
    bare._turn_s = 10.0
    flight = fly(make_loop(scenario()), [bare])
    assert sum(flown) == bare.steps == round(60 * flight.sim_s)
    assert set(flown[:-1]) == {600}
    assert 0 < flown[-1] <= 630
    assert bare.cpu_s > 0.0


Planted = Callable[[list[tuple[float, float]], list[tuple[float, float]]], dict[str, Any]]


@pytest.fixture
def planted(monkeypatch: pytest.MonkeyPatch) -> Planted:
    """A bench with planted costs of bare runs and flights, without and with the recording."""

    def measured(flights: list[tuple[float, float]], recorded: list[tuple[float, float]]) -> dict[str, Any]:
        left = {False: iter(flights), True: iter(recorded)}
        figures = iter({"p50": 9.0 - i, "p99": 10.0 + i, "max": 20.0 + i % 4} for i in range(20))
        in_turn: list[bool] = []

        def in_turns(_: Scenario, recording: bool) -> Any:
            in_turn.append(recording)
            return harness.bench.costs._Turns(*next(left[recording]), {"compute_ms": next(figures)})

        monkeypatch.setattr(harness.bench.costs, "_in_turns", in_turns)
        result = bench(scenario())
        assert in_turn == [False, True] * result["rounds"]
        return result

    return measured


def test_what_was_flown_while_the_machine_was_fastest_counts(planted: Planted) -> None:
    result = planted([(4.0, 8.0), (2.0, 6.0), (2.1, 6.3)], [(3.0, 13.5), (4.0, 16.0), (2.0, 9.0)])
    assert result["cpu_s"] == {
        "closed_loop": {"bare": 2.0, "flight": 6.0},
        "closed_loop_recording": {"bare": 2.0, "flight": 9.0},
    }
    assert (result["closed_loop_ratio"], result["closed_loop_recording_ratio"]) == (3.0, 4.5)
    assert result["planner_ms"] == {"p50": 4.0, "p99": 10.0, "max": 20.0}
    assert result["blocks"]["recording"] == pytest.approx(3.0 / 9.0)
    assert (result["rounds"], result["steady"]) == (3, True)


def test_rounds_go_on_until_the_two_fastest_are_alike(planted: Planted) -> None:
    result = planted([(2.0, 8.0), (2.1, 6.0), (2.2, 7.0), (1.9, 5.0), (1.95, 5.14)], [(2.0, 9.0)] * 5)
    assert (result["rounds"], result["steady"]) == (5, True)
    assert result["closed_loop_ratio"] == 5.0 / 1.9


def test_a_machine_that_never_rests_is_told(planted: Planted) -> None:
    falling = [(20.0 - each, 30.0) for each in range(10)]
    result = planted(falling, [(3.0, 4.0)] * 10)
    assert (result["rounds"], result["steady"]) == (10, False)
    assert bench_rows(result)["rounds"] == "10, not steady: the machine is busy"


def test_a_flight_without_a_plan_cannot_be_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    short = scenario()
    late = short.model_copy(update={"mission": short.mission.model_copy(update={"time_limit_s": 0.4})})
    late = late.model_copy(update={"sensor": late.sensor.model_copy(update={"latency_s": 1.0})})
    monkeypatch.setattr(harness.bench.costs, "_in_turns", lambda *_: pytest.fail("measured all the same"))
    with pytest.raises(ValueError, match=r"nothing to measure: time limit 0\.4 s"):
        bench(late)


SECONDS = st.floats(0.01, 100.0)


@given(
    in_loop=st.dictionaries(
        st.sampled_from(sorted(BLOCKS - {"recording"})), st.floats(0.001, 10.0), min_size=1
    ),
    files_s=SECONDS,
    recording_s=SECONDS,
)
def test_shares_of_blocks_sum_to_one(in_loop: dict[str, float], files_s: float, recording_s: float) -> None:
    closed = sum(in_loop.values()) + files_s
    whole = closed + recording_s
    shares = block_shares(in_loop, closed, whole)
    assert math.isclose(sum(shares.values()), 1.0)
    assert math.isclose(shares["recording"], recording_s / whole)
    assert math.isclose(shares["record"], (in_loop.get("record", 0.0) + files_s) / whole)
    for block in set(in_loop) - {"record"}:
        assert math.isclose(shares[block], in_loop[block] / whole)


def test_a_disturbed_lone_flight_leaves_the_shares_in_proportion() -> None:
    shares = block_shares({"dynamics": 6.0, "map": 3.0, "record": 1.0}, closed=5.0, recorded=5.0)
    assert shares == pytest.approx({"dynamics": 0.6, "map": 0.3, "record": 0.1, "recording": 0.0})


def test_a_watched_loop_flies_the_same_flight() -> None:
    plain = fly(make_loop(scenario()))
    watch = Stopwatch()
    flown = fly(watched(make_loop(scenario()), watch))
    assert digest(flown.track) == digest(plain.track)
    assert set(watch.seconds) == BLOCKS - {"loop", "recording"}
    assert min(watch.seconds.values()) > 0.0
