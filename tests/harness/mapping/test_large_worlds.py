"""What is written of very many obstacles is made with little memory, and is the same as of few."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.mapping.scan import RangeScan
from harness.recording.scene import lines_2d
from harness.recording.sensed import NEAR_CELLS, Sensed, returns_m
from harness.recording.solids import circle
from harness.world.obstacle import Circle, Obstacle, Polygon
from planner.interface import FloatArray
from tests.examples import examples

CELL_M = 20.0


def crowd(number: int, side_m: float, seed: int) -> list[Obstacle]:
    """Small circles and triangles in a square, one in fifty of them moving or timed."""
    rng = np.random.default_rng(seed)
    rows = zip(rng.uniform(0.0, side_m, (number, 2)).tolist(), rng.uniform(2.0, 30.0, number), strict=True)
    shapes = [
        Circle((x, y), size) if i % 3 else Polygon(((x, y), (x + size, y), (x, y + 2.0 * size)))
        for i, ((x, y), size) in enumerate(rows)
    ]
    return [
        Obstacle(shape, *(() if i % 50 else ((4.0, -3.0), (10.0, 60.0) if i % 100 else None)))
        for i, shape in enumerate(shapes)
    ]


def looks(rng: np.random.Generator, low_m: float, high_m: float) -> list[RangeScan]:
    """Three scans that returned places in a square."""
    away = rng.uniform(low_m, high_m, (3, 300)) + 1j * rng.uniform(low_m, high_m, (3, 300))
    return [
        RangeScan(t, t, 0.0, 0.0, 0.0, 0.0, 0.01, row / np.abs(row), np.abs(row), 1e6)
        for t, row in zip((0.0, 20.0, 80.0), away, strict=True)
    ]


@pytest.mark.parametrize("seed", range(5))
def test_what_a_scan_shows_of_a_crowd_is_told_by_the_nearest_edge(seed: int) -> None:
    obstacles, scans = crowd(300, 2000.0, seed), looks(np.random.default_rng(seed), 500.0, 1500.0)
    points = [returns_m(scan) for scan in scans]
    new_edges = Sensed(obstacles, CELL_M).take(scans, points)
    where, times = np.concatenate(points), np.repeat([0.0, 20.0, 80.0], 300)
    away = np.abs([each.distance(where, times) for each in obstacles])
    near = away.min(axis=0) <= NEAR_CELLS * CELL_M
    nearest = away.argmin(axis=0)
    assert set(new_edges.first) <= set(nearest[near].tolist())
    shown = {
        tuple(point): index for point, index, so in zip(where.tolist(), nearest, near, strict=True) if so
    }
    assert len(new_edges.points_m) > 100
    for point in new_edges.points_m.tolist():
        assert obstacles[shown[tuple(point)]].stands_for_ever
        assert shown[tuple(point)] in new_edges.first


@given(st.lists(st.integers(3, 6), min_size=1, max_size=6))
@settings(max_examples=examples(15))
def test_outlines_are_recorded_as_they_are(lengths: list[int]) -> None:
    def recorded(rings: list[FloatArray]) -> list[list[list[float]]]:
        batch = lines_2d(rings, (1, 2, 3), 1.0, 1).strips
        assert batch is not None
        found: list[list[list[float]]] = batch.as_arrow_array().to_pylist()
        return found

    rings = [circle((10.0 * i, 1 / 3), 2.0 + i, points) for i, points in enumerate(lengths)]
    assert recorded(rings) == [ring.astype(np.float32).tolist() for ring in rings]
