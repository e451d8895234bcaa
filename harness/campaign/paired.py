"""Planners against each other on the same cases: differences of each figure with intervals and a paired test.

A pair is one case flown with the same aircraft by both planners. What the world, the weather and the seed do to a
flight is then in both halves of a pair and drops out of their difference.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from harness.analysis.metric import Metric, number
from harness.analysis.registry import METRICS
from harness.campaign.table import IntArray
from harness.flight.record import FloatArray

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 1999
MIN_CASES: Final = 4
"""Below this many cases there is no interval: more than a fortieth of all resamples would hold one case only."""
BATCH: Final = 500
"""The bootstrap holds this many resamples in memory at a time."""
SEED: Final = 1
"""Seed of the resampling: the same runs give the same interval."""

RATIO: Final = "ratio"
"""Name of the length over the optimum, which counts only where both planners reached the goal."""

TESTED: Final[tuple[Metric, ...]] = tuple(
    each for each in METRICS if each.title and each.short and each.worse and not each.rare
)
"""The figures of the registry that are compared: those that people are shown and of which more, or less, is worse."""


@dataclass(frozen=True)
class Estimate:
    """A figure and its 95 % interval.

    Attributes:
        value: None where no pair gives one.
        low: lower end; None where there are fewer than `MIN_CASES`, or one value alone.
        high: upper end, likewise.
    """

    value: float | None = None
    low: float | None = None
    high: float | None = None

    def text(self, factor: float = 1.0) -> str:
        """Value and interval, with signs, as a person reads them; empty where there is no value."""
        if self.value is None:
            return ""
        told = _signed(self.value * factor)
        if self.low is None or self.high is None:
            return told
        return f"{told} ({_signed(self.low * factor)} to {_signed(self.high * factor)})"


@dataclass(frozen=True)
class Tested:
    """One figure of two planners in pairs.

    Attributes:
        figure: its label, with the unit.
        pairs: cases of which both have it.
        first: mean of the first planner, in the unit of the label.
        second: mean of the second.
        difference: mean of the first less the second, with its bootstrap interval over the cases.
        p: of Wilcoxon's signed-rank test over the cases (two-sided), corrected by Holm's method for all figures of the
            two planners; None where all pairs agree or there are fewer than `MIN_CASES`.
    """

    figure: str
    pairs: int
    first: float
    second: float
    difference: Estimate
    p: float | None


@dataclass(frozen=True)
class Duel:
    """Two planners on the cases that both flew.

    Attributes:
        pairs: cases, times aircraft, that both flew.
        only_first: of them, those where only the first reached its goal.
        only_second: those where only the second did.
        both_reached: pairs where both did.
        figures: the share of goals reached, in percent, then each figure of `TESTED` that both have.
    """

    first: str
    second: str
    pairs: int
    only_first: int
    only_second: int
    both_reached: int
    figures: tuple[Tested, ...]


def duels(
    planners: Sequence[str], cases: Sequence[Any], reached: Sequence[bool], figures: Mapping[str, FloatArray]
) -> tuple[Duel, ...]:
    """Every planner against every other, in the order in which they first appear.

    Args:
        planners: of each flight.
        cases: of each flight, what a pair has in common: the case first, then what else there is, its aircraft perhaps.
        reached: of each flight, whether it reached its goal.
        figures: by name of `TESTED`, one a flight; NaN where there is none.
    """
    flown: dict[str, dict[Any, int]] = {}
    for row, (planner, case) in enumerate(zip(planners, cases, strict=True)):
        flown.setdefault(planner, {})[case] = row
    return tuple(
        _duel(first, second, flown, np.array(reached, dtype=np.float64), figures)
        for first, second in itertools.combinations(flown, 2)
    )


def _duel(
    first: str,
    second: str,
    flown: Mapping[str, Mapping[Any, int]],
    reached: FloatArray,
    figures: Mapping[str, FloatArray],
) -> Duel:
    common = [case for case in flown[first] if case in flown[second]]
    ours, theirs = (
        np.array([flown[name][case] for case in common], dtype=np.int64) for name in (first, second)
    )
    numbers: dict[Any, int] = {}
    cases = np.array([numbers.setdefault(case[0], len(numbers)) for case in common], dtype=np.int64)
    won, lost = reached[ours] > 0.0, reached[theirs] > 0.0
    tested = [_tested("goals reached, %", 100.0 * reached[ours], 100.0 * reached[theirs], cases)]
    for metric in TESTED:
        values = figures.get(metric.name, np.full(len(reached), np.nan)) * metric.factor
        among = np.isfinite(values[ours]) & np.isfinite(values[theirs])
        among &= won & lost if metric.name == RATIO else True
        if among.any():
            label = f"{metric.label}, %" if metric.kind == "bool" else metric.label
            scale = 100.0 if metric.kind == "bool" else 1.0
            tested.append(
                _tested(label, scale * values[ours][among], scale * values[theirs][among], cases[among])
            )
    return Duel(
        first,
        second,
        pairs=len(common),
        only_first=int((won & ~lost).sum()),
        only_second=int((lost & ~won).sum()),
        both_reached=int((won & lost).sum()),
        figures=_corrected(tested) if common else (),
    )


def _tested(label: str, ours: FloatArray, theirs: FloatArray, cases: IntArray) -> Tested:
    from scipy import stats

    if not len(ours):
        return Tested(label, 0, 0.0, 0.0, Estimate(), None)
    estimate = mean_estimate(ours - theirs, cases)
    _, index = np.unique(cases, return_inverse=True)
    means = np.bincount(index, ours - theirs) / np.bincount(index)
    tells = len(means) >= MIN_CASES and bool(np.any(means != 0.0))
    p = float(stats.wilcoxon(means).pvalue) if tells else None
    return Tested(label, len(ours), float(ours.mean()), float(theirs.mean()), estimate, p)


def _corrected(tested: Sequence[Tested]) -> tuple[Tested, ...]:
    """The same with the p-values corrected by Holm's method (Scandinavian Journal of Statistics 6, 1979)."""
    order = sorted((each.p, place) for place, each in enumerate(tested) if each.p is not None)
    corrected: dict[int, float] = {}
    least = 0.0
    for rank, (p, place) in enumerate(order):
        least = max(least, min(1.0, (len(order) - rank) * p))
        corrected[place] = least
    return tuple(
        Tested(each.figure, each.pairs, each.first, each.second, each.difference, corrected.get(place))
        for place, each in enumerate(tested)
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
    if np.ptp(differences) == 0.0 or len(different) < MIN_CASES:
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


def _signed(value: float) -> str:
    return f"{'+' if value > 0 else ''}{number(value)}"
