"""What every planner kind must be, and the spy: no planner can reach the true world."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from harness.mapping.sensed_map import SensedMap
from harness.scenario.kinds import planner_kinds
from harness.scenario.sections import Sensor
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.range_sensor import RangeSensor
from harness.world.world import World
from planner.contract import AHEAD, MISSION, START, PlannerContract, bits, make
from planner.geometry.curves import on_loiter, pose_at
from wayproof import Mission, Path, Plan, PlannerKind, PlanRequest, PlanStatus

KINDS = planner_kinds()  # as they are before any test registers a kind of its own

OBSTACLES = (
    Obstacle(Circle((7000.0, 5000.0), 1500.0)),
    Obstacle(Polygon(((11_000.0, 7000.0), (13_000.0, 7500.0), (12_500.0, 9500.0), (11_500.0, 9300.0)))),
    Obstacle(Circle((15_500.0, 9000.0), 800.0)),
)

# One class of tests for each kind: Test_rolling_window and so on.
globals().update(
    {f"Test_{name}": type(f"Test_{name}", (PlannerContract,), {"kind": kind}) for name, kind in KINDS.items()}
)


class Flight:
    """A planner in a closed loop with sensor and map, its path flown without error."""

    def __init__(self, kind: str, obstacles: tuple[Obstacle, ...]) -> None:
        self.planner = make(KINDS[kind], MISSION)
        self.seen = SensedMap(MISSION.bounds_m, MISSION.clearance_m, MISSION.sensor_range_m)
        config = Sensor(range_m=MISSION.sensor_range_m, rays=360)
        self._sensor = RangeSensor(World(obstacles, MISSION.bounds_m), config, np.random.SeedSequence(1))
        self.request = PlanRequest(0.0, START, AHEAD, self.seen)
        self.answers: list[tuple[PlanRequest, Plan]] = []

    def go(self, seconds: int) -> None:
        """Asks after every scan, twice a second, and flies 25 m a second, up to the goal."""
        flown, arc_length_m = self.request.flown, self.request.arc_length_m
        for number in range(2 * seconds):
            time_s = 0.5 * number
            position, direction = START, AHEAD
            if flown is not None and flown.path is not None:
                pose = pose_at(flown.path, on_loiter(flown.path, arc_length_m))
                position, direction = pose[:2], pose[2:]
            if math.dist(position, MISSION.goal_m) <= MISSION.goal_radius_m:
                break
            self.seen.update(self._sensor.scan(*position, math.atan2(*direction), time_s))
            self.request = PlanRequest(time_s, position, direction, self.seen, flown, arc_length_m)
            answer = self.planner.plan(self.request)
            self.answers.append((self.request, answer))
            if answer.status is PlanStatus.FOUND:
                flown, arc_length_m = answer, 0.0
            arc_length_m += 12.5


@dataclass(frozen=True)
class NoKeys:
    """Keys of the planners below: none."""

    def resolved(self, mission: Mission) -> NoKeys:
        return self


class Faulty:
    """Flies straight at the goal from wherever it is; does one thing that no planner may do."""

    made = 0

    def __init__(self, fault: str, mission: Mission) -> None:
        Faulty.made += 1
        self.fault, self.mission = fault, mission

    def plan(self, request: PlanRequest) -> Plan:
        (x, y), (gx, gy) = request.position_m, self.mission.goal_m
        if (left := max(math.dist((x, y), (gx, gy)), 1.0)) < 2.0 and self.fault == "raises":
            raise ZeroDivisionError
        if request.flown is not None:
            return Plan(PlanStatus.KEPT, "straight on")
        ux, uy = ((gx - x) / left, (gy - y) / left) if self.fault == "turns at once" else request.direction
        reason = f"plan {Faulty.made}" if self.fault == "shares" else "straight on"
        bend = {"too tight": 1.0 / 50.0}.get(self.fault, 0.0)
        length = {"leaves": 50_000.0, "too tight": 60.0}.get(self.fault, left)
        path = Path(np.array([(x, y, ux, uy, bend, length)]))
        return Plan(PlanStatus.FOUND, reason, np.array([(x, y), (gx, gy)]), path)


@pytest.mark.parametrize(
    ("fault", "test"),
    [
        ("raises", "test_never_raises_wherever_the_first_plan_begins"),
        ("shares", "test_two_instances_give_the_same_plans_bit_for_bit"),
        ("turns at once", "test_its_answers_can_be_flown"),
        ("too tight", "test_its_answers_can_be_flown"),
        ("leaves", "test_its_answers_can_be_flown"),
        ("goes by", "test_an_empty_world_is_flown_to_the_goal"),
    ],
)
def test_the_contract_sees_a_fault(fault: str, test: str) -> None:
    def faulty(_: NoKeys, mission: Mission) -> Faulty:
        return Faulty(fault, mission)

    kind = PlannerKind("faulty", "does one thing that no planner may do", NoKeys, faulty)
    with pytest.raises((AssertionError, ZeroDivisionError)):
        getattr(type("Broken", (PlannerContract,), {"kind": kind})(), test)()


@pytest.mark.parametrize("kind", KINDS)
def test_what_has_not_come_into_range_changes_nothing(kind: str) -> None:
    far = (
        *OBSTACLES,
        Obstacle(Circle((16_000.0, 13_500.0), 700.0)),
        Obstacle(Circle((2000.0, 13_000.0), 900.0)),
    )
    with_more, without = Flight(kind, far), Flight(kind, OBSTACLES)
    for flight in (with_more, without):
        flight.go(200)
    assert [bits(a) for _, a in with_more.answers] == [bits(a) for _, a in without.answers]
    assert [r.position_m for r, _ in with_more.answers] == [r.position_m for r, _ in without.answers]
