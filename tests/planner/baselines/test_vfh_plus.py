import math
from dataclasses import replace

import numpy as np
import shapely

from planner import contract
from planner.baselines.vfh_plus import VfhPlus
from planner.contract import GivenMap
from planner.geometry.curves import pose_at
from planner.interface import FloatArray, Plan, PlanRequest, PlanStatus
from planner.keys import MarginConfig
from tests.planner.walls_and_paths import ring

MISSION = replace(contract.MISSION, goal_m=(15_000.0, 5000.0), bounds_m=(0.0, 0.0, 20_000.0, 10_000.0))
START = (2000.0, 5000.0)


def flown(points: FloatArray, most_m: float = 20_000.0) -> tuple[FloatArray, list[Plan], bool]:
    """The track of an exact flight, all plans, and whether the goal was reached."""
    planner, seen = VfhPlus(MarginConfig(), MISSION), GivenMap(points)
    place, direction, arc_length_m = START, (1.0, 0.0), 0.0
    current: Plan | None = None
    track, plans = [START], list[Plan]()
    for _ in range(int(most_m / 25.0)):
        plan = planner.plan(PlanRequest(0.0, place, direction, seen, current, arc_length_m))
        if plan.status is PlanStatus.FOUND:
            current, arc_length_m = plan, 0.0
            plans.append(plan)
        assert current is not None
        assert current.path is not None
        arc_length_m += 25.0
        x, y, ux, uy = pose_at(current.path, arc_length_m)
        place, direction = (x, y), (ux, uy)
        track.append(place)
        if math.dist(place, MISSION.goal_m) < MISSION.goal_radius_m:
            return np.array(track), plans, True
    return np.array(track), plans, False


def first(points: FloatArray, direction: tuple[float, float] = (1.0, 0.0), place: tuple[float, float] = START) -> Plan:
    return VfhPlus(MarginConfig(), MISSION).plan(PlanRequest(0.0, place, direction, GivenMap(points)))


def steered(plan: Plan) -> float:
    assert plan.path is not None
    _, _, tx, ty = pose_at(plan.path, math.inf)
    return math.atan2(ty, tx)


def test_nothing_near_steers_to_the_goal() -> None:
    track, plans, reached = flown(np.zeros((0, 2)))
    assert reached
    np.testing.assert_allclose(track[:, 1], 5000.0, atol=1e-6)
    assert len(plans) < 20


def test_obstacles_apart_are_passed_at_the_clearance() -> None:
    discs = ((5000.0, 5300.0, 700.0), (8500.0, 4600.0, 900.0), (12_000.0, 5200.0, 500.0))
    points = np.concatenate([ring(*disc, 50.0) for disc in discs])
    track, plans, reached = flown(points)
    assert reached
    assert shapely.distance(shapely.LineString(track), shapely.MultiPoint(points)) > MISSION.clearance_m
    assert max(plan.path.max_curvature_1pm for plan in plans if plan.path) <= 1.0 / MISSION.turn_radius_m + 1e-9
    assert len(track) * 25.0 < 1.15 * 13_000.0


def test_the_nearer_side_of_an_obstacle_is_taken() -> None:
    assert steered(first(ring(4000.0, 5200.0, 600.0, 50.0))) < -0.1
    assert steered(first(ring(4000.0, 4800.0, 600.0, 50.0))) > 0.1


def test_the_mask_forbids_a_turn_through_an_obstacle() -> None:
    # The goal is behind on the left in a free sector, and something ahead stands in the left turn to it.
    bearing = math.radians(170.0)
    behind = replace(MISSION, goal_m=(10_000.0 + 4000.0 * math.cos(bearing), 5000.0 + 4000.0 * math.sin(bearing)))
    beside = np.array([(10_000.0 + 250.0 * math.cos(1.0), 5000.0 + 250.0 * math.sin(1.0))])
    turns = []
    for points in (np.zeros((0, 2)), beside):
        request = PlanRequest(0.0, (10_000.0, 5000.0), (1.0, 0.0), GivenMap(points))
        path = VfhPlus(MarginConfig(), behind).plan(request).path
        assert path is not None
        turns.append(float(np.sign(path.segments[0, 4])))
    assert turns == [1.0, -1.0]  # left where nothing is there, else right


def test_a_sector_between_the_thresholds_stays_as_it_was() -> None:
    window = 12.0 * MISSION.turn_radius_m + 6.0 * MISSION.clearance_m
    near, middle = (window * math.sqrt(1.0 - magnitude) for magnitude in (0.6, 0.075))

    def swerves(distances: list[float]) -> bool:
        planner, plan = VfhPlus(MarginConfig(), MISSION), Plan(PlanStatus.KEPT, "")
        for i, distance in enumerate(distances, 1):
            seen = GivenMap(np.array([(START[0] + distance, START[1])]))
            seen.revision = seen.last_removal_revision = i
            plan = planner.plan(PlanRequest(0.0, START, (1.0, 0.0), seen))
        return abs(steered(plan)) > 0.05

    assert not swerves([middle])
    assert swerves([near])
    assert swerves([near, middle])


def test_a_dead_end_ends_in_a_holding_turn() -> None:
    plan = first(ring(*START, 900.0, 50.0))
    assert plan.status is PlanStatus.FOUND
    assert plan.path is not None
    assert plan.path.loiter
    assert "holding" in plan.reason


def test_near_the_border_a_path_ends_inside_and_none_is_held_back_far_from_it() -> None:
    """Three times from one place, each time in the direction that was chosen before."""
    xmin, ymin, xmax, ymax = MISSION.bounds_m
    for seed in range(100):
        rng = np.random.default_rng(seed)
        place = (float(rng.uniform(12_000.0, 19_700.0)), float(rng.uniform(500.0, 8000.0)))
        discs = rng.uniform((13_000.0, 3500.0, 300.0), (19_800.0, 11_000.0, 900.0), (6, 3)).tolist()
        if min(math.dist(place, (x, y)) - radius for x, y, radius in discs) < 400.0:
            continue
        seen = GivenMap(np.concatenate([ring(x, y, radius, 50.0) for x, y, radius in discs]))
        heading = float(rng.uniform(0.0, math.tau))
        direction = (math.cos(heading), math.sin(heading))
        far = min(place[0] - xmin, xmax - place[0], place[1] - ymin, ymax - place[1]) > 2000.0
        for _ in range(3):
            plan = VfhPlus(MarginConfig(), MISSION).plan(PlanRequest(0.0, place, direction, seen))
            assert not (far and "no turn stays inside" in plan.reason)
            if plan.path is None or plan.path.loiter:
                break
            arc_lengths_m = np.linspace(0.0, plan.path.length_m, 100).tolist()
            x, y = np.array([pose_at(plan.path, arc_length_m)[:2] for arc_length_m in arc_lengths_m]).T
            assert xmin - 1e-6 <= x.min() <= x.max() <= xmax + 1e-6
            assert ymin - 1e-6 <= y.min() <= y.max() <= ymax + 1e-6
            ux, uy = plan.path.segments[-1, 2:4].tolist()
            direction = (ux, uy)


def test_what_is_narrower_than_a_sector_is_steered_round_where_it_lies_between_two() -> None:
    bearing = math.radians(2.5)
    ahead = (math.cos(bearing), math.sin(bearing))
    goal, edge = ((START[0] + away * ahead[0], START[1] + away * ahead[1]) for away in (12_000.0, 500.0))
    planner = VfhPlus(MarginConfig(), replace(MISSION, clearance_m=10.0, goal_m=goal))
    plan = planner.plan(PlanRequest(0.0, START, ahead, GivenMap(np.array([edge]))))
    assert abs(steered(plan) - bearing) > math.asin(10.0 / 500.0)
