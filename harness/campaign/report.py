"""The page of a campaign's answers, `summary.html`, which needs nothing but itself, and `summary.json`."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from harness.analysis.causes import FINDINGS
from harness.analysis.metric import number
from harness.campaign.questions import QUESTIONS, shade
from harness.campaign.summary import Summary, Table
from harness.campaign.table import Runs, load_tables
from harness.files.errors import WriteError
from harness.files.whole_file import replace_text
from harness.report.page import Picture, rendered

PAGE = "summary.html"
PLAIN = "summary.json"
SCHEMA = "wayproof/campaign-summary/4"


def write_summary(summary: Summary, folder: Path) -> Path:
    """Writes the page and the same answers as JSON into a campaign's folder; returns the path of the page.

    Raises:
        WriteError: they could not be written.
    """
    page = folder / PAGE
    again = shlex.join(["wayproof", "report", str(folder)])
    try:
        plain = {"schema": SCHEMA, **asdict(summary)}
        replace_text(folder / PLAIN, json.dumps(plain, indent=2, allow_nan=False) + "\n")
        text = rendered(
            "campaign.html",
            summary=summary,
            questions=QUESTIONS,
            pictures=list(_pictures(summary, folder)) if summary.total.runs else [],
            findings=FINDINGS,
            command=shlex.join(["wayproof", "report", "--run-reports", str(folder)]),
            number=number,
            shade=shade,
        )
        replace_text(page, text)
    except OSError as error:
        raise WriteError(
            f"cannot write the summary in {folder}: {error.strerror or error}; the results are whole, and "
            f"`{again}` makes it from them"
        ) from error
    return page


def _pictures(summary: Summary, folder: Path) -> Iterator[Picture]:
    from harness.campaign import figures
    from harness.report.figure_style import svg

    for table in summary.curves:
        if len(table.rows.labels) > 1:  # one value is no plot
            yield Picture(
                svg(figures.success(table)),
                f"Share of goals reached against {table.rows.key}",
                f"Goals reached against {table.rows.key}, with Wilson's 95 % intervals.",
            )
    if any(len({*ratios}) > 1 for ratios in summary.lengths.values()):
        yield Picture(
            svg(figures.lengths(summary.lengths)),
            "Distribution of the flown length over the clairvoyant optimum",
            "Flown lengths: the share of the goals reached with at most this length over the clairvoyant optimum.",
        )
    scattered = figures.scatter(Runs(*load_tables(folder)), summary.varied)
    if scattered is not None:
        yield Picture(
            svg(scattered),
            "Figures of every run against each number that was varied",
            "Every run: clearance over the wanted one, largest cross-track error and length over the optimum, against "
            "each number that was varied. Crosses: the goal was not reached. Triangles at an edge: beyond it.",
        )


def rows_for_paper(summary: Summary) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of the table for a paper: the groups of the first table, and all runs."""
    found: list[list[str]] = []
    tables: tuple[Table, ...] = summary.tables[:1]
    keys = [axis.key for table in tables for axis in (table.rows, table.columns) if axis]
    for table in tables:
        for label, cells in zip(table.rows.labels, table.cells, strict=True):
            names = table.columns.labels if table.columns else (None,)
            for name, cell in zip(names, cells, strict=True):
                answers = [each.text(cell) if cell.runs else "" for each in QUESTIONS]
                found.append([*filter(None, (label, name)), str(cell.runs), *answers])
    total = [str(summary.total.runs), *(each.text(summary.total) for each in QUESTIONS)]
    found.append(["all runs", *("" for _ in keys[1:]), *total])
    return [*(keys or [""]), "runs", *(each.short for each in QUESTIONS)], found
