"""Guide vector, free sectors and their edges against brute force."""

import math
import time

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner.interface import FloatArray
from planner.rolling_window.window import SectorEdge, Window
from tests.examples import examples
from tests.planner.walls_and_paths import ring, wall

SPACING = 25.0
KEEP = 110.0
SEEDS = st.integers(0, 2**32 - 1)


def window_of(*obstacles: FloatArray, keep_m: float = KEEP) -> Window:
    """A window in which each array of edge points is one obstacle, labelled 0, 1, ..."""
    points = np.concatenate(obstacles) if obstacles else np.zeros((0, 2))
    labels: NDArray[np.intp] = np.repeat(np.arange(len(obstacles)), [len(each) for each in obstacles])
    return Window((0.0, 0.0), points, labels, SPACING, np.full(len(points), keep_m))


def assert_tangent(edge: SectorEdge, window: Window, origin: tuple[float, float]) -> None:
    """An edge is free as far as it touches, and touches there."""
    touch = (origin[0] + edge.ux * edge.touch_m, origin[1] + edge.uy * edge.touch_m)
    assert math.hypot(edge.ux, edge.uy) == pytest.approx(1.0)
    assert np.hypot(*(window.points_m - touch).T).min() == pytest.approx(KEEP, rel=1e-3)
    line = shapely.LineString([origin, touch])
    assert shapely.distance(line, shapely.points(window.points_m)).min() > KEEP * (1.0 - 1e-6)
    assert edge.clear_m >= edge.touch_m
    if math.isfinite(edge.clear_m):
        clear = (origin[0] + edge.ux * edge.clear_m, origin[1] + edge.uy * edge.clear_m)
        line = shapely.LineString([origin, clear])
        assert shapely.distance(line, shapely.points(window.points_m)).min() > KEEP * (1.0 - 1e-6)


@given(away=st.floats(1500.0, 6000.0), turn=st.floats(-math.pi, math.pi), radius=st.floats(100.0, 1200.0))
def test_the_edges_of_a_lone_circle_end_its_fan(away: float, turn: float, radius: float) -> None:
    window = window_of(ring(away * math.cos(turn), away * math.sin(turn), radius, SPACING))
    edges = window.sector_edges((0.0, 0.0), [0])
    offs = [(math.atan2(e.uy, e.ux) - turn + math.pi) % math.tau - math.pi for e in edges]
    dx, dy = window.points_m.T
    middle = (np.arctan2(dy, dx) - turn + math.pi) % math.tau - math.pi
    half = np.arcsin(KEEP / np.hypot(dx, dy))
    assert min(offs) == pytest.approx((middle - half).min(), abs=1e-5)
    assert max(offs) == pytest.approx((middle + half).max(), abs=1e-5)
    for edge in edges:
        assert_tangent(edge, window, (0.0, 0.0))
        assert math.isinf(edge.clear_m)


def random_window(seed: int, count: int) -> Window:
    """A window with so many rings and walls, some of which overlap; there is room about its centre."""
    rng = np.random.default_rng(seed)
    obstacles = []
    for _ in range(count):
        east, north = rng.uniform(-3000.0, 3000.0, 2).tolist()
        if rng.random() < 0.5:
            obstacles.append(ring(east, north, float(rng.uniform(80.0, 600.0)), SPACING))
        else:
            dx, dy = rng.uniform(-900.0, 900.0, 2).tolist()
            obstacles.append(wall((east, north), (east + dx, north + dy), SPACING))
    window = window_of(*obstacles)
    assume(np.hypot(*window.points_m.T).min() > KEEP + 5.0)
    return window


@settings(max_examples=examples(30))
@given(seed=SEEDS, count=st.integers(2, 6))
def test_every_edge_is_free_and_tangent(seed: int, count: int) -> None:
    window = random_window(seed, count)
    for label in range(count):
        for edge in window.sector_edges((0.0, 0.0), [label]):
            assert_tangent(edge, window, (0.0, 0.0))


def test_hidden_edges_are_not_returned_but_those_of_what_hides_them() -> None:
    near, far = ring(2000.0, 0.0, 900.0, SPACING), ring(6000.0, 0.0, 300.0, SPACING)
    window = window_of(near, far)
    from_far = window.sector_edges((0.0, 0.0), [1])
    assert from_far
    assert sorted(from_far) == sorted(window.sector_edges((0.0, 0.0), [0]))
    assert max(edge.touch_m for edge in from_far) < 3000.0


@settings(max_examples=examples(30))
@given(seed=SEEDS, count=st.integers(1, 6), outer=st.floats(1.005, 1.5))
def test_an_obstacle_is_hugged_up_to_the_outer_distance(seed: int, count: int, outer: float) -> None:
    window = random_window(seed, count)
    for edge in window.sector_edges((0.0, 0.0), range(count), outer * KEEP):
        along = np.append(np.linspace(edge.touch_m, edge.hugged_m, 500), edge.hugged_m + 1e-3)
        own = window.points_m[window.labels == edge.obstacle]
        nearest = np.hypot(*((along[:, None] * (edge.ux, edge.uy))[:, None] - own).T).min(axis=0)
        assert nearest[:-1].max() < outer * KEEP * (1.0 + 1e-9)
        assert nearest[-1] > outer * KEEP


def test_hugging_a_long_wall_takes_little_time() -> None:
    """A straight wall of 20,000 points to the north-west, hugged to its end, in whatever order they were seen."""
    ahead_m = 100.0 + 8.0 * np.arange(20_000)
    (x, y), outer = (-math.sqrt(0.5), math.sqrt(0.5)), 1.005 * KEEP
    beside_m = KEEP - 1e-4 + 1.1e-6 * ahead_m[-1]  # the tangent to the nearest point leads away from the wall
    origin, took_s = (y * (KEEP - 1e-4), -x * (KEEP - 1e-4)), []
    for order in (np.arange(20_000), np.random.default_rng(1).permutation(20_000)):
        window = window_of(np.outer(ahead_m[order], (x, y)))
        tangents = window.sector_edges(origin, [0])  # sorts the points into squares
        begun = time.process_time()
        edges = window.sector_edges(origin, [0], outer)
        took_s.append(time.process_time() - begun)
        assert len(edges) == len(tangents)
        hugged_m = max(edge.hugged_m for edge in edges if edge.touch_m < 200.0)
        assert hugged_m == pytest.approx(ahead_m[-1] + math.sqrt(outer**2 - beside_m**2), abs=0.1)
    assert max(took_s) < 0.05, took_s
