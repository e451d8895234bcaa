"""What a person sees of a campaign on a terminal: the answers, in 80 columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from harness.analysis.metric import number
from harness.campaign.cell import QUESTIONS, Cell
from harness.campaign.paired import Duel
from harness.campaign.summary import Summary, Table
from harness.cli.standard_output import say
from harness.cli.terminal import coloured, plain, print_line, print_table
from harness.files.wording import counted

SHOWN_WORST: Final = 5
LEGEND: Final = (
    "reached, below the wanted clearance, tracks: 95 % interval; "
    "length over the optimum: median/p95; plan: p99/max"
)


def print_summary(summary: Summary, all_tables: bool = False) -> None:
    """Prints the answers on standard output, with `all_tables` every table, not the first alone."""
    _print_counts(summary)
    if not summary.total.runs:
        return
    heads = ("", "runs", *(question.short for question in QUESTIONS))
    whole = ("all runs", *_cells(summary.total))
    for table in summary.tables if all_tables else summary.tables[:1]:
        keys = [table.rows.key, *([table.columns.key] if table.columns else [])]
        print_table(" x ".join(keys), [*_lines(table), whole], heads)
    if not summary.tables:
        print_table("", [whole], heads)
    print_line(LEGEND, style="dim")
    for duel in summary.duels:
        _print_duel(duel)
    _print_worst(summary)


def _print_worst(summary: Summary) -> None:
    """The runs that failed, and how to fly and to see one again."""
    failed = [run for run in summary.worst if run.outcome != "reached"]
    for run in failed[:SHOWN_WORST]:
        near = "" if run.min_clearance_m is None else f", least clearance {number(run.min_clearance_m)} m"
        print_line(f"{coloured(run.outcome)} run {run.run} ({plain(run.name)}){near}")
    if failed:
        say(f"again: {failed[0].command}")
    for view in [run.view for run in summary.worst if run.view][:1]:
        say(f"view: {view}")


def _print_counts(summary: Summary) -> None:
    """How many runs there are, how they ended, and what is missing."""
    total, missing = summary.total.runs, summary.missing
    runs = f"{total} of {counted(summary.planned or 0, 'run')}" if missing else counted(total, "run")
    ended = ", ".join(f"{outcome} {count}" for outcome, count in summary.outcomes.items())
    print_line(plain(f"{summary.name}: {runs}{ended and f': {ended}'}"))
    if summary.never:
        print_line(plain(summary.never))
    if missing:
        are, them = ("is missing", "it") if missing == 1 else ("are missing", "them")
        print_line(f"[bold yellow]not complete[/]: {missing} {are}, --resume flies {them}")


def _print_duel(duel: Duel) -> None:
    """Which figures of two planners differ beyond chance, at 5 %."""
    first, second = plain(duel.first), plain(duel.second)
    differ = [each for each in duel.figures if each.p is not None and each.p < 0.05]
    figures = "; ".join(f"{plain(each.figure)} {each.difference.text()}" for each in differ)
    print_line(
        f"{first} against {second} in {counted(duel.pairs, 'pair')} of flights ({duel.only_first} reached by "
        f"{first} alone, {duel.only_second} by {second} alone): "
        + (f"figures that differ at 5 %: {figures}" if figures else "no figure differs at 5 %")
    )


def _cells(cell: Cell) -> list[str]:
    return [str(cell.runs), *(question.text(cell) if cell.runs else "" for question in QUESTIONS)]


def _lines(table: Table) -> list[Sequence[str]]:
    """A line a cell; with two keys, the first one's value stands above the lines of the second."""
    lines: list[Sequence[str]] = []
    for label, cells in zip(table.rows.labels, table.cells, strict=True):
        if table.columns is None:
            lines.append((plain(label), *_cells(cells[0])))
            continue
        lines.append((f"[bold]{plain(label)}[/]",))
        names = zip(table.columns.labels, cells, strict=True)
        lines += [(f" {plain(name)}", *_cells(cell)) for name, cell in names]
    return lines
