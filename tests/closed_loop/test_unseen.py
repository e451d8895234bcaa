"""The planner knows what has been sensed and nothing else."""

import gc
from collections.abc import Callable
from types import BuiltinFunctionType, FunctionType, ModuleType
from typing import Any

import numpy as np
import pytest

from harness.flight.record import DIGEST_COLUMNS, Flight, Outcome
from harness.run.scenario_flight import make_loop
from harness.scenario.kinds import planner_kinds
from harness.world.obstacle import Obstacle
from harness.world.world import World
from tests.closed_loop.small import flown_by_point_mass, small_world
from wayproof import Mission, Plan, PlanRequest

RANGE_M = 1500.0
TRUTH = "clearance_m"
"""The one column that knows of obstacles which have not been seen."""

Answer = Callable[[Mission, PlanRequest], Plan]
COMMON = ({"circle": {"center_m": [1500.0, 1600.0], "radius_m": 200.0}},)
IMPERFECT = {"range_noise_m": 1.0, "dropout": 0.02, "false_return": 0.002, "latency_s": 0.1}


def circle(east: float, north: float, radius: float) -> dict[str, Any]:
    return {"circle": {"center_m": [east, north], "radius_m": radius}}


def rows_alike(one: Flight, other: Flight) -> int:
    """How many rows two tracks have in common from the start, bit for bit."""
    length = min(len(one.track), len(other.track))
    differ = np.zeros(length, dtype=bool)
    for name in set(DIGEST_COLUMNS) - {TRUTH}:
        a, b = (getattr(flight.track, name)[:length] for flight in (one, other))
        differ |= a.view(np.uint64) != b.view(np.uint64)
    return int(differ.argmax()) if differ.any() else length


@pytest.mark.parametrize("sensor", [{}, IMPERFECT], ids=["perfect", "imperfect"])
def test_an_obstacle_ahead_changes_nothing_before_it_is_in_range(sensor: dict[str, float]) -> None:
    hidden = east, north, radius = (4000.0, 4050.0, 300.0)
    without = flown_by_point_mass(small_world(*COMMON, sensor=sensor))
    with_it = flown_by_point_mass(small_world(*COMMON, circle(*hidden), sensor=sensor))
    away_m = np.hypot(with_it.track.east_m - east, with_it.track.north_m - north) - radius
    first_in_range = int((away_m <= RANGE_M).argmax())
    assert first_in_range > 600
    assert first_in_range <= rows_alike(without, with_it) < len(with_it.track)


def reachable(roots: list[object]) -> list[object]:
    """Everything that code which holds `roots` could get at through attributes and containers."""
    found: dict[int, object] = {}
    left = list(roots)
    while left:
        thing = left.pop()
        if isinstance(thing, type | ModuleType | FunctionType | BuiltinFunctionType) or id(thing) in found:
            continue
        found[id(thing)] = thing
        left.extend(gc.get_referents(thing))
    return list(found.values())


def true_parts(things: list[object]) -> list[str]:
    return [type(thing).__name__ for thing in things if isinstance(thing, World | Obstacle)]


def test_a_spy_as_planner_finds_nothing_of_the_true_world(answering: Callable[[Answer], None]) -> None:
    inner = planner_kinds()["rolling_window"]
    planners: list[Any] = []
    found: list[list[object]] = []

    def spy(mission: Mission, request: PlanRequest) -> Plan:
        if not planners:
            planners.append(inner.make(inner.config(), mission))
        if len(found) < 3 and request.time_s >= 40.0 * len(found):
            found.append(reachable([mission, request]))
        answer: Plan = planners[0].plan(request)
        return answer

    answering(spy)
    scenario = small_world(*COMMON, planner={"kind": "stand_in"})
    assert flown_by_point_mass(scenario).outcome is Outcome.REACHED
    assert [true_parts(things) for things in found] == [[], [], []]
    assert all(any(isinstance(thing, PlanRequest) for thing in things) for things in found)
    # The same search does find the truth where it can be had.
    assert "World" in true_parts(reachable([make_loop(scenario)]))
