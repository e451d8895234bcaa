"""What a scan looked through, against a loop over places and rays."""

from __future__ import annotations

import cmath
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPoint, Point, unary_union

from harness.mapping.scan import RangeScan
from harness.mapping.scan_comparison import (
    cleared_space,
    come,
    drawn_back,
    grown,
    joined,
    near_any,
    near_line,
)
from harness.mapping.scan_matching import FEWEST, nearest

RAYS, RANGE = 60, 1000.0
AT = complex(300.0, -200.0)


def scan_of(ranges: np.ndarray[tuple[int], np.dtype[np.float64]], fan_rad: float) -> RangeScan:
    """From north on, clockwise."""
    spacing = fan_rad / (RAYS if fan_rad == math.tau else RAYS - 1)
    fan = 1j * np.exp(-1j * spacing * np.arange(RAYS))
    return RangeScan(0.0, 0.0, AT.real, AT.imag, 0.0, 0.0, spacing, fan, ranges, RANGE)


@given(
    seed=st.integers(0, 2**32 - 1),
    fan_rad=st.sampled_from((math.tau, math.pi)),
    abreast=st.integers(1, 3),
    aimed_m=st.sampled_from((math.inf, 10.0)),
    within_m=st.sampled_from((math.inf, 700.0)),
)
def test_a_place_is_looked_through_where_the_rays_about_it_went_beyond(
    seed: int, fan_rad: float, abreast: int, aimed_m: float, within_m: float
) -> None:
    rng = np.random.default_rng(seed)
    ranges = rng.choice([rng.uniform(50.0, RANGE), math.inf, 600.0], RAYS)
    scan, sure_m = scan_of(ranges, fan_rad), 20.0
    places = AT + rng.uniform(1.0, 1100.0, 40) * np.exp(1j * rng.uniform(-math.pi, math.pi, 40))
    through = cleared_space(scan, places, sure_m, abreast, aimed_m, within_m)
    for place, seen in zip(places.tolist(), through.tolist(), strict=True):
        away = abs(place - AT)
        clockwise = (math.pi / 2 - cmath.phase(place - AT)) % math.tau
        ray = round(clockwise / scan.spacing_rad)
        about = range(ray - abreast, ray + abreast + 1)
        if fan_rad < math.tau and not 0 <= about[0] <= about[-1] < RAYS:
            assert not seen
            continue
        beyond = all(min(ranges[each % RAYS], RANGE) > away + sure_m for each in about)
        aimed = abs(clockwise - ray * scan.spacing_rad) * away < aimed_m
        assert seen == (beyond and aimed and away < within_m)


def test_of_no_places_none_was_looked_through() -> None:
    none = np.zeros(0, dtype=np.complex128)
    assert cleared_space(scan_of(np.full(RAYS, math.inf), math.tau), none, 1.0).tolist() == []


@pytest.mark.parametrize("north", [True, False])
def test_the_ends_of_a_whole_round_are_joined(north: bool) -> None:
    ranges = np.full(RAYS, math.inf)
    ranges[-1 if north else 0] = 100.0
    place = AT + cmath.rect(500.0, math.pi / 2 + (0.0 if north else 1.0) * math.tau / RAYS)
    assert not cleared_space(scan_of(ranges, math.tau), np.array([place]), 1.0).any()


@pytest.mark.parametrize("several", [1, 2, FEWEST])
def test_few_places_in_a_row_tell_nothing(several: int) -> None:
    """One or two places of a still wall may seem to be looked through: nothing has come there, or drawn back."""
    ranges = np.full(RAYS, 500.0)
    ranges[21 : 26 + several] = 900.0  # so many, and what lies abreast of them
    scan = scan_of(ranges, math.tau)
    bearings = math.pi / 2 - scan.spacing_rad * np.arange(RAYS)
    were = AT + 500.0 * np.exp(1j * bearings)
    assert np.count_nonzero(cleared_space(scan, were, 20.0)) == several + 1
    for shift in range(FEWEST):
        shifted = np.roll(were, shift)
        sampled = cleared_space(scan, shifted, 20.0)[::FEWEST].any()
        assert come(scan, shifted, 20.0).any() == sampled
        assert drawn_back(shifted, scan, 20.0, 1000.0).any() == sampled
    assert several + 1 < FEWEST or sampled


@given(seed=st.integers(0, 2**32 - 1), within_m=st.floats(1.0, 200.0), count=st.integers(0, 30))
def test_near_is_what_is_no_further_from_any(seed: int, within_m: float, count: int) -> None:
    rng = np.random.default_rng(seed)
    places, others = (rng.uniform(-300, 300, n) + 1j * rng.uniform(-300, 300, n) for n in (20, count))
    away = np.abs(np.subtract.outer(places, others)).min(axis=1, initial=math.inf)
    np.testing.assert_array_equal(near_any(places, others, within_m), away <= within_m)


@given(
    seed=st.integers(0, 2**32 - 1),
    within_m=st.floats(1.0, 200.0),
    apart_m=st.floats(0.0, 500.0),
    count=st.integers(0, 12),
)
def test_near_a_line_is_what_is_no_further_from_one_of_its_pieces(
    seed: int, within_m: float, apart_m: float, count: int
) -> None:
    rng = np.random.default_rng(seed)
    places, line = (rng.uniform(-300, 300, n) + 1j * rng.uniform(-300, 300, n) for n in (20, count))
    pieces = [
        LineString([(p.real, p.imag), (q.real, q.imag)]) for p, q in pairwise(line) if abs(q - p) <= apart_m
    ]
    shape = MultiPoint([(p.real, p.imag) for p in line]).union(unary_union(pieces))
    wanted = [not shape.is_empty and shape.distance(Point(p.real, p.imag)) <= within_m for p in places]
    np.testing.assert_array_equal(near_line(places, line, within_m, apart_m), wanted)


@pytest.mark.parametrize("turned", range(0, RAYS, 7))
def test_what_goes_on_without_a_step_belongs_to_it_also_where_the_fan_begins(turned: int) -> None:
    """A face of 20 rays, nearer than what is beside it; two returns of it are missing."""
    ranges = np.roll(np.where(np.arange(RAYS) < 20, 100.0, 400.0), turned)
    ranges[(turned + np.array([7, 8])) % RAYS] = math.inf
    scan = scan_of(ranges, math.tau)
    hits = (ranges < math.inf).nonzero()[0]
    inner = np.searchsorted(hits, np.array([turned + 4, turned + 5]) % RAYS)
    face = hits[grown(inner, hits, scan.ends_m(hits), 40.0, scan)]
    expected = [(turned + i) % RAYS for i in range(20) if i not in (7, 8)]
    np.testing.assert_array_equal(face, expected)
    # All round it never ends: each return once.
    whole = scan_of(np.full(RAYS, 100.0), math.tau)
    every = grown(np.array([turned]), np.arange(RAYS), whole.ends_m(np.arange(RAYS)), 40.0, whole)
    assert sorted(every) == list(range(RAYS))


def test_a_narrow_fan_ends_where_it_ends() -> None:
    scan = scan_of(np.full(RAYS, 100.0), math.pi)
    face = grown(np.array([3]), np.arange(RAYS), scan.ends_m(np.arange(RAYS)), 40.0, scan)
    np.testing.assert_array_equal(face, np.arange(RAYS))


def test_a_place_away_from_those_before_and_after_it_is_not_joined_to_them() -> None:
    places = np.array([0.0, 1.0, 30.0 + 5j, 2.0, 3.0, 90.0])
    np.testing.assert_array_equal(
        joined(places + 0j, np.full(6, 5.0)), [True, True, False, True, True, False]
    )


@settings(max_examples=25, derandomize=True)
@given(seed=st.integers(0, 10_000), places=st.integers(0, 40), points=st.integers(1, 40))
def test_the_nearest_of_some_points(seed: int, places: int, points: int) -> None:
    rng = np.random.default_rng(seed)
    here, there = (rng.normal(size=n) + 1j * rng.normal(size=n) for n in (places, points))
    away = np.abs(np.subtract.outer(here, there))
    assert nearest(here, there).tolist() == (away.argmin(axis=1).tolist() if places else [])
