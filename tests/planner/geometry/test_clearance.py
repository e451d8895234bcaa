"""Distances and crossings against shapely on dense samples."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.geometry.clearance import behind, distances, first_breach, first_exit_m, inside_bounds
from planner.geometry.curves import Pose, along, full_turn, pose_at
from planner.geometry.terrain import Terrain
from planner.interface import Path
from tests.examples import examples
from tests.planner.walls_and_paths import PIECES, integrated, path_of

SEEDS = st.integers(0, 2**32 - 1)
ASLANT = Pose(0.0, 0.0, 0.6, 0.8)
STRAIGHT = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 1000.0)]))


def dense_line(path: Path) -> shapely.LineString:
    segments = [tuple(row) for row in path.segments.tolist()]
    return shapely.LineString(integrated(path.segments[0, :4].tolist(), segments, 0.5)[:, :2])


@settings(max_examples=examples(30))
@given(pieces=PIECES, seed=SEEDS)
def test_distances_and_their_stations(pieces: list[tuple[float, float]], seed: int) -> None:
    path = path_of(ASLANT, pieces)
    points = np.random.default_rng(seed).uniform(-1500.0, 1500.0, (40, 2))
    distance, arc_length_m = distances(path, points)
    line = dense_line(path)
    np.testing.assert_allclose(distance, shapely.distance(line, shapely.points(points)), atol=2e-3)
    assert (arc_length_m >= 0.0).all()
    assert (arc_length_m <= path.length_m + 1e-6).all()
    places = np.array([pose_at(path, s)[:2] for s in arc_length_m])
    np.testing.assert_allclose(np.hypot(*(places - points).T), distance, atol=1e-6)


@settings(max_examples=examples(30))
@given(pieces=PIECES, seed=SEEDS, radius=st.floats(1.0, 500.0))
def test_a_breach_is_told_where_and_only_where_there_is_one(
    pieces: list[tuple[float, float]], seed: int, radius: float
) -> None:
    path = path_of(ASLANT, pieces)
    points = np.random.default_rng(seed).uniform(-1500.0, 1500.0, (6, 2))
    nearest = shapely.distance(dense_line(path), shapely.points(points))
    assume(np.abs(nearest - radius).min() > 0.01)
    arc_length_m = first_breach(path, points, radius)
    assert math.isfinite(arc_length_m) == (nearest < radius).any()
    if math.isfinite(arc_length_m):
        assert np.hypot(*(points - pose_at(path, arc_length_m)[:2]).T).min() < radius
    terrain = Terrain(points, np.full(6, radius), (-math.inf, -math.inf, math.inf, math.inf))
    assert len(terrain.squares[0][0]) == 6
    assert terrain.admits(path) == (nearest >= radius).all()
    for i, each in enumerate(points):
        alone = first_breach(path, each[None], radius)
        assert math.isfinite(alone) == (nearest[i] < radius)
        assert arc_length_m <= alone


def test_the_first_of_several_breaches_counts() -> None:
    points = np.array([(800.0, 10.0), (300.0, -20.0), (500.0, 90.0)])
    assert first_breach(STRAIGHT, points, 50.0) == pytest.approx(300.0)
    assert first_breach(STRAIGHT, points, np.array([50.0, 15.0, 100.0])) == pytest.approx(500.0)
    assert first_breach(STRAIGHT, points, 50.0, from_m=400.0) == pytest.approx(800.0)
    assert first_breach(STRAIGHT, points, 5.0) == math.inf
    assert first_breach(STRAIGHT, np.zeros((0, 2)), 5.0) == math.inf


def test_a_second_pass_is_a_breach_where_the_first_does_not_count() -> None:
    # Out past the point at 10 m, round to the left, and back past it at 190 m less far than is to be kept.
    rows = [(0.0, 0.0, 1.0, 0.0, 0.0, 1000.0), (1000.0, 0.0, 1.0, 0.0, 1 / 100.0, 100.0 * math.pi)]
    path = Path(np.array([*rows, (1000.0, 200.0, -1.0, 0.0, 0.0, 1000.0)]))
    point = np.array([(500.0, 90.0)])
    back = 1000.0 + 100.0 * math.pi + 500.0
    assert first_breach(path, point, 150.0) == pytest.approx(500.0)
    assert first_breach(path, point, 150.0, from_m=1000.0) == pytest.approx(back)
    assert first_breach(path, point, 150.0, from_m=back + 200.0) == math.inf


@settings(max_examples=examples(50))
@given(pieces=PIECES, seed=SEEDS, full=st.booleans())
def test_inside_bounds(pieces: list[tuple[float, float]], seed: int, full: bool) -> None:
    path = path_of(ASLANT, pieces)
    if full:
        end = along(path.segments[-1], float(path.segments[-1, 5]))
        path = Path(np.array([*path.segments.tolist(), full_turn(end, 300.0, 1.0)]))
    xmin, ymin, xmax, ymax = dense_line(path).bounds
    # Bounds about the path, some of them a little too narrow.
    slack = np.random.default_rng(seed).choice([0.05, 0.5, 500.0, 500.0, -0.05, -5.0], 4)
    bounds = (xmin - slack[0], ymin - slack[1], xmax + slack[2], ymax + slack[3])
    assert inside_bounds(path, bounds) == bool((slack > 0.0).all())


def test_the_boundary_belongs_to_the_area() -> None:
    assert inside_bounds(STRAIGHT, (0.0, 0.0, 1000.0, 10.0))
    assert not inside_bounds(STRAIGHT, (0.0, 0.0, 999.9, 10.0))
    assert not inside_bounds(STRAIGHT, (0.1, -1.0, 1000.0, 10.0))


def test_where_a_path_leaves_an_area() -> None:
    """By hand: on a circle of 100 m to the right it is 50 m east after 60 degrees, however long it goes on after it."""
    rows = [(0.0, 0.0, 0.0, 1.0, 0.0, 7.0), (0.0, 7.0, 0.0, 1.0, -0.01, 200.0 * math.pi)]
    path = Path(np.array([*rows, (0.0, 7.0, 0.0, 1.0, 0.01, 2e5)]))
    leaves_m = first_exit_m(path, (-1000.0, -1000.0, 50.0, 1000.0))
    assert leaves_m == pytest.approx(7.0 + 100.0 * math.pi / 3.0, abs=0.002)
    assert first_exit_m(path, (-1000.0, -1000.0, 200.001, 1000.0)) == math.inf
    assert first_exit_m(path, (-1000.0, -1000.0, 1000.0, 6.0)) == pytest.approx(6.0, abs=0.002)
    assert first_exit_m(path, (-1000.0, 1.0, 1000.0, 1000.0)) == 0.0


def test_what_lies_behind_an_edge_point() -> None:
    # An edge point 100 m north of the eye that hides 10 m to each side: at 200 m it hides 20 m to each side.
    places = np.array([(0.0, 99.0), (0.0, 101.0), (19.0, 200.0), (21.0, 200.0), (0.0, -200.0)])
    hidden = behind(places, (0.0, 0.0), np.array([(0.0, 100.0)]), 10.0)
    assert hidden.tolist() == [False, True, True, False, False]
