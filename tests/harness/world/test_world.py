import math
from collections.abc import Iterator

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import harness.world.world
from harness.world.world import Circle, Obstacle, Polygon, World
from planner.interface import FloatArray
from tests.examples import examples
from tests.harness.sensing import random_obstacle

BOUNDS = (0.0, 0.0, 20_000.0, 20_000.0)


@pytest.fixture(params=[512, -1], ids=["few are compared", "all are in a tree"], scope="module", autouse=True)
def few(request: pytest.FixtureRequest) -> Iterator[None]:
    """What holds of a world holds whichever way its obstacles are found."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(harness.world.world, "_FEW_STANDING", request.param)
        yield


def random_obstacles(rng: np.random.Generator, count: int, changing: bool) -> list[Obstacle]:
    obstacles = []
    for _ in range(count):
        east, north = rng.uniform(0.0, 20_000.0, 2)
        obstacles.append(random_obstacle(rng, east, north, rng.uniform(50.0, 1500.0), changing))
    return obstacles


def track(rng: np.random.Generator, rows: int) -> tuple[FloatArray, FloatArray]:
    """Points 2.5 m apart on a winding path, 0.1 s apart."""
    course: FloatArray = np.cumsum(rng.normal(0.0, 0.02, rows)) + rng.uniform(0.0, math.tau)
    steps = 2.5 * np.column_stack((np.sin(course), np.cos(course)))
    time_s = 0.1 * np.arange(rows, dtype=np.float64)
    return rng.uniform(5000.0, 15_000.0, 2) + np.cumsum(steps, axis=0), time_s


def true_distance(obstacle: Obstacle, east: float, north: float, time: float) -> float:
    """Signed distance by shapely, for a circle by its centre."""
    start, stop = obstacle.active_s or (-math.inf, math.inf)
    if not start <= time <= stop:
        return math.inf
    elapsed = time - (start if obstacle.active_s else 0.0)
    point = shapely.Point(east - obstacle.velocity_mps[0] * elapsed, north - obstacle.velocity_mps[1] * elapsed)
    if isinstance(obstacle.shape, Circle):
        return float(point.distance(shapely.Point(obstacle.shape.center_m))) - obstacle.shape.radius_m
    polygon = shapely.Polygon(obstacle.shape.vertices_m)
    distance = float(polygon.exterior.distance(point))
    return -distance if polygon.contains(point) else distance


@pytest.mark.parametrize("edge_m", [1e-14, 1e-170])
def test_clearance_of_a_polygon_with_an_edge_of_hardly_any_length(edge_m: float) -> None:
    house = Obstacle(Polygon(((-100.0, 300.0), (0.0, 200.0), (edge_m, 200.0), (100.0, 300.0))))
    nearly = World([house], BOUNDS)
    assert nearly.clearance_at(0.0, 0.0, 0.0) == pytest.approx(200.0)
    assert nearly.clearance_at(0.0, 290.0, 0.0) == pytest.approx(-10.0)


@settings(max_examples=examples(12))
@given(seed=st.integers(0, 2**32), count=st.integers(0, 40), pace=st.sampled_from([0.0, 1.0, 30.0]))
def test_clearance_along_a_track_is_that_to_the_nearest_of_all_obstacles(seed: int, count: int, pace: float) -> None:
    """Obstacles stand, or move and come and go: at their pace, or many times as far from row to row."""
    rng = np.random.default_rng(seed)
    obstacles = random_obstacles(rng, count, pace > 0.0)
    points, times = track(rng, 700)
    times *= pace
    clearance = World(obstacles, BOUNDS).clearance(points, times)
    for row in range(0, 700, 23):
        east, north = points[row].tolist()
        truth = min((true_distance(o, east, north, times[row]) for o in obstacles), default=math.inf)
        assert clearance[row] == pytest.approx(truth, abs=1e-9)


@settings(max_examples=examples(30))
@given(seed=st.integers(0, 2**32 - 1), moves=st.booleans())
def test_a_contact_on_the_way_is_found_where_shapely_finds_one(seed: int, moves: bool) -> None:
    """Thin bodies, met between two fixes: seen from the body, the way is another straight line."""
    rng = np.random.default_rng(seed)
    velocity = tuple(rng.uniform(-60.0, 60.0, 2).tolist()) if moves else (0.0, 0.0)
    turn, thick, at = rng.uniform(0.0, math.pi), rng.uniform(0.05, 1.0), rng.uniform(-4.0, 4.0, 2)
    along, across = (np.array([math.cos(a), math.sin(a)]) for a in (turn, turn + math.pi / 2))
    corners = [at + along * i + across * j * thick for i, j in ((-5, -1), (5, -1), (5, 1), (-5, 1))]
    world = World([Obstacle(Polygon(tuple((float(x), float(y)) for x, y in corners)), velocity)], BOUNDS)
    begin, end = ((*rng.uniform(-4.0, 4.0, 2).tolist(), time_s) for time_s in (0.0, 0.1))
    before_m, after_m = world.clearance_at(*begin), world.clearance_at(*end)
    assume(min(before_m, after_m) > 0.0)
    last = np.array(end[:2]) - 0.1 * np.array(velocity)
    inside = shapely.LineString([begin[:2], tuple(last)]).intersection(shapely.Polygon(corners)).length
    assume(inside == 0.0 or inside > 0.01)
    contact_m = world.contact_between(begin, before_m, end, after_m)
    assert (contact_m < 0.0) == (inside > 0.0)
    assert contact_m == math.inf or contact_m >= -thick
    assert world.contact_between(begin, 0.5 * before_m, end, after_m) < 0.0 or inside == 0.0


@pytest.mark.parametrize(
    ("active_s", "met"),
    [
        ((0.0, 1.0), True), ((0.03, 1.0), True), ((0.0, 0.07), True), ((0.03, 0.07), True),
        ((0.05, 0.06), True), ((0.06, 1.0), False), ((0.06, 0.07), False), ((0.0, 0.04), False),
    ],
)  # fmt: skip
def test_what_appears_or_goes_on_the_way_is_met_while_it_is_there(active_s: tuple[float, float], met: bool) -> None:
    """A wall that the middle of the way lies in, from 0.046 to 0.054 s."""
    wall = Polygon(((4.6, -9.0), (5.4, -9.0), (5.4, 9.0), (4.6, 9.0)))
    world = World([Obstacle(wall, active_s=active_s), Obstacle(Circle((0.0, 50.0), 1.0))], BOUNDS)
    begin, end = (0.0, 0.0, 0.0), (10.0, 0.0, 0.1)
    clearance = world.clearance_at(*begin), world.clearance_at(*end)
    assert (world.contact_between(begin, clearance[0], end, clearance[1]) < 0.0) is met


def test_an_obstacle_is_there_from_the_first_to_the_last_moment_of_its_window() -> None:
    world = World([Obstacle(Circle((0.0, 0.0), 10.0), active_s=(5.0, 8.0))], BOUNDS)
    moving = Obstacle(Circle((0.0, 0.0), 10.0), velocity_mps=(3.0, -2.0), active_s=(5.0, 8.0))
    assert moving.displacement_m(7.0) == (6.0, -4.0)
    times = np.array([4.999, 5.0, 8.0, 8.001])
    clearance = world.clearance(np.tile([30.0, 0.0], (4, 1)), times)
    assert clearance.tolist() == [math.inf, 20.0, 20.0, math.inf]
    assert [world.clearance_at(30.0, 0.0, time) for time in times] == clearance.tolist()


def test_the_boundary_belongs_to_the_area() -> None:
    world = World([], (0.0, 10.0, 100.0, 200.0))
    assert all(world.inside_bounds(*point) for point in ((0.0, 10.0), (100.0, 200.0), (50.0, 50.0)))
    outside = ((-0.001, 50.0), (100.001, 50.0), (50.0, 9.999), (50.0, 200.001), (math.nan, 50.0))
    assert not any(world.inside_bounds(*point) for point in outside)
