"""Planners against each other on the same cases: differences of each figure with intervals and a paired test.

A pair is one case flown with the same aircraft by both planners: world, weather and seed drop out of the difference.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from harness.analysis.metric import number
from harness.analysis.registry import METRICS
from harness.flight.record import FloatArray, IntArray

BOOTSTRAP_CONFIDENCE: Final = 0.95  # confidence of the interval of a mean difference
RESAMPLES: Final = 1999  # number of resamples of the cases, drawn for an interval
MIN_CASES: Final = 4
"""With fewer cases there is no interval, since more than a fortieth of all resamples would hold one case only."""
MOST_EXACT: Final = 13  # the test is exact up to this many cases
RESAMPLING_SEED: Final = 1  # a fixed seed, so that the same runs give the same interval
TESTED: Final = tuple(each for each in METRICS if each.title and each.short and each.worse and not each.rare)
"""Figures of the registry that are compared: people are shown them, and more or less of them is worse."""


@dataclass(frozen=True)
class Estimate:
    """A mean with its bootstrap interval, each None where it is unknown."""

    value: float | None = None
    low: float | None = None
    high: float | None = None

    def text(self) -> str:
        """Returns mean and interval as people are shown them."""
        value, *ends = (
            "" if each is None else f"{'+' if each > 0 else ''}{number(each)}"
            for each in (self.value, self.low, self.high)
        )
        return f"{value} ({' to '.join(ends)})" if all(ends) else value


@dataclass(frozen=True)
class Tested:
    """One figure of two planners on the pairs where both have it: their means, in the unit of the label."""

    figure: str
    pairs: int
    first: float
    second: float
    difference: Estimate  # mean of the first less the second, with its bootstrap interval over the cases
    p: float | None
    """P-value of Wilcoxon's signed-rank test over the cases (two-sided), corrected by Holm's method over all figures;
    None where all pairs agree or there are fewer than `MIN_CASES`."""


@dataclass(frozen=True)
class Duel:
    """Two planners on the pairs (cases, times aircraft) that both flew, counted by who reached the goal.

    `figures`: the share of goals reached, in percent, then each figure of `TESTED` that both have.
    """

    first: str
    second: str
    pairs: int
    only_first: int
    only_second: int
    both_reached: int
    figures: tuple[Tested, ...]
    cases: int  # different ones among the pairs

    @property
    def tells(self) -> bool:
        """Whether that many cases, were they all to differ one way, could bring a corrected p-value below 0.05."""
        return max(1, sum(each.p is not None for each in self.figures)) * 2.0 ** (1 - self.cases) < 0.05


def duels(
    planners: Sequence[str], cases: Sequence[Any], reached: Sequence[bool], figures: Mapping[str, FloatArray]
) -> tuple[Duel, ...]:
    """Compares every planner with every other, in the order in which they first appear.

    `cases` tells what a pair has in common: case, perhaps aircraft. `figures` are by name, NaN where a run has none.
    """
    flown: dict[str, dict[Any, int]] = {}
    for row, (planner, case) in enumerate(zip(planners, cases, strict=True)):
        flown.setdefault(planner, {})[case] = row
    held, found = np.array(reached, dtype=bool), []
    every = {"goals reached, %": 100.0 * held}
    for each in TESTED:
        if each.name in figures:
            unit, percent = (", %", 100.0) if each.kind == "bool" else ("", 1.0)
            every[each.label + unit] = figures[each.name] * each.factor * percent
    for first, second in itertools.combinations(flown, 2):
        if not (common := [case for case in flown[first] if case in flown[second]]):
            continue
        rows = np.array([[flown[name][case] for case in common] for name in (first, second)], dtype=int)
        won, lost = held[rows]
        names, numbers = np.unique([str(case[0]) for case in common], return_inverse=True)
        tested = [_test(label, values[rows], numbers) for label, values in every.items()]
        counts = (len(common), int((won & ~lost).sum()), int((lost & ~won).sum()), int((won & lost).sum()))
        found.append(Duel(first, second, *counts, _correct([*filter(None, tested)]), len(names)))
    return tuple(found)


def _test(label: str, halves: FloatArray, cases: IntArray) -> Tested | None:
    """Compares one figure (2, n) of both planners over the cases (n,); None where no pair has it."""
    from scipy import stats

    if not (known := np.isfinite(halves).all(axis=0)).any():
        return None
    ours, theirs = halves[:, known]
    _, index = np.unique(cases[known], return_inverse=True)
    means = np.bincount(index, ours - theirs) / np.bincount(index)
    tells = len(means) >= MIN_CASES and bool(np.any(means != 0.0))
    p = float((_exact if len(means) <= MOST_EXACT else stats.wilcoxon)(means).pvalue) if tells else None
    estimate = mean_estimate(ours - theirs, index)
    return Tested(label, len(ours), float(ours.mean()), float(theirs.mean()), estimate, p)


def _exact(differences: FloatArray) -> Any:
    """Tries all signs, as `scipy.stats.wilcoxon` does where there are ties or zeros, but all at once."""
    from scipy import stats

    def rank_sum(signed: FloatArray, axis: int) -> Any:
        ranks = stats.rankdata(np.abs(signed), axis=axis) - np.sum(signed == 0.0, axis=axis, keepdims=True)
        return np.sum(ranks * (signed > 0.0), axis=axis)

    return stats.permutation_test((differences,), rank_sum, permutation_type="samples")


def _correct(tested: Sequence[Tested]) -> tuple[Tested, ...]:
    """Returns the same with p-values corrected by Holm's method (Scandinavian Journal of Statistics 6, 1979)."""
    order = sorted((each.p, place) for place, each in enumerate(tested) if each.p is not None)
    raised = (min(1.0, (len(order) - rank) * p) for rank, (p, _) in enumerate(order))
    corrected = dict(zip((place for _, place in order), itertools.accumulate(raised, max), strict=True))
    return tuple(replace(each, p=corrected.get(place)) for place, each in enumerate(tested))


def mean_estimate(differences: FloatArray, cases: IntArray) -> Estimate:
    """Returns the mean of finite paired differences (n,), with its percentile bootstrap interval over the cases.

    All pairs of a case are drawn together. Efron and Tibshirani, An Introduction to the Bootstrap (1993), ch. 8 and 13.
    """
    mean = float(differences.mean())
    different, index = np.unique(cases, return_inverse=True)
    if np.ptp(differences) == 0.0 or len(different) < MIN_CASES:
        return Estimate(mean)
    sums, counts = np.bincount(index, differences), np.bincount(index)
    rng = np.random.default_rng(RESAMPLING_SEED)
    drawn = [rng.integers(len(sums), size=len(sums)) for _ in range(RESAMPLES)]
    means = [sums[each].sum() / counts[each].sum() for each in drawn]
    low, high = np.quantile(means, (0.5 - 0.5 * BOOTSTRAP_CONFIDENCE, 0.5 + 0.5 * BOOTSTRAP_CONFIDENCE))
    return Estimate(mean, float(low), float(high))
