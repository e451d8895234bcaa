"""The planner of the paper as a planner: asked with edge points given directly."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner import contract
from planner.geometry.curves import end_of, pose_at, poses_at, sample
from planner.interface import BoolArray, FloatArray, Mission, MovingEdges, Path, Plan, PlanRequest, PlanStatus
from planner.nearest_edge import distance_to_edges
from planner.rolling_window.config import RollingWindowConfig
from planner.rolling_window.planner import RollingWindow
from tests.examples import examples
from tests.planner.walls_and_paths import assert_flyable, ring

MISSION = replace(
    contract.MISSION,
    goal_m=(20_000.0, 0.0),
    bounds_m=(-2000.0, -12_000.0, 22_000.0, 12_000.0),
    sensor_range_m=8000.0,
)
SPACING = 50.0


class Seen:
    """Edge points of the true world that have come into range, and nothing else."""

    spacing_m = SPACING
    last_removal_revision = 0
    moving: tuple[MovingEdges, ...] = ()
    last_contradiction_s = -math.inf
    distance_m = distance_to_edges

    def __init__(self, truth: FloatArray, range_m: float = MISSION.sensor_range_m) -> None:
        self.revision = 0
        self._hidden, self._range_m = truth, range_m
        self._shown: list[tuple[int, FloatArray]] = []

    def look(self, east_m: float, north_m: float) -> None:
        near = np.hypot(self._hidden[:, 0] - east_m, self._hidden[:, 1] - north_m) < self._range_m
        if near.any():
            self.show(self._hidden[near])
            self._hidden = self._hidden[~near]

    def show(self, points: FloatArray) -> None:
        self.revision += 1
        self._shown.append((self.revision, points))

    def edges_since(self, revision: int) -> FloatArray:
        return np.concatenate([np.zeros((0, 2)), *(p for at, p in self._shown if at > revision)])

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        return np.ones(len(points_m), dtype=np.bool_)


def nothing() -> FloatArray:
    return np.zeros((0, 2))


def seen_at_once(points: FloatArray) -> Seen:
    seen = Seen(nothing())
    seen.show(points)
    return seen


def planner(mission: Mission = MISSION) -> RollingWindow:
    return RollingWindow(RollingWindowConfig().resolved(mission), mission)


def first_request(seen: Seen, position: tuple[float, float] = (0.0, 0.0)) -> PlanRequest:
    return PlanRequest(0.0, position, (1.0, 0.0), seen)


def request_on(plan: Plan, arc_length_m: float, seen: Seen) -> PlanRequest:
    assert plan.path is not None
    pose = pose_at(plan.path, arc_length_m)
    return PlanRequest(arc_length_m / 25.0, pose[:2], pose[2:], seen, plan, arc_length_m)


def flight(
    truth: FloatArray, mission: Mission = MISSION, step_m: float = 100.0, pilot: RollingWindow | None = None
) -> tuple[FloatArray, list[Plan], Plan]:
    """Places flown through without error, plans flown, and the last one, until the goal is reached."""
    seen, pilot = Seen(truth, mission.sensor_range_m), pilot or planner(mission)
    seen.look(0.0, 0.0)
    plan = pilot.plan(first_request(seen))
    assert plan.status is PlanStatus.FOUND
    places, plans, arc_length_m = [(0.0, 0.0)], [plan], 0.0
    while math.dist(places[-1], mission.goal_m) > mission.goal_radius_m:
        assert len(places) < 1500, "does not arrive"
        arc_length_m += step_m
        request = request_on(plan, arc_length_m, seen)
        places.append(request.position_m)
        seen.look(*request.position_m)
        if (answer := pilot.plan(request)).status is PlanStatus.FOUND:
            assert answer.path is not None
            # The new plan is flown from here on without a jump.
            start = pose_at(answer.path, 0.0)
            np.testing.assert_allclose(start[:2], request.position_m, atol=1e-4)
            np.testing.assert_allclose(start[2:], request.direction, atol=1e-5)
            plan, arc_length_m = answer, 0.0
            plans.append(plan)
        else:
            assert answer.path is None
    return np.array(places), plans, plan


def room(line: FloatArray, points: FloatArray) -> float:
    return float(shapely.distance(shapely.LineString(line), shapely.points(points)).min(initial=math.inf))


def test_straight_in_the_open() -> None:
    plan = planner().plan(first_request(Seen(nothing())))
    assert plan.status is PlanStatus.FOUND
    assert plan.path is not None
    assert_flyable(plan.path, MISSION.turn_radius_m)
    # Straight as far as the sensor sees, and then a turn that can be flown for ever.
    assert plan.path.loiter
    *ahead, turn = plan.path.segments
    assert all(segment[4] == 0.0 for segment in ahead)
    assert sum(segment[5] for segment in ahead) == pytest.approx(MISSION.sensor_range_m)
    assert turn[5] == pytest.approx(math.tau * MISSION.turn_radius_m)
    np.testing.assert_allclose(plan.waypoints_m, [(0.0, 0.0), MISSION.goal_m])
    assert "20.0 km to go" in plan.reason


@settings(max_examples=examples(10))
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 6))
def test_arrives_through_fields_of_separate_circles(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    ranges = ((3000.0, 17_000.0), (-5000.0, 5000.0), (300.0, 2000.0))
    circles = np.column_stack([rng.uniform(*each, count) for each in ranges])
    assume((np.hypot(circles[:, :1] - (0.0, 20_000.0), circles[:, 1:2]) - circles[:, 2:]).min() > 700.0)
    apart = np.hypot(*(circles[:, None, :2] - circles[None, :, :2]).transpose(2, 0, 1))
    apart -= circles[:, None, 2] + circles[None, :, 2]
    assume(count == 1 or apart[np.triu_indices(count, 1)].min() > 600.0)
    points = np.concatenate([ring(x, y, r, SPACING) for x, y, r in circles.tolist()])
    places, plans, _ = flight(points)
    assert room(places, points) >= MISSION.clearance_m - 0.5
    for plan in plans:
        assert plan.path is not None
        assert_flyable(plan.path, MISSION.turn_radius_m)
        assert shapely.box(*MISSION.bounds_m).covers(shapely.LineString(sample(plan.path, 100.0, 0.1)))
        if not plan.path.loiter:
            np.testing.assert_allclose(end_of(plan.path)[:2], MISSION.goal_m, atol=1e-3)
            np.testing.assert_allclose(plan.waypoints_m[-1], MISSION.goal_m)
        np.testing.assert_allclose(plan.waypoints_m[0], plan.path.segments[0, :2], atol=1e-3)


def test_a_plan_is_kept_while_nothing_changes() -> None:
    seen, pilot = seen_at_once(ring(9000.0, 500.0, 2000.0, SPACING)), planner()
    plan = pilot.plan(first_request(seen))
    for arc_length_m in (0.0, 10.0, 50.0, 200.0):
        answer = pilot.plan(request_on(plan, arc_length_m, seen))
        assert answer.status is PlanStatus.KEPT
        assert answer.path is None
        assert len(answer.waypoints_m) == 0
    # From then on it is only prolonged: the same track points, the same way, as far as can be certified.
    course, arc_length_m, prolonged = plan.waypoints_m[1:].tolist(), 0.0, 0
    while math.dist(pose_at(plan.path or Path(nothing()), arc_length_m)[:2], MISSION.goal_m) > 500.0:
        arc_length_m += 250.0
        answer = pilot.plan(request_on(plan, arc_length_m, seen))
        assert answer.status in (PlanStatus.KEPT, PlanStatus.NO_BETTER, PlanStatus.FOUND)
        if answer.path is None or plan.path is None:
            continue
        assert [node for node in answer.waypoints_m[1:].tolist() if node not in course] == []
        overlap = np.linspace(0.0, 2000.0, 5)
        np.testing.assert_allclose(
            poses_at(answer.path, overlap), poses_at(plan.path, arc_length_m + overlap), atol=1e-3
        )
        plan, arc_length_m, prolonged = answer, 0.0, prolonged + 1
    assert 1 <= prolonged <= 40


@pytest.mark.parametrize("latency_s", [0.0, 4.0])
def test_new_points_on_the_plan_bring_a_new_one(latency_s: float) -> None:
    seen, pilot = Seen(nothing()), planner(replace(MISSION, compute_latency_s=latency_s))
    plan = pilot.plan(first_request(seen))
    points = ring(2500.0, 100.0, 600.0, SPACING)
    seen.show(points)
    answer = pilot.plan(request_on(plan, 500.0, seen))
    assert answer.status is PlanStatus.FOUND
    assert answer.path is not None
    assert room(sample(answer.path, 50.0, 0.01), points) >= MISSION.clearance_m
    # It leaves the old plan a second of flight ahead of where the aircraft is when it comes, not at it.
    on_m = 20.0 + 20.0 * latency_s
    old = plan.path or Path(nothing())
    np.testing.assert_allclose(pose_at(answer.path, on_m), pose_at(old, 500.0 + on_m), atol=1e-6)


def test_a_plan_that_comes_while_the_aircraft_turns_begins_on_that_turn() -> None:
    seen, pilot = Seen(nothing()), planner(replace(MISSION, compute_latency_s=10.0))
    plan = pilot.plan(first_request(seen))
    old = plan.path or Path(nothing())
    turn_at_m = old.length_m - float(old.segments[-1, 5])
    path = pilot.plan(request_on(plan, turn_at_m - 100.0, seen)).path
    assert path is not None
    np.testing.assert_allclose(pose_at(path, 200.0), pose_at(old, turn_at_m + 100.0), atol=1e-6)


def test_a_plan_shows_how_it_came_about() -> None:
    plan = planner().plan(first_request(seen_at_once(ring(6000.0, 0.0, 1000.0, SPACING))))
    assert plan.picture is not None
    picture = plan.picture()
    np.testing.assert_allclose(picture.guide_m, [(0.0, 0.0), MISSION.goal_m])
    np.testing.assert_allclose(picture.candidates[0], plan.waypoints_m)
    assert len(picture.candidates) > 1
    assert not picture.window_m, "no window bounds its search"


def test_a_boundary_close_by_is_kept() -> None:
    # Round the south is shorter, but there the area ends.
    points = ring(9000.0, 100.0, 2000.0, SPACING)
    places, _, plan = flight(points, replace(MISSION, bounds_m=(-2000.0, -2100.0, 22_000.0, 12_000.0)))
    assert places[:, 1].min() > -2100.0
    assert places[:, 1].max() > 2200.0
    assert room(places, points) >= 199.5
    assert plan.status is PlanStatus.FOUND


def test_defaults_are_derived_from_the_mission() -> None:
    config = RollingWindowConfig().resolved(MISSION)
    assert (config.margin_m, config.rolling_step_m) == (20.0, 500.0)
    tight = RollingWindowConfig().resolved(replace(MISSION, clearance_m=20.0))
    assert tight.margin_m == 6.0  # twice the tracking error
    own = RollingWindowConfig(margin_m=0.0, rolling_step_m=99.0, steps=5, candidates=2)
    assert own.resolved(MISSION) == own
    assert RollingWindowConfig().resolved(replace(MISSION, sensor_range_m=4000.0)).rolling_step_m == 250.0
    assert config.resolved(MISSION) == config
