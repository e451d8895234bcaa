"""What tests of the map share: a sensor that flies through a world."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.mapping.scan import RangeScan
from harness.scenario.sections import Sensor
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.range_sensor import RangeSensor
from harness.world.world import World

FloatArray = NDArray[np.float64]

BOUNDS = (0.0, 0.0, 6000.0, 6000.0)
CLEARANCE, RANGE = 40.0, 1500.0
SPEED = 25.0
SCAN_S = 0.5


def sensor(world: World, seed: int = 1, **keys: Any) -> RangeSensor:
    return RangeSensor(world, Sensor(**{"range_m": RANGE} | keys), np.random.SeedSequence(seed))


def world_of(*obstacles: Obstacle | Circle | Polygon) -> World:
    return World([each if isinstance(each, Obstacle) else Obstacle(each) for each in obstacles], BOUNDS)


def block(west: float, south: float, east: float, north: float) -> Polygon:
    return Polygon(((west, south), (east, south), (east, north), (west, north)))


def regular(east: float, north: float, radius_m: float, corners: int, turn_rad: float = 0.0) -> Polygon:
    angles = turn_rad + math.tau * np.arange(corners) / corners
    return Polygon(tuple((east + radius_m * math.cos(a), north + radius_m * math.sin(a)) for a in angles.tolist()))


def star(rng: np.random.Generator, east: float, north: float, size: float) -> Polygon:
    """A simple polygon, mostly concave: corners at random distances, in directions less than pi apart."""
    count = rng.integers(4, 12)
    turns = (np.arange(count) + rng.uniform(0.0, 0.9, count)) * math.tau / count
    corners = [
        (east + size * share * math.cos(turn), north + size * share * math.sin(turn))
        for turn, share in zip(turns, rng.uniform(0.2, 1.0, count), strict=True)
    ]
    return Polygon(tuple(corners if rng.random() < 0.5 else corners[::-1]))


def random_obstacle(rng: np.random.Generator, east: float, north: float, size: float, changing: bool) -> Obstacle:
    """A circle or a star; with `changing` it may move at 20 m/s, and be there for less than a minute."""
    shape = Circle((east, north), size) if rng.random() < 0.5 else star(rng, east, north, size)
    velocity, active = (0.0, 0.0), None
    if changing and rng.random() < 0.5:
        velocity = (rng.uniform(-20.0, 20.0), rng.uniform(-20.0, 20.0))
    if changing and rng.random() < 0.5:
        start = rng.uniform(0.0, 60.0)
        active = (start, start + rng.uniform(1.0, 60.0))
    return Obstacle(shape, velocity, active)


def flight(
    eye: RangeSensor,
    seconds: float,
    start: tuple[float, float] = (3000.0, 1500.0),
    course_rad: float = 0.0,
    turn_rad_s: float = 0.0,
    start_s: float = 0.0,
    speed: float = SPEED,
) -> Iterator[RangeScan]:
    """Scans of an aircraft that flies straight on, or turns to the right."""
    (east, north), course = start, course_rad
    for i in range(round(seconds / SCAN_S)):
        yield eye.scan(east, north, course, start_s + SCAN_S * i)
        course += turn_rad_s * SCAN_S
        east += speed * SCAN_S * math.sin(course)
        north += speed * SCAN_S * math.cos(course)


def off(world: World, points: FloatArray, time_s: float = 0.0) -> FloatArray:
    """(k,) distance of points from the nearest true edge, negative inside."""
    distance: FloatArray = world.clearance(points, np.full(len(points), time_s))
    return distance
