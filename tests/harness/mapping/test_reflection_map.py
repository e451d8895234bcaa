"""The map of a noisy sensor against the true world."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from harness.mapping.reflection_map import ReflectionMap
from harness.world.obstacle import Circle, Obstacle
from harness.world.world import World
from tests.examples import examples
from tests.harness.sensing import (
    BOUNDS,
    CLEARANCE,
    RANGE,
    SCAN_S,
    FloatArray,
    block,
    flight,
    off,
    regular,
    sensor,
    world_of,
)

NOISE = 0.01 * RANGE
CELL = CLEARANCE / 4.0
SEEDS = st.integers(0, 2**32 - 1)
FLAWS: list[dict[str, float]] = [{}, {"dropout": 0.1, "false_return": 0.01}, {"field_of_view_deg": 180.0}]


def empty_map() -> ReflectionMap:
    return ReflectionMap(BOUNDS, CLEARANCE, RANGE, NOISE)


def seen_by_flight(world: World, seconds: float, seed: int = 1, **keys: float) -> ReflectionMap:
    seen = empty_map()
    for scan in flight(sensor(world, seed, **{"range_noise_m": NOISE} | keys), seconds, (2600.0, 1500.0)):
        seen.update(scan)
    return seen


def edges(seen: ReflectionMap) -> FloatArray:
    return seen.edges_since(-1)


def random_world(seed: int) -> World:
    """Some obstacles ahead, none in the way of the flight."""
    rng = np.random.default_rng(seed)
    shapes = []
    for _ in range(5):
        east, north, radius = rng.uniform((2000.0, 1900.0, 60.0), (4000.0, 3000.0, 250.0)).tolist()
        if abs(east - 2600.0) < radius + 80.0:
            continue
        turned = regular(east, north, radius, int(rng.integers(3, 6)), rng.uniform(0.0, 6.0))
        shapes.append(Circle((east, north), radius) if rng.random() < 0.5 else turned)
    return world_of(*(shapes or [Circle((3200.0, 2500.0), 100.0)]))


@pytest.mark.parametrize("flaws", FLAWS)
def test_most_edges_lie_nearer_to_true_walls_than_1_2_deviations(flaws: dict[str, float]) -> None:
    before = []
    for seed in range(10):
        world = random_world(seed)
        before.append(off(world, edges(seen_by_flight(world, 30.0, seed, **flaws))) / NOISE)
    assert max(np.quantile(each, 0.95) for each in before) < 1.2
    assert (np.quantile(np.concatenate(before), (0.95, 1.0)) < (0.9, 2.5)).all(), "of all, and the furthest"


@settings(max_examples=examples(10))
@given(seed=SEEDS, flaws=st.sampled_from(FLAWS))
@example(seed=848, flaws={})
def test_edges_lie_at_true_walls_and_cover_what_is_in_view(seed: int, flaws: dict[str, float]) -> None:
    world = random_world(seed)
    points = edges(seen_by_flight(world, 30.0, seed, **flaws))
    before = off(world, points) / NOISE
    # What lies behind a wall does no harm.
    # An edge lies no further off than a single return would: 1.645 is the normal distribution's 95 % quantile.
    assert np.quantile(before, 0.95) < 1.645
    assert before.max() < 3.5  # of 400 single returns one is beyond, in one world of eleven
    assert before.min() > -4.5
    exact = next(flight(sensor(world), 1.0, (2600.0, 1900.0)))
    near = np.flatnonzero(exact.ranges_m < 0.5 * RANGE)
    assume(len(near) > 10)
    here, known = complex(exact.east_m, exact.north_m), points[:, 0] + 1j * points[:, 1]
    where = here + exact.from_sensor_m(near)
    away = np.abs(where[:, None] - known).min(axis=1)
    assert np.median(away) < 1.2 * NOISE + CELL
    # What is not known is seen only through a chink between known edges.
    lines = here + np.multiply.outer(where[away >= 2.0 * CLEARANCE] - here, np.linspace(0.0, 1.0, 200))
    assert (np.abs(lines[..., None] - known).min(axis=(1, 2)) < CLEARANCE).all(), "no gap to fly through"


@pytest.mark.parametrize("false_return", [0.0, 0.01])
def test_there_are_no_edges_in_empty_space(false_return: float) -> None:
    seen = seen_by_flight(world_of(), 60.0, dropout=0.1, false_return=false_return)
    assert len(edges(seen)) == 0
    assert seen.revision == 0


@pytest.mark.parametrize("active_s", [20.0, 60.0])
def test_what_has_gone_fades_within_thirty_seconds_in_view(active_s: float) -> None:
    goes = Obstacle(Circle((2900.0, 2200.0), 100.0), active_s=(0.0, active_s))
    world, seen = world_of(goes, Circle((3400.0, 2200.0), 100.0)), empty_map()
    left: dict[float, int] = {}
    for scan in flight(sensor(world, range_noise_m=NOISE), active_s + 31.0, (2600.0, 1900.0), speed=3.0):
        seen.update(scan)
        left[scan.time_s] = int((edges(seen)[:, 0] < 3150.0).sum())
    assert left[active_s - SCAN_S] > 15
    assert left[active_s + 30.0] == 0
    assert seen.last_removal_revision > 0
    assert len(edges(seen)) > 15


def test_what_appears_is_an_edge_within_ten_seconds_though_looked_through_for_long() -> None:
    comes = Obstacle(Circle((2900.0, 2200.0), 100.0), active_s=(60.0, 500.0))
    seen, known_s = empty_map(), []
    for scan in flight(sensor(world_of(comes), range_noise_m=NOISE), 80.0, (2600.0, 1900.0), speed=3.0):
        seen.update(scan)
        if len(edges(seen)) > 10:
            known_s.append(scan.time_s)
    assert 60.0 < known_s[0] <= 70.0


def test_memory_is_bounded_by_the_area() -> None:
    seen = ReflectionMap((2000.0, 2000.0, 2600.0, 2600.0), CLEARANCE, RANGE, NOISE)
    eye = sensor(world_of(block(2500.0, 1900.0, 2550.0, 2700.0)), range_noise_m=NOISE, false_return=0.5)
    for _ in range(8):
        for scan in flight(eye, 20.0, (2100.0, 2050.0)):
            seen.update(scan)
    known = edges(seen)
    assert len(known) > 50
    # Area and a border of twice the clearance and a cell.
    assert len(known) <= ((600.0 + 2.0 * (2.0 * CLEARANCE + CELL)) / CELL + 1) ** 2
    assert known.min() > 2000.0 - 2.0 * CLEARANCE - CELL
    assert known.max() < 2600.0 + 2.0 * CLEARANCE + 2.0 * CELL
