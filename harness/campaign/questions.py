"""What people are shown of a group of runs: one entry a question, with its text and its shade in a heat map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from harness.analysis.metric import number
from harness.analysis.rows import DASH
from harness.campaign.cell import Cell, Share


@dataclass(frozen=True)
class Question:
    """One question to the runs of a cell.

    Attributes:
        title: of its heat map.
        note: what the figures are.
        short: heading of its column on a terminal, and in a table for a paper.
        text: the answer.
        shade: how bad it is, from 0 to 1; None where there is no answer.
    """

    title: str
    note: str
    short: str
    text: Callable[[Cell], str]
    shade: Callable[[Cell], float | None]


def share_text(share: Share | None) -> str:
    """A share in per cent with its interval, which says how far from none or all it may still be."""
    if share is None:
        return DASH
    # One failure in thousands of runs is what a campaign is flown for: only all is 100 and only none is 0.
    percent = 100.0 * share.value if share.value in (0.0, 1.0) else min(max(100.0 * share.value, 0.1), 99.9)
    return f"{percent:.3g} ({_end(share.low)}{DASH}{_end(share.high)})"


def _end(share: float) -> str:
    """An end of an interval, in per cent; near none or all with a digit more."""
    percent = 100.0 * share
    return f"{percent:.0f}" if 1.0 <= percent <= 99.0 or share in (0.0, 1.0) else f"{percent:.1f}"


def _pair(first: float | None, second: float | None, text: Callable[[float], str]) -> str:
    parts = [DASH if each is None else text(each) for each in (first, second)]
    return DASH if first is None and second is None else "/".join(parts)


def _digits(value: float) -> str:
    return f"{value:.{0 if value >= 10 else 1 if value >= 1 else 2}f}"


def _bad(share: Share | None) -> float | None:
    return None if share is None else 1.0 - share.value


INTERVAL = "per cent of the runs, with Wilson's 95 % interval"

QUESTIONS = (
    Question(
        "Goal reached",
        INTERVAL,
        "reached %",
        lambda cell: share_text(cell.success),
        lambda cell: _bad(cell.success),
    ),
    Question(
        "Length over the clairvoyant optimum",
        "Median/95th percentile where the goal was reached; full shade at twice the optimum",
        "length",
        lambda cell: _pair(cell.length_median, cell.length_p95, "{:.2f}".format),
        lambda cell: None if cell.length_median is None else cell.length_median - 1.0,
    ),
    Question(
        "Least clearance",
        "Least distance to an obstacle edge in any run, in m",
        "clear m",
        lambda cell: number(cell.least_clearance_m) or DASH,
        lambda cell: None if cell.below_wanted is None else cell.below_wanted.value,
    ),
    Question(
        "Below the wanted clearance",
        f"At any time; {INTERVAL}",
        "below %",
        lambda cell: share_text(cell.below_wanted),
        lambda cell: None if cell.below_wanted is None else cell.below_wanted.value,
    ),
    Question(
        "Trackable",
        f"The aircraft tracked every leg; {INTERVAL}",
        "tracks %",
        lambda cell: share_text(cell.trackable),
        lambda cell: _bad(cell.trackable),
    ),
    Question(
        "Planner time",
        "Milliseconds: largest p99 of a run/longest search; full shade at 20 ms of p99",
        "plan ms",
        lambda cell: _pair(cell.planner_p99_ms, cell.planner_max_ms, _digits),
        lambda cell: None if cell.planner_p99_ms is None else cell.planner_p99_ms / 20.0,
    ),
)
"""In the order in which they are shown."""


def legend() -> list[str]:
    """What each column of a table for a paper is."""
    return [f"{each.short}: {each.title} ({each.note.partition('; full shade')[0]})." for each in QUESTIONS]


def shade(question: Question, cell: Cell) -> str:
    """The shade of a cell, as a number for a style sheet; empty where there is no answer."""
    bad = question.shade(cell)
    return "" if bad is None else f"{min(max(bad, 0.0), 1.0):.3f}"
