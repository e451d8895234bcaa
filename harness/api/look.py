"""How results look in a notebook: the tables of the command line, as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow as pa


def flight_html(title: str, metrics: Mapping[str, Any]) -> str:
    """The table that `fly` and `check` print at their end."""
    from rich.text import Text

    if metrics.get("check") is not None:
        from harness.cli.flight_rows import verdict_rows as rows
    else:
        from harness.cli.flight_rows import flight_rows as rows
    return _table(title, (), [(name, Text.from_markup(text).plain) for name, text in rows(metrics).items()])


def comparison_html(title: str, table: pa.Table) -> str:
    """A row a scenario and planner, with the figures that a terminal shows."""
    from harness.analysis.rows import COMPARED, ON_TERMINAL

    shown = [metric for metric in COMPARED.values() if metric.short in ON_TERMINAL]
    rows = [
        (row["scenario"], row["planner"], *(metric.text(row[metric.name]) for metric in shown))
        for row in table.to_pylist()
    ]
    return _table(title, ["scenario", "planner", *(metric.label for metric in shown)], rows)


def _table(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = f"<thead><tr>{_cells(heads, 'th')}</tr></thead>" if heads else ""
    body = "".join(f"<tr>{_cells(row, 'td')}</tr>" for row in rows)
    return f"<p><b>{escape(title)}</b></p><table>{head}<tbody>{body}</tbody></table>"


def _cells(texts: Sequence[str], tag: str) -> str:
    return "".join(f'<{tag} style="text-align:left">{escape(text)}</{tag}>' for text in texts)
