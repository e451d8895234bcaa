"""How a flight ends that has no way to begin: no room for a first turn, or a sensor that shows nothing."""

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from harness.flight.closed_loop import fly
from harness.flight.record import Flight
from harness.run.scenario_flight import fly_to_folder, make_loop
from tests.closed_loop.small import small_world
from tests.closed_loop.worlds_table import SHARED, referee_faults
from wayproof import Scenario

WEST_TO_EAST = {"mission": {"start_m": [1000.0, 3000.0], "goal_m": [5500.0, 3000.0], "course_deg": 90.0}}
world = partial(small_world, flown=WEST_TO_EAST)


def flown(scenario: Scenario) -> Flight:
    return fly(make_loop(scenario))


def test_without_room_for_a_first_turn_the_flight_ends_before_it_goes_wrong(tmp_path: Path) -> None:
    wall = [[1121.0, 500.0], [1171.0, 500.0], [1171.0, 5500.0], [1121.0, 5500.0]]
    metrics = fly_to_folder(world({"polygon": {"vertices_m": wall}}), tmp_path / "run", recording=False)
    assert metrics["outcome"] == "planner_failed"
    assert metrics["reason"].endswith("there is no room for a turn at the start")
    assert metrics["flight_time_s"] < 1.0
    if not SHARED.is_dir():
        pytest.skip("the referee is not beside this checkout")
    assert referee_faults(tmp_path / "run") == []


@pytest.mark.parametrize("course_deg", [0.0, 90.0])
def test_a_start_on_the_boundary_that_leads_along_it_or_into_the_area_is_flown(course_deg: float) -> None:
    mission = {"start_m": [0.0, 3000.0], "goal_m": [2000.0, 3000.0], "course_deg": course_deg}
    assert flown(world(mission=mission)).outcome.value == "reached"


@pytest.mark.parametrize("dropout", [0.95, 1.0])
def test_a_sensor_that_shows_nothing_ends_a_flight_within_the_clearance_of_the_start(dropout: float) -> None:
    ahead = {"circle": {"center_m": [2200.0, 3000.0], "radius_m": 300.0}}
    scenario = world(ahead, sensor={"dropout": dropout})
    flight = flown(scenario)
    assert flight.outcome.value == "planner_failed"
    assert flight.reason.endswith("nothing ahead of the aircraft has been seen to be free")
    gone_m = math.hypot(flight.track.east_m[-1] - 1000.0, flight.track.north_m[-1] - 3000.0)
    assert 0.5 * scenario.planner.clearance_m < gone_m < scenario.planner.clearance_m


@pytest.mark.parametrize(("dropout", "seed"), [(0.1, 1), (0.3, 2), (0.5, 3)])
def test_what_returns_only_now_and_then_is_kept_clear_of(dropout: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    poles = [
        {"circle": {"center_m": [east, 3000.0 + rng.uniform(-80.0, 80.0)], "radius_m": 0.05}}
        for east in (2300.0, 3500.0)
    ]
    flight = flown(world(*poles, sensor={"dropout": dropout, "rays": 360}))
    assert flight.outcome.value == "reached"
    assert flight.track.clearance_m.min() > 60.0
