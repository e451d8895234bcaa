"""The exact point robot against lengths by hand."""

import math

import pytest
import shapely

from tests.closed_loop.point_robot import walked_m
from wayproof import Mission

START, GOAL, CLEARANCE_M, GOAL_RADIUS_M = (3000.0, 5000.0), (17_000.0, 5000.0), 200.0, 100.0


def walked(*obstacles: shapely.Polygon, range_m: float = 3000.0) -> float:
    bounds = (0.0, 0.0, 20_000.0, 10_000.0)
    mission = Mission(GOAL, GOAL_RADIUS_M, bounds, CLEARANCE_M, 1.0, 1.0, 1.0, 1.0, range_m)
    return walked_m([*obstacles], mission, START, 400_000.0)


def test_round_a_circle_in_sight_it_takes_both_tangents_and_the_arc_between() -> None:
    radius = 1500.0 + CLEARANCE_M
    half = math.sqrt(7000.0**2 - radius**2) + radius * (0.5 * math.pi - math.acos(radius / 7000.0))
    circle = shapely.Point(10_000.0, 5000.0).buffer(1500.0, quad_segs=64)
    assert walked(circle, range_m=10_000.0) == pytest.approx(2.0 * half - GOAL_RADIUS_M, rel=2e-3)


def test_a_wall_out_of_sight_is_gone_round_when_it_is_seen() -> None:
    """Of a wall whose nearer end is 1,000 m aside, nothing is seen until 3,000 m before it, then that end."""
    optimum_m = 2.0 * math.hypot(7000.0, 1000.0)
    assert optimum_m < walked(shapely.box(10_000.0, 2000.0, 10_010.0, 6000.0)) < optimum_m + 500.0


def test_a_goal_that_is_walled_in_has_no_way() -> None:
    ring = shapely.Point(GOAL).buffer(1500.0).difference(shapely.Point(GOAL).buffer(1450.0))
    assert math.isinf(walked(ring))
