"""Squares of the plane hold each point once; what lies near a ray is found among them as among all points."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.interface import FloatArray
from planner.kernels.buckets import TARGET_BUCKETS, bucketed, cells_of
from planner.kernels.fans import entered, first_met

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS, count=st.integers(1, 120), side=st.floats(100.0, 2000.0))
def test_squares_hold_each_point_once_and_know_their_neighbours(seed: int, count: int, side: float) -> None:
    points = np.random.default_rng(seed).uniform(-4000.0, 4000.0, (count, 2))
    some = np.arange(3, 3 + count)
    members, (first, counts, one, other) = cells_of(np.concatenate((np.full((3, 2), 1e6), points)), some, side)
    assert sorted(members.tolist()) == some.tolist()
    assert first.tolist() == (np.cumsum(counts) - counts).tolist()
    in_square = np.repeat(np.floor(points[members[first] - 3] / side), counts, axis=0)
    np.testing.assert_array_equal(np.floor(points[members - 3] / side), in_square)
    squares = [tuple(each) for each in np.floor(points[members[first] - 3] / side).astype(int).tolist()]
    assert len(set(squares)) == len(squares)
    touching = {
        frozenset((i, j))
        for i, (x, y) in enumerate(squares)
        for j, (u, v) in enumerate(squares[:i])
        if max(abs(x - u), abs(y - v)) == 1
    }
    pairs = [frozenset(pair) for pair in zip(one.tolist(), other.tolist(), strict=True)]
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == touching


def random_circles(seed: int, count: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-4000.0, 4000.0, (count, 2)), rng.uniform(0.0, 300.0, count)


@given(seed=SEEDS, count=st.integers(0, 200), side=st.floats(0.1, 5000.0))
def test_circles_hold_what_is_kept_from_their_points(seed: int, count: int, side: float) -> None:
    points, keep = random_circles(seed, count)
    order, (held, first, circles) = bucketed(points, keep, side)
    assert sorted(order.tolist()) == list(range(count))
    np.testing.assert_array_equal(held, np.vstack((points.T, keep))[:, order])
    assert (first[0], first[-1], len(first)) == (0, count, len(circles.T) + 1)
    about = np.repeat(circles, np.diff(first), axis=1)
    assert (np.hypot(*(held[:2] - about[:2])) + held[2] <= about[2] + 1e-9).all()
    assert len(circles.T) <= 2 * TARGET_BUCKETS


@given(seed=SEEDS, count=st.integers(0, 200), bearing=st.floats(-math.pi, math.pi))
def test_a_ray_meets_what_it_meets_among_all_points(seed: int, count: int, bearing: float) -> None:
    points, keep = random_circles(seed, count)
    ux, uy = math.cos(bearing), math.sin(bearing)
    order, squares = bucketed(points, keep, 500.0)
    distance, met = first_met(squares, (100.0, -50.0, ux, uy))
    away = points - (100.0, -50.0)
    ahead, beside = away @ (ux, uy), away @ (uy, -ux)
    hit = (ahead > 0.0) & (np.abs(beside) < keep)
    entry = np.where(hit, ahead - np.sqrt(np.maximum(keep**2 - beside**2, 0.0)), math.inf)
    assert distance == pytest.approx(max(entry.min(initial=math.inf), 0.0))
    assert not hit.any() or entry[order[met]] == pytest.approx(entry.min())


@given(seed=SEEDS, count=st.integers(0, 200), length=st.floats(0.0, 8000.0))
def test_a_line_enters_what_it_enters_among_all_points(seed: int, count: int, length: float) -> None:
    points, keep = random_circles(seed, count)
    whole, parts = bucketed(points, keep, 20_000.0), bucketed(points, keep, 500.0)
    line = (100.0, -50.0), (100.0 + length, -50.0)
    found = [
        dict(zip(order[which].tolist(), entry.tolist(), strict=True))
        for order, squares in (whole, parts)
        for entry, which in [entered(squares, *line, count)]
    ]
    assert found[0] == found[1]
    one = entered(parts[1], *line, 1)[0]
    assert len(one) == min(len(found[0]), 1)
    assert set(one) <= set(found[0].values())
