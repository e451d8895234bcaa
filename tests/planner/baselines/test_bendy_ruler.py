"""BendyRuler's bearings against angles worked out by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.baselines.bendy_ruler import BendyRuler
from planner.contract import MISSION
from planner.geometry.curves import Pose
from planner.keys import MarginConfig

HERE = (1000.0, 7000.0)
EAST = replace(MISSION, goal_m=(19_000.0, 7000.0))


def ruler() -> BendyRuler:
    return BendyRuler(MarginConfig(), EAST)


def bearing(planner: BendyRuler, *points: tuple[float, float]) -> float:
    return math.degrees(planner.direction(Pose(*HERE, 1.0, 0.0), np.array(points).reshape(-1, 2) + HERE))


def test_with_nothing_in_the_way_it_flies_at_the_goal() -> None:
    assert bearing(ruler()) == 0.0
    # The first line keeps 300 m from what lies 300 m beyond its end; the second ones keep 0 and 300 sin 45 deg = 212 m.
    # Turned by 5 deg, the one 45 deg to the left keeps 304.6 sin 45 deg + 104.6 cos 45 deg = 289 m.
    assert bearing(ruler(), (1500.0, 0.0)) == pytest.approx(5.0)


@pytest.mark.parametrize(("ahead_m", "turn_deg"), [(600.0, 25.0), (400.0, 35.0), (1000.0, 15.0)])
def test_the_first_of_the_bearings_in_turns_that_keeps_the_margin_is_taken(ahead_m: float, turn_deg: float) -> None:
    # asin(220 / 600) = 21.5 deg, asin(220 / 400) = 33.4 deg, asin(220 / 1000) = 12.7 deg; steps of 5, left first.
    assert bearing(ruler(), (ahead_m, 0.0)) == pytest.approx(turn_deg)
    assert bearing(ruler(), (ahead_m, 1.0)) == pytest.approx(turn_deg), "a hair to the left: still the left"
    beside = ahead_m * math.sin(math.radians(10.0))
    assert bearing(ruler(), (ahead_m, beside)) < 0.0, "to the left by 10 deg: the right"


def test_where_no_bearing_is_clear_the_one_of_the_largest_margin_is_taken() -> None:
    ring = [
        (150.0 * math.cos(a), 150.0 * math.sin(a)) for a in np.radians(np.arange(0.0, 360.0, 3.0)) if abs(a - 2.0) > 0.3
    ]
    assert bearing(ruler(), *ring) == pytest.approx(math.degrees(2.0), abs=5.0)


def test_a_bearing_far_off_the_last_one_is_resisted_but_not_that_of_a_clear_way_to_the_goal() -> None:
    """As ArduPilot's `AP_OABendyRuler::resist_bearing_change`: "If we have a clear path to destination, go there"."""
    planner = ruler()
    # Straight at the goal the margin is 260 m, along 80 deg 221 m: no better by half.
    free = ((600.0, 260.0), (600.0, -260.0), (300.0, 408.0))
    for last_deg in (80.0, 70.0):
        planner.chosen = math.radians(last_deg)
        assert bearing(planner, *free) == 0.0
        # 1,400 m ahead, 200 m beyond the first line, the second is cut; it is clear at 45 deg to the right.
        planner.chosen = math.radians(last_deg)
        assert bearing(planner, *free, (1400.0, 141.0)) == pytest.approx(80.0 if last_deg == 80.0 else 0.0)
