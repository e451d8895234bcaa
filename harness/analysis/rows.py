"""The rows of a comparison and their forms: CSV for programs, Markdown for papers, labels for people."""

from __future__ import annotations

import csv
import html
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.analysis.metric import Metric
from harness.analysis.registry import METRICS
from harness.files.wording import printable

DASH = "\N{EN DASH}"

COMPARED = {metric.name: metric for metric in METRICS if metric.short or metric.derived}
"""The figures of a row, by name: those that people are shown, and those that take more than `metrics.json`."""

ON_TERMINAL = (
    "outcome",
    "km",
    "ratio",
    "clear m",
    "\N{GREEK SMALL LETTER KAPPA}\N{MIDDLE DOT}R",
    "tracks",
    "tse max",
    "p99 ms",
)
"""Those that fit 80 columns, by `Metric.short`."""


@dataclass(frozen=True, init=False, repr=False)
class Row:
    """One planner, under one guidance law, on one scenario.

    Every figure of `COMPARED` can be read as an attribute; one that does not exist is None.

    Attributes:
        scenario: its name.
        planner: its kind.
        reason: how the flight ended, as a sentence.
        guidance: the guidance law; empty where all flew under the same one.
        figures: all figures, by name.
    """

    scenario: str
    planner: str
    reason: str
    guidance: str
    figures: Mapping[str, Any]

    def __init__(
        self, scenario: str, planner: str, outcome: str, reason: str, guidance: str = "", **figures: Any
    ) -> None:
        unknown = figures.keys() - COMPARED.keys()
        if unknown:
            raise TypeError(f"no figures of a comparison: {', '.join(sorted(unknown))}")
        known = {**dict.fromkeys(COMPARED), **figures, "outcome": outcome}
        for name, value in zip(
            self.__dataclass_fields__, (scenario, planner, reason, guidance, known), strict=True
        ):
            object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in COMPARED:
            raise AttributeError(name)
        return self.figures[name]

    @property
    def label(self) -> str:
        """What people are shown as its name."""
        return f"{self.planner}, {self.guidance}" if self.guidance else self.planner

    def text(self, metric: Metric) -> str:
        """A figure as people are shown it; empty where there is none."""
        return metric.text(self.figures[metric.name])

    def plain(self) -> dict[str, Any]:
        """All of it, column by column."""
        names = {
            "scenario": self.scenario,
            "planner": self.planner,
            "outcome": self.outcome,
            "reason": self.reason,
        }
        return {**names, **self.figures, "guidance": self.guidance}


def row_of(
    scenario: str,
    planner: str,
    metrics: Mapping[str, Any],
    *,
    optimum_m: float | None,
    turn_radius_m: float,
    guidance: str = "",
) -> Row:
    """The row of a flight that came to an end."""
    flown = {name: metric.value(metrics) for name, metric in COMPARED.items() if not metric.derived}
    length, reached = metrics["flown_length_m"], metrics["outcome"] == "reached"
    flown |= {
        "optimum_m": optimum_m,
        "ratio": length / optimum_m if reached and optimum_m else None,
        "turn_radius_m": turn_radius_m,
        "tightest_turn": metrics["smoothness"]["planned"]["max_curvature_1pm"] * turn_radius_m,
        "tightest_flown_turn": metrics["smoothness"]["flown"]["max_curvature_1pm"] * turn_radius_m,
    }
    return Row(scenario, planner, flown.pop("outcome"), metrics["reason"], guidance, **flown)


def shown_figures(rows: Sequence[Row]) -> list[Metric]:
    """The figures that a table of rows shows: the rare ones only where a row has one that is not 0."""
    return [
        metric
        for metric in METRICS
        if metric.short and (not metric.rare or any(row.figures[metric.name] for row in rows))
    ]


def rows_for_paper(rows: Sequence[Row]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of the table for a paper: a line a flight, the figures of `ON_TERMINAL`."""
    shown = _on_terminal()
    heads = ["scenario", "planner", *(each.short for each in shown)]
    return heads, [[row.scenario, row.label, *(row.text(each) or DASH for each in shown)] for row in rows]


def legend() -> list[str]:
    """What each of those figures is, with its unit."""
    shown = [each for each in _on_terminal() if each.title != each.short]
    return [f"{each.short}: {each.title}{f', in {each.unit}' if each.unit else ''}." for each in shown]


def _on_terminal() -> list[Metric]:
    return [next(each for each in METRICS if each.short == short) for short in ON_TERMINAL]


def to_csv(rows: Sequence[Row]) -> str:
    """All figures at full precision; a figure that does not exist is an empty cell."""
    text = io.StringIO()
    columns = Row("", "", "", "").plain()
    writer = csv.DictWriter(text, list(columns), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        cells = row.plain().items()
        writer.writerow({key: printable(cell) if isinstance(cell, str) else cell for key, cell in cells})
    return text.getvalue()


def to_markdown(rows: Sequence[Row]) -> str:
    """One table a scenario: a line for each figure, a column for each planner."""
    parts = []
    for name in dict.fromkeys(row.scenario for row in rows):
        own = [row for row in rows if row.scenario == name]
        lines = [f"## {escaped(name)}", "", _line(["", *(row.label for row in own)])]
        lines.append(_line(["---", *("---:" for _ in own)]))
        shown = shown_figures(own)
        lines += [_line([figure.label, *(row.text(figure) or DASH for row in own)]) for figure in shown]
        lines += ["", *(f"- {escaped(row.label)}: {escaped(row.reason)}" for row in own), ""]
        parts.append("\n".join(lines))
    return "\n".join(parts)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(map(escaped, cells))} |"


def escaped(text: str) -> str:
    """Text in one line that Markdown takes for nothing else, nor whoever shows its HTML."""
    text = html.escape(printable(" ".join(text.splitlines())), quote=False)
    for mark in "\\|`*[]":
        text = text.replace(mark, f"\\{mark}")
    return text
