import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from harness.mapping.scan import RangeScan
from harness.scenario.sections import Sensor
from harness.world.range_sensor import RangeSensor
from harness.world.world import Circle, Obstacle, Polygon, World
from planner.interface import FloatArray
from tests.examples import examples
from tests.harness.sensing import random_obstacle

BOUNDS = (0.0, 0.0, 100_000.0, 100_000.0)


def sensor(world: World, seed: int = 1, **keys: Any) -> RangeSensor:
    return RangeSensor(world, Sensor(**{"range_m": 1000.0} | keys), np.random.SeedSequence(seed))


def bits(scan: RangeScan) -> bytes:
    return scan.ranges_m.tobytes() + scan.directions.tobytes()


def square(east: float, north: float, half: float) -> Polygon:
    corners = ((-half, -half), (half, -half), (half, half), (-half, half))
    return Polygon(tuple((east + dx, north + dy) for dx, dy in corners))


def random_obstacles(
    rng: np.random.Generator, count: int, inner: float, outer: float, changing: bool = False
) -> list[Obstacle]:
    obstacles = []
    for _ in range(count):
        bearing, away, size = rng.uniform(0.0, math.tau), rng.uniform(inner, outer), rng.uniform(10.0, 200.0)
        east, north = away * math.sin(bearing), away * math.cos(bearing)
        obstacles.append(random_obstacle(rng, east, north, size, changing))
    return obstacles


def first_crossing(directions: FloatArray, shape: Any) -> FloatArray:
    """(n,) distance from the origin along each direction to the edge of a shape, +inf if there is none."""
    rays = shapely.linestrings(np.stack((np.zeros_like(directions), 5000.0 * directions), axis=1))
    crossing = shapely.intersection(rays, shape.boundary)
    distance: FloatArray = np.nan_to_num(shapely.distance(shapely.Point(0.0, 0.0), crossing), nan=math.inf)
    return distance


@settings(max_examples=examples(30))
@given(
    seed=st.integers(0, 2**32),
    count=st.integers(1, 12),
    field=st.sampled_from([10.0, 90.0, 180.0, 270.0, 359.0, 360.0]),
    heading=st.floats(-10.0, 10.0),
)
def test_ranges_lie_between_those_of_slightly_larger_and_smaller_shapes(
    seed: int, count: int, field: float, heading: float
) -> None:
    obstacles = random_obstacles(np.random.default_rng(seed), count, 0.0, 1200.0)
    eye = sensor(World(obstacles, BOUNDS), field_of_view_deg=field, rays=60, beam_deg=0.0)
    scan = eye.scan(0.0, 0.0, heading, 0.0)
    low, high = np.full(60, math.inf), np.full(60, math.inf)
    for obstacle in obstacles:
        if isinstance(obstacle.shape, Circle):
            center, radius = shapely.Point(obstacle.shape.center_m), obstacle.shape.radius_m
            # Polygons of 512 edges inside and round the circle, which differ by 0.004 m at most.
            around = center.buffer(radius / math.cos(math.pi / 512), quad_segs=128)
            within = center.buffer(radius, quad_segs=128)
        else:
            exact = shapely.Polygon(obstacle.shape.vertices_m)
            around, within = (exact.buffer(by, join_style="mitre", mitre_limit=50.0) for by in (1e-6, -1e-6))
        assume(not around.contains(shapely.Point(0.0, 0.0)) or within.contains(shapely.Point(0.0, 0.0)))
        both = first_crossing(scan.directions, around), first_crossing(scan.directions, within)
        low, high = np.minimum(low, np.minimum(*both)), np.minimum(high, np.maximum(*both))
    assert ((scan.ranges_m >= low - 1e-6) | (low > 1000.0 - 1e-6)).all()
    assert ((scan.ranges_m <= high + 1e-6) | (high > 1000.0 - 1e-6)).all()
    assert ((scan.ranges_m <= 1000.0) | np.isinf(scan.ranges_m)).all()


@pytest.mark.parametrize("edge_m", [1e-14, 1e-170])
def test_an_edge_shorter_than_places_are_told_apart_hides_nothing(edge_m: float) -> None:
    house = Polygon(((-100.0, 300.0), (0.0, 200.0), (edge_m, 200.0), (100.0, 300.0)))
    world = World([Obstacle(house), Obstacle(square(0.0, -500.0, 100.0))], BOUNDS)
    scan = sensor(world, rays=4, beam_deg=0.0).scan(30.0, 0.0, math.pi / 4, 0.0)
    assert scan.nearest_m == pytest.approx(math.hypot(30.0, 200.0))
    np.testing.assert_allclose(scan.ranges_m, [math.inf, 230.0, math.inf, 400.0])


def test_moving_obstacles_are_seen_where_they_are() -> None:
    circle = Obstacle(Circle((0.0, 500.0), 100.0), velocity_mps=(0.0, 10.0), active_s=(100.0, 140.0))
    polygon = Obstacle(square(0.0, -500.0, 100.0), velocity_mps=(0.0, -10.0))
    source = sensor(World([circle, polygon], BOUNDS), field_of_view_deg=360.0, rays=4)
    times = (0.0, 30.0, 99.9, 100.0, 120.0, 140.0, 140.1)
    scans = [source.scan(0.0, 0.0, math.pi / 4, time).ranges_m for time in times]
    ahead_m = [math.inf, math.inf, math.inf, 400.0, 600.0, 800.0, math.inf]
    behind_m = [400.0, 700.0, math.inf, math.inf, math.inf, math.inf, math.inf]
    np.testing.assert_allclose([scan[1] for scan in scans], ahead_m)
    np.testing.assert_allclose([scan[3] for scan in scans], behind_m)


@settings(max_examples=examples(20))
@given(seed=st.integers(0, 2**32), near=st.integers(0, 10), far=st.integers(1, 40), changing=st.booleans())
def test_obstacles_out_of_range_do_not_change_a_bit(seed: int, near: int, far: int, changing: bool) -> None:
    rng = np.random.default_rng(seed)
    obstacles = random_obstacles(rng, near, 0.0, 900.0)
    # At most 200 m large, and 20 m/s for 60 s: from 2500 m they do not come within 1000 m.
    beyond = random_obstacles(rng, far, 1201.0, 1600.0) if not changing else []
    beyond += random_obstacles(rng, far, 3700.0, 4000.0, changing=changing)
    shuffled = [(obstacles + beyond)[i] for i in rng.permutation(near + len(beyond))]
    keys: dict[str, Any] = {"range_noise_m": 3.0, "dropout": 0.1, "false_return": 0.1}
    one, other = sensor(World(obstacles, BOUNDS), **keys), sensor(World(shuffled, BOUNDS), **keys)
    for number in range(5):
        heading = rng.uniform(0.0, math.tau)
        assert bits(one.scan(0.0, 0.0, heading, 12.0 * number)) == bits(other.scan(0.0, 0.0, heading, 12.0 * number))


@settings(max_examples=examples(12))
@given(seed=st.integers(0, 2**32))
def test_a_scan_does_not_depend_on_where_the_sensor_was_before(seed: int) -> None:
    world = World(random_obstacles(np.random.default_rng(seed), 30, 0.0, 3000.0, changing=True), BOUNDS)
    flown = sensor(world)
    for number in range(60):
        pose = (20.0 * number, 7.0 * number, 0.1 * number, 1.7 * number)
        assert bits(flown.scan(*pose)) == bits(sensor(world).scan(*pose))


@given(st.integers(0, 10_000), st.sampled_from([360.0, 90.0]))
@settings(max_examples=examples(20))
def test_no_return_is_nearer_than_the_scan_says_before_its_rays_are_followed(seed: int, field: float) -> None:
    rng = np.random.default_rng(seed)
    world = World(random_obstacles(rng, 5, 300.0, 1500.0), BOUNDS)
    scan = sensor(world, field_of_view_deg=field).scan(0.0, 0.0, rng.uniform(0.0, math.tau), 0.0)
    nearest = scan.nearest_m
    least = float(scan.ranges_m.min())
    assert nearest <= least + 1e-6
    if field == 360.0 and least < math.inf:
        assert nearest > 0.95 * least - 1.0
    assert dataclasses.replace(scan, ranges_m=scan.ranges_m + 5.0).nearest_m == least + 5.0
