import math
from typing import Any

import numpy as np
import pytest

from harness.scenario.sections import Sensor
from harness.world.range_sensor import RangeSensor
from harness.world.world import Circle, Obstacle, World
from planner.interface import FloatArray

BOUNDS = (0.0, 0.0, 100_000.0, 100_000.0)
EMPTY = World([], BOUNDS)
ROOM = World([Obstacle(Circle((0.0, 0.0), 600.0))], BOUNDS)  # seen from its centre, every ray returns 600 m


def sensor(world: World, seed: int = 1, **keys: Any) -> RangeSensor:
    return RangeSensor(world, Sensor(**{"range_m": 1000.0} | keys), np.random.SeedSequence(seed))


def ranges(world: World, scans: int = 1, seed: int = 1, **keys: Any) -> FloatArray:
    """(scans, n) ranges of one sensor that stands at the origin."""
    source = sensor(world, seed, **keys)
    return np.array([source.scan(0.0, 0.0, 0.0, 0.5 * number).ranges_m for number in range(scans)])


def test_noise_is_gaussian_about_the_true_range() -> None:
    noisy = ranges(ROOM, scans=200, range_noise_m=5.0) - 600.0
    count = noisy.size
    assert noisy.mean() == pytest.approx(0.0, abs=5 * 5.0 / math.sqrt(count))
    assert noisy.std() == pytest.approx(5.0, abs=5 * 5.0 / math.sqrt(2 * count))
    for sigmas, share in ((1.0, 0.682689), (2.0, 0.954500), (3.0, 0.997300)):
        assert (np.abs(noisy) < sigmas * 5.0).mean() == pytest.approx(share, abs=5 * 0.5 / math.sqrt(count))
    assert abs(np.corrcoef(noisy[:, :-1].ravel(), noisy[:, 1:].ravel())[0, 1]) < 5 / math.sqrt(count)
    assert abs(np.corrcoef(noisy[:-1].ravel(), noisy[1:].ravel())[0, 1]) < 5 / math.sqrt(count)


def test_noise_neither_makes_a_range_negative_nor_longer_than_the_range() -> None:
    close = ranges(World([Obstacle(Circle((0.0, 0.0), 1.0))], BOUNDS), scans=20, range_noise_m=5.0)
    assert close.min() == 0.0
    assert (close == 0.0).mean() == pytest.approx(0.5793 - 0.1586, abs=0.02)  # Phi(-1 / 5)
    edge = ranges(ROOM, scans=20, range_m=600.0, range_noise_m=5.0)
    assert np.isinf(edge).mean() == pytest.approx(0.5, abs=0.02)
    assert edge[np.isfinite(edge)].max() <= 600.0
    assert np.isinf(ranges(EMPTY, range_noise_m=5.0)).all()


def test_false_returns_are_spread_evenly_over_the_range() -> None:
    scans = ranges(EMPTY, scans=200, false_return=0.2)
    returned = scans[np.isfinite(scans)]
    assert returned.size / scans.size == pytest.approx(0.2, abs=5 * 0.4 / math.sqrt(scans.size))
    assert returned.min() > 0.0
    assert returned.max() <= 1000.0
    shares, _ = np.histogram(returned, bins=10, range=(0.0, 1000.0))
    np.testing.assert_allclose(shares / returned.size, 0.1, atol=5 * 0.3 / math.sqrt(returned.size))
    np.testing.assert_array_equal(ranges(ROOM, scans=200, false_return=0.2, dropout=1.0), scans)


def test_each_imperfection_has_a_stream_of_its_own() -> None:
    noisy = ranges(ROOM, scans=5, range_noise_m=5.0)
    lost = np.isinf(ranges(ROOM, scans=5, dropout=0.3))
    false = ranges(EMPTY, scans=5, false_return=0.2)
    every = ranges(ROOM, scans=5, range_noise_m=5.0, dropout=0.3, false_return=0.2)
    np.testing.assert_array_equal(every, np.where(np.isfinite(false), false, np.where(lost, math.inf, noisy)))
    chances = [(noisy > 600.0).ravel(), lost.ravel(), np.isfinite(false).ravel()]
    assert np.abs(np.corrcoef(chances) - np.eye(3)).max() < 5 / math.sqrt(noisy.size)
