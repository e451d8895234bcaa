"""What a scan looked through, against bearings that are exact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from harness.mapping.cleared_space import through_cells, through_places
from planner.interface import BoolArray, FloatArray
from tests.examples import examples

RAYS = 48
SEED = st.integers(0, 2**32 - 1)


def through(
    ranges: FloatArray,
    spacing: float,
    beam: float,
    at: tuple[float, float],
    start: float,
    *,
    cell: float = 50.0,
    reach: float = 450.0,
    closed: bool = True,
    disc: BoolArray | None = None,
    seen: BoolArray | None = None,
    looks: NDArray[np.uint8] | None = None,
    aside: int = 0,
    needed: int = 1,
) -> BoolArray:
    """(16, 16) which of the cells from a corner on are seen to be free."""
    seen = np.zeros((16, 16), dtype=np.bool_) if seen is None else seen.copy()
    looks = np.zeros((16, 16), dtype=np.uint8) if looks is None else looks
    disc = np.ones((16, 16), dtype=np.bool_) if disc is None else disc
    grid = (ranges, *at, cell, start, spacing, beam, closed, reach, 5.0, aside, needed)
    through_cells(seen, looks, disc, *grid)
    return seen


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0, 1.7])
@pytest.mark.parametrize(("field_rad", "rays"), [(math.tau, RAYS), (2.0, RAYS), (0.02, 2_000)])
@settings(max_examples=examples(10))
@given(seed=SEED)
def test_cells_are_looked_through_where_all_beams_that_meet_them_went_beyond(
    field_rad: float, rays: int, share: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    spacing, closed, half = field_rad / rays, field_rad == math.tau, 0.75 * 50.0
    start, at = rng.uniform(0.0, math.tau), tuple(rng.uniform(-420.0, -380.0, 2).tolist())
    ranges = rng.choice([150.0, 300.0, math.inf], rays, p=[0.1, 0.1, 0.8])
    disc, before = rng.random((16, 16)) < 0.9, rng.random((16, 16)) < 0.1
    seen = through(ranges, spacing, share * spacing, at, start, closed=closed, disc=disc, seen=before)
    for column, row in np.ndindex(seen.shape):
        x, y = (column + 0.5) * 50.0 + at[0], (row + 0.5) * 50.0 + at[1]
        away = math.hypot(x, y)
        if before[column, row] or not disc[column, row] or away + half + 5.0 >= 450.0:
            assert seen[column, row] == before[column, row]
            continue
        wide = math.asin(min(half / away, 1.0)) if away > half else math.pi
        axes = np.arange(-rays, 2 * rays) if closed else np.arange(rays)
        off = (axes * spacing - (math.atan2(x, y) - start) % math.tau + math.pi) % math.tau - math.pi
        meets = np.abs(off) <= wide + 0.5 * share * spacing - 1e-9
        blocked = bool((ranges[axes[meets] % rays] <= away + half + 5.0).any())
        assert not (seen[column, row] and blocked and share <= 1.0)
        if not blocked and share == 1.0 and closed:
            assert seen[column, row]


def test_where_returns_get_lost_several_looks_in_a_row_are_needed() -> None:
    spacing = math.tau / 12
    nothing, something = np.full(12, math.inf), np.full(12, math.inf)
    something[3] = 200.0
    looks = np.zeros((16, 16), dtype=np.uint8)
    at = (-400.0, -400.0)
    for ranges, free in (
        (nothing, 0),
        (nothing, 0),
        (something, 1),
        (nothing, 1),
        (nothing, 1),
        (nothing, 2),
    ):
        seen = through(ranges, spacing, spacing, at, 0.0, aside=1, needed=3, looks=looks)
        # 200 m to the east something was met: there it begins anew.
        assert [seen[4, 8], seen[11, 8]] == [free > 0, free > 1]


@given(seed=SEED)
def test_rays_that_are_finer_than_bearings_that_err_are_told_apart(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rays, spacing, start = 100_000, 1.7e-7, 1.0
    ranges = np.full(rays, 50.0)
    gaps = rng.integers(10, rays - 10, 50)
    for gap in gaps.tolist():
        ranges[gap - 2 : gap + 3] = math.inf
    asked = np.concatenate((gaps, rng.integers(10, rays - 10, 50)))
    places = 100.0 * np.exp(1j * (math.pi / 2 - start - spacing * asked))
    through = np.zeros(len(places), dtype=np.bool_)
    many = through_places(
        through, places, ranges, 0.0, 0.0, start, spacing, 0.0, False, 900.0, 1.0, 2, math.inf, 1
    )
    expected = [bool((ranges[ray - 2 : ray + 3] == math.inf).all()) for ray in asked.tolist()]
    assert through.tolist() == expected
    assert many == sum(expected) >= 50
