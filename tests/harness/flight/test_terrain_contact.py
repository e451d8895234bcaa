"""A flight ends where the true aircraft meets the true ground, or passes through the goal circle."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from harness.flight.record import Outcome
from harness.flight.termination import MissionEnd
from harness.world.ground import Ground
from harness.world.world import World
from harness.world_files.height_field import HeightField
from wayproof import AircraftState, Mission

BOUNDS = (0.0, 0.0, 20_000.0, 20_000.0)
MISSION = Mission(
    goal_m=(19_000.0, 10_000.0), goal_radius_m=100.0, bounds_m=BOUNDS, clearance_m=100.0, turn_radius_m=100.0,
    speed_mps=25.0, roll_in_s=0.5, tracking_error_m=1.0, sensor_range_m=1000.0, compute_latency_s=0.0,
    sensor_latency_s=0.0, wind_mps=0.0,
)  # fmt: skip


def ridge(east_m: float = 8000.0, cell_m: float = 50.0) -> Ground:
    """Flat at 100 m, with a ridge of 400 m, as high only on one line of nodes, from south to north at 10 km north."""
    heights = np.full((401, 401), 100.0)
    heights[:, 160] = 400.0
    return Ground(HeightField((east_m - 160 * cell_m, 10_000.0 - 200 * cell_m), (cell_m, cell_m), heights))


def flight(up_m: float, climb_mps: float = 0.0) -> Iterator[AircraftState]:
    """Eastwards at 25 m/s from 1 km east, ten states a second."""
    for k in range(7300):
        time_s = k / 10.0
        yield AircraftState(
            time_s, 1000.0 + 25.0 * time_s, 10_000.0, up_m + climb_mps * time_s, 25.0, 0.0, climb_mps,
            math.pi / 2, 0.0, 0.0, 25.0, 1.0,
        )  # fmt: skip


def end(up_m: float, climb_mps: float = 0.0, ground: Ground | None = None) -> tuple[Outcome, str, AircraftState, int]:
    judge = MissionEnd(World([], BOUNDS, ground or ridge()), MISSION, 1e4)
    looks = 0
    for state in flight(up_m, climb_mps):
        looks += state.time_s >= judge._next_look_s
        if (verdict := judge.verdict(state, None)) is not None:
            return *verdict, state, looks
    raise AssertionError("the flight has no end")


def test_a_flight_into_a_ridge_ends_there() -> None:
    outcome, reason, state, _ = end(300.0)
    assert outcome is Outcome.COLLISION
    assert reason.startswith("flew into the terrain: ")
    # The slope of 6 m a metre reaches 300 m at a third of the cell before its top.
    assert state.east_m == pytest.approx(8000.0 - 50.0 / 3.0, abs=3.0)


def test_a_ridge_between_two_states_is_met() -> None:
    """With slopes of 300 m a metre it is 0.52 m wide at 322 m, between states at 8000 and 8002.5 m."""
    outcome, reason, state, _ = end(322.0, ground=ridge(8001.5625, 1.0))
    assert (outcome, reason) == (Outcome.COLLISION, "flew into the terrain between two steps")
    assert state.east_m == pytest.approx(8002.5)


def test_a_flight_over_it_is_looked_at_seldom() -> None:
    outcome, _, _, looks = end(500.0)
    assert outcome is Outcome.REACHED
    assert looks < 2000


def test_a_descent_into_flat_ground_ends_where_they_meet() -> None:
    outcome, _, state, _ = end(300.0, climb_mps=-2.0)
    assert outcome is Outcome.COLLISION
    assert state.up_m == pytest.approx(100.0, abs=0.3)


@pytest.mark.parametrize(
    ("eastern_m", "missed"),
    [(2e4, Outcome.TIMEOUT), (19_001.4, Outcome.OUT_OF_BOUNDS), (19_000.9, Outcome.OUT_OF_BOUNDS)],
)
@pytest.mark.parametrize("beside_m", [0.15, 0.25])
def test_no_goal_circle_is_missed_between_steps(beside_m: float, eastern_m: float, missed: Outcome) -> None:
    """Steps of 2.5 m past a circle of 0.2 m round a goal between two of them, near the border or not."""
    mission = replace(MISSION, goal_m=(19_001.0, 10_000.0 + beside_m), goal_radius_m=0.2)
    judge = MissionEnd(World([], (0.0, 0.0, eastern_m, 20_000.0)), mission, 725.0)
    ends = filter(None, (judge.verdict(state, None) for state in flight(300.0)))
    assert next(ends).outcome is (Outcome.REACHED if beside_m < 0.2 and eastern_m > 19_001.0 else missed)
