"""MPPI's model and costs against numbers by hand, and its samples against its seed."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.baselines.mppi import Mppi, MppiConfig
from planner.contract import MISSION, GivenMap, circle_outline
from planner.geometry.curves import Pose
from planner.interface import Plan, PlanRequest, PlanStatus

HERE = (1000.0, 7000.0)
EAST = replace(MISSION, goal_m=(19_000.0, 7000.0))  # R = 150 m: a step is 75 m
NORTH = Pose(*HERE, 0.0, 1.0)


def ask(planner: Mppi, points: np.ndarray) -> Plan:
    return planner.plan(PlanRequest(0.0, HERE, (1.0, 0.0), GivenMap(points)))


def test_a_rollout_is_a_chain_of_arcs() -> None:
    # To the left at R = 150 m for four steps of 75 m: 2 rad of a circle about (850, 7000).
    left, straight = Mppi(MppiConfig(steps=4), EAST).rollout(NORTH, np.array([[1.0 / 150.0] * 4, [0.0] * 4]))
    angles = np.array([0.5, 1.0, 1.5, 2.0])
    np.testing.assert_allclose(left[:, 0], 850.0 + 150.0 * np.cos(angles))
    np.testing.assert_allclose(left[:, 1], 7000.0 + 150.0 * np.sin(angles))
    np.testing.assert_allclose(straight, [(1000.0, 7000.0 + 75.0 * i) for i in (1, 2, 3, 4)])


def test_a_rollout_costs_its_way_what_is_left_and_what_it_comes_too_near_to() -> None:
    planner = Mppi(MppiConfig(steps=4), EAST)
    places = planner.rollout(Pose(*HERE, 1.0, 0.0), np.zeros((1, 4)))
    # 18,000 m to the goal are 240 steps, four of them flown.
    assert planner.costs(places, np.zeros((0, 2)))[0] == pytest.approx(240.0)
    # Two of the four places are nearer than the clearance of 200 m to a point 190 m beside (1187.5, 7000).
    cost = planner.costs(places, np.array([[1187.5, 7190.0]]))[0]
    assert cost == pytest.approx(240.0 + 2 * 50.0 + 1 * 0.0, abs=6.1)
    outside = planner.rollout(Pose(19_900.0, 7000.0, 1.0, 0.0), np.zeros((1, 4)))
    assert planner.costs(outside, np.zeros((0, 2)))[0] > 3 * 50.0


def test_the_samples_follow_from_the_seed() -> None:
    points = circle_outline(2200.0, 7000.0, 300.0)
    first, again = (ask(Mppi(MppiConfig(), EAST), points) for _ in range(2))
    other = ask(Mppi(MppiConfig(seed=2), EAST), points)
    assert first.path is not None
    assert again.path is not None
    assert other.path is not None
    assert first.path.segments.tobytes() == again.path.segments.tobytes()
    assert first.path.segments.tobytes() != other.path.segments.tobytes()
    assert first.path.max_curvature_1pm <= 1.0 / 150.0 + 1e-12


def test_it_goes_round_an_obstacle_ahead_and_holds_where_it_is_shut_in() -> None:
    plan = ask(Mppi(MppiConfig(steps=40), EAST), circle_outline(2200.0, 7000.0, 300.0))
    assert plan.path is not None
    assert (np.hypot(*(plan.waypoints_m - (2200.0, 7000.0)).T) - 300.0).min() > MISSION.clearance_m
    assert plan.waypoints_m[-1, 0] > 2500.0
    angle = np.arange(0.0, math.tau, 0.02)
    ring = np.column_stack((HERE[0] + 250.0 * np.cos(angle), HERE[1] + 250.0 * np.sin(angle)))
    shut_in = ask(Mppi(MppiConfig(), EAST), ring)
    assert shut_in.status in (PlanStatus.FOUND, PlanStatus.NO_PATH)
    assert shut_in.path is None or shut_in.path.loiter
