"""A small world from corner to corner, and a flight through it without JSBSim."""

from typing import Any

from harness.files.strict_yaml import dump
from harness.flight.closed_loop import fly
from harness.flight.record import Flight
from harness.run.scenario_flight import make_loop
from tests.point_mass import PointMass
from tests.scenarios import scenario_of
from wayproof import Scenario

FROM_CORNER_TO_CORNER: dict[str, dict[str, Any]] = {
    "mission": {"start_m": [300.0, 300.0], "goal_m": [5700.0, 5700.0], "goal_radius_m": 60.0},
    "aircraft": {"model": "aerosonde", "airspeed_mps": 25.0},
    "sensor": {"range_m": 1500.0, "rays": 720},
    "planner": {"kind": "rolling_window", "clearance_m": 40.0},
}


def small_world(
    *obstacles: dict[str, Any], flown: dict[str, Any] = FROM_CORNER_TO_CORNER, **sections: dict[str, Any]
) -> Scenario:
    """6 km by 6 km, with some keys replaced; calm air and a perfect sensor."""
    plain = {
        "schema": "wayproof/scenario/1",
        "name": "small",
        "area": {"bounds_m": [0.0, 0.0, 6000.0, 6000.0]},
        "obstacles": [*obstacles],
        **flown,
    }
    for name, keys in sections.items():
        plain[name] = {**plain.get(name, {}), **keys}
    return scenario_of(dump(plain))


def flown_by_point_mass(scenario: Scenario) -> Flight:
    return fly(make_loop(scenario, PointMass))
