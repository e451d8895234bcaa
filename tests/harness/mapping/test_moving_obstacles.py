"""What moves is found, and nothing else is."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from harness.mapping.moving_obstacles import COASTS_S, MovingObstacles
from harness.mapping.scan import RangeScan
from harness.mapping.scan_comparison import runs_of
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.world import World
from planner.interface import MovingEdges
from tests.examples import examples
from tests.harness.sensing import CLEARANCE, SCAN_S, SPEED, block, flight, off, regular, sensor, world_of

SEEDS = st.integers(0, 2**32 - 1)
START = (3000.0, 1500.0)
Found = list[tuple[float, tuple[MovingEdges, ...]]]


def watched(scans: Iterable[RangeScan], noise_m: float = 0.0, clearance_m: float = CLEARANCE) -> Found:
    """What is known to move after each scan, and the time of that."""
    seen = MovingObstacles(clearance_m, noise_m)
    found: Found = []
    for scan in scans:
        seen.update(scan)
        found.append((scan.time_s, seen.found))
    return found


def errors(found: Found, velocity: complex) -> list[float]:
    """How far off each velocity is, m/s."""
    return [abs(complex(*each.velocity_mps) - velocity) for _, all_found in found for each in all_found]


def known_error(each: MovingEdges, velocity: complex) -> float:
    """How far off a velocity is, m/s; across its face where nothing else of it shows: along it it is not known."""
    points = each.points_m[:, 0] + 1j * each.points_m[:, 1]
    off, along = complex(*each.velocity_mps) - velocity, points[-1] - points[0]
    along /= max(abs(along), 1e-9)
    is_straight = np.abs(((points - points[0]) * along.conjugate()).imag).max() < 0.1
    return abs((off * along.conjugate()).imag) if is_straight else abs(off)


def passing(
    speed_mps: float, turned_rad: float, away_m: float, bearing_rad: float, size: float, corners: int
) -> tuple[World, complex]:
    """An obstacle that comes nearer or crosses, and its velocity (east + i north).

    It is `away_m` from the aircraft after 20 s, in a direction; there it moves towards the aircraft, but for an angle.
    """
    direction = complex(math.sin(bearing_rad), math.cos(bearing_rad))
    velocity = -speed_mps * direction * complex(math.cos(turned_rad), math.sin(turned_rad))
    place = complex(*START) + 1j * SPEED * 20.0 + away_m * direction - velocity * 20.0
    shape: Circle | Polygon = Circle((place.real, place.imag), size)
    if corners > 2:
        shape = regular(place.real, place.imag, size, corners, bearing_rad + turned_rad)
    return world_of(Obstacle(shape, velocity_mps=(velocity.real, velocity.imag))), velocity


@pytest.mark.flights
@settings(max_examples=20, derandomize=True)  # of a thousand passes three are told worse
@given(
    speed=st.floats(1.0, 10.0),
    turned=st.floats(-1.4, 1.4),
    away=st.floats(400.0, 800.0),
    bearing=st.floats(-1.1, 1.1),
    size=st.floats(50.0, 150.0),
    corners=st.sampled_from([0, 0, 3, 4, 5]),
)
@example(speed=3.0, turned=0.25, away=400.0, bearing=-0.75, size=81.0, corners=5)
@example(speed=2.0, turned=-1.25, away=672.0, bearing=0.75, size=50.0, corners=3)  # a lone face, another in the end
@example(speed=4.0, turned=1.4, away=509.0, bearing=1.05, size=137.0, corners=3)  # a face that slides along itself
def test_velocity_is_told(speed: float, turned: float, away: float, bearing: float, size: float, corners: int) -> None:
    world, velocity = passing(speed, turned, away, bearing, size, corners)
    found = watched(flight(sensor(world), 40.0, START))
    # Slower ones take longer to leave what was looked through.
    assert speed < 2.0 or any(all_found for time_s, all_found in found if time_s <= 30.0)
    assert max(len(all_found) for _, all_found in found) <= 2
    told = [each for time_s, all_found in found if time_s <= 28.0 for each in all_found]
    assert np.median([known_error(each, velocity) for each in told] or [0.0]) < 1.5
    # Near by, an obstacle shows other faces than before: for a moment that looks like motion.
    assert max(errors([each for each in found if each[0] <= 28.0], velocity), default=0.0) < 5.0


@pytest.mark.parametrize(("speed", "period_s"), [(20.0, 0.5), (25.0, 0.5), (30.0, 0.5), (20.0, 1.0), (25.0, 1.0)])
def test_what_is_fast_is_found(speed: float, period_s: float) -> None:
    """Until its velocity is known it may be anywhere that it can have come to since it was seen first."""
    eye = sensor(world_of(Obstacle(Circle((2550.0, 2300.0), 80.0), velocity_mps=(speed, 0.0))))
    scans = [eye.scan(3000.0, 1500.0, 0.0, time_s) for time_s in np.arange(0.0, 30.0, period_s)]
    found = [each for _, all_found in watched(iter(scans)) for each in all_found]
    assert found
    assert abs(complex(*found[-1].velocity_mps) - speed) < 0.5


@pytest.mark.parametrize("corners", [0, 4])
@pytest.mark.parametrize("flaws", [{}, {"dropout": 0.1, "false_return": 0.01}, {"field_of_view_deg": 180.0}])
def test_it_is_where_it_is_told_to_be(corners: int, flaws: dict[str, Any]) -> None:
    world, velocity = passing(8.0, 0.7, 500.0, 0.3, 100.0, corners)
    found = watched(flight(sensor(world, **flaws), 35.0, START))
    assert next(time_s for time_s, all_found in found if all_found) <= 20.0
    assert max(errors(found, velocity)) < 2.0
    assert max(errors(found[-10:], velocity)) < 0.2
    for time_s, all_found in found:
        for each in all_found:
            assert each.time_s == time_s
            assert np.abs(off(world, each.points_m, time_s)).max() < 0.3 * CLEARANCE


@pytest.mark.parametrize("corners", [0, 4])
@pytest.mark.parametrize("size", [8.0, 12.0])
def test_what_few_beams_meet_is_found(corners: int, size: float) -> None:
    """It is 900 m away at first: few beams meet it."""
    world, velocity = passing(8.0, 0.7, 300.0, 0.3, size, corners)
    found = watched(flight(sensor(world), 25.0, START))
    assert next(time_s for time_s, all_found in found if all_found) < 20.0
    assert np.median(errors(found, velocity)) < 1.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_face_is_found_whichever_way_it_slides_along_itself(side: float) -> None:
    face = block(2920.0 - side * 540.0, 3420.0, 3080.0 - side * 540.0, 3580.0)
    eye = sensor(world_of(Obstacle(face, velocity_mps=(side * 8.0, 0.0))), range_m=2000.0)
    assert told_s(watched(flight(eye, 20.0, START), clearance_m=60.0), complex(side * 8.0)) < 17.0


def test_noise_on_a_face_is_not_taken_for_motion_along_it() -> None:
    """Neighbours on the face point in all directions, and none of that shows where it has slid to."""
    face = Obstacle(block(2620.0, 3420.0, 2780.0, 3580.0), velocity_mps=(5.0, -6.0))
    flown = [flight(sensor(world_of(face), seed, range_noise_m=4.0), 45.0, START) for seed in range(4)]
    off_mps = [each for scans in flown for each in errors(watched(scans, 4.0), 5.0 - 6.0j)]
    assert np.percentile(off_mps, 90) < 3.0


def random_still_world(seed: int) -> World:
    rng = np.random.default_rng(seed)
    shapes: list[Circle | Polygon] = []
    for _ in range(int(rng.integers(3, 14))):
        east, north, size = rng.uniform(1500.0, 4500.0), rng.uniform(1500.0, 5500.0), rng.uniform(20.0, 300.0)
        corners, turn = int(rng.integers(3, 7)), rng.uniform(0.0, math.tau)
        long, high = rng.uniform(50.0, 1500.0), rng.uniform(20.0, 200.0)
        kinds: tuple[Circle | Polygon, ...] = (
            Circle((east, north), size),
            regular(east, north, size, corners, turn),
            block(east, north, east + long, north + high),
        )
        shapes.append(kinds[int(rng.integers(3))])
    return world_of(*shapes)


STILL: list[dict[str, Any]] = [
    {},
    {"dropout": 0.1, "false_return": 0.01},
    {"range_noise_m": 2.0, "field_of_view_deg": 180.0},
    {"range_noise_m": 4.0, "dropout": 0.1, "false_return": 0.01},
    {"rays": 180},
]


@pytest.mark.flights
@settings(max_examples=examples(30))
@given(
    seed=SEEDS,
    flaws=st.sampled_from(STILL),
    turn=st.sampled_from([0.0, 0.0, 0.05, -0.16]),
    course=st.floats(-0.6, 0.6),
)
@example(seed=623, flaws=STILL[0], turn=0.0, course=0.0)
@example(seed=1215, flaws=STILL[4], turn=0.0, course=-0.24699075901474227)
@example(seed=11734, flaws=STILL[1], turn=0.05, course=0.0707772080525213)
@example(seed=68076, flaws=STILL[1], turn=-0.16, course=0.006071549687820643)
def test_nothing_moves_in_a_still_world(seed: int, flaws: dict[str, Any], turn: float, course: float) -> None:
    world, outside = random_still_world(seed), []
    for scan in flight(sensor(world, seed, **flaws), 90.0, (3000.0, 1000.0), course, turn):
        if world.clearance_at(scan.east_m, scan.north_m, 0.0) < 20.0:
            break
        outside.append(scan)
    assert not any(all_found for _, all_found in watched(outside, flaws.get("range_noise_m", 0.0)))


@pytest.mark.parametrize("flaws", STILL)
@pytest.mark.parametrize("corners", [0, 4])
def test_what_appears_does_not_move(corners: int, flaws: dict[str, Any]) -> None:
    shape = Circle((2830.0, 2400.0), 80.0) if corners == 0 else regular(2830.0, 2400.0, 80.0, corners, 0.3)
    world = world_of(Obstacle(shape, active_s=(15.0, 500.0)))
    found = watched(flight(sensor(world, **flaws), 60.0, START), flaws.get("range_noise_m", 0.0))
    assert not any(all_found for _, all_found in found)


def told_s(found: Found, velocity: complex) -> float:
    """When something is first told to move, and moves as told."""
    time_s, told = next((time_s, all_found) for time_s, all_found in found if all_found)
    assert min(abs(complex(*each.velocity_mps) - velocity) for each in told) < 0.5
    return time_s


@pytest.mark.parametrize(
    ("place", "velocity", "from_east", "within_s"),
    [
        ((2800.0, 2380.0), 8.0 + 0.0j, 3100.0, 25.0),
        ((2900.0, 2380.0), 8.0 + 0.0j, 3100.0, 15.0),
        ((2900.0, 2380.0), 6.0 - 5.0j, 3000.0, 15.0),
        ((2900.0, 2380.0), 4.0 + 0.0j, 3100.0, 15.0),
    ],
)
def test_what_comes_out_between_still_ones_is_found_soon(
    place: tuple[float, float], velocity: complex, from_east: float, within_s: float
) -> None:
    """Nearer to them than the clearance: they belong to no outline that is followed."""
    moves = Obstacle(Circle(place, 80.0), velocity_mps=(velocity.real, velocity.imag))
    world = world_of(moves, Circle((2880.0, 2280.0), 100.0), Circle((3150.0, 2420.0), 50.0))
    assert told_s(watched(flight(sensor(world), 50.0, (from_east, 1800.0), speed=5.0)), velocity) < within_s


def test_what_leaves_sight_moves_on_for_a_while() -> None:
    """It goes behind a wall."""
    velocity = 8.0 + 0.0j
    moves = Obstacle(Circle((2700.0, 2600.0), 40.0), velocity_mps=(8.0, 0.0))
    world = world_of(moves, block(3000.0, 2300.0, 3600.0, 2350.0))
    found = watched(flight(sensor(world), 80.0, (3000.0, 1900.0), speed=2.0))
    times = [time_s for time_s, all_found in found if all_found]
    hidden_s = 43.0  # wholly behind the wall from then on
    assert times[0] < 25.0
    assert hidden_s < times[-1] < hidden_s + COASTS_S
    assert np.diff(times).max() == SCAN_S
    last = next(all_found for time_s, all_found in reversed(found) if all_found)
    assert abs(complex(*last[0].velocity_mps) - velocity) < 1.0
    assert np.abs(off(World([moves], world.bounds_m), last[0].points_m, times[-1])).max() < 40.0


@pytest.mark.parametrize("lost", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("first", [100, 712, 715])
def test_a_run_of_returns_goes_on_over_three_lost_ones_wherever_beam_0_is(first: int, lost: int) -> None:
    scan = sensor(world_of()).scan(*START, 0.0, 0.0)
    hits = np.sort((first + np.delete(np.arange(12), range(5, 5 + lost))) % len(scan.ranges_m))
    places = ((hits - first) % len(scan.ranges_m)).astype(np.complex128)
    assert len(runs_of(hits, places, np.full(len(hits), 20.0), scan)) == (2 if lost > 3 else 1)
