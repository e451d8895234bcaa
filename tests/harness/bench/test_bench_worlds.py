"""Fields of obstacles of one density, and the same flight in them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from harness.bench import worlds
from harness.flight.closed_loop import fly
from harness.flight.record import digest
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import parse_scenario


@pytest.mark.parametrize("count", worlds.COUNTS[:4])
def test_a_field_has_its_number_of_obstacles_at_the_density(count: int) -> None:
    east, north, radius = worlds.field(count).T
    assert len(east) == count
    half = np.quantile(np.maximum(np.abs(east), np.abs(north)), 0.9)
    assert (2.0 * half / worlds.SPACING_M) ** 2 == pytest.approx(0.9 * count, rel=0.3)
    away = np.hypot(np.abs(east) - worlds.HALF_WAY_M, north) - radius
    assert away.min() > 2.0 * worlds.CLEARANCE_M
    assert radius.min() >= worlds.RADIUS_M[0]


def test_a_smaller_field_is_the_middle_of_a_larger_one() -> None:
    small, large = worlds.field(100), worlds.field(10_000)
    assert (large[:100] == small).all()
    outside = np.maximum(np.abs(large[100:, 0]), np.abs(large[100:, 1]))
    assert outside.min() > math.sqrt(100) / 2 * worlds.SPACING_M * 0.8


def test_what_lies_far_off_changes_nothing_of_the_flight() -> None:
    flights = [fly(make_loop(parse_scenario(worlds.scenario_text(count)))) for count in (100, 1000)]
    assert flights[0].outcome.value == "reached"
    assert digest(flights[0].track) == digest(flights[1].track)


@pytest.mark.flights
def test_every_field_up_to_the_most_is_measured() -> None:
    told: list[tuple[int, int, str]] = []
    rows = worlds.bench_worlds(150, lambda *step: told.append(step))
    assert [row["obstacles"] for row in rows] == [10, 100]
    assert told == [(0, 2, "10 obstacles"), (1, 2, "100 obstacles")]
    for row in rows:
        assert row["outcome"] == "reached"
        assert row["closed_loop_ratio"] > 0.5
        assert 0.0 < row["write_s"] < row["load_s"]
        assert row["loop_ms"] > 0.0
    assert rows[0]["peak_mib"] <= rows[1]["peak_mib"]
