"""What README assumes of moving obstacles, flown: within the assumptions nothing is hit."""

import math
from typing import Any

import numpy as np
import pytest

from harness.flight.closed_loop import fly
from harness.flight.record import Outcome
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import scenario_of
from harness.world.motion_assumptions import outside_assumptions
from wayproof import Scenario


def wall(seed: int, width_share: float = 0.99) -> Scenario:
    """A wall at 19 m/s towards an aircraft that wants to get behind it; `width_share` of the range wide."""
    rng = np.random.default_rng([seed, 19])
    course, range_m = rng.uniform(0.0, math.tau), float(rng.choice([1500.0, 2000.0, 3000.0]))
    start = np.array((10_000.0, 10_000.0))
    ahead = np.array((math.cos(course), math.sin(course)))
    aside = np.array((-ahead[1], ahead[0]))
    half = 0.5 * width_share * range_m
    centre = start - ahead * rng.uniform(1.2, 2.0) * range_m + aside * rng.uniform(-0.8, 0.8) * half
    ring = [centre + aside * half, centre - aside * half]
    ring += [each - 50.0 * ahead for each in reversed(ring)]
    turned = course + math.pi + rng.uniform(-0.5, 0.5)
    goal = start + 3.0 * range_m * np.array((math.cos(turned), math.sin(turned)))
    polygon = {"vertices_m": [each.tolist() for each in ring]}
    plain: dict[str, Any] = {
        "schema": "wayproof/scenario/1",
        "name": "wall",
        "area": {"bounds_m": [-10_000.0, -10_000.0, 30_000.0, 30_000.0]},
        "obstacles": [{"polygon": polygon, "velocity_mps": (19.0 * ahead).tolist()}],
        "mission": {"start_m": start.tolist(), "goal_m": goal.tolist(), "altitude_m": 300.0},
        "aircraft": {"model": "aerosonde", "airspeed_mps": 25.0},
        "sensor": {"range_m": range_m},
        "planner": {"kind": "rolling_window", "clearance_m": 120.0},
    }
    return scenario_of(plain)


@pytest.mark.parametrize("seed", [*range(4), *(pytest.param(n, marks=pytest.mark.slow) for n in range(4, 60))])
def test_a_fast_wall_no_wider_than_the_sensing_range_is_flown_round(seed: int) -> None:
    scenario = wall(seed)
    assert outside_assumptions(scenario) == ()
    flight = fly(make_loop(scenario))
    assert flight.outcome is Outcome.REACHED, flight.reason
    assert flight.track.clearance_m.min() > 0.0
