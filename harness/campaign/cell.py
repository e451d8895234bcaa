"""What a group of runs comes to, and what people are shown of it: one entry of `QUESTIONS` a figure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.analysis.metric import number
from harness.analysis.rows import DASH
from harness.campaign.table import Runs
from harness.flight.record import FloatArray

CONFIDENCE: Final = 0.95


@dataclass(frozen=True)
class Share:
    """A share of some runs, from 0 to 1, with Wilson's 95 % interval (Wilson 1927)."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        """In per cent with its interval, which says how far from none or all it may still be."""
        # One failure in thousands of runs is what a campaign is flown for: only all is 100 and only none is 0.
        percent = 100.0 * self.value
        percent = percent if self.value in (0.0, 1.0) else min(max(percent, 0.1), 99.9)
        ends = (
            f"{100.0 * end:.{0 if 0.01 <= end <= 0.99 or end in (0.0, 1.0) else 1}f}"
            for end in (self.low, self.high)
        )
        return f"{percent:.3g} ({DASH.join(ends)})"


@dataclass(frozen=True)
class Cell:
    """The figures of a group of runs. One that no run has is None.

    Attributes:
        success: their share. A goal proved unreachable, and a run whose software failed, did not reach it.
        length_median: flown length over the clairvoyant optimum where the goal was reached, median.
        below_wanted: share of the runs flown that were below the wanted clearance at any time.
        trackable: share of the runs flown in which every leg was tracked.
        planner_p99_ms: largest 99th percentile of a run; of all searches together it is no larger.
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

    def figure(of: Callable[[FloatArray], Any], values: FloatArray) -> float | None:
        return float(of(values)) if len(values) else None

    def share(held: NDArray[np.bool_]) -> Share | None:
        return wilson(int(held.sum()), len(held)) if len(held) else None

    ratios = known("length_ratio", among & runs.reached)
    return Cell(
        int(among.sum()),
        int((runs.reached & among).sum()),
        success=share(runs.reached[among]),
        length_median=figure(np.median, ratios),
        length_p95=figure(lambda values: np.percentile(values, 95), ratios),
        least_clearance_m=figure(np.min, known("min_clearance_m")),
        below_wanted=share(known("clearance_violation_s") > 0.0),
        trackable=share(known("trackable") > 0.0),
        planner_p99_ms=figure(np.max, known("compute_ms.p99")),
        planner_max_ms=figure(np.max, known("compute_ms.max")),
    )


def wilson(successes: int, trials: int) -> Share:
    """Of a number of trials that is at least 1."""
    from scipy import stats

    interval = stats.binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return Share(successes / trials, float(interval.low), float(interval.high))


@dataclass(frozen=True)
class Question:
    """A figure, or two, of a cell.

    Attributes:
        short: heading of its column on a terminal, and in a table for a paper.
        bad: how bad it is, from 0 to 1.
    """

    title: str
    note: str
    short: str
    first: Callable[[Cell], Any]
    bad: Callable[[Cell], float]
    form: Callable[[Any], str] = str
    second: Callable[[Cell], Any] | None = None

    def text(self, cell: Cell) -> str:
        """The answer; a dash where there is none."""
        figures = [self.first(cell), *([self.second(cell)] if self.second else [])]
        texts = [DASH if each is None else self.form(each) for each in figures]
        return DASH if {*texts} == {DASH} else "/".join(texts)

    def shade(self, cell: Cell) -> str:
        """How bad it is, as a number for a style sheet; empty where there is no answer."""
        return "" if self.first(cell) is None else f"{min(max(self.bad(cell), 0.0), 1.0):.3f}"


def _below(cell: Cell) -> float:
    return cell.below_wanted.value if cell.below_wanted else 0.0


def _digits(value: float) -> str:
    return f"{value:.{0 if value >= 10 else 1 if value >= 1 else 2}f}"


INTERVAL: Final = "per cent of the runs, with Wilson's 95 % interval"

QUESTIONS: Final = (
    Question(
        *("Goal reached", INTERVAL, "reached %"),
        first=lambda cell: cell.success,
        bad=lambda cell: 1.0 - cell.reached / cell.runs,
    ),
    Question(
        "Length over the clairvoyant optimum",
        "Median/95th percentile where the goal was reached; full shade at twice the optimum",
        "length",
        first=lambda cell: cell.length_median,
        bad=lambda cell: (cell.length_median or 1.0) - 1.0,
        form="{:.2f}".format,
        second=lambda cell: cell.length_p95,
    ),
    Question(
        *("Least clearance", "Least distance to an obstacle edge in any run, in m", "clear m"),
        first=lambda cell: cell.least_clearance_m,
        bad=_below,
        form=number,
    ),
    Question(
        *("Below the wanted clearance", f"At any time; {INTERVAL}", "below %"),
        first=lambda cell: cell.below_wanted,
        bad=_below,
    ),
    Question(
        *("Trackable", f"The aircraft tracked every leg; {INTERVAL}", "tracks %"),
        first=lambda cell: cell.trackable,
        bad=lambda cell: 1.0 - (cell.trackable.value if cell.trackable else 0.0),
    ),
    Question(
        "Planner time",
        "Milliseconds: largest p99 of a run/longest search; full shade at 20 ms of p99",
        "plan ms",
        first=lambda cell: cell.planner_p99_ms,
        bad=lambda cell: (cell.planner_p99_ms or 0.0) / 20.0,
        form=_digits,
        second=lambda cell: cell.planner_max_ms,
    ),
)
"""In the order in which they are shown."""


def legend() -> list[str]:
    """What each column of a table for a paper is."""
    return [f"{each.short}: {each.title} ({each.note.partition('; full shade')[0]})." for each in QUESTIONS]
