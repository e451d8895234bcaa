"""The bench: what it measures, and that its figures are those of the flight that it flew."""

import math
from collections import defaultdict
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import harness.bench.costs
from harness.bench.costs import Bare, Turns, bench, block_shares, watched
from harness.cli.bench import bench_rows
from harness.flight.closed_loop import fly
from harness.flight.record import digest
from harness.run.scenario_flight import make_loop
from tests.scenarios import scenario_of
from wayproof import Scenario

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
    return scenario_of(SHORT)


@pytest.mark.flights
def test_a_bench_has_ratios_and_shares_of_flights(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[int, int]] = []
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(harness.bench.costs, "ROUNDS", 2)
    result = bench(scenario(), lambda done, of, _what: told.append((done, of)))
    assert (result["outcome"], result["step_rate_hz"], result["bare_rate_hz"]) == ("reached", 60, 60)
    assert 1.0 < result["closed_loop_ratio"] < result["closed_loop_recording_ratio"]
    assert set(result["blocks"]) == BLOCKS
    assert sum(result["blocks"].values()) == pytest.approx(1.0)
    assert min(result["blocks"].values()) > 0.0
    assert 0.0 < result["planner_ms"]["p50"] <= result["planner_ms"]["p99"] <= result["planner_ms"]["max"]
    assert {name.strip() for name in bench_rows(result)} >= BLOCKS
    assert told == [(flight, 7) for flight in range(1, 7)], "one alone, then three rounds of two"
    assert list(tmp_path.iterdir()) == []


def test_the_bare_model_follows_the_flight_in_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    flown: list[int] = []

    def advance(steps: int) -> None:
        flown.append(steps)
        plain(steps)

    monkeypatch.setattr(harness.bench.costs, "TURN_S", 10.0)
    bare = Bare(scenario())
    plain = bare.model.advance
    monkeypatch.setattr(bare.model, "advance", advance)
    assert round(60 * fly(make_loop(scenario()), [bare]).sim_s) == sum(flown) == bare.steps
    assert set(flown[:-1]) == {600}
    assert 0 < flown[-1] <= 630
    assert bare.cpu_s > 0.0


def test_the_median_of_all_rounds_but_the_first_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of planted costs of bare runs and flights, without and with the recording in turns."""
    costs = {
        False: [(1.0, 1.0), (4.0, 8.0), (2.0, 6.0), (2.1, 8.4)],
        True: [(1.0, 1.0), (3.0, 13.5), (4.0, 16.0), (2.0, 10.0)],
    }
    figures = iter({"p50": 9.0 - i, "p99": 10.0 + i, "max": 20.0 + i % 4} for i in range(8))
    planted = {recording: iter(each) for recording, each in costs.items()}
    monkeypatch.setattr(harness.bench.costs, "ROUNDS", 3)
    monkeypatch.setattr(
        harness.bench.costs,
        "in_turns",
        lambda _, recording: Turns(*next(planted[recording]), {"compute_ms": next(figures)}),
    )
    result = bench(scenario())
    assert (result["closed_loop_ratio"], result["closed_loop_recording_ratio"]) == (3.0, 4.5)
    assert result["planner_ms"] == {"p50": 2.0, "p99": 12.0, "max": 20.0}
    assert result["blocks"]["recording"] == pytest.approx((4.5 - 3.0) / 4.5)


def test_a_flight_without_a_plan_cannot_be_measured() -> None:
    with pytest.raises(ValueError, match=r"nothing to measure: time limit 0\.4 s"):
        bench(scenario().with_({"mission.time_limit_s": 0.4, "sensor.latency_s": 1.0}))


SECONDS = st.floats(0.01, 100.0)


@given(
    in_loop=st.dictionaries(st.sampled_from(sorted(BLOCKS - {"recording"})), st.floats(0.001, 10.0), min_size=1),
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
    plain, seconds = fly(make_loop(scenario())), defaultdict[str, float](float)
    assert digest(fly(watched(make_loop(scenario()), seconds)).track) == digest(plain.track)
    assert set(seconds) == BLOCKS - {"loop", "recording"}
    assert min(seconds.values()) > 0.0
