from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from harness.files.strict_yaml import dump
from harness.flight.closed_loop import fly
from harness.flight.record import Flight
from harness.run.scenario_flight import make_loop
from harness.scenario.scenario import Scenario, parse_scenario
from planner import registry
from planner.interface import Mission, Plan, PlanRequest
from planner.registry import PlannerKind
from planner.rolling_window.config import RollingWindowConfig
from tests.point_mass import PointMass

SmallWorld = Callable[..., Scenario]
FlyPointMass = Callable[[Scenario], Flight]
Answer = Callable[[Mission, PlanRequest], Plan]


def world(*obstacles: dict[str, Any], **sections: dict[str, Any]) -> Scenario:
    """6 km by 6 km, from corner to corner, with some keys replaced; calm air and a perfect sensor."""
    plain: dict[str, Any] = {
        "schema": "wayproof/scenario/1",
        "name": "small",
        "area": {"bounds_m": [0.0, 0.0, 6000.0, 6000.0]},
        "obstacles": list(obstacles),
        "mission": {"start_m": [300.0, 300.0], "goal_m": [5700.0, 5700.0], "goal_radius_m": 60.0},
        "aircraft": {"model": "aerosonde", "airspeed_mps": 25.0},
        "sensor": {"range_m": 1500.0, "rays": 720},
        "planner": {"kind": "rolling_window", "clearance_m": 40.0},
    }
    for name, keys in sections.items():
        plain[name] = {**plain.get(name, {}), **keys}
    return parse_scenario(dump(plain))


def fly_point_mass(scenario: Scenario) -> Flight:
    """The whole loop but for JSBSim."""
    return fly(make_loop(scenario, PointMass))


@pytest.fixture(scope="session")
def small_world() -> SmallWorld:
    return world


@pytest.fixture(scope="session")
def flown_by_point_mass() -> FlyPointMass:
    return fly_point_mass


@pytest.fixture
def answering(monkeypatch: pytest.MonkeyPatch) -> Callable[[Answer], None]:
    """Makes `planner.kind: stand_in` a planner that gives the answers of a function."""

    def install(answer: Answer) -> None:
        class StandIn:
            def __init__(self, _: object, mission: Mission) -> None:
                self.mission = mission

            def plan(self, request: PlanRequest) -> Plan:
                return answer(self.mission, request)

        kind = PlannerKind("stand_in", "answers as a test tells it to", RollingWindowConfig, StandIn)
        monkeypatch.setattr(registry, "BUILT_IN", (*registry.BUILT_IN, kind))

    return install
