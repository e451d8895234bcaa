"""The search for the mildest failing condition, against failures that are known."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.falsify.breaking_point import Search, Values, Vary
from harness.files.strict_yaml import InputError
from tests.examples import examples

Fails = Callable[[Values], bool]
EVENLY = Vary("key", 0.0, 1.0, decimals=17)


def found(
    fails: Fails, keys: int = 1, conditions: int = 40, tolerance: float = 0.01
) -> tuple[Search, list[Values]]:
    """A search, and the conditions that it asked for."""
    asked: list[Values] = []

    def judge(point: Values) -> bool:
        asked.append(point)
        return fails(point)

    return Search([EVENLY] * keys, judge, conditions, tolerance).run(), asked


@given(st.floats(0.001, 1.0), st.sampled_from([0.1, 0.03, 0.004]))
@settings(max_examples=examples(30))
def test_one_key_is_narrowed_down_to_the_tolerance(edge: float, tolerance: float) -> None:
    result, asked = found(lambda point: point[0] >= edge, tolerance=tolerance)
    assert result.mildest is not None
    assert result.passed_below is not None
    assert result.passed_below[0] < edge <= result.mildest[0]
    assert result.mildest[0] - result.passed_below[0] <= tolerance
    assert result.settled
    assert len(asked) == len(set(asked)) <= 40


Islands = st.lists(st.tuples(st.floats(0.01, 0.95), st.floats(0.005, 0.2)), min_size=1, max_size=4)


@given(Islands, st.integers(12, 60), st.sampled_from([0.03, 0.01]))
@settings(max_examples=examples(40))
def test_no_failing_range_as_wide_as_a_step_lies_below_the_answer(
    islands: list[tuple[float, float]], conditions: int, tolerance: float
) -> None:
    def fails(point: Values) -> bool:
        return any(start <= point[0] <= start + width for start, width in islands)

    result, asked = found(fails, conditions=conditions, tolerance=tolerance)
    edge = 1.0 if result.mildest is None else result.mildest[0]
    for start, width in islands:
        assert width <= 1.0 / result.steps + 1e-9 or start >= edge - tolerance
    assert (len(asked) <= conditions, result.settled) == (True, True)
    assert result.mildest is None or fails(result.mildest)


def test_the_mild_end_comes_first_and_may_be_all_there_is() -> None:
    at_once, asked = found(lambda point: True)
    assert (at_once.mildest, at_once.passed_below, asked) == ((0.0,), None, [(0.0,)])
    never, asked = found(lambda point: False)
    assert (never.mildest, never.settled) == (None, True)
    assert asked == [(step / never.steps,) for step in range(never.steps + 1)]


@pytest.mark.parametrize("conditions", range(2, 14))
def test_the_conditions_are_counted(conditions: int) -> None:
    result, asked = found(lambda point: point[0] > 0.77, conditions=conditions, tolerance=0.001)
    assert len(asked) <= conditions
    assert result.mildest is not None
    assert result.mildest[0] > 0.77
    assert result.settled == (conditions >= 12), "two ends and ten halvings to a thousandth"


@given(st.lists(st.floats(0.05, 0.95), min_size=2, max_size=3))
@settings(max_examples=examples(12))
def test_where_every_key_makes_it_harder_the_mildest_is_found(edges: list[float]) -> None:
    keys, tolerance = len(edges), 0.02
    result, asked = found(
        lambda point: all(place >= edge for place, edge in zip(point, edges, strict=True)),
        keys,
        conditions=120,
        tolerance=tolerance,
    )
    assert result.mildest is not None
    assert result.settled
    assert len(asked) <= 120
    for place, edge in zip(result.mildest, edges, strict=True):
        assert edge <= place <= edge + tolerance, "every key was taken back as far as it goes"


def test_a_key_that_does_nothing_goes_back_to_its_mild_end() -> None:
    result, _ = found(lambda point: point[1] >= 0.6, keys=3, conditions=120)
    assert result.mildest is not None
    assert (result.mildest[0], result.mildest[2]) == (0.0, 0.0)
    assert 0.6 <= result.mildest[1] <= 0.61


def test_places_without_a_scenario_are_passed_over_away_from_the_diagonal() -> None:
    def judge(point: Values) -> bool:
        if point[0] < point[1] - 0.3:
            raise InputError("the goal lies inside an obstacle")
        return point[1] >= 0.7

    result = Search([EVENLY] * 2, judge, 60, 0.01).run()
    assert result.mildest == pytest.approx((0.4, 0.7), abs=0.02)
    with pytest.raises(InputError, match="inside an obstacle"):
        Search([EVENLY] * 2, lambda point: judge((0.1, point[1])), 60, 0.01).run()
