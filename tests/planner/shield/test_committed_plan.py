"""The monitor of the plan in effect."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from planner import contract
from planner.geometry.course import Course
from planner.geometry.curves import pose_at
from planner.interface import FloatArray, Path, Plan, PlanRequest, PlanStatus
from planner.shield.committed_plan import CUT_SHARE, CommittedPlan, PlanMonitor, start_of
from tests.planner.rolling_window.test_rolling_window import Seen

STRAIGHT = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 9000.0)]))
TURN = (2000.0, 0.0, 1.0, 0.0, 0.01, 2.0 * math.pi * 100.0)
COMMITTED = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 2000.0), TURN]), loiter=True)
EDGES = np.array([(1000.0, 900.0), (5000.0, 100.0), (1500.0, -50.0)])


MISSION = replace(contract.MISSION, goal_m=(9000.0, 0.0), goal_radius_m=50.0, sensor_range_m=3000.0)


def monitoring() -> PlanMonitor:
    return PlanMonitor(MISSION, keep_m=300.0, urgent_m=1000.0, lead_m=50.0, step_m=500.0)


def in_effect(monitor: PlanMonitor, plan: CommittedPlan, points: FloatArray, removed: int = 0) -> None:
    """The loop has put into effect what was proposed."""
    monitor.proposed = plan
    assert monitor.take_effect(plan.plan, points, removed)
    assert monitor.plan is plan
    assert monitor.proposed is None


def committed(known: int) -> CommittedPlan:
    course = Course(STRAIGHT, ((9000.0, 0.0),), known, shortest=True)
    return CommittedPlan(Plan(PlanStatus.FOUND, "", path=COMMITTED), COMMITTED, course, 2000.0)


@pytest.mark.parametrize(("known", "cut", "broken"), [(3, False, False), (2, True, True), (1, True, True)])
def test_a_plan_is_cut_by_what_came_in_while_it_was_looked_for(known: int, cut: bool, broken: bool) -> None:
    monitor = monitoring()
    in_effect(monitor, committed(known), EDGES)
    assert math.isfinite(monitor.cut_m) is cut
    assert monitor.broken is broken
    if cut:
        assert 1200.0 <= monitor.cut_m <= 1500.0


def test_what_is_left_has_the_straight_on_which_it_rolls() -> None:
    way, roll = (0.0, 0.0, 1.0, 0.0, 0.001, 400.0), 40.0
    x, y, ux, uy = pose_at(Path(np.array([way])), 400.0)
    turn = (x + roll * ux, y + roll * uy, ux, uy, -0.01, 2.0 * math.pi * 100.0)
    path = Path(np.array([way, (x, y, ux, uy, 0.0, roll), turn]), loiter=True)
    flown = CommittedPlan(Plan(PlanStatus.FOUND, "", path=path), path, committed(3).course, 400.0)
    for at_m, lengths in ((100.0, [300.0, roll, turn[5]]), (410.0, [30.0, turn[5]]), (450.0, [turn[5]])):
        left = flown.left(at_m)
        assert left.segments[:, 5].tolist() == pytest.approx(lengths)
        for before, after in itertools.pairwise(left.segments):
            assert pose_at(Path(before[None]), before[5])[:2] == pytest.approx(after[:2])


def test_a_new_plan_begins_on_the_one_in_effect_or_at_an_aircraft_that_is_not_near_it() -> None:
    for off_m, north in ((11.9, 0.0), (12.1, 12.1)):  # four tracking errors
        request = PlanRequest(0.0, (400.0, off_m), (1.0, 0.0), Seen(EDGES))
        onward = start_of(committed(3), request, 400.0, 300.0, MISSION).prefix
        assert onward == [pytest.approx((400.0, north, 1.0, 0.0, 0.0, 300.0))]
    assert start_of(None, request, 0.0, 300.0, MISSION).prefix == [(400.0, 12.1, 1.0, 0.0, 0.0, 300.0)]
    request, late = request._replace(position_m=(400.0, 0.0)), replace(MISSION, compute_latency_s=4.0)
    cut = start_of(committed(3), request._replace(direction=(0.6, 0.8)), 400.0, 300.0, late, to_m=390.0).prefix
    assert cut == [pytest.approx((400.0, 0.0, 1.0, 0.0, 0.0, 4.0 * late.ground_speed_mps))], "flown until then"


def test_in_its_turn_a_plan_is_broken_by_what_is_near_that_and_by_nothing_beside_its_course() -> None:
    flown, monitor = committed(3), monitoring()
    in_effect(monitor, flown, EDGES[:0])
    assert not monitor.look(flown, 2100.0, (2100.0, 100.0), np.array([(5000.0, 100.0)]))
    assert monitor.cut_m == math.inf
    assert not monitor.look(flown, 2100.0, (2100.0, 100.0), np.array([(2000.0, 401.0)]))
    assert not monitor.broken
    assert not monitor.look(flown, 2100.0, (2100.0, 100.0), np.array([(2000.0, 397.0)]))
    assert monitor.broken


def test_a_plan_that_ends_at_the_goal_has_no_turn_and_is_over_there() -> None:
    flown = CommittedPlan(Plan(PlanStatus.FOUND, "", path=STRAIGHT), STRAIGHT, committed(3).course, 8953.0)
    assert flown.left(400.0).length_m == pytest.approx(8600.0)
    assert flown.turn.length_m == 0.0
    assert [flown.is_over(at_m) for at_m in (8953.0, 8999.0, 9000.0, 9100.0)] == [False, False, True, True]
    assert not committed(3).is_over(1e6)
    monitor = monitoring()
    in_effect(monitor, flown, EDGES[:0])
    assert not monitor.look(flown, 400.0, (400.0, 0.0), np.array([(1000.0, 301.0)]))
    assert not monitor.broken
    monitor.look(flown, 400.0, (400.0, 0.0), np.array([(1000.0, 299.0)]))
    assert monitor.broken


def test_what_has_gone_meanwhile_hides_nothing_that_came_in() -> None:
    monitor = monitoring()
    course = committed(4).course  # one of the four is gone; the last of the edges is new
    assert monitor.cut_at(course, EDGES) == math.inf
    assert 1200.0 <= monitor.cut_at(course, EDGES, removed=2) <= 1500.0
    in_effect(monitor, committed(4), EDGES, removed=9)
    assert monitor.broken


def test_a_cut_beyond_the_turn_does_not_break_the_plan() -> None:
    monitor = monitoring()
    in_effect(monitor, committed(1), EDGES[:2])
    assert 4700.0 <= monitor.cut_m <= 5000.0
    assert not monitor.broken


def test_the_window_rolls_on_the_sooner_the_nearer_something_is_wrong() -> None:
    flown, monitor = committed(3), monitoring()
    assert not monitor.due(flown, 0.0, 1e4, newly_cut=False)  # all is well, and the turn far ahead
    assert monitor.due(flown, 300.0, 500.0, newly_cut=False)  # the turn comes nearer: a rolling step
    assert not monitor.due(flown, 300.0, 499.0, newly_cut=False)
    assert monitor.due(flown, 1100.0, 60.0, newly_cut=False)  # it is near
    assert not monitor.due(flown, 1100.0, 40.0, newly_cut=False)
    in_effect(monitor, committed(1), EDGES[:2])
    least_m = CUT_SHARE * monitor.cut_m
    assert not monitor.due(committed(1), 0.0, 0.9 * 50.0, newly_cut=False)
    assert monitor.due(committed(1), 0.0, max(least_m, 50.0), newly_cut=False)
    assert monitor.due(committed(1), 1100.0, 0.0, newly_cut=True)
