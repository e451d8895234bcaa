"""On which side of things two ways pass."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.geometry.course import Course
from planner.geometry.curves import Point, end_of, pose_at
from planner.interface import FloatArray, Path
from planner.kernels.fans import encircled
from tests.examples import examples

GOAL = (1000.0, 0.0)
BELOW: tuple[Point, ...] = ((500.0, -200.0), GOAL)
ABOVE: tuple[Point, ...] = ((500.0, 200.0), GOAL)
START = (0.0, 0.0)


def course(nodes: tuple[Point, ...], known: int) -> Course:
    rows = []
    for a, b in zip((START, *nodes), nodes, strict=False):
        length = math.dist(a, b)
        rows.append((*a, (b[0] - a[0]) / length, (b[1] - a[1]) / length, 0.0, length))
    return Course(Path(np.array(rows)), nodes, known, shortest=True)


def winding(loop: FloatArray, point: FloatArray) -> int:
    """How often a closed polyline goes round a point: the sum of the angles that its sides subtend."""
    x, y = (loop - point).T
    angle = np.arctan2(y, x)
    step = np.diff(np.append(angle, angle[0]))
    step -= math.tau * np.rint(step / math.tau)
    return round(float(step.sum()) / math.tau)


@settings(max_examples=examples(50))
@given(seed=st.integers(0, 2**32 - 1), sides=st.integers(3, 12))
def test_encircled_is_an_odd_winding_number(seed: int, sides: int) -> None:
    rng = np.random.default_rng(seed)
    loop, points = rng.uniform(0.0, 100.0, (sides, 2)), rng.uniform(-20.0, 120.0, (40, 2))
    expected = [winding(loop, point) % 2 == 1 for point in points]
    np.testing.assert_array_equal(encircled(loop, points), expected)


@pytest.mark.parametrize(("point", "same"), [((500.0, 0.0), False), ((500.0, 300.0), True), ((500.0, -300.0), True)])
def test_the_other_side_is_that_with_something_between(point: Point, same: bool) -> None:
    points = np.array([point])
    assert course(BELOW, 1).same_side((START, *ABOVE), points) is same
    assert course(BELOW, 1).same_side((START, *BELOW), points)


def test_what_was_not_known_then_does_not_count() -> None:
    points = np.array([(500.0, 300.0), (500.0, 0.0)])
    assert course(BELOW, 1).same_side((START, *ABOVE), points)
    assert not course(BELOW, 2).same_side((START, *ABOVE), points)


def test_what_is_left_of_a_course_begins_at_the_station_and_keeps_the_nodes_ahead() -> None:
    nodes = ((300.0, 0.0), (600.0, 300.0), GOAL)
    whole = course(nodes, 7)
    left = whole.ahead(400.0)
    assert left.nodes == nodes[1:]
    assert (left.known, left.shortest) == (7, True)
    assert left.path.length_m == pytest.approx(whole.path.length_m - 400.0)
    np.testing.assert_allclose(pose_at(left.path, 0.0), pose_at(whole.path, 400.0), atol=1e-9)
    np.testing.assert_allclose(end_of(left.path)[:2], GOAL, atol=1e-9)
