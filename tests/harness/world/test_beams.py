"""The nearest obstacle within each beam, against shapely's wedges."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.mapping.scan import RangeScan
from harness.scenario.sections import Sensor
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.range_sensor import RangeSensor
from harness.world.world import World
from tests.examples import examples
from tests.longer import longer

BOUNDS = (0.0, 0.0, 100_000.0, 100_000.0)
RANGE = 1000.0
SEED = st.integers(0, 2**32 - 1)


def look(*obstacles: Obstacle, heading: float = 0.0, time_s: float = 0.0, **keys: Any) -> RangeScan:
    config = Sensor(**{"range_m": RANGE} | keys)
    eye = RangeSensor(World(obstacles, BOUNDS), config, np.random.SeedSequence(1))
    return eye.scan(0.0, 0.0, heading, time_s)


def fence(middle: complex, turned: float, long: float, thick: float) -> Polygon:
    corners = [
        middle + 0.5 * complex(math.cos(turned), math.sin(turned)) * complex(x, y)
        for x, y in ((-long, -thick), (long, -thick), (long, thick), (-long, thick))
    ]
    return Polygon(tuple((each.real, each.imag) for each in corners))


def crowd(rng: np.random.Generator) -> list[Obstacle]:
    """Poles, discs and fences all about the sensor, some of them around it."""
    places = rng.uniform(-900.0, 900.0, (8, 2))
    obstacles = [Obstacle(Circle((x, y), float(rng.choice([0.01, 1.0, 30.0, 300.0])))) for x, y in places[:4]]
    for x, y in places[4:]:
        thick, long = float(rng.choice([0.01, 1.0, 50.0])), rng.uniform(1.0, 800.0)
        obstacles.append(Obstacle(fence(complex(x, y), rng.uniform(0.0, 7.0), long, thick)))
    return obstacles


def nearest_within(obstacle: Obstacle, low: float, high: float, larger: bool) -> float:
    """Distance from the origin to the nearest edge of an obstacle between two bearings.

    A circle is taken to be a polygon of 1024 corners inside it, or about it where it is to be larger.
    """
    if isinstance(obstacle.shape, Circle):
        radius = obstacle.shape.radius_m / (math.cos(math.pi / 1024) if larger else 1.0)
        edge = shapely.Point(obstacle.shape.center_m).buffer(radius, quad_segs=256).exterior
    else:
        edge = shapely.Polygon(obstacle.shape.vertices_m).exterior
    bearings = np.linspace(low, high, max(math.ceil((high - low) / 0.02), 1) + 1)
    far = 5000.0 * np.column_stack((np.sin(bearings), np.cos(bearings)))
    met = shapely.Polygon([(0.0, 0.0), *far]).intersection(edge)
    return math.inf if met.is_empty else shapely.Point(0.0, 0.0).distance(met)


@pytest.mark.parametrize("share", [1.0, *longer([0.3, 1.6])])
@settings(max_examples=examples(10), deadline=None)
@given(
    seed=SEED,
    rays=st.sampled_from([4, 7, 36, 90]),
    field=st.sampled_from([90.0, 180.0, 360.0]),
    heading=st.floats(-7.0, 7.0),
)
def test_each_beam_returns_the_nearest_edge_within_it(
    share: float, seed: int, rays: int, field: float, heading: float
) -> None:
    obstacles, beam_deg = crowd(np.random.default_rng(seed)), share * field / rays
    keys = {} if share == 1.0 else {"beam_deg": min(beam_deg, 120.0)}
    scan = look(*obstacles, heading=heading, field_of_view_deg=field, rays=rays, **keys)
    half = 0.5 * scan.beam_rad
    assert half == pytest.approx(0.5 * math.radians(min(beam_deg, 120.0)))
    for beam in range(rays):
        axis = heading - math.radians(field) / 2 + (beam + 0.5) * scan.spacing_rad
        # A hair wider and narrower: what only touches a side may count or not.
        least, most = math.inf, math.inf
        for each in obstacles:
            ranges = [
                nearest_within(each, axis - half - by, axis + half + by, larger)
                for by, larger in ((1e-9, True), (1e-9, False), (-1e-9, True), (-1e-9, False))
            ]
            # From inside, the larger circle is further away.
            least, most = min(least, *ranges[:2]), min(most, max(ranges[2:]))
        got = float(scan.ranges_m[beam])
        assert got >= least - 1e-5 or least > RANGE - 1e-5
        assert got <= most + 1e-5 or most > RANGE - 1e-5


@given(seed=SEED, rays=st.sampled_from([3, 90, 720]), radius=st.sampled_from([1e-6, 0.01, 1.0]))
@settings(max_examples=examples(30), deadline=None)
def test_nothing_is_so_thin_that_it_fits_between_touching_beams(seed: int, rays: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    heading, away = rng.uniform(0.0, math.tau), rng.uniform(10.0, 990.0)
    # Half of them on the side of a beam, to the last bit.
    side = heading - math.pi + rng.integers(rays) * (math.tau / rays)
    bearing = side if seed % 2 else rng.uniform(0.0, math.tau)
    pole = Circle((away * math.sin(bearing), away * math.cos(bearing)), radius)
    scan = look(Obstacle(pole), heading=heading, rays=rays)
    assert scan.ranges_m.min() == pytest.approx(away - radius, abs=1e-9)
    pencils = look(Obstacle(pole), heading=heading, rays=rays, beam_deg=0.0)
    assert pencils.ranges_m.min() >= away - radius - 1e-9
