"""The search for the mildest failing condition, against failures that are known."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.falsify.breaking_point import Search
from tests.examples import examples


def found(fails: Callable[[float], bool], conditions: int = 40, tolerance: float = 0.01) -> tuple[Search, list[float]]:
    """A search along one key from 0 to 1, and the values that it asked for."""
    asked: list[float] = []

    def judge(values: tuple[float, ...]) -> bool:
        asked.append(values[0])
        return fails(values[0])

    return Search(lambda place: (place,), judge, conditions, tolerance).run(), asked


@given(st.floats(0.001, 1.0), st.sampled_from([0.1, 0.03, 0.004]))
@settings(max_examples=examples(30))
def test_one_key_is_narrowed_down_to_the_tolerance(edge: float, tolerance: float) -> None:
    result, asked = found(lambda place: place >= edge, tolerance=tolerance)
    assert result.fails is not None
    assert result.passes is not None
    assert result.passes < edge <= result.fails
    assert round(result.fails - result.passes, 12) <= tolerance
    assert result.settled
    assert len(asked) == len(set(asked)) <= 40


Islands = st.lists(st.tuples(st.floats(0.01, 0.95), st.floats(0.005, 0.2)), min_size=1, max_size=4)


@given(Islands, st.integers(12, 60), st.sampled_from([0.03, 0.01]))
@settings(max_examples=examples(40))
def test_no_failing_range_as_wide_as_a_step_lies_below_the_answer(
    islands: list[tuple[float, float]], conditions: int, tolerance: float
) -> None:
    def fails(place: float) -> bool:
        return any(start <= place <= start + width for start, width in islands)

    result, asked = found(fails, conditions=conditions, tolerance=tolerance)
    edge = 1.0 if result.fails is None else result.fails
    for start, width in islands:
        assert width <= 1.0 / result.steps + 1e-9 or start >= edge - tolerance
    assert (len(asked) <= conditions, result.settled) == (True, True)
    assert result.fails is None or fails(result.fails)


@pytest.mark.parametrize("conditions", range(2, 14))
def test_the_conditions_are_counted(conditions: int) -> None:
    result, asked = found(lambda place: place > 0.77, conditions=conditions, tolerance=0.001)
    assert len(asked) <= conditions
    assert result.fails is not None
    assert result.fails > 0.77
    assert result.settled == (conditions >= 12), "two ends and ten halvings to a thousandth"


@pytest.mark.parametrize(("conditions", "steps"), [(28, 25), (101, 100)])
def test_a_step_as_wide_as_the_tolerance_is_narrow_enough(conditions: int, steps: int) -> None:
    """25 steps halved twice, or 100 steps, are hundredths: nothing is left to narrow down."""
    result = found(lambda place: place > 0.995, conditions=conditions)[0]
    assert (result.steps, result.fails, result.passes, result.settled) == (steps, 1.0, 0.99, True)
