"""What every planner kind must be, and the spy: no planner can reach the true world."""

from __future__ import annotations

import gc
import inspect
import math
import types
from dataclasses import FrozenInstanceError, fields, is_dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from harness.obstacle import Circle, Obstacle, Polygon
from harness.obstacle_map import ObstacleMap
from harness.range_sensor import RangeSensor
from harness.scenario_sections import Sensor
from harness.world import World
from planner.curves import along, pose_at, sample
from planner.interface import (
    BoolArray,
    FloatArray,
    Mission,
    Path,
    Plan,
    Planner,
    PlanRequest,
    PlanStatus,
)
from planner.registry import planner_kinds

KINDS = planner_kinds()
MISSION = Mission(
    goal_m=(18_000.0, 12_000.0),
    goal_radius_m=300.0,
    bounds_m=(0.0, 0.0, 20_000.0, 15_000.0),
    clearance_m=200.0,
    turn_radius_m=150.0,
    speed_mps=25.0,
    roll_in_s=1.0,
    tracking_error_m=3.0,
    sensor_range_m=6000.0,
)
START = (1000.0, 1000.0)
OBSTACLES = (
    Obstacle(Circle((7000.0, 5000.0), 1500.0)),
    Obstacle(Polygon(((11_000.0, 7000.0), (13_000.0, 7500.0), (12_500.0, 9500.0), (11_500.0, 9300.0)))),
    Obstacle(Circle((15_500.0, 9000.0), 800.0)),
)


class Recorded:
    """A seen world with points given beforehand, that keeps account of what it was asked."""

    spacing_m = 50.0

    def __init__(self, points: FloatArray) -> None:
        self._points = points
        self.revision = 1
        self.taken_back_at = 0

    def edges_since(self, revision: int) -> FloatArray:
        return self._points if revision < 1 else np.zeros((0, 2))

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        return np.zeros(len(points_m), dtype=np.bool_)


def make(kind: str) -> Planner:
    config = KINDS[kind].config().resolved(MISSION)
    planner: Planner = KINDS[kind].make(config, MISSION)
    return planner


def first_request(seen: Any) -> PlanRequest:
    return PlanRequest(0.0, START, (math.sqrt(0.5), math.sqrt(0.5)), seen)


class Flight:
    """A planner in a closed loop with sensor and map, its path flown without error."""

    def __init__(self, kind: str, obstacles: tuple[Obstacle, ...]) -> None:
        world = World(obstacles, MISSION.bounds_m)
        self.planner = make(kind)
        self.seen = ObstacleMap(MISSION.bounds_m, MISSION.clearance_m, MISSION.sensor_range_m)
        config = Sensor(range_m=MISSION.sensor_range_m, rays=360)
        self._sensor = RangeSensor(world, config, np.random.SeedSequence(1))
        self.request = first_request(self.seen)
        self.answers: list[tuple[PlanRequest, Plan]] = []

    def go(self, seconds: int) -> None:
        """Asks after every scan, twice a second, and flies 25 m a second, up to the goal."""
        flown, station = self.request.flown, self.request.station_m
        for number in range(2 * seconds):
            time_s = 0.5 * number
            position, direction = START, (math.sqrt(0.5), math.sqrt(0.5))
            if flown is not None and flown.path is not None:
                pose = pose_at(flown.path, station)
                position, direction = pose[:2], pose[2:]
            if math.dist(position, MISSION.goal_m) <= MISSION.goal_radius_m:
                break
            heading = math.atan2(*direction)
            self.seen.update(self._sensor.scan(*position, heading, time_s))
            self.request = PlanRequest(time_s, position, direction, self.seen, flown, station)
            answer = self.planner.plan(self.request)
            self.answers.append((self.request, answer))
            if answer.status is PlanStatus.FOUND:
                flown, station = answer, 0.0
            station += 12.5


@pytest.fixture(scope="module")
def flights() -> dict[str, Flight]:
    """One flight of every kind among the obstacles."""
    made = {}
    for kind in KINDS:
        made[kind] = Flight(kind, OBSTACLES)
        made[kind].go(300)
    return made


def arrays_in(value: Any) -> list[FloatArray]:
    """All arrays in a plan."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, tuple):
        return [array for each in value for array in arrays_in(each)]
    if is_dataclass(value):
        return [array for field in fields(value) for array in arrays_in(getattr(value, field.name))]
    return []


def bits(plan: Plan) -> tuple[object, ...]:
    return (plan.status, plan.reason, *((a.shape, a.tobytes()) for a in arrays_in(plan)))


@pytest.mark.parametrize("kind", KINDS)
def test_conforms_to_the_protocol(kind: str) -> None:
    planner = make(kind)
    assert list(inspect.signature(planner.plan).parameters) == ["request"]
    assert KINDS[kind].kind == kind
    assert len(KINDS[kind].summary) > 20


@pytest.mark.parametrize("kind", KINDS)
def test_its_config_is_frozen_described_and_resolves_to_itself(kind: str) -> None:
    config = KINDS[kind].config()
    for field in fields(config):
        assert field.metadata["doc"]
        with pytest.raises(FrozenInstanceError):
            setattr(config, field.name, None)
    resolved = config.resolved(MISSION)
    assert all(getattr(resolved, field.name) is not None for field in fields(resolved))
    assert resolved.resolved(MISSION) == resolved


@pytest.mark.parametrize("kind", KINDS)
def test_an_empty_world_is_flown_to_the_goal(kind: str) -> None:
    flight = Flight(kind, ())
    flight.go(950)
    assert math.dist(flight.request.position_m, MISSION.goal_m) <= MISSION.goal_radius_m + 12.5
    assert not {answer.status for _, answer in flight.answers} & {PlanStatus.NO_PATH, PlanStatus.UNREACHABLE}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("course_deg", [0, 60, 120, 180, 240, 300])
def test_never_raises_wherever_the_first_plan_begins(kind: str, course_deg: int) -> None:
    direction = (math.sin(math.radians(course_deg)), math.cos(math.radians(course_deg)))
    ring = np.array(
        [(3000.0 + 900.0 * math.cos(a), 3000.0 + 900.0 * math.sin(a)) for a in np.arange(0, 6.3, 0.05)]
    )
    for points in (np.zeros((0, 2)), ring, np.array([MISSION.goal_m]), np.array([START])):
        for position in (START, (3000.0, 3000.0), (0.0, 0.0), MISSION.goal_m):
            plan = make(kind).plan(PlanRequest(0.0, position, direction, Recorded(points)))
            assert isinstance(plan.status, PlanStatus)


@pytest.mark.parametrize("kind", KINDS)
def test_two_instances_give_the_same_plans_bit_for_bit(kind: str, flights: dict[str, Flight]) -> None:
    again = Flight(kind, OBSTACLES)
    again.go(300)
    first = [bits(answer) for _, answer in flights[kind].answers]
    assert [bits(answer) for _, answer in again.answers] == first
    assert len({status for status, *_ in first}) > 1


@pytest.mark.parametrize("kind", KINDS)
def test_plans_are_complete(kind: str, flights: dict[str, Flight]) -> None:
    for request, plan in flights[kind].answers:
        assert isinstance(plan.status, PlanStatus)
        assert plan.reason
        if plan.status is not PlanStatus.FOUND:
            assert plan.path is None
            assert len(plan.waypoints_m) == 0
            continue
        assert plan.path is not None
        assert plan.waypoints_m.shape[1] == 2
        np.testing.assert_allclose(plan.path.segments[0, :2], request.position_m, atol=1e-3)
        np.testing.assert_allclose(plan.path.segments[0, 2:4], request.direction, atol=1e-6)
        if not plan.path.loiter:
            assert math.dist(plan.waypoints_m[-1], MISSION.goal_m) <= MISSION.goal_radius_m
            assert math.dist(pose_at(plan.path, math.inf)[:2], plan.waypoints_m[-1]) < 1e-3
    assert any(plan.status is PlanStatus.FOUND for _, plan in flights[kind].answers)


@pytest.mark.parametrize("kind", KINDS)
def test_paths_are_smooth_no_tighter_than_the_turn_radius_and_inside(
    kind: str, flights: dict[str, Flight]
) -> None:
    xmin, ymin, xmax, ymax = MISSION.bounds_m
    for _, plan in flights[kind].answers:
        if plan.path is None:
            continue
        rows = plan.path.segments
        assert plan.path.max_curvature_1pm <= 1.0 / MISSION.turn_radius_m + 1e-9
        for row, following in pairwise(rows):
            np.testing.assert_allclose(along(row, float(row[5])), following[:4], atol=1e-4)
        points = sample(plan.path, 100.0, 0.1)
        assert (points >= (xmin - 1e-6, ymin - 1e-6)).all()
        assert (points <= (xmax + 1e-6, ymax + 1e-6)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_what_it_is_given_stays_as_it_is(kind: str) -> None:
    angle = np.arange(0.0, math.tau, 0.03)
    points = np.column_stack((5000.0 + 900.0 * np.cos(angle), 4000.0 + 900.0 * np.sin(angle)))
    given = points.copy()
    given.setflags(write=False)
    planner, seen = make(kind), Recorded(given)
    plan = planner.plan(first_request(seen))
    np.testing.assert_array_equal(given, points)
    assert plan.path is not None
    before = bits(plan)
    for array in arrays_in(plan):
        assert not np.shares_memory(array, given)
    pose = pose_at(plan.path, 100.0)
    planner.plan(PlanRequest(4.0, pose[:2], pose[2:], seen, plan, 100.0))
    assert bits(plan) == before


@pytest.mark.parametrize("kind", KINDS)
def test_a_change_to_what_was_given_does_not_reach_the_planner(kind: str) -> None:
    angle = np.arange(0.0, math.tau, 0.03)
    points = np.column_stack((5000.0 + 900.0 * np.cos(angle), 4000.0 + 900.0 * np.sin(angle)))
    theirs, ours = make(kind), make(kind)
    given = points.copy()
    spoilt, whole = Recorded(given), Recorded(points)
    plan, same = theirs.plan(first_request(spoilt)), ours.plan(first_request(whole))
    given[:] = 0.0
    # The window rolls: both search with what they remember.
    assert plan.path is not None
    station = 0.4 * plan.path.length_m
    pose = pose_at(plan.path, station)
    answers = [
        each.plan(PlanRequest(400.0, pose[:2], pose[2:], seen, flown, station))
        for each, seen, flown in ((theirs, spoilt, plan), (ours, whole, same))
    ]
    assert bits(answers[0]) == bits(answers[1])


@pytest.mark.parametrize("kind", KINDS)
def test_plans_cannot_be_changed(kind: str, flights: dict[str, Flight]) -> None:
    plan = next(plan for _, plan in flights[kind].answers if plan.path is not None)
    assert isinstance(plan.path, Path)
    with pytest.raises(FrozenInstanceError):
        plan.status = PlanStatus.KEPT  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        plan.path.segments[0, 0] = 0.0
    for array in arrays_in(plan):
        assert not array.flags.writeable


def reachable(*roots: object) -> list[object]:
    """Everything that can be reached from objects through attributes, containers and closures."""
    code = (type, types.ModuleType, types.CodeType, types.BuiltinFunctionType, property)
    found: dict[int, object] = {}
    pending = list(roots)
    while pending:
        each = pending.pop()
        if id(each) in found or isinstance(each, code):
            continue
        found[id(each)] = each
        if isinstance(each, types.FunctionType):
            # What it has captured, but not the names of its module.
            pending += [each.__closure__, each.__defaults__, each.__kwdefaults__]
            continue
        pending += gc.get_referents(each)
        pending += getattr(each, "__dict__", {}).values()
    return list(found.values())


def truths(*roots: object) -> list[object]:
    return [
        each
        for each in reachable(*roots)
        if isinstance(each, World | Obstacle | Circle | Polygon | RangeSensor)
    ]


@pytest.mark.parametrize("kind", KINDS)
def test_the_true_world_cannot_be_reached_from_what_a_planner_has(kind: str) -> None:
    flight = Flight(kind, OBSTACLES)
    flight.go(40)
    assert truths(flight.request, flight.planner) == []
    assert len(truths(flight)) >= 1 + len(OBSTACLES)


@pytest.mark.parametrize("hide", ["attribute", "closure"])
def test_the_spy_sees_a_world_that_is_planted(hide: str) -> None:
    planted = World(OBSTACLES, MISSION.bounds_m)
    flight = Flight("rolling_window", OBSTACLES)

    def peek() -> World:
        return planted

    setattr(flight.seen, "truth", {"hidden": [planted if hide == "attribute" else peek]})  # noqa: B010
    assert planted in truths(flight.request)


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
