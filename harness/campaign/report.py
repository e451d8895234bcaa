"""The page of a campaign's answers, `summary.html`, which needs nothing but itself, and `summary.json`."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from harness.analysis.causes import FINDINGS
from harness.analysis.metric import number
from harness.campaign.cell import QUESTIONS
from harness.campaign.summary import Summary
from harness.campaign.table import Runs
from harness.files.errors import WriteError
from harness.files.whole_file import replace_text
from harness.report.page import Picture, rendered

PAGE = "summary.html"
PLAIN = "summary.json"
SCHEMA = "wayproof/campaign-summary/5"


def write_summary(summary: Summary, folder: Path) -> Path:
    """Writes the page and the same answers as JSON into a campaign's folder; returns the path of the page.

    Raises:
        WriteError: they could not be written.
    """
    try:
        plain = {"schema": SCHEMA, **asdict(summary)}
        replace_text(folder / PLAIN, json.dumps(plain, indent=2, allow_nan=False) + "\n")
        text = rendered(
            "campaign.html",
            summary=summary,
            questions=QUESTIONS,
            pictures=_pictures(folder, summary.varied) if summary.total.runs else [],
            findings=FINDINGS,
            number=number,
        )
        replace_text(folder / PAGE, text)
    except OSError as error:
        again = shlex.join(["wayproof", "report", str(folder)])
        raise WriteError(
            f"cannot write the summary in {folder}: {error.strerror or error}; the results are whole, and "
            f"`{again}` makes it from them"
        ) from error
    return folder / PAGE


def _pictures(folder: Path, varied: Sequence[str]) -> list[Picture]:
    """Every run against what was varied, where numbers were."""
    from harness.campaign.figures import scatter
    from harness.report.figure_style import svg

    figure = scatter(Runs.of(folder), varied)
    title = "Figures of every run against each number that was varied"
    caption = (
        "Every run: clearance over the wanted one, largest cross-track error and length over the optimum, against each "
        "number that was varied. Crosses: the goal was not reached. Triangles at an edge: beyond it."
    )
    return [] if figure is None else [Picture(svg(figure), title, caption)]


def rows_for_paper(summary: Summary) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of the table for a paper: the groups of the first table, and all runs."""
    table = summary.tables[0] if summary.tables else None
    keys = [axis.key for axis in (table.rows, table.columns) if axis] if table else [""]
    found: list[list[str]] = []
    if table:
        for label, cells in zip(table.rows.labels, table.cells, strict=True):
            names = [[label, name] for name in table.columns.labels] if table.columns else [[label]]
            for named, cell in zip(names, cells, strict=True):
                answers = [each.text(cell) if cell.runs else "" for each in QUESTIONS]
                found.append([*named, str(cell.runs), *answers])
    total = [str(summary.total.runs), *(each.text(summary.total) for each in QUESTIONS)]
    found.append(["all runs", *("" for _ in keys[1:]), *total])
    return [*keys, "runs", *(each.short for each in QUESTIONS)], found
