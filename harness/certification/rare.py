"""Small failure probabilities by subset simulation: days are drawn nearer and nearer to failure.

Subset simulation (Au and Beck, Probabilistic Engineering Mechanics 16, 2001, doi:10.1016/S0266-8920(01)00019-4) writes
a small probability as a product of larger ones: that the margin is below a first level, below a second one if it is
below the first, and so on down to 0. A pilot run picks the levels. Independent runs keep them, and multiply the days
below each by Markov chains (generalized splitting: Botev and Kroese, Statistics and Computing 22, 2012). A move is
reversible with respect to the law of the days and rejected above the level. With fixed levels the estimate of each run
is therefore unbiased, however slowly its chains mix (Del Moral, Doucet and Jasra, J. R. Statist. Soc. B 68, 2006).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np

from harness.certification.bounds import clopper_pearson, lognormal_bounds
from harness.flight.record import FloatArray, IntArray

RUNS: Final = 8  # independent runs; the bounds come from how much they differ
CHAIN: Final = 5
"""Days of a chain, with that which it begins at: a level is the quantile 1 / CHAIN of the pilot's margins."""
PILOT_LEAST, PILOT_SHARE, PILOT_MOST = 50, 0.02, 0.25
"""The pilot begins with this many days, or this share of all if that is more, and ends having used this share."""
ACCEPTED, ADAPTED = 0.42, 0.7
"""The pilot adapts the length of the moves so that this share stays below the level, with this gain."""
MOST_LOG_VARIANCE: Final = 1.0
"""If the logarithms of the estimates have a larger variance than this, their mean has no useful bounds."""

Evaluate: TypeAlias = Callable[[FloatArray, IntArray], FloatArray]
"""Margins (n,) of days, above 0 where the claim holds, from their standard normal numbers (n, d) and seeds (n,)."""


@dataclass(frozen=True)
class Rare:
    """The probability that a day fails: an unbiased estimate, and bounds of it, each by itself at some confidence.

    `levels`: of the margin, falling. `plain_runs`: how many days were drawn as they come. `estimates`: of each
    independent run, 0 if it met no failure. `method`: how the bounds were derived.
    """

    failure_probability: float
    failure_lower: float
    failure_upper: float
    levels: tuple[float, ...]
    estimates: tuple[float, ...]
    plain_runs: int
    method: str


def subset_simulation(evaluate: Evaluate, normals: int, most: int, seed: int, confidence: float) -> Rare:
    """Estimates how often the margin of a day is not above 0, with at most `most` evaluations.

    A day consists of `normals` standard normal numbers, and the seed of its random streams in flight. `seed` is that of
    the simulation: which days are evaluated, and in which order, depends on it and on the margins alone.
    """
    sampler = _Sampler(evaluate, np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(9,))))
    levels, lengths, plain, used = sampler.pilot(normals, most)
    number = (most - used) * CHAIN // (RUNS * (CHAIN + (CHAIN - 1) * len(levels))) // CHAIN * CHAIN
    days, weights = sampler.first(number, normals, RUNS), np.full(RUNS, 1.0 / number)
    plain = np.append(plain, days["margin"])
    failed, count = int((plain <= 0.0).sum()), len(plain)
    for level, length in zip(levels, lengths, strict=True):
        nearest, share = sampler.thinned(days[days["margin"] <= level], number // CHAIN)
        days, weights = sampler.multiplied(nearest, level, length)[0], weights * share / CHAIN
    estimates = np.bincount(days["run"][days["margin"] <= 0.0], minlength=RUNS) * weights
    mean = float(estimates.mean()) if levels else failed / count
    if levels and estimates.all() and np.log(estimates).var(ddof=1) < MOST_LOG_VARIANCE:
        low, high = lognormal_bounds(estimates, confidence)
        method = f"subset simulation, {RUNS} independent runs with fixed levels, their estimates taken as lognormal"
    else:
        low, high = clopper_pearson(failed, count, confidence)
        why = "they are not rare" if failed * CHAIN**2 > count else "the pilot found no levels"
        if levels:
            why = "runs of the subset simulation differ too much"
        method = f"Clopper-Pearson, failures of the {count} days drawn as they come: {why}"
    results = tuple(levels), tuple(estimates.tolist()), count
    return Rare(mean, min(low, mean), max(high, mean), *results, method)


@dataclass(frozen=True)
class _Sampler:
    """Draws days and moves them: arrays of their numbers `normals`, their `seed`, `margin` and independent `run`."""

    evaluate: Evaluate
    rng: np.random.Generator

    def first(self, number: int, normals: int, runs: int = 1) -> Any:
        """Draws and evaluates `number` days of each run, as they come."""
        kinds = [("normals", float, (normals,)), ("seed", np.int64), ("margin", float), ("run", np.int64)]
        days = np.zeros(number * runs, kinds)
        days["normals"] = self.rng.standard_normal((len(days), normals))
        days["seed"] = self.rng.integers(0, 2**53, len(days))
        days["run"] = np.repeat(np.arange(runs), number)
        days["margin"] = self.evaluate(days["normals"], days["seed"])
        return days

    def pilot(self, normals: int, most: int) -> tuple[list[float], list[float], FloatArray, int]:
        """Returns levels, the length of moves at each, margins of the days drawn as they come, and the days used."""
        days = self.first(max(PILOT_LEAST, int(PILOT_SHARE * most)), normals)
        plain, count, length = days["margin"], len(days) // CHAIN, 0.5
        used, levels, lengths = len(plain), [np.inf], [length]
        while used + count * (CHAIN - 1) <= PILOT_MOST * most:
            nearest = np.argsort(days["margin"], kind="stable")[:count]
            if not 0.0 < (level := float(days["margin"][nearest[-1]])) < levels[-1]:
                break
            days, length = self.multiplied(days[nearest], level, length, ADAPTED)
            used += count * (CHAIN - 1)
            levels.append(level)
            lengths.append(length)
        known = slice(1, None if len(levels) > 2 else 1)  # with one level, counting is as good
        return levels[known], lengths[known], plain, used

    def thinned(self, days: Any, most: int) -> tuple[Any, FloatArray]:
        """Picks at most `most` days of each run; returns them, and how many days each of a run stands for (RUNS,).

        They lie at equal steps in the order of their margins, each as likely as the others (systematic sampling).
        """
        count = np.bincount(days["run"], minlength=RUNS)
        step = np.maximum(count / most, 1.0)
        begin = step * self.rng.random(RUNS) - np.cumsum(count) + count
        place, each = np.arange(len(days)) + np.repeat(begin, count), np.repeat(step, count)
        taken = np.floor(place / each) < np.floor((place + 1.0) / each)
        return days[np.lexsort((days["margin"], days["run"]))][taken], step

    def multiplied(self, days: Any, level: float, length: float, adapted: float = 0.0) -> tuple[Any, float]:
        """Moves days below a level along Markov chains; returns the days of all chains, and the next move's length.

        A move takes the normal numbers a part of the way to new ones (preconditioned Crank-Nicolson: Cotter, Roberts,
        Stuart and White, Statistical Science 28, 2013), and draws the seed anew in one of two cases.
        """
        rng, chain = self.rng, [days]
        for _ in range(CHAIN - 1) if len(days) else ():
            moved, new = days.copy(), rng.standard_normal(days["normals"].shape)
            moved["normals"] = np.sqrt(1.0 - length**2) * days["normals"] + length * new
            seeds = rng.integers(0, 2**53, len(days))
            moved["seed"] = np.where(rng.random(len(days)) < 0.5, seeds, days["seed"])
            moved["margin"] = self.evaluate(moved["normals"], moved["seed"])
            below = moved["margin"] <= level
            days = np.where(below, moved, days)
            length = min(1.0, length * float(np.exp(adapted * (below.mean() - ACCEPTED))))
            chain.append(days)
        return np.concatenate(chain), length
