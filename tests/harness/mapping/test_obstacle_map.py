"""The obstacle map against the true world, fed by the range sensor and by scans made by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings

from harness.mapping.obstacle_map import ObstacleMap
from harness.mapping.scan import RangeScan
from harness.world.world import Circle, Obstacle, Polygon, World
from tests.examples import examples
from tests.harness.looking import (
    BOUNDS,
    CLEARANCE,
    MIDDLE,
    RANGE,
    SEEDS,
    WALL,
    FloatArray,
    distance_to,
    on_circle,
    random_world,
    scans,
    sensor,
    world_of,
)

SPACING = CLEARANCE / 4.0


def empty_map(doubtful: bool = True) -> ObstacleMap:
    return ObstacleMap(BOUNDS, CLEARANCE, RANGE, doubtful=doubtful)


def fed(*sequences: list[RangeScan], doubtful: bool = True) -> ObstacleMap:
    seen = empty_map(doubtful)
    for scan in (scan for sequence in sequences for scan in sequence):
        seen.update(scan)
    return seen


def edges(seen: ObstacleMap) -> FloatArray:
    return seen.edges_since(-1)


def cells(points: FloatArray) -> set[tuple[int, int]]:
    """Cells of the grid on which points are kept, at most one a cell."""
    origin = BOUNDS[0] - 2.0 * CLEARANCE - SPACING
    return {(int(x), int(y)) for x, y in np.floor((points - origin) / SPACING).tolist()}


MOST_IN_A_CELL = 1 + 4 * 4  # points in a cell: one, and of a near outline one in every sixteenth of it


@settings(max_examples=examples(15))
@given(seed=SEEDS)
def test_edges_lie_on_true_edges_and_cover_what_was_seen(seed: int) -> None:
    world = random_world(seed)
    taken = scans(sensor(world, rays=1440), on_circle(4))
    if not len(points := edges(fed(taken, taken))):
        assert all(np.isinf(scan.ranges_m).all() for scan in taken)
        return
    # Rays lie 13 m apart or less: what is put between two hits of one wall is near it. What is put between
    # two obstacles too near to each other to pass between lies within the clearance of one of them.
    of_each = np.array([np.abs(o.distance(points, np.zeros(len(points)))) for o in world.obstacles])
    off = np.sort(of_each, axis=0)
    between = np.zeros(len(points), dtype=np.bool_) if len(off) < 2 else off[1] < 2.0 * CLEARANCE
    assert off[0].max() <= CLEARANCE
    assert off[0, ~between].max(initial=0.0) < SPACING
    assert len(points) <= MOST_IN_A_CELL * len(cells(points))
    tree = shapely.STRtree(shapely.points(points))
    for scan in taken:
        # What a single ray met is not believed: it might be a false return.
        rays = np.flatnonzero(np.isfinite(scan.ranges_m))
        hits = (scan.east_m, scan.north_m) + scan.directions[rays] * scan.ranges_m[rays, None]
        near = np.abs(scan.ranges_m[rays, None] - scan.ranges_m[rays]) < 0.5 * CLEARANCE
        apart = np.abs(rays[:, None] - rays)
        hits = hits[(near & (np.minimum(apart, len(scan.ranges_m) - apart) <= 2)).sum(axis=0) > 1]
        if len(hits):
            _, gap = tree.query_nearest(shapely.points(hits), return_distance=True, all_matches=False)
            assert gap.max() <= SPACING * math.sqrt(2.0) + 1e-6


def test_a_wall_is_known_at_the_second_look_and_at_once_where_no_return_is_false() -> None:
    first, second = scans(sensor(world_of(WALL)), [MIDDLE, MIDDLE])
    assert len(edges(fed([first]))) == 0
    at_once, known = edges(fed([first], doubtful=False)), edges(fed([first, second]))
    assert cells(at_once) == cells(known)
    assert known[:, 0].min() < 4000.0 + SPACING
    assert known[:, 0].max() > 6000.0 - SPACING
    assert np.diff(np.sort(known[:, 0])).max() < 2.0 * SPACING


@pytest.mark.parametrize(("way_m", "gap_m"), [(0.0, 2.0 * SPACING), (600.0, 600.0 + 2.0 * 110.0)])
def test_neighbouring_hits_too_near_to_pass_between_are_joined(way_m: float, gap_m: float) -> None:
    # Rays 105 m apart on a wall, in whose middle there may be a way.
    halves = [
        Polygon(((a, 6000.0), (b, 6000.0), (b, 6400.0), (a, 6400.0)))
        for a, b in ((3500.0, 5000.0 - way_m / 2), (5000.0 + way_m / 2, 6500.0))
    ]
    points = edges(fed(scans(sensor(world_of(*halves), rays=60), [MIDDLE] * 8)))
    front = points[np.abs(points - (5000.0, 6000.0)).max(axis=1) < 900.0]
    assert way_m <= np.diff(np.sort(front[np.abs(front[:, 1] - 6000.0) < 1.0, 0])).max() < gap_m


@pytest.mark.parametrize("at_m", [100.0, 900.0, 2500.0])
def test_one_false_return_makes_no_wall_in_any_later_scan(at_m: float) -> None:
    world = world_of(WALL)
    taken = scans(sensor(world), on_circle(60))
    truth, seen = fed(taken), empty_map()
    for i, scan in enumerate(taken):
        false = replace(scan, ranges_m=np.where(np.arange(len(scan.ranges_m)) == 500, at_m, scan.ranges_m))
        seen.update(false if i == 7 else scan)
        assert np.abs(distance_to(world, edges(seen))).max(initial=0.0) < SPACING
    np.testing.assert_array_equal(edges(seen), edges(truth))


@pytest.mark.parametrize("seed", range(4))
def test_with_a_fifth_of_the_returns_lost_walls_stay_closed(seed: int) -> None:
    world, seen = world_of(WALL), empty_map()
    for i, scan in enumerate(scans(sensor(world, seed, dropout=0.2), on_circle(120))):
        seen.update(scan)
        if i >= 10:
            along = np.sort(np.concatenate((edges(seen)[:, 0], [4000.0, 6000.0])))
            assert np.diff(along).max() < 2.0 * CLEARANCE
    assert np.diff(np.sort(edges(seen)[:, 0])).max() < 2.0 * SPACING + 1.0


@pytest.mark.parametrize("doubtful", [True, False])
def test_an_obstacle_that_has_gone_is_forgotten(doubtful: bool) -> None:
    gone = Obstacle(Circle((5000.0, 6500.0), 400.0), active_s=(0.0, 30.0))
    eye = sensor(World([gone, Obstacle(Circle((5000.0, 3500.0), 400.0))], BOUNDS))
    seen = fed(scans(eye, on_circle(60)), doubtful=doubtful)
    assert (edges(seen)[:, 1] > 5500.0).sum() > 10
    kept = edges(seen)[edges(seen)[:, 1] < 4500.0]
    for scan in scans(eye, on_circle(60) * 4, start_s=31.0):
        seen.update(scan)
    left = edges(seen)
    assert (left[:, 1] > 5500.0).sum() == 0
    assert cells(kept) <= cells(left)
    assert seen.last_removal_revision > 0


def test_edges_since_tells_each_edge_once_in_order() -> None:
    world = world_of(WALL, Circle((7000.0, 5000.0), 500.0))
    seen, known, revisions = empty_map(), np.zeros((0, 2)), [seen_revision := 0]
    for scan in scans(sensor(world), [(3000.0 + 40.0 * i, 5000.0) for i in range(60)]):
        seen.update(scan)
        fresh = seen.edges_since(seen_revision)
        assert (len(fresh) > 0) == (seen.revision > seen_revision)
        known = np.concatenate((known, fresh))
        assert seen.revision in (seen_revision, seen_revision + 1)
        seen_revision = seen.revision
        revisions.append(seen_revision)
        np.testing.assert_array_equal(edges(seen), known)
    assert seen.last_removal_revision == 0
    assert len(cells(known)) == len(known) > 40
    assert len(seen.edges_since(seen.revision)) == 0
    later = seen.edges_since(revisions[30])
    np.testing.assert_array_equal(later, known[len(known) - len(later) :])


@pytest.mark.parametrize("beam", [0, 360])
@pytest.mark.parametrize("off_m", [0.0, 13.0, 29.0, 41.0])
def test_a_corner_is_kept_in_detail_though_both_of_its_sides_are_in_sight(off_m: float, beam: int) -> None:
    corner = (5000.0 + off_m, 5300.0 + off_m)
    block = Polygon((corner, (corner[0] + 600.0, corner[1] + 600.0), (corner[0] - 600.0, corner[1] + 600.0)))
    eye = sensor(world_of(block))
    seen = fed(scans(eye, [(4990.0, 2800.0), (5000.0, 2850.0)]))
    for place in (MIDDLE, (5010.0, 5000.0)):
        bearing = math.atan2(corner[0] - place[0], corner[1] - place[1])
        for scan in scans(eye, [place], heading_rad=bearing + math.pi - math.tau * (beam + 0.5) / 720):
            seen.update(scan)
    # Near by rays are 3 m apart, and the points that were kept from afar up to 50.
    assert np.hypot(*(edges(seen) - corner).T).min() < 5.0


def test_the_flank_of_a_pillar_is_known_in_detail_though_the_gap_behind_it_is_closed() -> None:
    pillars = [Circle((5000.0 + 90.0 * i, 5000.0 + 90.0 * j), 45.0) for i, j in ((0, 0), (0, 1), (1, 0))]
    seen = ObstacleMap(BOUNDS, 50.0, RANGE, doubtful=False)
    past = [(4903.7 - 1.62 * i, 5000.0 + 12.4 * i) for i in range(-90, 4)]
    for scan in scans(sensor(world_of(*pillars)), past):
        seen.update(scan)
    track = np.array(past)
    known = min(np.hypot(*(track - edge).T).min() for edge in edges(seen))
    assert known == pytest.approx(distance_to(world_of(*pillars), track).min(), abs=0.5)
