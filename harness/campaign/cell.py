"""Runs in groups by a varied key, the figures of a group, and the questions about it that people are shown."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.analysis.metric import number
from harness.analysis.rows import DASH
from harness.campaign.results import Runs
from harness.campaign.sampling import DIRECTION_ENDS
from harness.files.strict_yaml import Scalar
from harness.flight.record import FloatArray, IntArray

CONFIDENCE: Final = 0.95  # confidence of intervals of shares of runs
MAX_NUMBERS: Final = 8  # a key with more different numbers than this is taken as drawn at random
BINS: Final = 4  # quantiles, or sectors if from all round, of more numbers drawn at random than this
NOT_SET: Final = "not set"  # label of runs without a value of a key
COMPASS_SECTORS: Final = tuple(  # labels of bins of directions, deg
    f"{name}, {low:g} to {low + 90:g}" for name, low in zip("NESW", (-45, 45, 135, 225), strict=True)
)


@dataclass(frozen=True)
class Share:
    """A share of some runs, from 0 to 1, with Wilson's 95 % interval (Wilson 1927)."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        """In per cent with its interval, which says how far from none or all it may still be."""
        ends = (f"{100.0 * end:.{_decimals(end)}f}" for end in (self.low, self.high))
        digits = max(3, 2 + _decimals(self.value)) if self.value > 0.5 else 3
        return f"{100.0 * self.value:.{digits}g} ({DASH.join(ends)})"


def _decimals(share: float) -> int:
    """Decimals of a share in per cent with which only none is 0 and only all is 100.

    One failure in thousands of runs is what a campaign is flown for.
    """
    far = 100.0 * min(share, 1.0 - share)
    return math.ceil(-math.log10(far)) if 0.0 < far < 1.0 else 0


@dataclass(frozen=True)
class Cell:
    """The figures of a group of runs; one that no run has is None.

    `success` is of all runs, the other shares of those flown to an end; lengths are over the clairvoyant optimum, of
    the runs that reached the goal. `planner_p99_ms` is the largest 99th percentile of a run.
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

    @property
    def answers(self) -> list[str]:
        """Number of runs, then the answer to each of `QUESTIONS`, empty where there are no runs."""
        return [str(self.runs), *(each.text(self) if self.runs else "" for each in QUESTIONS)]


def cell_of(runs: Runs, among: NDArray[np.bool_]) -> Cell:
    """Returns the figures of the runs that `among` marks."""

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
    """Returns the share of successes with Wilson's interval; there is at least one trial."""
    from scipy import stats

    interval = stats.binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return Share(successes / trials, float(interval.low), float(interval.high))


@dataclass(frozen=True)
class Question:
    """A question about a cell that people are shown, answered by one figure of it or two, by name."""

    title: str
    note: str
    short: str  # heading of its column on a terminal
    figures: tuple[str, ...]
    bad: Callable[[Any], float]  # returns how bad the answer is, from 0 to 1, where the first figure is known
    form: Callable[[Any], str] = str

    def text(self, cell: Cell) -> str:
        """Returns the answer; a dash where there is none."""
        values = [getattr(cell, name) for name in self.figures]
        texts = [DASH if each is None else self.form(each) for each in values]
        return DASH if {*texts} == {DASH} else "/".join(texts)

    def shade(self, cell: Cell) -> str:
        """Returns how bad the answer is, as a number for a style sheet; empty where there is no answer."""
        known = getattr(cell, self.figures[0]) is not None
        return f"{min(max(self.bad(cell), 0.0), 1.0):.3f}" if known else ""


def _below_share(cell: Cell) -> float:
    return cell.below_wanted.value if cell.below_wanted else 0.0


def _digits(value: float) -> str:
    return f"{value:.{0 if value >= 10 else 1 if value >= 1 else 2}f}"


INTERVAL_NOTE: Final = "per cent of the runs, with Wilson's 95 % interval"
LENGTH_NOTE: Final = "Median/95th percentile where the goal was reached; full shade at twice the optimum"
CLEARANCE_NOTE: Final = "Least distance to an obstacle edge in any run, in m"
TRACKED_NOTE: Final = f"The aircraft tracked every leg; {INTERVAL_NOTE}"
TIME_NOTE: Final = "Milliseconds: largest p99 of a run/longest search; full shade at 20 ms of p99"
LENGTHS, TIMES = ("length_median", "length_p95"), ("planner_p99_ms", "planner_max_ms")
BELOW_TITLE: Final = "Below the wanted clearance"
QUESTIONS: Final = (
    Question("Goal reached", INTERVAL_NOTE, "reached %", ("success",), lambda cell: 1.0 - cell.success.value),
    Question(
        *("Length over the clairvoyant optimum", LENGTH_NOTE, "length", LENGTHS),
        *(lambda cell: cell.length_median - 1.0, "{:.2f}".format),
    ),
    Question("Least clearance", CLEARANCE_NOTE, "clear m", ("least_clearance_m",), _below_share, number),
    Question(BELOW_TITLE, f"At any time; {INTERVAL_NOTE}", "below %", ("below_wanted",), _below_share),
    Question("Trackable", TRACKED_NOTE, "tracks %", ("trackable",), lambda cell: 1.0 - cell.trackable.value),
    Question("Planner time", TIME_NOTE, "plan ms", TIMES, lambda cell: cell.planner_p99_ms / 20.0, _digits),
)
"""The questions in the order in which people are shown them."""


def legend() -> list[str]:
    """Returns a line for each column of a table for a paper."""
    return [f"{each.short}: {each.title} ({each.note.partition('; full shade')[0]})." for each in QUESTIONS]


@dataclass(frozen=True)
class Axis:
    """The values of a varied key in groups; `edges` are the limits of quantiles, each in the group above it."""

    key: str
    labels: tuple[str, ...]
    edges: tuple[float, ...] = ()


def are_numbers(values: Sequence[Scalar]) -> bool:
    """Tells whether all values that are given are numbers."""
    return set() < {type(value) for value in values if value is not None} <= {int, float}


def grouped(key: str, values: Sequence[Any], drawn: bool = False) -> tuple[Axis, IntArray]:
    """Returns the groups of values and each one's group: numbers rising, many binned; names as they come; None last."""
    given = [*dict.fromkeys(value for value in values if value is not None)]
    if not are_numbers(values):
        names = {value: str(value).lower() if isinstance(value, bool) else str(value) for value in given}
    elif len(given) > (BINS if drawn else MAX_NUMBERS):
        return _bin(key, values)
    else:
        digits = 6 if float in map(type, given) else 17  # all of an integer
        names = dict(zip(sorted(given), _distinct(sorted(given), digits), strict=True))
    labels = [*dict.fromkeys(names.values()), *([NOT_SET] if None in values else [])]
    index = [labels.index(NOT_SET if value is None else names[value]) for value in values]
    return Axis(key, tuple(labels)), np.array(index, dtype=np.int64)


def _bin(key: str, values: Sequence[Any]) -> tuple[Axis, IntArray]:
    """Groups numbers into quantiles; directions from all round into quarters of the compass about its points."""
    numbers = np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    missing, turns = np.isnan(numbers), key.endswith(DIRECTION_ENDS)
    if turns:
        around = np.sort(numbers[~missing] % 360.0)
        gaps = np.diff(around, append=around[0] + 360.0)
    if turns and gaps.max() <= 90.0:
        labels, edges = COMPASS_SECTORS, ()
        index = np.floor(np.nan_to_num((numbers + 45.0) % 360.0) / 90.0)
    else:
        if turns:  # they rise from behind the widest gap on
            begin = around[gaps.argmax() + 1 - len(around)]
            numbers = begin + (numbers % 360.0 - begin) % 360.0
        limits = np.unique(np.quantile(numbers[~missing], np.linspace(0.0, 1.0, BINS + 1)))
        edges = tuple((limits % 360.0 if turns else limits).tolist())
        labels = tuple(f"{low} to {high}" for low, high in itertools.pairwise(_distinct(edges, 4)))
        index = np.searchsorted(limits[1:-1], numbers, side="right")
    group = np.where(missing, len(labels), index).astype(np.int64)
    return Axis(key, (*labels, NOT_SET) if missing.any() else labels, edges), group


def _distinct(values: Sequence[float], digits: int) -> list[str]:
    """Formats different numbers with at least so many digits, and as many as they need to differ."""
    each = ([f"{value:.{count}g}" for value in values] for count in range(digits, 18))
    return next((texts for texts in each if len(set(texts)) == len(texts)), list(map(str, values)))
