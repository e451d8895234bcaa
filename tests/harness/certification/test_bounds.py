"""Bounds of a probability: against closed forms, an integral done by numpy, and planted systems of known rate."""

import math
from functools import cache

import numpy as np
import pytest

from harness.certification import certification
from harness.certification.bounds import clopper_pearson, lognormal_bounds, sequential_bounds, verdict
from harness.certification.certification import DayCount, Terms

CONFIDENCE = 0.95
REPETITIONS = 400
MOST_MISSED = 0.07
"""A bound at 95 % misses in at most 5 % of the repetitions; with 400 of them, 7 % are two standard errors more."""


def binomial_tail(runs: int, most: int, rate: float) -> float:
    return sum(math.comb(runs, k) * rate**k * (1 - rate) ** (runs - k) for k in range(most + 1))


def test_where_all_held_the_lower_bound_is_the_root_of_the_doubt() -> None:
    for runs in (1, 12, 286, 3000):
        low, high = clopper_pearson(runs, runs, CONFIDENCE)
        assert low == pytest.approx(0.05 ** (1 / runs), rel=1e-9)
        assert high == 1.0
    assert 100 * (1 - clopper_pearson(286, 286, CONFIDENCE)[0]) == pytest.approx(1.042, abs=1e-3)


@pytest.mark.parametrize(("held", "runs"), [(90, 100), (1, 7), (299, 300)])
def test_at_each_bound_the_outcome_is_as_unlikely_as_the_doubt(held: int, runs: int) -> None:
    low, high = clopper_pearson(held, runs, CONFIDENCE)
    failed = runs - held
    assert binomial_tail(runs, failed, 1 - low) == pytest.approx(0.05, rel=1e-6)
    assert 1 - binomial_tail(runs, failed - 1, 1 - high) == pytest.approx(0.05, rel=1e-6)


def test_bounds_of_lognormal_estimates_are_those_of_olsson() -> None:
    """Of logarithms -4, -5, -6: mean -5, variance 1, so the middle -4.5; Student's t at 95 % with 2 free is 2.91999."""
    wide = 2.919986 * math.sqrt(1.0 / 3.0 + 1.0 / (2.0 * 2.0))
    low, high = lognormal_bounds(np.exp([-4.0, -5.0, -6.0]), CONFIDENCE)
    assert (low, high) == pytest.approx((math.exp(-4.5 - wide), math.exp(-4.5 + wide)), rel=1e-5)


@pytest.mark.parametrize(("held", "runs"), [(0, 5), (90, 100), (100, 100), (297, 300)])
def test_sequential_bounds_lie_where_the_averaged_likelihood_is_as_many_times_as_large(held: int, runs: int) -> None:
    failed = runs - held
    low, high = sequential_bounds(held, runs, CONFIDENCE)
    assert low < held / runs + 1e-12
    assert high > held / runs - 1e-12
    # Rates f = sin(x)^2 are evenly spread in x under Jeffreys' prior.
    for bound, above in ((1 - low, False), (1 - high, True)):
        if not (failed if above else held):
            assert bound == (0.0 if above else 1.0)
            continue
        edge = math.asin(math.sqrt(bound))
        x = np.linspace(*((edge, math.pi / 2) if above else (0.0, edge)), 400_001)
        x = 0.5 * (x[1:] + x[:-1])
        f = np.sin(x) ** 2
        ratio = np.exp(failed * (np.log(f) - math.log(bound)) + held * (np.log1p(-f) - math.log1p(-bound))).mean()
        assert ratio == pytest.approx(20.0, rel=1e-4)
        judged = [verdict(held, runs, 1.0 - bound + more, CONFIDENCE) for more in (-1e-6, 1e-6)]
        assert judged == (["undecided", "refuted"] if above else ["shown", "undecided"])


@pytest.mark.parametrize("rate", [1e-1, 1e-2, 1e-3, 1e-4])
def test_a_claim_that_is_just_true_is_rarely_decided_at_any_look(rate: float) -> None:
    rng = np.random.default_rng(round(1 / rate))
    looks = np.unique(np.geomspace(1, 20_000, 300).astype(int))
    wrong = {"shown": 0, "refuted": 0}
    judged = cache(verdict)
    for _ in range(REPETITIONS):
        failed = np.cumsum(rng.random(looks[-1]) < rate)[looks - 1]
        said = {judged(int(n - k), int(n), 1 - rate, CONFIDENCE) for n, k in zip(looks, failed, strict=True)}
        for each in said & wrong.keys():
            wrong[each] += 1
    assert max(wrong.values()) <= MOST_MISSED * REPETITIONS


@pytest.mark.parametrize("rate", [1e-1, 1e-2, pytest.param(1e-3, marks=pytest.mark.slow)])
def test_bounds_at_the_day_that_decides_cover_the_rate(rate: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certification, "verdict", cache(verdict))
    rng = np.random.default_rng(round(7 / rate))
    missed = np.zeros(2, dtype=int)
    for _ in range(REPETITIONS):
        tally = DayCount(Terms(probability=1 - 2 * rate, confidence=CONFIDENCE))
        for run, failed in enumerate(rng.random(round(20 / rate)) < rate):
            tally.add(run, not failed)
            if tally.decided:
                break
        low, high = sequential_bounds(tally.held, tally.runs, CONFIDENCE)
        missed += low > 1 - rate, high < 1 - rate
    assert max(missed) <= MOST_MISSED * REPETITIONS


def test_days_count_in_their_order_and_none_after_the_one_that_decides() -> None:
    rng = np.random.default_rng(3)
    held = (rng.random(200) < 0.97).tolist()
    terms = Terms(probability=0.8, confidence=CONFIDENCE)
    in_order, shuffled = DayCount(terms), DayCount(terms)
    for run, each in enumerate(held):
        in_order.add(run, each)
    for run in rng.permutation(200).tolist():
        shuffled.add(run, held[run])
    assert in_order.decided
    assert in_order.runs < 200
    assert (in_order.runs, in_order.held) == (shuffled.runs, shuffled.held)
