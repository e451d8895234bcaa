"""Space seen to be free, against the true world."""

import math
from collections.abc import Iterable

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.mapping.free_space import FreeSpace
from harness.mapping.scan import RangeScan
from harness.world.world import Circle
from tests.examples import examples
from tests.harness.looking import (
    BOUNDS,
    CLEARANCE,
    FREE_CELL,
    MIDDLE,
    RANGE,
    SEEDS,
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


@settings(max_examples=examples(15))
@given(seed=SEEDS, field=st.sampled_from([360.0, 360.0, 120.0]), heading=st.floats(0.0, 6.0))
def test_seen_free_is_true_only_where_there_is_nothing(seed: int, field: float, heading: float) -> None:
    world = random_world(seed)
    seen = fed(scans(sensor(world, field_of_view_deg=field), on_circle(6, 500.0), heading_rad=heading))
    points = np.random.default_rng(seed).uniform(1000.0, 9000.0, (20_000, 2))
    free = seen.contains(points)
    assert free.any()
    assert distance_to(world, points[free]).min() > 0.0


@settings(max_examples=examples(10))
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
    assert seen.contains(points[in_range & (gap > 2.0 * FREE_CELL)]).mean() > 0.97
    assert not seen.contains(points[gap == 0.0]).any()


@pytest.mark.parametrize("beam_deg", [0.0, 4.0])
@pytest.mark.parametrize("width_m", [40.0, CLEARANCE])
def test_beyond_where_what_is_least_wide_could_hide_between_two_beams_nothing_is_known(
    beam_deg: float, width_m: float
) -> None:
    # 40 axes: 9 degrees apart, 200 m at a distance of 1273 m.
    (scan,) = scans(sensor(world_of(), rays=40, beam_deg=beam_deg), [MIDDLE])
    seen = FreeSpace(BOUNDS, CLEARANCE, RANGE, least_width_m=width_m)
    seen.update(scan)
    points = np.random.default_rng(3).uniform(0.0, 10_000.0, (20_000, 2))
    free = seen.contains(points)
    reach_m = min(width_m / math.radians(9.0 - beam_deg), RANGE)
    assert free.any()
    assert 0.8 * reach_m - FREE_CELL < np.hypot(*(points - MIDDLE).T)[free].max() <= reach_m + 1e-6


@settings(max_examples=examples(15))
@given(seed=SEEDS, rays=st.sampled_from([12, 90, 720]), heading=st.floats(0.0, 7.0))
def test_no_pole_stands_in_free_space_however_thin(seed: int, rays: int, heading: float) -> None:
    poles = np.random.default_rng(seed).uniform(2000.0, 8000.0, (12, 2))
    world = world_of(*(Circle(tuple(place), 0.01) for place in poles.tolist()))
    assert not fed(scans(sensor(world, rays=rays), [MIDDLE], heading_rad=heading)).contains(poles).any()


@pytest.mark.parametrize(("lost", "looks"), [(0.0, 1), (0.01, 1), (0.1, 2), (0.5, 7), (0.95, 90)])
def test_where_returns_get_lost_space_is_free_after_as_many_looks_as_make_a_miss_unlikely(
    lost: float, looks: int
) -> None:
    (scan,) = scans(sensor(world_of()), [MIDDLE])
    seen, place = FreeSpace(BOUNDS, CLEARANCE, RANGE, lost=lost), np.array([(5000.0, 6000.0)])
    for _ in range(looks - 1):
        seen.update(scan)
        assert not seen.contains(place).any()
    seen.update(scan)
    assert seen.contains(place).all()


@pytest.mark.parametrize("bearing", [0.0, 1.0, 2.5, math.pi, 4.0, 5.5])
@pytest.mark.parametrize("away", [400.0, 1200.0])
def test_what_has_appeared_hides_what_is_behind_it_on_both_its_sides_and_no_more(bearing: float, away: float) -> None:
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


@pytest.mark.parametrize("away", [(4000.0, 0.0), (-4000.0, 0.0), (0.0, 4000.0), (0.0, -4000.0)])
def test_the_border_belongs_to_the_area_on_all_four_sides(away: tuple[float, float]) -> None:
    seen = fed(scans(sensor(world_of()), [(MIDDLE[0] + away[0], MIDDLE[1] + away[1])]))
    assert seen.contains(np.add(MIDDLE, 1.25 * np.array([away]))).all()
    assert not seen.contains(np.add(MIDDLE, 1.26 * np.array([away]))).any()


def test_an_edge_takes_back_its_own_cell_where_beams_do_not_divide_a_full_circle() -> None:
    scan = sensor(world_of(), rays=7, field_of_view_deg=100.0).scan(5003.0, 6000.0, math.pi, 0.0)
    seen, edge = fed([scan]), np.array([(5000.0, 4500.0)])  # its cell's middle lies east of south, it west
    assert seen.take_back(scan, edge)
    assert not seen.contains(edge).any()
