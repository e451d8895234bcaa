"""Space seen to be free, against the true world."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.mapping.free_space import FreeSpace
from harness.mapping.scan import RangeScan
from harness.world.world import Circle
from tests.harness.looking import (
    BOUNDS,
    CLEARANCE,
    FREE_CELL,
    MIDDLE,
    RANGE,
    SEEDS,
    WALL,
    distance_to,
    on_circle,
    random_world,
    scans,
    sensor,
    world_of,
)


def fed(taken: Iterable[RangeScan]) -> FreeSpace:
    seen = FreeSpace(BOUNDS, CLEARANCE, RANGE)
    for scan in taken:
        seen.update(scan)
    return seen


def test_a_lost_return_shows_no_free_space_behind_the_wall() -> None:
    first = sensor(world_of(WALL)).scan(*MIDDLE, 0.0, 0.0)
    ranges = first.ranges_m.copy()
    ranges[np.argmin(np.abs(first.directions[:, 0]) - first.directions[:, 1])] = math.inf
    behind = np.column_stack((np.full(60, 5000.0), np.linspace(6010.0, 7500.0, 60)))
    assert not fed([replace(first, ranges_m=ranges)]).contains(behind).any()


@pytest.mark.parametrize("seed", range(3))
def test_with_a_fifth_of_the_returns_lost_what_is_behind_walls_stays_unknown(seed: int) -> None:
    world = world_of(WALL)
    seen = fed(scans(sensor(world, seed, dropout=0.2), on_circle(100, 600.0)))
    points = np.random.default_rng(seed).uniform(2000.0, 8000.0, (20_000, 2))
    assert distance_to(world, points[seen.contains(points)]).min() > 0.0


@settings(max_examples=30)
@given(seed=SEEDS, field=st.sampled_from([360.0, 360.0, 120.0]), heading=st.floats(0.0, 6.0))
def test_seen_free_is_true_only_where_there_is_nothing(seed: int, field: float, heading: float) -> None:
    world = random_world(seed)
    seen = fed(scans(sensor(world, field_of_view_deg=field), on_circle(6, 500.0), heading_rad=heading))
    points = np.random.default_rng(seed).uniform(1000.0, 9000.0, (20_000, 2))
    free = seen.contains(points)
    assert free.any()
    assert distance_to(world, points[free]).min() > 0.0


@settings(max_examples=20)
@given(seed=SEEDS)
def test_most_of_what_is_plainly_visible_is_seen_free(seed: int) -> None:
    world = random_world(seed)
    seen = fed(scans(sensor(world), [MIDDLE]))
    points = np.random.default_rng(seed).uniform(2000.0, 8000.0, (2000, 2))
    lines = shapely.linestrings(np.stack((np.broadcast_to(MIDDLE, points.shape), points), axis=1))
    shapes = [
        shapely.Point(o.shape.center_m).buffer(o.shape.radius_m)
        if isinstance(o.shape, Circle)
        else shapely.Polygon(o.shape.vertices_m)
        for o in world.obstacles
    ]
    gap = shapely.distance(lines, shapely.union_all(shapes))
    in_range = np.hypot(*(points - MIDDLE).T) < RANGE - 2.0 * FREE_CELL
    plain = in_range & (gap > 2.0 * FREE_CELL)
    assert seen.contains(points[plain]).mean() > 0.97
    assert not seen.contains(points[gap == 0.0]).any()


def test_nothing_beyond_the_range_is_known() -> None:
    seen = fed(scans(sensor(world_of()), [MIDDLE]))
    points = np.random.default_rng(3).uniform(0.0, 10_000.0, (20_000, 2))
    away = np.hypot(*(points - MIDDLE).T)
    free = seen.contains(points)
    assert away[free].max() <= RANGE
    assert free[away < RANGE - 2.0 * FREE_CELL].all()


def test_nothing_is_known_before_the_first_scan_nor_outside_the_area() -> None:
    outside = np.array([(-10.0, 5000.0), (5000.0, 10_010.0), (1e7, 1e7), (-1e7, 0.0)])
    assert not FreeSpace(BOUNDS, CLEARANCE, RANGE).contains(np.array([MIDDLE, *outside])).any()
    seen = fed(scans(sensor(world_of()), [(100.0, 5000.0), (5000.0, 9900.0)]))
    assert not seen.contains(outside).any()
    assert seen.contains(np.array([(150.0, 5000.0)])).all()
    assert seen.contains(np.zeros((0, 2))).shape == (0,)


def test_beyond_where_rays_are_as_far_apart_as_the_clearance_nothing_is_known() -> None:
    # 40 rays: 0.157 rad apart, 200 m at a distance of 1273 m.
    seen = fed(scans(sensor(world_of(), rays=40), [MIDDLE]))
    points = np.random.default_rng(3).uniform(0.0, 10_000.0, (20_000, 2))
    free = seen.contains(points)
    assert free.any()
    assert np.hypot(*(points - MIDDLE).T)[free].max() <= CLEARANCE / (math.tau / 40) + 1e-6


@pytest.mark.parametrize("heading_deg", [0.0, 77.0, 200.0, 350.0])
@pytest.mark.parametrize("field_deg", [60.0, 180.0, 300.0])
def test_outside_the_field_of_view_nothing_is_known(heading_deg: float, field_deg: float) -> None:
    heading = math.radians(heading_deg)
    world = world_of(*(Circle(place, 250.0) for place in on_circle(12, 1500.0)))
    eye = sensor(world, field_of_view_deg=field_deg)
    seen = fed(scans(eye, [MIDDLE] * 4, heading_rad=heading))
    points = np.random.default_rng(5).uniform(2000.0, 8000.0, (40_000, 2))
    offset = points - MIDDLE
    away = np.hypot(*offset.T)
    off_nose = np.abs((np.arctan2(offset[:, 0], offset[:, 1]) - heading + math.pi) % math.tau - math.pi)
    outside = off_nose > math.radians(field_deg) / 2
    # A whole cell is marked or not: beside the edge of the field no more than a cell.
    beside = away * np.sin(np.minimum(off_nose - math.radians(field_deg) / 2, math.pi / 2))
    free = seen.contains(points)
    assert free.any()
    assert not free[outside & (beside > FREE_CELL * math.sqrt(2.0)) & (away > 2 * FREE_CELL)].any()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_hides_just_beside_the_field_of_view_is_not_in_free_space(side: float) -> None:
    # Circles that begin half a degree off the outermost ray.
    edge = side * math.radians(45.0)
    shapes = []
    for away in (700.0, 1200.0, 1800.0, 2400.0):
        turn = edge + side * (math.asin(150.0 / away) + math.radians(0.5))
        shapes.append(Circle((MIDDLE[0] + away * math.sin(turn), MIDDLE[1] + away * math.cos(turn)), 150.0))
    world = world_of(*shapes)
    seen = fed(scans(sensor(world, field_of_view_deg=90.0), [MIDDLE]))
    points = np.random.default_rng(7).uniform(2000.0, 8000.0, (60_000, 2))
    free = seen.contains(points)
    assert free.any()
    assert distance_to(world, points[free]).min() > 0.0


@settings(max_examples=20)
@given(
    seed=SEEDS,
    field=st.sampled_from([360.0, 120.0]),
    east=st.floats(BOUNDS[0], BOUNDS[2]),
    noise=st.sampled_from([0.0, 20.0]),
)
def test_a_cell_is_free_where_the_rays_about_it_went_beyond(
    seed: int, field: float, east: float, noise: float
) -> None:
    eye = sensor(random_world(seed), rays=90, field_of_view_deg=field)
    (scan,) = scans(eye, [(east, MIDDLE[1])])
    seen = FreeSpace(BOUNDS, CLEARANCE, RANGE, noise)
    seen.update(scan)
    rng, rays = np.random.default_rng(seed), len(scan.ranges_m)
    reach, half = min(RANGE, CLEARANCE / scan.spacing_rad), 0.75 * FREE_CELL
    columns, rows = (math.ceil((BOUNDS[2 + axis] - BOUNDS[axis]) / FREE_CELL) for axis in (0, 1))
    for column, row in zip(rng.integers(0, columns, 500), rng.integers(0, rows, 500), strict=True):
        middle = np.array((BOUNDS[0], BOUNDS[1])) + (np.array((column, row)) + 0.5) * FREE_CELL
        x, y = middle - (scan.east_m, scan.north_m)
        away = math.hypot(x, y)
        ray = round((math.atan2(x, y) - scan.start_rad) % math.tau / scan.spacing_rad)
        aside = math.ceil(half / scan.spacing_rad / max(away, half)) + 1
        inside = field == 360.0 or (aside <= ray < rays - aside)
        about = np.arange(1 - 2 ** aside.bit_length(), 2 ** aside.bit_length())
        beyond = min(reach, scan.ranges_m[(ray + about) % rays].min())
        assert seen.contains(middle[None])[0] == (inside and beyond - half - noise > away)


@pytest.mark.parametrize("bearing", [0.0, 1.0, 2.5, math.pi, 4.0, 5.5])
@pytest.mark.parametrize("away", [400.0, 1200.0])
def test_what_has_appeared_hides_what_is_behind_it_on_both_its_sides_and_no_more(
    bearing: float, away: float
) -> None:
    (scan,) = scans(sensor(world_of()), [MIDDLE])
    seen = fed([scan])
    points = np.random.default_rng(11).uniform(2000.0, 8000.0, (40_000, 2))
    points = points[seen.contains(points)]
    edge = np.array((MIDDLE[0] + away * math.sin(bearing), MIDDLE[1] + away * math.cos(bearing)))
    assert seen.take_back(scan, edge[None])
    free = seen.contains(points)
    distance, aside = np.hypot(*(points - MIDDLE).T), (np.arctan2(*(points - MIDDLE).T) - bearing) % math.tau
    aside = np.minimum(aside, math.tau - aside)
    # What counts is where the middle of a cell lies: half its diagonal off at most.
    off = 0.75 * FREE_CELL / np.maximum(distance, FREE_CELL)
    half = math.asin(1.5 * FREE_CELL / away)
    assert not free[(aside < half - off) & (distance > away - 0.25 * FREE_CELL)].any()
    assert free[(aside > half + off + 2.0 * scan.spacing_rad) | (distance < away - 1.75 * FREE_CELL)].all()
