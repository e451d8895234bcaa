"""A late, noisy or lying sensor and a slow planner: still reached, still safe, in a simple world."""

from typing import Any

import pytest

from harness.flight.record import Flight, Outcome
from harness.mapping.sensed_map import NOISY_SHARE
from tests.closed_loop.moving_worlds import TURNED_DEG, moving, popping_up
from tests.closed_loop.small import flown_by_point_mass, small_world
from tests.longer import longer

WORLD: tuple[dict[str, Any], ...] = (
    {"circle": {"center_m": [1800.0, 1900.0], "radius_m": 250.0}},
    {"polygon": {"vertices_m": [[3500.0, 3300.0], [4200.0, 3400.0], [4100.0, 4200.0], [3400.0, 4000.0]]}},
    {"circle": {"center_m": [4700.0, 4100.0], "radius_m": 150.0}},
)


@pytest.mark.parametrize(
    ("section", "keys"),
    [
        ("sensor", {"latency_s": 1.0}),
        ("planner", {"compute_latency_s": 1.0}),
        ("sensor", {"range_noise_m": 3.0}),
        ("sensor", {"dropout": 0.2}),
        ("sensor", {"false_return": 0.01}),
        ("sensor", {"field_of_view_deg": 200.0}),
        ("sensor", {"rate_hz": 0.5}),
        ("sensor", {"latency_s": 0.5, "range_noise_m": 2.0, "dropout": 0.05, "false_return": 0.005}),
    ],
    ids=lambda value: value if isinstance(value, str) else "-".join(value),
)
@pytest.mark.parametrize("seed", [1, *longer([2])])
def test_is_reached_and_safe(section: str, keys: dict[str, float], seed: int) -> None:
    scenario = small_world(*WORLD, **{section: keys}).model_copy(update={"seed": seed})
    flight = flown_by_point_mass(scenario)
    assert flight.outcome is Outcome.REACHED, flight.reason
    noise_m = 3.0 * scenario.sensor.range_noise_m
    assert flight.track.clearance_m.min() >= 0.8 * scenario.planner.clearance_m - noise_m


def test_a_late_scan_and_a_late_plan_take_effect_late() -> None:
    late = small_world(*WORLD, sensor={"latency_s": 0.7}, planner={"compute_latency_s": 0.5})
    assert flown_by_point_mass(small_world(*WORLD)).plans[0].time_s == 0.0
    assert flown_by_point_mass(late).plans[0].time_s == 1.2


def assert_reached(flight: Flight, clearance_m: float) -> None:
    assert flight.outcome is Outcome.REACHED, flight.reason
    assert flight.track.clearance_m.min() >= clearance_m


@pytest.mark.flights
@pytest.mark.parametrize("seed", [0, *longer(range(1, 4))])
@pytest.mark.parametrize("flaws", [{}, {"dropout": 0.1, "false_return": 0.01}], ids=["noise", "all"])
def test_with_noise_of_a_hundredth_of_the_range_edges_are_weighed(flaws: dict[str, float], seed: int) -> None:
    noisy = small_world(*WORLD, sensor={"range_noise_m": 15.0, **flaws}, planner={"clearance_m": 60.0})
    assert noisy.sensor.range_noise_m > NOISY_SHARE * noisy.planner.clearance_m
    # Edges may be thought of two standard deviations too far back.
    assert_reached(flown_by_point_mass(noisy.model_copy(update={"seed": seed})), 60.0 - 2.0 * 15.0)


@pytest.mark.parametrize("seed", [*range(3), *longer(range(3, 6))])
@pytest.mark.parametrize("kind", TURNED_DEG)
def test_what_moves_is_kept_clear_of(kind: str, seed: int) -> None:
    assert_reached(flown_by_point_mass(small_world(WORLD[0], moving(seed, kind))), 0.9 * 40.0)


@pytest.mark.parametrize("seed", [*range(3), *longer(range(3, 6))])
def test_what_appears_ahead_is_kept_clear_of(seed: int) -> None:
    assert_reached(flown_by_point_mass(small_world(WORLD[0], popping_up(seed))), 0.9 * 40.0)
