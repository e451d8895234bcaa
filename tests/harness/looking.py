"""What tests of maps share: a sensor that looks from some places in a world."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from hypothesis import strategies as st

from harness.mapping.scan import RangeScan
from harness.world.range_sensor import RangeSensor
from harness.world.world import Circle, Polygon, World
from tests.harness import sensing
from tests.harness.sensing import FloatArray as FloatArray
from tests.harness.sensing import off
from tests.harness.sensing import world_of as world_of

BOUNDS = (0.0, 0.0, 10_000.0, 10_000.0)
CLEARANCE, RANGE = 200.0, 3000.0
FREE_CELL = CLEARANCE / 2.0
MIDDLE = (5000.0, 5000.0)
SEEDS = st.integers(0, 2**32 - 1)


distance_to = off


def sensor(world: World, seed: int = 1, **keys: Any) -> RangeSensor:
    return sensing.sensor(world, seed, **{"range_m": RANGE} | keys)


def on_circle(count: int, radius_m: float = 300.0) -> list[tuple[float, float]]:
    angles = (math.tau * i / count for i in range(count))
    return [(MIDDLE[0] + radius_m * math.cos(a), MIDDLE[1] + radius_m * math.sin(a)) for a in angles]


def scans(
    eye: RangeSensor, places: Iterable[tuple[float, float]], start_s: float = 0.0, heading_rad: float = 0.0
) -> list[RangeScan]:
    return [eye.scan(*place, heading_rad, start_s + 0.5 * i) for i, place in enumerate(places)]


WALL = Polygon(((4000.0, 6000.0), (6000.0, 6000.0), (6000.0, 6400.0), (4000.0, 6400.0)))


def random_world(seed: int) -> World:
    """Obstacles wider than what rays may miss, none about the middle."""
    rng = np.random.default_rng(seed)
    shapes: list[Circle | Polygon] = []
    for _ in range(int(rng.integers(1, 7))):
        away, turn, size = rng.uniform(1300.0, 3500.0), rng.uniform(0.0, math.tau), rng.uniform(200.0, 600.0)
        x, y = MIDDLE[0] + away * math.cos(turn), MIDDLE[1] + away * math.sin(turn)
        if rng.random() < 0.5:
            shapes.append(Circle((x, y), float(size)))
            continue
        corners = rng.uniform(0.0, math.tau) + math.tau * np.arange(4) / 4
        shapes.append(Polygon(tuple((x + float(size) * math.cos(a), y + float(size) * math.sin(a)) for a in corners)))
    return world_of(*shapes)
