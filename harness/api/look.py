"""How results look in a notebook: the tables of the command line, as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    import pyarrow as pa

    from harness.campaign.summary import Summary

COMPARED: Final = (
    "scenario",
    "planner",
    "outcome",
    "flown_length_m",
    "ratio",
    "min_clearance_m",
    "cross_track_p95_m",
    "planner_p99_ms",
)
"""The columns of a comparison that are shown; all are in its table."""


def flight_html(title: str, metrics: Mapping[str, Any]) -> str:
    """The table that `fly` and `check` print at their end.

    Args:
        title: stands above it.
        metrics: the content of `metrics.json`.
    """
    from rich.text import Text

    if metrics.get("check") is not None:
        from harness.cli.flight_rows import verdict_rows as rows
    else:
        from harness.cli.flight_rows import flight_rows as rows
    return _table(title, (), [(name, Text.from_markup(text).plain) for name, text in rows(metrics).items()])


def comparison_html(title: str, table: pa.Table) -> str:
    """A row a scenario and planner.

    Args:
        title: stands above it.
        table: as `ComparisonResult.table`.
    """
    names = [name for name in COMPARED if name in table.column_names]
    rows = [[_number(row[name]) for name in names] for row in table.select(names).to_pylist()]
    return _table(title, [name.replace("_", " ") for name in names], rows)


def campaign_html(title: str, summary: Summary) -> str:
    """The answers of a campaign: all runs, and the groups of its first table.

    Args:
        title: stands above it.
        summary: the answers.
    """
    from harness.campaign.questions import QUESTIONS

    cells = [("all runs", summary.total)]
    for table in summary.tables[:1]:
        for label, row in zip(table.rows.labels, table.cells, strict=True):
            columns = table.columns.labels if table.columns else ("",)
            cells += [
                (f"{label} {name}".strip(), cell)
                for name, cell in zip(columns, row, strict=True)
                if cell.runs
            ]
    rows = [
        (label, str(cell.runs), *(question.brief(cell) if cell.runs else "" for question in QUESTIONS))
        for label, cell in cells
    ]
    return _table(title, ("", "runs", *(question.short for question in QUESTIONS)), rows)


def _table(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = f"<thead><tr>{_cells(heads, 'th')}</tr></thead>" if heads else ""
    body = "".join(f"<tr>{_cells(row, 'td')}</tr>" for row in rows)
    return f"<p><b>{escape(title)}</b></p><table>{head}<tbody>{body}</tbody></table>"


def _cells(texts: Sequence[str], tag: str) -> str:
    return "".join(f'<{tag} style="text-align:left">{escape(text)}</{tag}>' for text in texts)


def _number(value: object) -> str:
    if value is None:
        return "-"
    return f"{value:,.4g}" if isinstance(value, float) else str(value)
