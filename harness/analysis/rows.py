"""The rows of a comparison and their forms: CSV for programs, tables for papers, labels for people."""

from __future__ import annotations

import csv
import html
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from harness.analysis.metric import Metric
from harness.analysis.registry import METRICS
from harness.files.wording import printable

DASH: Final = "\N{EN DASH}"

COMPARED: Final = {metric.name: metric for metric in METRICS if metric.short or metric.derived}
"""The figures of a row, by name: those that people are shown, and those that take more than `metrics.json`."""
_HEADINGS: Final = ("outcome", "km", "ratio", "clear m", "κ·R", "tracks", "tse max", "p99 ms")
ON_TERMINAL: Final = tuple(next(each for each in METRICS if each.short == short) for short in _HEADINGS)
"""The figures that a table on a terminal shows: those that fit 80 columns."""
LATEX_ESCAPES: Final = str.maketrans(
    {
        **{each: f"\\{each}" for each in "&%$#_{}"},
        **{"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"},
        **{"<": r"$<$", ">": r"$>$", "\N{EN DASH}": "--", "\N{GREEK SMALL LETTER KAPPA}": r"$\kappa$"},
        **{"\N{MIDDLE DOT}": r"$\cdot$", "\N{DEGREE SIGN}": r"$^\circ$", "[": "{[}", "*": "{*}"},
    }
)
"""How characters are written that LaTeX takes for commands or that its fonts lack."""


class Row:
    """One planner, under one guidance law, on one scenario.

    Every figure of `COMPARED` can be read as an attribute; one that does not exist is None. `guidance` is empty where
    all flew under the same law.
    """

    def __init__(
        self, scenario: str, planner: str, outcome: str, reason: str, guidance: str = "", **figures: Any
    ) -> None:
        self.scenario, self.planner, self.reason, self.guidance = scenario, planner, reason, guidance
        self.figures: Mapping[str, Any] = {**dict.fromkeys(COMPARED), **figures, "outcome": outcome}

    def __getattr__(self, name: str) -> Any:
        if name not in COMPARED:
            raise AttributeError(name)
        return self.figures[name]

    @property
    def label(self) -> str:
        """The name of the row, as people are shown it."""
        return f"{self.planner}, {self.guidance}" if self.guidance else self.planner

    def text(self, metric: Metric) -> str:
        """A figure as people are shown it; empty where there is none."""
        return metric.text(self.figures[metric.name])

    def plain(self) -> dict[str, Any]:
        """All values of the row, column by column."""
        begin = {"scenario": self.scenario, "planner": self.planner, "outcome": self.outcome}
        return {**begin, "reason": self.reason, **self.figures, "guidance": self.guidance}


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
    smooth = metrics["smoothness"]
    flown |= {
        "optimum_m": optimum_m,
        "ratio": length / optimum_m if reached and optimum_m else None,
        "turn_radius_m": turn_radius_m,
        "tightest_turn": smooth["planned"]["max_curvature_1pm"] * turn_radius_m,
        "tightest_flown_turn": smooth["flown"]["max_curvature_1pm"] * turn_radius_m,
    }
    return Row(scenario, planner, flown.pop("outcome"), metrics["reason"], guidance, **flown)


def shown_figures(rows: Sequence[Row]) -> list[Metric]:
    """The figures that a table of rows shows: the rare ones only where a row has one that is not 0."""
    shown = [metric for metric in METRICS if metric.short]
    return [each for each in shown if not each.rare or any(row.figures[each.name] for row in rows)]


def rows_for_paper(rows: Sequence[Row]) -> tuple[list[str], list[list[str]], list[str]]:
    """Returns headings, the cells of a line for each flight, and what each heading means, with its unit."""
    heads = ["scenario", "planner", *(each.short for each in ON_TERMINAL)]
    lines = [[row.scenario, row.label, *(row.text(each) or DASH for each in ON_TERMINAL)] for row in rows]
    named = [each for each in ON_TERMINAL if each.title != each.short]
    return heads, lines, [f"{each.short}: {each.title}{each.unit and f', in {each.unit}'}." for each in named]


def latex(heads: Sequence[str], rows: Iterable[Sequence[str]], legend: Sequence[str]) -> str:
    """A `tabular`, numbers to the right, with the rules of the package booktabs; comments before it have the legend."""
    cells = ((printable(cell).translate(LATEX_ESCAPES) for cell in row) for row in (heads, *rows))
    first, *others = map(" & ".join, cells)
    lines = [
        *(r"% \usepackage{booktabs}", *(f"% {printable(each)}" for each in legend)),
        *(f"\\begin{{tabular}}{{l{'r' * (len(heads) - 1)}}}", "\\toprule", f"{first} \\\\", "\\midrule"),
        *(*(f"{line} \\\\" for line in others), "\\bottomrule", "\\end{tabular}"),
    ]
    return "\n".join(lines) + "\n"


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]], legend: Sequence[str]) -> str:
    """A table of Markdown, numbers to the right, and the legend as a list behind it."""
    rule = ["---", *["---:"] * (len(heads) - 1)]
    lines = [f"| {' | '.join(map(escaped, row))} |" for row in (heads, rule, *rows)]
    return "\n".join([*lines, "", *(f"- {escaped(each)}" for each in legend)]) + "\n"


def csv_table(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as CSV, headings first; None is an empty cell."""
    text = io.StringIO()
    plain = ([printable(cell) if isinstance(cell, str) else cell for cell in row] for row in rows)
    csv.writer(text, lineterminator="\n").writerows(plain)
    return text.getvalue()


def to_csv(rows: Sequence[Row]) -> str:
    """All figures at full precision; a figure that does not exist is an empty cell."""
    return csv_table([list(Row("", "", "", "").plain()), *(list(row.plain().values()) for row in rows)])


def escaped(text: str) -> str:
    """Text in one line that Markdown takes for nothing else, nor whoever shows its HTML."""
    text = html.escape(printable(" ".join(text.splitlines())), quote=False)
    for mark in "\\|`*[]":
        text = text.replace(mark, f"\\{mark}")
    return text
