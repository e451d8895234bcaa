"""What a group of runs comes to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.campaign.table import Runs
from harness.flight.record import FloatArray

CONFIDENCE: Final = 0.95


@dataclass(frozen=True)
class Share:
    """A share of some runs, from 0 to 1, with Wilson's 95 % interval (Wilson 1927).

    Attributes:
        value: the share.
        low: lower end of its interval.
        high: upper end.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Cell:
    """The figures of a group of runs. One that no run has is None.

    Attributes:
        runs: how many.
        reached: how many of them reached their goal.
        success: their share. A goal proved unreachable, and a run whose software failed, did not reach it.
        length_median: flown length over the clairvoyant optimum where the goal was reached, median.
        length_p95: the same, 95th percentile.
        least_clearance_m: least distance to an obstacle edge in any run.
        below_wanted: share of the runs flown that were below the wanted clearance at any time.
        trackable: share of the runs flown in which every leg was tracked.
        planner_p99_ms: largest 99th percentile of a run; of all searches together it is no larger.
        planner_max_ms: longest search.
    """

    runs: int
    reached: int
    success: Share | None = None
    length_median: float | None = None
    length_p95: float | None = None
    least_clearance_m: float | None = None
    below_wanted: Share | None = None
    trackable: Share | None = None
    planner_p99_ms: float | None = None
    planner_max_ms: float | None = None


def cell_of(runs: Runs, among: NDArray[np.bool_]) -> Cell:
    """What the runs among some come to."""

    def known(name: str, of: NDArray[np.bool_] = among) -> FloatArray:
        values = runs.numbers(name)[of]
        return values[np.isfinite(values)]

    ratios = known("length_ratio", among & runs.reached)
    return Cell(
        int(among.sum()),
        int((runs.reached & among).sum()),
        success=share_of(runs.reached[among]),
        length_median=_figure(np.median, ratios),
        length_p95=_figure(lambda values: np.percentile(values, 95), ratios),
        least_clearance_m=_figure(np.min, known("min_clearance_m")),
        below_wanted=share_of(known("clearance_violation_s") > 0.0),
        trackable=share_of(known("trackable") > 0.0),
        planner_p99_ms=_figure(np.max, known("compute_ms.p99")),
        planner_max_ms=_figure(np.max, known("compute_ms.max")),
    )


def _figure(figure: Any, values: FloatArray) -> float | None:
    return float(figure(values)) if len(values) else None


def share_of(held: NDArray[np.bool_]) -> Share | None:
    """The share of runs of which something holds; None without runs."""
    return wilson(int(held.sum()), len(held)) if len(held) else None


def wilson(successes: int, trials: int) -> Share:
    """Of a number of trials that is at least 1."""
    from scipy import stats

    interval = stats.binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return Share(successes / trials, float(interval.low), float(interval.high))
