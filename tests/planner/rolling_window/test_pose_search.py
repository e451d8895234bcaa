"""The search over poses finds ways where turning is tight, and only ways that can be flown."""

import math
from collections.abc import Generator
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from planner.geometry.course import Route
from planner.geometry.curves import Limits, Point, Pose, end_of, sample
from planner.geometry.terrain import Terrain, WorkCount
from planner.interface import FloatArray, Path
from planner.rolling_window.cost_to_go import CostToGo
from planner.rolling_window.pose_search import ENOUGH_RADII, search_poses
from planner.rolling_window.route_optimisation import optimise
from tests.examples import examples
from tests.planner.walls_and_paths import assert_flyable, wall

WIDE = (-1e5, -1e5, 1e5, 1e5)
RADIUS, KEEP = 200.0, 60.0
LIMITS = Limits(RADIUS, 50.0)


def terrain(points: FloatArray, bounds: tuple[float, float, float, float] = WIDE) -> Terrain:
    return Terrain(points, np.full(len(points), KEEP), bounds)


def distances_to_go(
    start: Pose, goal: Point, points: FloatArray, bounds: tuple[float, float, float, float]
) -> CostToGo:
    near = (-6000.0, -6000.0, 6000.0, 6000.0) if bounds == WIDE else bounds
    to_go = CostToGo(start[:2], goal, near, points, np.full(len(points), KEEP), WorkCount())
    for _ in to_go.spread():
        pass
    return to_go


def searched(
    start: Pose,
    curvature: float,
    goal: Point,
    points: FloatArray,
    bounds: tuple[float, float, float, float] = WIDE,
) -> Route | None:
    """What the search finds, led by the distances to go."""
    to_go = distances_to_go(start, goal, points, bounds)
    return returned(search_poses(start, curvature, goal, LIMITS, terrain(points, bounds), to_go))


def returned(search: Generator[None, None, Route | None]) -> Route | None:
    while True:
        try:
            next(search)
        except StopIteration as end:
            found: Route | None = end.value
            return found


def found_way(
    start: Pose, goal: Point, points: FloatArray, bounds: tuple[float, float, float, float] = WIDE
) -> Path | None:
    """The path found, after a look at whether it can be flown."""
    if (found := searched(start, 0.0, goal, points, bounds)) is None:
        return None
    nodes, path = found.nodes, found.path
    if nodes[-1] != goal:
        to_go = distances_to_go(start, goal, points, bounds)
        assert to_go(nodes[-1]) < to_go(start[:2]) - ENOUGH_RADII * RADIUS
    assert_flyable(path, RADIUS)
    np.testing.assert_allclose(path.segments[0, :4], start, atol=1e-6)
    np.testing.assert_allclose(end_of(path)[:2], nodes[-1], atol=1e-4)
    line = shapely.LineString(sample(path, 50.0, 0.01))
    assert shapely.distance(line, shapely.points(points)).min(initial=math.inf) >= KEEP - 0.02
    assert shapely.box(*bounds).buffer(1e-6).covers(line)
    return path


def test_in_the_open_it_is_the_turn_onto_the_goal() -> None:
    path = found_way(Pose(0.0, 0.0, 1.0, 0.0), (0.0, 3000.0), np.zeros((0, 2)))
    assert path is not None
    centre_to_goal = math.hypot(0.0, 3000.0 - RADIUS)
    turn = math.pi / 2 + math.asin(RADIUS / centre_to_goal)
    assert abs(path.length_m - math.sqrt(centre_to_goal**2 - RADIUS**2) - turn * RADIUS) < 1e-6


def test_turns_into_an_opening_to_be_met_right() -> None:
    # A way out to the left that a turn at once would miss, and that a corner in its middle has no room for.
    ends = [(-400.0, 150.0, 450.0, 150.0), (900.0, 150.0, 900.0, -150.0)]
    ends += [(800.0, 150.0, 900.0, 150.0), (-400.0, -150.0, 900.0, -150.0)]
    points = np.concatenate([wall(end[:2], end[2:], 15.0) for end in ends])
    start, goal = Pose(0.0, 0.0, 1.0, 0.0), (0.0, 1500.0)
    assert optimise(start, 0.0, [(0.0, 0.0), goal], LIMITS, 50.0, terrain(points)) is None
    assert found_way(start, goal, points) is not None


@settings(max_examples=examples(20))
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 12))
@example(seed=351985684, count=11)  # far enough on, but not at the goal
def test_whatever_is_found_can_be_flown(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.column_stack((rng.uniform(150.0, 2500.0, count), rng.uniform(-700.0, 700.0, count)))
    course = float(rng.uniform(-math.pi, math.pi))
    start = Pose(0.0, 0.0, math.cos(course), math.sin(course))
    assume(found_way(start, (3000.0, 0.0), points, (-1000.0, -1000.0, 3500.0, 1000.0)) is not None)


@pytest.mark.parametrize("before", [1.0, -1.0])
def test_a_turn_never_follows_the_opposite_one_at_once(before: float) -> None:
    for goal in ((300.0, 2000.0), (300.0, -2000.0), (-1000.0, 50.0), (-1000.0, -50.0)):
        found = searched(Pose(0.0, 0.0, 1.0, 0.0), before / RADIUS, goal, np.zeros((0, 2)))
        assert found is not None
        assert all(a * b >= 0.0 for a, b in pairwise([before / RADIUS, *found.path.segments[:, 4].tolist()]))
