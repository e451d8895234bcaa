"""Rare failures of planted systems: the estimate is unbiased, its bounds cover, and it takes far fewer flights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np
import pytest

from harness.certification.rare import Point, Severity, rare

BELL = NormalDist()


def planted(rate: float, keys: int, calls: list[int] | None = None) -> Severity:
    """Fails with exactly this probability: where a weighted sum of all quantities is above a threshold."""
    weights = np.arange(1.0, keys + 1.0) / math.sqrt(sum(k * k for k in range(1, keys + 1)))
    threshold = BELL.inv_cdf(1.0 - rate)

    def severity(points: Sequence[Point]) -> Sequence[float]:
        if calls is not None:
            calls.append(len(points))
        sums = np.array([point.normal for point in points]) @ weights
        return list(np.where(sums >= threshold, math.inf, sums))

    return severity


@pytest.mark.parametrize("rate", [1e-2, 1e-4])
def test_the_estimate_is_near_and_takes_far_fewer_flights_than_plain_sampling(rate: float) -> None:
    found = [rare(planted(rate, 3), 3, seed, 0.95) for seed in range(12)]
    estimates = np.array([each.probability for each in found])
    spread = float(estimates.std(ddof=1)) / rate
    assert float(estimates.mean()) == pytest.approx(rate, rel=4.0 * spread / math.sqrt(len(found)))
    flights = np.mean([each.flights for each in found])
    plain = (1.0 - rate) / rate / spread**2  # flights of plain sampling with the same relative error
    assert plain > (20.0 if rate == 1e-4 else 3.0) * flights
    assert all(each.low <= each.probability <= each.high for each in found)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [1e-1, 1e-2, 1e-3, 1e-4])
def test_each_bound_covers_the_rate(rate: float) -> None:
    found = [rare(planted(rate, 3), 3, seed, 0.95) for seed in range(400)]
    assert sum(each.low <= rate for each in found) >= 0.93 * len(found)
    assert sum(each.high >= rate for each in found) >= 0.93 * len(found)


def test_where_nothing_fails_the_upper_bound_is_that_of_the_days_drawn() -> None:
    calls: list[int] = []
    found = rare(never(calls), 2, 1, 0.95)
    assert (found.probability, found.low) == (0.0, 0.0)
    assert found.high == pytest.approx(1.0 - 0.05 ** (1 / 1000), rel=1e-6)
    assert found.flights == sum(calls)


def never(calls: list[int]) -> Severity:
    """Never fails, and no day is nearer to it than another."""

    def severity(points: Sequence[Point]) -> Sequence[float]:
        calls.append(len(points))
        return [0.0] * len(points)

    return severity
