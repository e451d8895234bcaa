"""Polygons with holes: free inside for distance, contact, sensor and optimum, and in a scenario file."""

import math

import numpy as np
import pytest
import shapely

from harness.scenario.sections import Sensor
from harness.world.obstacle import Obstacle, Polygon
from harness.world.range_sensor import RangeSensor
from harness.world.world import World
from tests.scenarios import scenario_of
from wayproof import InputError, dump_scenario

OUTER = ((0.0, 0.0), (1000.0, 0.0), (1000.0, 1000.0), (0.0, 1000.0))
HOLE = ((300.0, 200.0), (300.0, 800.0), (700.0, 800.0), (700.0, 200.0))
RING = Polygon(OUTER, (HOLE,))
BOUNDS = (-500.0, -500.0, 1500.0, 1500.0)

YAML = """schema: wayproof/scenario/1
name: holes
area: {{bounds_m: [-5000, -5000, 6000, 6000]}}
obstacles:
  - polygon:
      vertices_m: [[0, 0], [1000, 0], [1000, 1000], [0, 1000], [0, 0]]
      holes_m: {holes}
mission: {{start_m: [-3000, 0], goal_m: [4000, 0]}}
"""


def test_distances_are_those_of_shapely() -> None:
    shape = shapely.Polygon(OUTER, [HOLE])
    east, north = np.random.default_rng(3).uniform(-400.0, 1400.0, (2, 500))
    points = shapely.points(east, north)
    expected = np.where(
        shapely.contains(shape, points),
        -shapely.distance(shape.boundary, points),
        shapely.distance(shape, points),
    )
    assert RING.distance(east, north) == pytest.approx(expected, abs=1e-9)
    assert RING.distance(np.array([500.0]), np.array([500.0]))[0] == pytest.approx(200.0)


def test_the_sensor_sees_the_inner_walls_from_the_hole() -> None:
    world = World([Obstacle(RING)], BOUNDS)
    sensor = RangeSensor(world, Sensor(range_m=2000.0, rays=8, beam_deg=0.0), np.random.SeedSequence(1))
    scan = sensor.scan(500.0, 500.0, 0.0, 0.0)
    assert np.isfinite(scan.ranges_m).all()
    assert scan.ranges_m.min() == pytest.approx(200.0 / math.cos(math.radians(22.5)))


def test_a_contact_is_found_on_the_way_out_of_a_hole() -> None:
    world = World([Obstacle(RING)], BOUNDS)
    assert world.clearance_at(500.0, 500.0, 0.0) == pytest.approx(200.0)
    begin, end = (500.0, 500.0, 0.0), (1200.0, 500.0, 10.0)
    assert world.contact_between(begin, 200.0, end, 200.0) < 0.0


def test_a_scenario_keeps_its_holes() -> None:
    text = YAML.format(holes="[[[200, 200], [200, 200], [800, 200], [800, 800], [200, 200]]]")
    scenario = scenario_of(text)
    polygon = scenario.obstacles[0].polygon
    assert polygon is not None
    assert polygon.holes_m == (((200.0, 200.0), (800.0, 200.0), (800.0, 800.0)),)
    assert scenario_of(dump_scenario(scenario)) == scenario
    assert World.from_scenario(scenario).clearance_at(700.0, 300.0, 0.0) == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("holes", "sentence"),
    [
        ("[[[200, 200], [1800, 200], [800, 800]]]", "has holes_m that lie outside of it, cross or touch"),
        ("[[[2000, 200], [2800, 200], [2800, 800]]]", "has holes_m that lie outside of it, cross or touch"),
        ("[[[200, 200], [800, 800], [800, 200], [200, 800]]]", r"holes_m\[0\]: crosses or touches itself"),
        ("[[[200, 200], [800, 800]]]", r"holes_m\[0\]: has 2 items; must have at least 3"),
        ("[[[200, 200], [200, 200], [800, 800]]]", r"holes_m\[0\]: has 2 distinct vertices"),
    ],
)
def test_holes_that_are_none_are_refused(holes: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        scenario_of(YAML.format(holes=holes))
