"""What a scan looked through, against bearings that are exact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.mapping.cleared_space import NEARLY_RAD, nearly_towards, through_cells, through_places

RAYS = 48
SEED = st.integers(0, 2**32 - 1)


@given(
    bearing=st.one_of(st.floats(0.0, math.tau), st.integers(0, 16).map(lambda part: part * math.pi / 8.0)),
    start=st.floats(0.0, math.tau, exclude_max=True),
    spacing=st.floats(2.1 * NEARLY_RAD, 2.0),
)
def test_the_ray_that_is_found_is_the_one_towards_a_place_or_next_to_it(
    bearing: float, start: float, spacing: float
) -> None:
    east, north = 700.0 * math.sin(bearing), 700.0 * math.cos(bearing)
    exact = (math.atan2(east, north) - start) % math.tau / spacing
    found = nearly_towards(east, north, start, spacing)
    # Bearings just before the first ray come a turn after it.
    assert any(abs(found - round(exact + turns * math.tau / spacing)) <= 1 for turns in (-1, 0, 1))


def test_a_place_where_the_sensor_is_has_some_ray() -> None:
    assert nearly_towards(0.0, 0.0, 1.0, 0.1) >= 0


@pytest.mark.parametrize(("field_rad", "rays"), [(math.tau, RAYS), (2.0, RAYS), (0.02, 2_000)])
@settings(max_examples=20)
@given(seed=SEED)
def test_cells_are_looked_through_where_all_rays_about_them_went_beyond(
    field_rad: float, rays: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    spacing, closed, cell, reach = field_rad / rays, field_rad == math.tau, 50.0, 450.0
    start, x_first, y_first = rng.uniform(0.0, math.tau), *rng.uniform(-420.0, -380.0, 2)
    ranges = rng.choice([150.0, 300.0, math.inf], rays, p=[0.1, 0.1, 0.8])
    disc = rng.random((16, 16)) < 0.9
    before = rng.random((16, 16)) < 0.1
    seen = before.copy()
    through_cells(seen, disc, ranges, x_first, y_first, cell, start, spacing, closed, reach, 5.0)
    half = 0.75 * cell
    for column, row in np.ndindex(seen.shape):
        x, y = (column + 0.5) * cell + x_first, (row + 0.5) * cell + y_first
        away = math.hypot(x, y)
        ray = round((math.atan2(x, y) - start) % math.tau / spacing)
        level = math.ceil(half / spacing / max(away, half)) + 1
        wide = 2 ** (level.bit_length())
        about = np.arange(ray - wide + 1, ray + wide)
        free = away + half + 5.0 < reach and (closed or level <= ray < rays - level)
        free = free and bool((ranges[about % rays] > away + half + 5.0).all())
        assert seen[column, row] == (before[column, row] or (disc[column, row] and free))


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
        through, places, ranges, 0.0, 0.0, start, spacing, False, 900.0, 1.0, 2, math.inf, 1
    )
    expected = [bool((ranges[ray - 2 : ray + 3] == math.inf).all()) for ray in asked.tolist()]
    assert through.tolist() == expected
    assert many == sum(expected) >= 50
