"""Places given up after turning before them."""

from __future__ import annotations

from planner.dead_ends import DeadEnds


def test_a_place_is_given_up_at_the_second_turn_before_it() -> None:
    ends = DeadEnds(100.0)
    assert not ends.turned_before((0.0, 0.0))
    assert not ends.turned_before((150.0, 0.0))
    assert ends.turned_before((0.0, 60.0))


def test_a_place_that_was_given_up_is_counted_anew() -> None:
    ends = DeadEnds(100.0)
    ends.turned_before((0.0, 0.0))
    assert ends.turned_before((0.0, 0.0))
    assert not ends.turned_before((0.0, 0.0))
    assert ends.turned_before((0.0, 0.0))
