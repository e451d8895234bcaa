"""The tree of Dubins curves against distances worked out by numpy."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.baselines.dubins_tree import HOLD_REGROW_S, DubinsTree, DubinsTreeConfig
from planner.contract import MISSION, GivenMap
from planner.geometry.curves import sample
from planner.interface import FloatArray, Mission, Path, Plan, PlanRequest, PlanStatus
from tests.planner.walls_and_paths import ring, wall

START = (2000.0, 5000.0)
EAST = replace(MISSION, goal_m=(15_000.0, 5000.0))


def first(points: FloatArray, mission: Mission = EAST) -> Plan:
    return DubinsTree(DubinsTreeConfig(), mission).plan(PlanRequest(0.0, START, (1.0, 0.0), GivenMap(points)))


def keeps_m(path: Path | None, points: FloatArray) -> float:
    assert path is not None
    return float(np.hypot(*(sample(path, 20.0)[:, None] - points).transpose(2, 0, 1)).min())


def test_a_tree_finds_a_way_round_twice_the_same() -> None:
    points = ring(5000.0, 5200.0, 1200.0, 50.0)
    plan, again = first(points), first(points)
    assert plan.path is not None
    assert again.path is not None
    np.testing.assert_array_equal(plan.path.segments, again.path.segments)
    assert plan.path.max_curvature_1pm <= 1.0 / EAST.turn_radius_m + 1e-9
    assert keeps_m(plan.path, points) > EAST.clearance_m
    assert plan.path.length_m < 1.3 * 13_000.0


@pytest.mark.parametrize("north_m", [4000.0, 4600.0, 5000.0, 5400.0])
def test_it_keeps_away_from_what_is_known_beyond_the_sensing_range(north_m: float) -> None:
    points = np.concatenate((ring(5000.0, 5200.0, 1200.0, 50.0), ring(11_500.0, north_m, 1500.0, 50.0)))
    assert keeps_m(first(points).path, points) > EAST.clearance_m


def test_the_area_may_be_as_large_as_a_continent() -> None:
    wide = replace(EAST, bounds_m=(-3e6, -3e6, 3e6, 3e6), clearance_m=20.0)
    assert first(ring(5000.0, 5200.0, 1200.0, 50.0), wide).status is PlanStatus.FOUND


def test_from_a_turn_to_hold_in_another_way_is_looked_for() -> None:
    planner, around = DubinsTree(DubinsTreeConfig(), EAST), ring(*START, 1500.0, 50.0)
    hold = planner.plan(PlanRequest(0.0, START, (1.0, 0.0), GivenMap(around)))
    assert hold.path is not None
    assert hold.path.loiter

    def asked(time_s: float, seen: GivenMap) -> PlanStatus:
        return planner.plan(PlanRequest(time_s, START, (1.0, 0.0), seen, hold, 10.0)).status

    gone = GivenMap(around[:0])
    gone.revision = gone.last_removal_revision = 2
    assert asked(0.9 * HOLD_REGROW_S, GivenMap(around)) is PlanStatus.KEPT
    assert asked(HOLD_REGROW_S, GivenMap(around)) is PlanStatus.NO_PATH
    assert asked(1.9 * HOLD_REGROW_S, gone) is PlanStatus.KEPT
    assert asked(2.0 * HOLD_REGROW_S, gone) is PlanStatus.FOUND


def test_in_a_turn_that_a_shield_holds_a_tree_is_grown_as_seldom() -> None:
    planner, points = DubinsTree(DubinsTreeConfig(), EAST), ring(5000.0, 5200.0, 1200.0, 50.0)
    held = Path(np.array([(*START, 1.0, 0.0, 1.0 / EAST.turn_radius_m, math.tau * EAST.turn_radius_m)]))

    def asked(time_s: float) -> Plan:
        return planner.plan(PlanRequest(time_s, START, (1.0, 0.0), GivenMap(points), committed=held))

    assert (grown := asked(0.0)).status is PlanStatus.FOUND
    between = asked(0.9 * HOLD_REGROW_S)
    assert (between.status, between.reason) == (PlanStatus.KEPT, f"{grown.reason}; no new tree is due")
    assert asked(HOLD_REGROW_S).status is PlanStatus.FOUND


def test_a_path_stays_inside_the_area_where_the_way_round_leads_along_its_border() -> None:
    points = wall((8000.0, 1500.0), (8000.0, 13_500.0), 50.0)
    path = first(points).path
    assert keeps_m(path, points) > EAST.clearance_m
    assert path is not None
    assert sample(path, 20.0)[:, 1].max() <= EAST.bounds_m[3]
    assert math.dist(sample(path, 20.0)[-1], EAST.goal_m) < 1.0
