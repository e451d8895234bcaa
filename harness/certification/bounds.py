"""One-sided confidence bounds of a probability, from how often something held.

For a number of trials that is fixed before the first, the bounds are those of Clopper and Pearson (Biometrika 26,
1934). Where the number depends on what came out, they come from a mixture test (Robbins, Annals of Mathematical
Statistics 41, 1970): the likelihood of what was seen, averaged over all failure rates on one side of a rate f, over its
likelihood at f, is a nonnegative supermartingale if the true rate lies on the other side of f. By Ville's inequality it
ever exceeds 1 / (1 - confidence) with a probability of at most 1 - confidence: a test may stop at any time.
"""

from __future__ import annotations

import math
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

PRIOR: Final = 0.5
"""Both parameters of the beta distribution over failure rates (Jeffreys' prior): much of it lies near 0 and 1."""

Verdict: TypeAlias = Literal["shown", "refuted", "undecided"]


def clopper_pearson(held: int, runs: int, confidence: float) -> tuple[float, float]:
    """Lower and upper bound, each by itself, of the probability of what `held` in a number of runs fixed beforehand."""
    from scipy import special

    low = special.betaincinv(held, runs - held + 1, 1.0 - confidence) if held else 0.0
    return float(low), float(special.betaincinv(held + 1, runs - held, confidence) if held < runs else 1.0)


def lognormal_bounds(estimates: NDArray[np.float64], confidence: float) -> tuple[float, float]:
    """Lower and upper bound, each by itself, of the expected value of independent estimates above 0.

    They are taken as lognormal: Cox's interval of such a mean with Student's quantile (Olsson, Journal of Statistics
    Education 13, 2005).
    """
    from scipy import special

    logs, free = np.log(estimates), len(estimates) - 1
    middle, variance = logs.mean() + 0.5 * logs.var(ddof=1), logs.var(ddof=1)
    wide = special.stdtrit(free, confidence) * math.sqrt(variance / len(logs) + 0.5 * variance**2 / free)
    return math.exp(middle - wide), min(math.exp(middle + wide), 1.0)


def sequential_bounds(held: int, runs: int, confidence: float) -> tuple[float, float]:
    """Bounds as those of `clopper_pearson`, but valid at every number of runs at once."""
    if not runs:
        return 0.0, 1.0
    failed, wanted = runs - held, math.log(1.0 / (1.0 - confidence))

    def end(outer: float, *, above: bool) -> float:
        """Failure rate at which the evidence is enough, rounded outwards: a bound is never tighter than the test."""
        inner = failed / runs
        while (middle := 0.5 * (inner + outer)) not in (inner, outer):
            if _evidence(middle, failed, runs, above=above) >= wanted:
                outer = middle
            else:
                inner = middle
        return outer

    return 1.0 - (end(1.0, above=False) if held else 1.0), 1.0 - (end(0.0, above=True) if failed else 0.0)


def verdict(held: int, runs: int, probability: float, confidence: float) -> Verdict:
    """Judges the claim that something holds with at least `probability` by the runs so far; valid at every look."""
    rate, failed, wanted = 1.0 - probability, runs - held, math.log(1.0 / (1.0 - confidence))
    if _evidence(rate, failed, runs, above=False) >= wanted:
        return "shown"
    return "refuted" if _evidence(rate, failed, runs, above=True) >= wanted else "undecided"


def _evidence(rate: float, failed: int, runs: int, *, above: bool) -> float:
    """Logarithm of the likelihood averaged over the failure rates on one side of `rate`, over the likelihood at it."""
    from scipy import special

    share = special.betaincc if above else special.betainc
    a, b = PRIOR + failed, PRIOR + runs - failed
    if (posterior := float(share(a, b, rate))) <= 0.0:
        return -math.inf
    averaged = math.log(posterior) + special.betaln(a, b)
    prior = math.log(float(share(PRIOR, PRIOR, rate))) + special.betaln(PRIOR, PRIOR)
    return float(averaged - prior - (special.xlogy(failed, rate) + special.xlog1py(runs - failed, -rate)))
