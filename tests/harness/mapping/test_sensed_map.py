"""Edges, what moves and free space, put together."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.mapping.scan import RangeScan
from harness.mapping.sensed_map import ScanErrors, SensedMap
from harness.world.obstacle import Circle, Obstacle
from harness.world.world import World
from tests.examples import examples
from tests.harness.sensing import BOUNDS, CLEARANCE, RANGE, block, flight, off, regular, sensor, world_of
from tests.longer import longer

FREE_CELL = CLEARANCE / 2.0
START = (3000.0, 1500.0)


def empty_world(noise_m: float = 0.0, false_returns: bool = False) -> SensedMap:
    return SensedMap(BOUNDS, CLEARANCE, RANGE, ScanErrors(noise_m, false_returns))


def fed(scans: Iterable[RangeScan]) -> SensedMap:
    seen = empty_world()
    for scan in scans:
        seen.update(scan)
    return seen


@pytest.mark.parametrize("corners", [0, 4])
def test_edges_of_what_moves_are_not_among_the_still_ones_and_leave_no_trail(corners: int) -> None:
    shape = Circle((2700.0, 2400.0), 60.0) if corners == 0 else regular(2700.0, 2400.0, 60.0, corners, 0.2)
    world = world_of(Obstacle(shape, velocity_mps=(8.0, -2.0)), block(2000.0, 2600.0, 4000.0, 2700.0))
    mover, still = (World(world.obstacles[part], BOUNDS) for part in (slice(1), slice(1, None)))
    seen, found_s = empty_world(), []
    for scan in flight(sensor(world), 45.0, (3000.0, 1500.0), speed=5.0):
        seen.update(scan)
        found_s += [scan.time_s] if seen.moving else []
        if seen.moving:
            edges = seen.edges_since(-1)
            strays = edges[np.abs(off(still, edges)) > CLEARANCE]
            # At once: it is not waited for looks through its trail. Single beams may meet its ends at a glance.
            assert len(strays) <= 8
            assert np.abs(off(mover, strays, scan.time_s)).max(initial=0.0) < 1.5 * CLEARANCE
            assert np.abs(off(world, seen.moving[0].points_m, scan.time_s)).max() < 0.3 * CLEARANCE
    assert found_s[0] < 20.0
    assert found_s[-1] == 44.5
    assert (np.abs(off(still, seen.edges_since(-1))) < 1.0).sum() > 50


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_of_what_moves_also_that_is_known_to_which_comes_into_view_as_one_passes_by(side: float) -> None:
    """It is met head on, and passed with its other flank in view in the end; beside it stands something."""
    body = Obstacle(Circle((3000.0 + side * 450.0, 2000.0), 140.0), velocity_mps=(-7.0 * side, 4.0))
    world = world_of(body, Circle((3000.0 - side * 260.0, 2300.0), 60.0))
    mover, still = (World(world.obstacles[part], BOUNDS) for part in (slice(1), slice(1, None)))
    seen, looks = empty_world(), 0
    for scan in flight(sensor(world), 55.0, (3000.0, 1300.0), speed=22.0):
        seen.update(scan)
        if seen.moving:
            edges, ends = seen.edges_since(-1), scan.ends_m((scan.ranges_m < math.inf).nonzero()[0])
            assert (np.abs(off(still, edges)) > CLEARANCE).sum() <= 12
            met = np.column_stack((ends.real, ends.imag))
            met = met[np.abs(off(mover, met, scan.time_s)) < 1.0]
            away = np.hypot(*(met[:, None] - seen.moving[0].points_m).transpose(2, 0, 1)).min(axis=1)
            assert np.quantile(away, 0.9) < 0.2 * CLEARANCE
            looks += 1
    assert looks > 80


@settings(max_examples=examples(10))
@given(seed=st.integers(0, 2**32 - 1), appears_s=st.sampled_from([5.0, 10.0, 15.0]))
def test_what_is_seen_free_is_free_of_what_has_appeared_in_view(seed: int, appears_s: float) -> None:
    rng = np.random.default_rng(seed)
    place, size = (rng.uniform(2300.0, 3700.0), rng.uniform(2200.0, 3200.0)), rng.uniform(30.0, 150.0)
    shape = Circle(place, size) if rng.random() < 0.5 else regular(*place, size, int(rng.integers(3, 7)))
    world = world_of(Obstacle(shape, active_s=(appears_s, 500.0)))
    taken = [*flight(sensor(world), 20.0, START)]
    points = np.random.default_rng(1).uniform(1500.0, 4500.0, (20_000, 2))
    free = points[fed(taken).seen_free(points)]
    last = taken[-1]
    offset = free[:, 0] - last.east_m + 1j * (free[:, 1] - last.north_m)
    assert len(free) > 1000
    # Beyond the range nobody can know; further than the rays are dense nothing was marked.
    assert off(world, free[np.abs(offset) < 0.9 * RANGE], last.time_s).min() > -FREE_CELL


def test_nothing_surprises_in_a_still_world() -> None:
    world = world_of(
        block(2400.0, 2500.0, 3600.0, 2600.0), Circle((3200.0, 2000.0), 90.0), Circle((2500.0, 1900.0), 40.0)
    )
    for turn in (0.0, 0.1, -0.1):
        assert fed(flight(sensor(world), 30.0, START, turn_rad_s=turn)).last_contradiction_s == -math.inf


NOISE = 0.01 * RANGE
FLAWS: dict[str, Any] = {"range_noise_m": NOISE, "dropout": 0.1, "false_return": 0.01}


def test_a_narrow_field_of_view_that_turns_on_the_spot_shows_what_is_all_round() -> None:
    around = 500.0 * np.array([(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)])
    eye = sensor(world_of(*(Circle(tuple(START + each), 60.0) for each in around)), field_of_view_deg=120.0)
    seen = fed(flight(eye, 20.0, START, turn_rad_s=0.4, speed=2.0))
    assert (seen.distance_m(START + 0.88 * around) < CLEARANCE).all()
    assert seen.seen_free(START + 0.7 * (around + np.roll(around, 1, axis=0))).all()


@pytest.mark.parametrize("fov_deg", [360.0, 180.0])
@pytest.mark.parametrize(("start", "velocity"), [((2600.0, 2300.0), (8.0, -2.0)), ((3000.0, 2900.0), (0.0, -9.0))])
def test_with_much_noise_what_moves_is_followed(
    start: tuple[float, float], velocity: tuple[float, float], fov_deg: float
) -> None:
    moves = Obstacle(Circle(start, 60.0), velocity_mps=velocity)
    still = block(2000.0, 2800.0, 2600.0, 2900.0)
    # Far from others before the flight begins.
    world, seen = world_of(moves, still), empty_world(noise_m=NOISE, false_returns=True)
    mover = World(world.obstacles[:1], BOUNDS)
    known_s: list[float] = []
    for scan in flight(sensor(world, field_of_view_deg=fov_deg, **FLAWS), 45.0, START, speed=5.0):
        seen.update(scan)
        for each in seen.moving:
            assert np.median(np.abs(off(mover, each.points_m, scan.time_s))) < 1.5 * NOISE
            if each.velocity_mps != (0.0, 0.0):
                known_s.append(scan.time_s)
                assert math.dist(each.velocity_mps, velocity) < (4.0 if scan.time_s < 30.0 else 2.0)
    assert known_s[0] < 25.0
    assert known_s[-1] > 40.0


@pytest.mark.flights
@settings(max_examples=examples(10))
@given(seed=st.integers(0, 2**32 - 1), fov_deg=st.sampled_from([360.0, 180.0]))
def test_with_much_noise_nothing_is_taken_to_move_that_stands(seed: int, fov_deg: float) -> None:
    rng = np.random.default_rng(seed)
    shapes = [
        Circle((east, rng.uniform(1700.0, 3500.0)), rng.uniform(20.0, 120.0))
        for east in (2400.0, 2700.0, 3300.0, 3500.0, 3700.0)
    ]
    eye = sensor(world_of(*shapes), seed % 1000, field_of_view_deg=fov_deg, **FLAWS)
    seen, told = empty_world(noise_m=NOISE, false_returns=True), 0
    for scan in flight(eye, 60.0, START, turn_rad_s=rng.uniform(-0.05, 0.05)):
        seen.update(scan)
        told += len(seen.moving) > 0
        assert all(each.velocity_mps == (0.0, 0.0) for each in seen.moving)
    assert told <= 12, "for a moment at most"


@pytest.mark.parametrize("noise_m", [15.0, 30.0, 60.0])
@pytest.mark.parametrize("false_return", [0.1, 0.4])
@pytest.mark.parametrize(
    ("clearance_m", "seconds"),
    [(CLEARANCE, 60.0), *longer([(10.0, 25.0)]), pytest.param(10.0, 60.0, marks=pytest.mark.slow)],
)
def test_whatever_a_bad_sensor_returns_is_taken_in(
    noise_m: float, false_return: float, clearance_m: float, seconds: float
) -> None:
    world = world_of(
        Obstacle(Circle((2700.0, 2400.0), 60.0), velocity_mps=(8.0, -2.0)),
        block(2000.0, 2600.0, 4000.0, 2700.0),
        *(Circle((300.0 + 700.0 * i, 1700.0 + 170.0 * (i % 3)), 50.0) for i in range(8)),
    )
    eye = sensor(world, range_noise_m=noise_m, false_return=false_return, dropout=0.1, rays=360)
    seen = SensedMap(BOUNDS, clearance_m, RANGE, ScanErrors(noise_m, false_returns=True))
    for scan in flight(eye, seconds, START, turn_rad_s=0.02):
        seen.update(scan)
        for each in seen.moving:
            assert np.isfinite(each.points_m).all()
            assert math.hypot(*each.velocity_mps) <= 30.0 + 1e-9
    assert np.isfinite(seen.edges_since(-1)).all()


def test_walls_that_are_seen_from_a_shifted_pose_stay_one_and_their_gap_opens_again() -> None:
    """The error of the pose goes to and fro by 15 m and 0.6 degrees; in the last minute it is gone."""
    west, east = block(2000.0, 2600.0, 2920.0, 2700.0), block(3080.0, 2600.0, 4000.0, 2700.0)
    world, shift_m = world_of(west, east), 15.0
    seen = SensedMap(BOUNDS, CLEARANCE, RANGE, ScanErrors(pose_error_m=0.5 * shift_m))
    numbers, narrowest_m = [], math.inf
    for scan in flight(sensor(world), 300.0, (3000.0, 1300.0), speed=4.0):
        wrong = 1.0 if scan.time_s < 240.0 else 0.0
        off_m = wrong * shift_m * np.array([math.sin(scan.time_s / 20.0), math.cos(scan.time_s / 27.0)])
        turned_rad = wrong * 0.01 * math.sin(scan.time_s / 7.0)
        seen.update(scan.taken_from(scan.east_m + off_m[0], scan.north_m + off_m[1], scan.heading_rad + turned_rad))
        edges = seen.edges_since(-1)
        numbers.append(len(edges))
        if len(edges):
            narrowest_m = min(narrowest_m, 2.0 * float(np.abs(edges[:, 0] - 3000.0).min()))
        assert not seen.moving
    # A band of twice the error's size, however long it is looked at, not a new wall with each look.
    assert np.abs(off(world, seen.edges_since(-1))).max() < 1.5 * shift_m + 0.01 * RANGE
    assert max(numbers[400:]) < 1.1 * max(numbers[:250])
    assert narrowest_m > 160.0 - 2.0 * shift_m - 0.02 * RANGE
    assert 2.0 * float(np.abs(seen.edges_since(-1)[:, 0] - 3000.0).min()) > max(narrowest_m, 130.0)
    assert seen.seen_free(np.array([[3000.0, 2500.0], [3000.0, 2650.0]])).all()
