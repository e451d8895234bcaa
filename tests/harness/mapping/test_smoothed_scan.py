"""Quieter scans against those of a sensor without errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from harness.mapping.scan import RangeScan
from harness.mapping.smoothed_scan import ERR, find_medians, smoothed
from harness.world.obstacle import Circle
from tests.harness.sensing import CLEARANCE, RANGE, block, flight, sensor, world_of

NOISE = 0.01 * RANGE
PLACE = (3000.0, 2000.0)


def scans(*shapes: object, count: int = 40, **keys: float) -> list[RangeScan]:
    """Scans from one place."""
    eye = sensor(world_of(*shapes), **keys)  # type: ignore[arg-type]
    return [*flight(eye, 0.5 * count, PLACE, speed=0.0)]


@pytest.mark.parametrize(("away_m", "share"), [(1200.0, ERR), (400.0, 0.4), (150.0, 0.25)])
def test_errors_shrink_the_more_the_nearer(away_m: float, share: float) -> None:
    ring = Circle(PLACE, away_m)
    errors = (
        np.array([smoothed(scan, CLEARANCE).ranges_m for scan in scans(ring, range_noise_m=NOISE)]) - away_m
    )
    assert errors.std() < 1.1 * share * NOISE
    assert abs(errors.mean()) < 0.05 * NOISE


def test_lost_and_false_returns_hardly_count() -> None:
    wall = block(2000.0, 2400.0, 4000.0, 2500.0)
    (exact,) = scans(wall, count=1)
    there = np.isfinite(exact.ranges_m)
    wall_ends = np.convolve(np.diff(there, append=there[0]), np.ones(11), "same") > 0.0
    inside, outside = there & ~wall_ends, ~there & ~wall_ends
    assert min(inside.sum(), outside.sum()) > 100
    quiet = np.array(
        [smoothed(scan, CLEARANCE).ranges_m for scan in scans(wall, dropout=0.1, false_return=0.01)]
    )
    assert np.isinf(quiet[:, outside]).all()
    assert np.isinf(quiet[:, inside]).mean() < 0.02
    off = quiet[:, inside] / exact.ranges_m[inside] - 1.0
    assert np.abs(off[np.isfinite(off)]).max() < 0.06


def test_steps_stay_where_they_are() -> None:
    (exact,) = scans(Circle((3000.0, 2250.0), 60.0), block(2000.0, 2600.0, 4000.0, 2700.0), count=1)
    quiet = smoothed(exact, CLEARANCE).ranges_m
    steps, kept = (
        np.flatnonzero(np.abs(np.diff(np.minimum(ranges, RANGE))) > 100.0)
        for ranges in (exact.ranges_m, quiet)
    )
    assert len(steps) == 4
    np.testing.assert_array_equal(kept, steps)


def test_medians_are_those_of_what_was_returned() -> None:
    rng = np.random.default_rng(3)
    ring = np.where(rng.random(400) < 0.4, math.inf, rng.uniform(0.0, 100.0, 400).round())
    for width in (5, 9, 33):
        rays = np.arange(0, 400 - width, 3)
        medians = np.empty(len(rays))
        find_medians(medians, ring, rays, 0, width)
        for ray, median in zip(rays.tolist(), medians.tolist(), strict=True):
            returned = sorted(ring[ray : ray + width][np.isfinite(ring[ray : ray + width])].tolist())
            lower = returned[(len(returned) - 1) // 2] if 2 * len(returned) > width else math.inf
            assert median == lower
