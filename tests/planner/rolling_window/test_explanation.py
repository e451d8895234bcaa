"""What a person is told of a plan."""

from __future__ import annotations

import pytest

from planner.geometry.curves import Point
from planner.rolling_window.commitment import explanation


@pytest.mark.parametrize(
    ("first", "told"),
    [
        ((3000.0, 400.0), "obstacle ahead at 3.0 km, passing left"),
        ((3000.0, -400.0), "obstacle ahead at 3.0 km, passing right"),
    ],
)
def test_says_on_which_side_what_is_ahead_is_passed(first: Point, told: str) -> None:
    assert explanation((0.0, 0.0), (10_000.0, 0.0), [first, (10_000.0, 0.0)]) == told


def test_says_how_far_the_goal_is() -> None:
    assert (
        explanation((0.0, 0.0), (6000.0, 8000.0), [(6000.0, 8000.0)])
        == "way to the goal in view, 10.0 km to go"
    )
