"""Places given up after turning before them."""

from __future__ import annotations

import numpy as np
import pytest

from planner.geometry.curves import Pose
from planner.interface import Mission
from planner.memory import ObstacleMemory
from planner.rolling_window.dead_ends import DeadEnds

MISSION = Mission(
    goal_m=(9000.0, 0.0),
    goal_radius_m=50.0,
    clearance_m=50.0,
    sensor_range_m=3000.0,
    speed_mps=25.0,
    turn_radius_m=110.0,
    roll_in_s=1.0,
    tracking_error_m=3.0,
    bounds_m=(-1e5, -1e5, 1e5, 1e5),
)


def test_a_place_is_given_up_at_the_second_turn_before_it() -> None:
    ends = DeadEnds(MISSION, ObstacleMemory(MISSION.clearance_m))
    assert not ends.turned_before((0.0, 0.0))
    assert not ends.turned_before((150.0, 0.0))
    assert ends.turned_before((0.0, 60.0))


def test_what_lies_beside_a_place_is_given_up_with_it() -> None:
    memory = ObstacleMemory(MISSION.clearance_m)
    DeadEnds(MISSION, memory).give_up(Pose(1000.0, 0.0, 1.0, 0.0))
    beside = [(1000.0, each) for each in (-100.0, -50.0, 0.0, 50.0, 100.0)]
    np.testing.assert_allclose(sorted(memory.refused_m.tolist()), beside)


def test_before_the_goal_only_the_way_to_it_is_given_up() -> None:
    memory = ObstacleMemory(MISSION.clearance_m)
    DeadEnds(MISSION, memory).give_up(Pose(8950.0, 0.0, 1.0, 0.0))
    assert memory.refused_m.tolist() == [pytest.approx((8840.0, 0.0))]
