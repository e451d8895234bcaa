"""Distances to the goal on a grid against plane geometry."""

import math

import numpy as np
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.geometry.curves import Point
from planner.geometry.terrain import WorkCount
from planner.interface import FloatArray
from planner.rolling_window import cost_to_go
from planner.rolling_window.cost_to_go import CostToGo
from tests.examples import examples
from tests.planner.walls_and_paths import ring, wall

START, GOAL = (1000.0, 2500.0), (9000.0, 2500.0)
BOUNDS = (0.0, 0.0, 10_000.0, 5000.0)
KEEP = 200.0


def spread(points: FloatArray, work_count: WorkCount | None = None, keep: float = KEEP) -> CostToGo:
    to_go = CostToGo(START, GOAL, BOUNDS, points, np.full(len(points), keep), work_count or WorkCount())
    assert all(step is None for step in to_go.spread())
    return to_go


@given(st.tuples(st.floats(100.0, 9900.0), st.floats(100.0, 4900.0)))
def test_in_the_open_it_is_the_distance(place: Point) -> None:
    far = np.array([(0.0, 0.0), (10_000.0, 0.0), (0.0, 5000.0), (10_000.0, 5000.0)])
    assume(np.hypot(*(far - place).T).min() > KEEP)
    straight = math.dist(place, GOAL)
    # Both ends lie somewhere in their cells, and what a level is short of is made up for after five.
    assert straight <= spread(far)(place) <= straight + 3.0 * KEEP / cost_to_go.KEEP_CELLS


def test_round_a_wall() -> None:
    way = math.dist(START, (4800.0, 4200.0)) + 400.0 + math.dist((5200.0, 4200.0), GOAL)
    assert 0.92 * way < spread(wall((5000.0, 0.0), (5000.0, 4000.0), 50.0))(START) < 1.01 * way


def test_outside_of_the_grid_it_is_the_straight_line() -> None:
    to_go = spread(wall((5000.0, 0.0), (5000.0, 5000.0), 50.0))
    assert to_go((START[0] - 2.0 * KEEP + 1.0, 1.0)) == math.inf
    for place in ((START[0] - 2.0 * KEEP - 1.0, 1.0), (START[0], -1.0)):
        assert to_go(place) == math.dist(place, GOAL)


@settings(max_examples=examples(30))
@given(seed=st.integers(0, 10_000), count=st.integers(5, 120))
def test_no_way_is_told_only_where_there_is_none(seed: int, count: int) -> None:
    points = np.random.default_rng(seed).uniform((0.0, 0.0), (10_000.0, 5000.0), (count, 2))
    ends = shapely.points([START, GOAL])
    solid = shapely.union_all(shapely.buffer(shapely.points(points), KEEP, quad_segs=64))
    assume(not shapely.intersects(ends, solid).any())
    parts = shapely.get_parts(shapely.box(*BOUNDS).difference(solid))
    told = spread(points)(START) < math.inf
    assert told or not any(shapely.contains(part, ends).all() for part in parts)
    narrower = shapely.union_all(shapely.buffer(shapely.points(points), 0.6 * KEEP, quad_segs=64))
    parts = shapely.get_parts(shapely.box(*BOUNDS).buffer(KEEP).difference(narrower))
    assert not told or any(shapely.contains(part, ends).all() for part in parts)


def test_ends_nearer_to_something_than_is_kept_are_open() -> None:
    """As the search has it, from such points no more is kept than the distance of the ends."""
    points = np.concatenate((ring(1000.0, 2700.0, 100.0, 30.0), ring(9000.0, 2300.0, 90.0, 30.0)))
    room = np.min([np.hypot(*(points - end).T) for end in (START, GOAL)], axis=0) - 1e-3
    to_go = CostToGo(START, GOAL, BOUNDS, points, np.minimum(KEEP, room), WorkCount())
    for _ in to_go.spread():
        pass
    assert to_go(START) < 1.1 * math.dist(START, GOAL)
