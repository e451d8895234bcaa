"""The page and the file of a campaign's answers: `summary.html`, which needs nothing but itself, and `summary.json`."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from harness.analysis.causes import FINDINGS
from harness.analysis.metric import number
from harness.campaign.points import run_points
from harness.campaign.questions import QUESTIONS, difference, ratio, shade
from harness.campaign.summary import Summary
from harness.files.errors import WriteError
from harness.files.whole_file import replace_text
from harness.report.page import Picture, rendered

PAGE = "summary.html"
PLAIN = "summary.json"
SCHEMA = "wayproof/campaign-summary/3"


def write_summary(summary: Summary, folder: Path) -> Path:
    """Writes the page and the same answers as JSON into a campaign's folder; returns the path of the page.

    Raises:
        WriteError: they could not be written.
    """
    page = folder / PAGE
    try:
        replace_text(folder / PLAIN, json.dumps(plain(summary), indent=2, allow_nan=False) + "\n")
        replace_text(page, summary_html(summary, folder))
    except OSError as error:
        raise WriteError(
            f"cannot write the summary in {folder}: {error.strerror or error}; the results are whole, and "
            f"`{shlex.join(['wayproof', 'report', str(folder)])}` makes it from them"
        ) from error
    return page


def plain(summary: Summary) -> dict[str, Any]:
    """The content of `summary.json`."""
    return {"schema": SCHEMA, **asdict(summary)}


def summary_html(summary: Summary, folder: Path) -> str:
    """The text of `summary.html`.

    Args:
        summary: the answers.
        folder: the campaign's, for what is drawn run by run.
    """
    return rendered(
        "campaign.html",
        summary=summary,
        questions=QUESTIONS,
        pictures=list(_pictures(summary, folder)) if summary.total.runs else [],
        failures=_failure_maps(summary, folder),
        findings=FINDINGS,
        command=shlex.join(["wayproof", "report", "--run-reports", str(folder)]),
        difference=difference,
        ratio=ratio,
        number=number,
        shade=shade,
    )


def _pictures(summary: Summary, folder: Path) -> Iterator[Picture]:
    from harness.campaign import figures as campaign_figures
    from harness.report.figure_style import svg

    for table in summary.curves:
        yield Picture(
            svg(campaign_figures.success(table)),
            f"Share of goals reached against {table.rows.key}",
            f"Goals reached against {table.rows.key}, with Wilson's 95 % intervals.",
        )
    if summary.lengths:
        yield Picture(
            svg(campaign_figures.lengths(summary.lengths)),
            "Distribution of the flown length over the clairvoyant optimum",
            "Flown lengths: the share of the goals reached with at most this length over the clairvoyant optimum.",
        )
    scattered = campaign_figures.scatter(run_points(folder))
    if scattered is not None:
        yield Picture(
            svg(scattered),
            "Figures of every run against each number that was varied",
            "Every run: clearance over the wanted one, largest cross-track error and length over the optimum, against "
            "each number that was varied. Crosses: the goal was not reached.",
        )


def _failure_maps(summary: Summary, folder: Path) -> Picture | None:
    """Where runs failed; None where none did, or no run folder was kept of any that did."""
    from harness.campaign.figures import failures, where_failed
    from harness.report.figure_style import svg

    failed = failures(summary, folder)
    if not failed:
        return None

    return Picture(
        svg(where_failed(failed)),
        "Maps of the runs that failed",
        "Where the worst of them ended (cross): track from S to G, obstacles with the wanted clearance; axes in km.",
    )
