"""What people are shown of a group of runs: one entry a question, with its text and its shade in a heat map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from harness.analysis.metric import number
from harness.analysis.rows import DASH
from harness.campaign.paired import Estimate
from harness.campaign.summary import Cell


@dataclass(frozen=True)
class Question:
    """One question to the runs of a cell.

    Attributes:
        title: of its heat map.
        note: what the figures are.
        short: heading of its column on a terminal.
        text: the answer.
        brief: the answer on a terminal.
        shade: how bad it is, from 0 to 1; None where there is no answer.
    """

    title: str
    note: str
    short: str
    text: Callable[[Cell], str]
    brief: Callable[[Cell], str]
    shade: Callable[[Cell], float | None]


def percent(share: float | None) -> str:
    """A share in per cent; only all is 100 and only none is 0."""
    if share is None:
        return DASH
    return f"{100 * share:.0f} %" if share in (0.0, 1.0) else f"{_partly(share):.1f} %"


def _partly(share: float) -> float:
    """Per cent of what is neither all nor none, that a digit after the point does not round to either."""
    return min(max(100 * share, 0.1), 99.9)


def interval(low: float | None, high: float | None) -> str:
    """Both ends of an interval of a share, in per cent."""
    return "" if low is None or high is None else f"{100 * low:.1f}{DASH}{100 * high:.1f}"


def difference(estimate: Estimate) -> str:
    """A difference of shares in percentage points, with its interval."""
    if estimate.value is None:
        return DASH
    if estimate.low is None or estimate.high is None:
        return f"{100 * estimate.value:+.1f}"
    return f"{100 * estimate.value:+.1f} ({100 * estimate.low:+.1f} to {100 * estimate.high:+.1f})"


def ratio(estimate: Estimate) -> str:
    """A ratio with its interval."""
    if estimate.value is None:
        return DASH
    if estimate.low is None or estimate.high is None:
        return f"{estimate.value:.4f}"
    return f"{estimate.value:.4f} ({estimate.low:.4f} to {estimate.high:.4f})"


def of_runs(cell: Cell) -> str:
    """How many of the runs reached their goal."""
    return f"{cell.reached} of {cell.runs}"


def _pair(first: float | None, second: float | None, text: Callable[[float], str]) -> str:
    parts = [DASH if each is None else text(each) for each in (first, second)]
    return DASH if first is None and second is None else " / ".join(parts)


def _success(cell: Cell) -> str:
    spread = interval(cell.success_low, cell.success_high)
    return f"{percent(cell.success)} ({spread}), {of_runs(cell)}" if cell.runs else DASH


def _success_briefly(cell: Cell) -> str:
    if cell.success is None or cell.success_low is None or cell.success_high is None:
        return DASH
    share = 100 * cell.success if cell.success in (0.0, 1.0) else _partly(cell.success)
    return f"{share:.3g} ({100 * cell.success_low:.0f}{DASH}{100 * cell.success_high:.0f})"


def _two_digits(value: float | None) -> str:
    return DASH if value is None else f"{value:.{0 if value >= 10 else 1 if value >= 1 else 2}f}"


def _length(cell: Cell) -> str:
    return _pair(cell.length_median, cell.length_p95, "{:.3f}".format)


def _clearance(cell: Cell) -> str:
    return _pair(cell.least_clearance_m, None, number).removesuffix(f" / {DASH}")


def _compact(text: str) -> str:
    return text.replace(" / ", "/").replace(" %", "%")


QUESTIONS = (
    Question(
        "Goal reached",
        "Share of the runs with Wilson's 95 % interval in per cent, and their number",
        "reached %",
        _success,
        _success_briefly,
        lambda cell: None if cell.success is None else 1.0 - cell.success,
    ),
    Question(
        "Length over the clairvoyant optimum",
        "Median / 95th percentile where the goal was reached; full shade at twice the optimum",
        "length",
        _length,
        lambda cell: _compact(_pair(cell.length_median, cell.length_p95, "{:.2f}".format)),
        lambda cell: None if cell.length_median is None else cell.length_median - 1.0,
    ),
    Question(
        "Clearance",
        "Least distance to an obstacle edge in m; share of the runs that were ever below the wanted one",
        "clear m",
        lambda cell: (
            f"{_clearance(cell)} m, {percent(cell.below_wanted)} below"
            if cell.below_wanted is not None
            else DASH
        ),
        lambda cell: _compact(f"{_clearance(cell)} {percent(cell.below_wanted)}"),
        lambda cell: cell.below_wanted,
    ),
    Question(
        "Trackable",
        "Share of the runs in which the aircraft tracked every leg",
        "tracks",
        lambda cell: percent(cell.trackable),
        lambda cell: _compact(percent(cell.trackable)),
        lambda cell: None if cell.trackable is None else 1.0 - cell.trackable,
    ),
    Question(
        "Planner time",
        "Milliseconds: median of the runs' p50 / largest p99 of a run / longest search; full shade at 20 ms of p99",
        "planner ms",
        lambda cell: (
            f"{_pair(cell.planner_p50_ms, cell.planner_p99_ms, number)} / {number(cell.planner_max_ms)}"
            if cell.planner_p50_ms is not None
            else DASH
        ),
        lambda cell: (
            "/".join(map(_two_digits, (cell.planner_p50_ms, cell.planner_p99_ms, cell.planner_max_ms)))
            if cell.planner_p50_ms is not None
            else DASH
        ),
        lambda cell: None if cell.planner_p99_ms is None else cell.planner_p99_ms / 20.0,
    ),
)
"""In the order in which they are shown."""


def shade(question: Question, cell: Cell) -> str:
    """The shade of a cell, as a number for a style sheet; empty where there is no answer."""
    bad = question.shade(cell)
    return "" if bad is None else f"{min(max(bad, 0.0), 1.0):.3f}"
