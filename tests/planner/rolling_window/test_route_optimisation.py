"""Shortcuts and curves: shorter, never nearer than allowed, never tighter than the turn radius."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from planner.geometry.curves import Limits, Point, Pose, end_of, sample
from planner.geometry.terrain import Terrain
from planner.interface import FloatArray
from planner.rolling_window.route_optimisation import optimise, shortcut
from tests.planner.walls_and_paths import assert_flyable, ring

EAST = Pose(0.0, 0.0, 1.0, 0.0)
WIDE = (-1e5, -1e5, 1e5, 1e5)
KEEP, RADIUS, CUT = 100.0, 150.0, 30.0
LIMITS = Limits(RADIUS, 40.0)
SEEDS = st.integers(0, 2**32 - 1)


def terrain(points: FloatArray, keep_m: float = KEEP, bounds: tuple[float, float, float, float] = WIDE) -> Terrain:
    return Terrain(points, np.full(len(points), keep_m), bounds)


def spread(seed: int, count: int) -> FloatArray:
    """Edge points off the start and off one another's way now and then."""
    rng = np.random.default_rng(seed)
    return np.column_stack((rng.uniform(700.0, 9000.0, count), rng.uniform(-2500.0, 2500.0, count)))


def walk(seed: int, count: int) -> list[Point]:
    rng = np.random.default_rng(seed)
    east, north = np.sort(rng.uniform(500, 9500, count)), rng.uniform(-2000, 2000, count)
    return [(0.0, 0.0), *zip(east.tolist(), north.tolist(), strict=True), (10_000.0, 0.0)]


def room(nodes: list[Point], points: FloatArray) -> float:
    return float(shapely.distance(shapely.LineString(nodes), shapely.points(points)).min(initial=math.inf))


@given(seed=SEEDS, count=st.integers(0, 6), nodes=st.integers(1, 8))
def test_shortcuts_are_clear_and_never_longer(seed: int, count: int, nodes: int) -> None:
    track, points = walk(seed, nodes), spread(seed, count)
    kept = shortcut(track, terrain(points))
    assert kept[0] == track[0]
    assert kept[-1] == track[-1]
    assert [node for node in track if node in kept] == kept
    assert shapely.LineString(kept).length <= shapely.LineString(track).length + 1e-6
    for a, b in pairwise(kept):
        if track.index(b) > track.index(a) + 1:
            near = room([a, b], points)
            # Ends inside a disc may lead out of it.
            at_ends = min(room([a, a], points), room([b, b], points))
            assert near >= KEEP - 1e-6 or near == pytest.approx(at_ends)


@given(seed=SEEDS, count=st.integers(0, 6), nodes=st.integers(0, 6))
def test_what_is_optimised_can_be_flown(seed: int, count: int, nodes: int) -> None:
    track, points = walk(seed, nodes), spread(seed, count)
    bounds = (-300.0, -2200.0, 10_100.0, 2200.0)
    found = optimise(EAST, 0.0, track, LIMITS, CUT, terrain(points, bounds=bounds))
    assume(found is not None)
    assert found is not None
    choice, path = found.nodes, found.path
    assert_flyable(path, RADIUS)
    np.testing.assert_allclose(path.segments[0, :4], EAST, atol=1e-5)
    np.testing.assert_allclose(end_of(path)[:2], track[-1], atol=1e-4)
    assert choice[-1] == track[-1]
    assert set(choice) <= set(track)
    line = shapely.LineString(sample(path, 50.0, 0.01))
    assert shapely.distance(line, shapely.points(points)).min(initial=math.inf) >= KEEP - 0.02
    assert shapely.box(*bounds).buffer(1e-6).covers(line)


def test_round_a_circle_the_curve_keeps_its_distance_and_is_hardly_longer_than_need() -> None:
    points = ring(5000.0, 0.0, 1000.0, 25.0)
    outer = 1000.0 + KEEP + CUT
    turns = [math.acos(outer / 5000.0) + i * 0.12 for i in range(40)]
    around = [(5000.0 - outer * math.cos(a), outer * math.sin(a)) for a in turns if a < math.pi - turns[0]]
    nodes = [(0.0, 0.0), *around, (10_000.0, 0.0)]
    found = optimise(Pose(0.0, 0.0, 0.974, math.sqrt(1 - 0.974**2)), 0.0, nodes, LIMITS, CUT, terrain(points))
    assert found is not None
    line = shapely.LineString(sample(found.path, 50.0, 0.01))
    r = 1000.0 + KEEP
    exact = 2.0 * math.sqrt(5000.0**2 - r * r) + r * (math.pi - 2.0 * math.acos(r / 5000.0))
    assert shapely.distance(line, shapely.points(points)).min() >= KEEP - 0.02
    assert exact - 1.0 < found.path.length_m < 1.01 * exact
    assert len(found.nodes) < len(nodes) - 1


def test_a_turn_round_something_is_flown_on_where_its_track_points_lie_outside() -> None:
    """Half-way round a post the first track points could be reached only by a turn against the one that is flown."""
    around, limits, post = 321.0, Limits(110.0, 15.5), terrain(np.zeros((1, 2)), 312.0)
    begin = Pose(-0.593 * around, -math.sqrt(1.0 - 0.593**2) * around, math.sqrt(1.0 - 0.593**2), -0.593)
    nodes = [begin[:2], (-138.0, -301.5), (17.0, -332.0), (169.0, -287.5), (822.0, 275.0), (3000.0, 2600.0)]
    route = optimise(begin, 1.0 / around, nodes, limits, 9.0, post)
    assert route is not None
    assert_flyable(route.path, limits.radius_m)
    assert post.admits(route.path)
    assert route.path.segments[0, 4] == pytest.approx(1.0 / around)
    assert route.path.length_m < 4800.0
