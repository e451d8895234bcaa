"""Planners against each other on the same cases: differences with bootstrap intervals.

A pair is one case flown with the same aircraft by both planners. What the world, the weather and the seed do
to a flight is then in both halves of a pair and drops out of their difference.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from harness.campaign.table import IntArray, Runs
from harness.flight.record import FloatArray

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 9999
FEWEST_CASES: Final = 4
"""Least number of cases with an interval: with fewer, more than a fortieth of all resamples hold one case only."""
BATCH: Final = 500
"""Resamples in memory at a time."""

SEED: Final = 1
"""Seed of the resampling: the same runs give the same interval."""


@dataclass(frozen=True)
class Estimate:
    """A figure and its 95 % interval.

    Attributes:
        value: None where no pair gives one.
        low: lower end; None where there are fewer than `FEWEST_CASES`, or one value alone.
        high: upper end, likewise.
    """

    value: float | None = None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Duel:
    """Two planners on the cases that both flew.

    Attributes:
        first: kind of one planner.
        second: kind of the other.
        pairs: cases, times aircraft, that both flew.
        only_first: of them, those where only the first reached its goal.
        only_second: those where only the second did.
        success: share reached by the first less that of the second.
        both_reached: pairs where both did.
        length: flown length of the first over that of the second where both reached, geometric mean.
    """

    first: str
    second: str
    pairs: int
    only_first: int
    only_second: int
    success: Estimate
    both_reached: int
    length: Estimate


def duels(runs: Runs) -> tuple[Duel, ...]:
    """Every planner against every other, in the order in which they first appear."""
    flown: dict[str, dict[tuple[int, str], int]] = {}
    planners, aircraft = runs.names["planner"], runs.names["aircraft"]
    for row, planner in enumerate(planners):
        flown.setdefault(planner, {})[int(runs.case[row]), aircraft[row]] = row
    return tuple(_duel(runs, first, second, flown) for first, second in itertools.combinations(flown, 2))


def _duel(runs: Runs, first: str, second: str, flown: Mapping[str, Mapping[tuple[int, str], int]]) -> Duel:
    common = [case for case in flown[first] if case in flown[second]]
    ours = np.array([flown[first][case] for case in common], dtype=np.int64)
    theirs = np.array([flown[second][case] for case in common], dtype=np.int64)
    won, lost = runs.reached[ours], runs.reached[theirs]
    both = won & lost
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(runs.flown_length_m[ours][both] / runs.flown_length_m[theirs][both])
    finite, of_case = np.isfinite(logs), runs.case[ours]
    length = mean_estimate(logs[finite], of_case[both][finite])
    return Duel(
        first,
        second,
        pairs=len(common),
        only_first=int((won & ~lost).sum()),
        only_second=int((lost & ~won).sum()),
        success=mean_estimate(won.astype(np.float64) - lost, of_case),
        both_reached=int(both.sum()),
        length=Estimate(*(None if each is None else float(np.exp(each)) for each in _ends(length))),
    )


def mean_estimate(differences: FloatArray, cases: IntArray) -> Estimate:
    """The mean of paired differences with the percentile bootstrap interval over the cases.

    All pairs of a case, one an aircraft, are drawn together: they share its world, weather and seed. Efron and
    Tibshirani, An Introduction to the Bootstrap (1993), chapters 8 and 13.

    Args:
        differences: (n,) one a pair, all finite.
        cases: (n,) case of each.
    """
    if not len(differences):
        return Estimate()
    mean = float(differences.mean())
    different, index = np.unique(cases, return_inverse=True)
    if np.ptp(differences) == 0.0 or len(different) < FEWEST_CASES:
        return Estimate(mean)
    from scipy import stats

    interval = stats.bootstrap(
        (np.bincount(index, differences), np.bincount(index)),
        lambda sums, counts, axis: sums.sum(axis=axis) / counts.sum(axis=axis),
        paired=True,
        vectorized=True,
        confidence_level=CONFIDENCE,
        n_resamples=RESAMPLES,
        batch=BATCH,
        method="percentile",
        rng=np.random.default_rng(SEED),
    ).confidence_interval
    return Estimate(mean, float(interval.low), float(interval.high))


def _ends(estimate: Estimate) -> tuple[float | None, float | None, float | None]:
    return estimate.value, estimate.low, estimate.high
