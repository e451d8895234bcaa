"""The search for the mildest failing condition, against failures that are known."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.falsify.search import STEPS, Point, Searched, search
from harness.files.strict_yaml import InputError
from tests.examples import examples

Fails = Callable[[Point], bool]


def found(
    fails: Fails, keys: int = 1, conditions: int = 40, tolerance: float = 0.01, seed: int = 1
) -> tuple[Searched, list[Point]]:
    """A search, and the conditions that it asked for."""
    asked: list[Point] = []

    def judge(point: Point) -> bool:
        asked.append(point)
        return fails(point)

    return search(keys, judge, conditions, tolerance, seed), asked


@given(st.floats(0.001, 1.0), st.sampled_from([0.1, 0.03, 0.004]))
@settings(max_examples=examples(30))
def test_one_key_is_narrowed_down_to_the_tolerance(edge: float, tolerance: float) -> None:
    result, asked = found(lambda point: point[0] >= edge, tolerance=tolerance)
    assert result.mildest is not None
    assert result.passed_below is not None
    assert result.passed_below[0] < edge <= result.mildest[0]
    assert result.mildest[0] - result.passed_below[0] <= tolerance
    assert result.settled
    bracket = STEPS + 1 + math.ceil(math.log2(1 / STEPS / tolerance) + 1)
    assert all(point <= result.mildest for point in asked[bracket:]), "what is left looks below"
    assert len(asked) == len(set(asked)) <= 40
    assert result.not_monotone == ()


def test_the_ends_come_first_and_may_be_all_there_is() -> None:
    at_once, asked = found(lambda point: True)
    assert (at_once.mildest, at_once.passed_below, asked) == ((0.0,), None, [(0.0,)])
    never, asked = found(lambda point: False)
    assert never.mildest is None
    assert never.settled
    assert asked[:2] == [(0.0,), (1.0,)]
    assert sorted(asked[: STEPS + 1]) == [(step / STEPS,) for step in range(STEPS + 1)]
    assert (len(asked), never.spent, never.widest_gap) == (40, True, (0.75, 0.78125))


Islands = st.lists(st.tuples(st.floats(0.01, 0.95), st.floats(0.005, 0.2)), min_size=1, max_size=4)


@given(Islands, st.integers(12, 60), st.sampled_from([0.03, 0.01]))
@settings(max_examples=examples(40))
def test_of_several_failing_islands_none_wider_than_the_widest_gap_is_milder(
    islands: list[tuple[float, float]], conditions: int, tolerance: float
) -> None:
    def fails(point: Point) -> bool:
        return any(start <= point[0] <= start + width for start, width in islands)

    result, asked = found(fails, conditions=conditions, tolerance=tolerance)
    assert result.widest_gap is not None
    gap = result.widest_gap[1] - result.widest_gap[0]
    edge = 1.0 if result.mildest is None else result.mildest[0]
    for start, width in islands:
        assert width <= gap or start + width > edge - tolerance, "no failure as wide as that lies below"
    assert result.spent == (len(asked) == conditions)
    if not result.spent:
        assert gap <= tolerance, "conditions are left only where nothing is left to try"
    if result.mildest is not None:
        assert fails(result.mildest)
        assert result.milder == sum(point < result.mildest for point in asked)
        assert not any(fails(point) for point in asked if point < result.mildest)
        if result.settled:
            assert result.passed_below is not None
            assert result.mildest[0] - result.passed_below[0] <= tolerance
        above = [point for point in asked if point > result.mildest and not fails(point)]
        assert result.passed_above == max(above, default=None)


def test_an_island_below_the_first_bracket_is_found_with_the_conditions_that_are_left() -> None:
    def fails(point: Point) -> bool:
        return 0.65 <= point[0] <= 0.69 or 0.725 <= point[0] <= 0.74 or point[0] >= 0.758

    result, asked = found(fails)
    assert result.mildest is not None
    assert 0.65 <= result.mildest[0] <= 0.66, "not 0.758, where the bisection ends"
    assert (len(asked), result.passed_above, result.settled) == (40, (0.7578125,), True)
    few, _ = found(fails, conditions=14)
    assert few.mildest is not None
    assert few.mildest[0] > 0.66, "fewer conditions find less"


def test_a_failure_found_last_that_could_not_be_narrowed_down_is_not_settled() -> None:
    def fails(point: Point) -> bool:
        return 0.05 <= point[0] <= 0.07 or point[0] >= 0.5

    results = [found(fails, conditions=conditions)[0] for conditions in range(9, 41)]
    opened = [each for each in results if each.mildest is not None and each.mildest[0] < 0.1]
    assert (opened[0].settled, opened[-1].settled) == (False, True)
    assert all(each.spent for each in results if not each.settled)


def test_a_failure_between_ends_that_pass_is_found_and_said_to_be_odd() -> None:
    result, _ = found(lambda point: 0.3 <= point[0] <= 0.4)
    assert result.mildest is not None
    assert 0.3 <= result.mildest[0] <= 0.31
    assert all(failed[0] <= passed[0] for failed, passed in result.not_monotone)
    assert ((0.375,), (1.0,)) in result.not_monotone


def test_the_conditions_are_counted() -> None:
    for conditions in range(2, 14):
        result, asked = found(lambda point: point[0] > 0.77, conditions=conditions, tolerance=0.001)
        assert len(asked) == conditions
        assert not result.settled
        assert result.mildest is not None
        assert result.mildest[0] > 0.77
    with pytest.raises(ValueError, match="2 conditions or more"):
        found(lambda point: True, conditions=1)
    with pytest.raises(ValueError, match="tolerance between 0 and 1"):
        found(lambda point: True, tolerance=1.0)


@pytest.mark.parametrize("conditions", range(2, 14))
def test_settled_is_a_scan_in_eighths_and_nothing_less(conditions: int) -> None:
    result, asked = found(lambda point: False, conditions=conditions)
    assert len(asked) == conditions, "none is left over"
    assert result.settled == (conditions >= STEPS + 1)


def test_a_coarse_scan_leaves_conditions_to_bisect_with() -> None:
    _, asked = found(lambda point: point[0] >= 0.47, conditions=8)
    assert [point[0] for point in asked] == [0, 1, 0.25, 0.5, 0.75, 0.375, 0.4375, 0.46875]
    result, _ = found(lambda point: point[0] >= 0.47, conditions=9, tolerance=0.2)
    assert result.settled, "what bisection left over made the scan whole"
    assert result.mildest == (0.5,)
    result, _ = found(lambda point: point[0] == 0.125 or point[0] >= 0.97, conditions=8, tolerance=0.2)
    assert (result.settled, result.mildest) == (False, (0.125,)), "what was left over found it"


@pytest.mark.parametrize("whole", [1, 4])
def test_whole_numbers_need_no_more_conditions_than_there_are_of_them(whole: int) -> None:
    def judge(point: Point) -> bool:
        return point[0] >= 0.8

    result = search(1, judge, whole + 1, 0.01, 1, snap=lambda point: (round(point[0] * whole) / whole,))
    assert (result.settled, len(result.verdicts), result.mildest) == (True, whole + 1, (1.0,))


@pytest.mark.parametrize(("keys", "conditions"), [(2, 16), (2, 80), (3, 16), (3, 120)])
def test_with_several_keys_every_condition_is_used_or_nothing_is_left(keys: int, conditions: int) -> None:
    def fails(point: Point) -> bool:
        return 0.6 <= point[0] <= 0.7 or min(point) > 0.9

    for seed in range(4):
        result, asked = found(fails, keys, conditions, seed=seed)
        assert (len(asked), result.spent) == (conditions, True)

    def whole(point: Point) -> Point:
        return tuple(round(place) for place in point)

    corners = search(keys, lambda point: False, conditions, 0.01, 1, whole)
    assert (len(corners.verdicts), corners.spent, corners.settled) == (2**keys, False, True)


@given(st.lists(st.floats(0.05, 0.95), min_size=2, max_size=3), st.integers(0, 3))
@settings(max_examples=examples(12))
def test_where_every_key_makes_it_harder_the_mildest_is_found(edges: list[float], seed: int) -> None:
    keys, tolerance = len(edges), 0.02
    result, asked = found(
        lambda point: all(place >= edge for place, edge in zip(point, edges, strict=True)),
        keys,
        conditions=120,
        tolerance=tolerance,
        seed=seed,
    )
    assert result.mildest is not None
    assert max(edges) <= max(result.mildest) <= max(edges) + tolerance
    assert result.settled
    assert len(asked) <= 120
    for place, edge in zip(result.mildest, edges, strict=True):
        assert edge <= place <= edge + tolerance, "every key was taken back as far as it goes"
    assert result.not_monotone == ()


def test_a_key_that_does_nothing_goes_back_to_its_mild_end() -> None:
    result, _ = found(lambda point: point[1] >= 0.6, keys=3, conditions=120)
    assert result.mildest is not None
    assert (result.mildest[0], result.mildest[2]) == (0.0, 0.0)
    assert 0.6 <= result.mildest[1] <= 0.61


def test_a_milder_failure_off_the_diagonal_is_found_by_sobol_points() -> None:
    def fails(point: Point) -> bool:
        return min(point) >= 0.9 or (point[0] > 0.25 and point[1] < 0.2)

    result, asked = found(fails, keys=2, conditions=100)
    assert result.mildest is not None
    assert 0.25 < result.mildest[0] <= 0.26
    assert result.mildest[1] == 0.0
    assert result.not_monotone, "harder in the second key passes"
    again, asked_again = found(fails, keys=2, conditions=100)
    assert (again.verdicts, asked_again) == (result.verdicts, asked)
    assert found(fails, keys=2, conditions=100, seed=2)[1] != asked


def test_places_without_a_scenario_are_passed_over_away_from_the_diagonal() -> None:
    def judge(point: Point) -> bool:
        if point[0] > point[1] + 0.3:
            raise InputError("the goal lies inside an obstacle")
        return point[1] >= 0.7

    result = search(2, judge, 60, 0.01, 1)
    assert result.mildest == pytest.approx((0.0, 0.7), abs=0.02)
    assert all(point[0] <= point[1] + 0.3 for point in result.verdicts)
    with pytest.raises(InputError, match="inside an obstacle"):
        search(2, lambda point: judge((point[1], 0.1)), 60, 0.01, 1)


def test_points_that_stand_for_the_same_value_are_tried_once() -> None:
    asked: list[Point] = []

    def judge(point: Point) -> bool:
        asked.append(point)
        return point[0] >= 0.5

    result = search(1, judge, 40, 0.001, 1, snap=lambda point: (round(point[0] * 4) / 4,))
    assert sorted(asked) == [(0.0,), (0.25,), (0.5,), (0.75,), (1.0,)]
    assert (result.mildest, result.passed_below, result.settled) == ((0.5,), (0.25,), True)
