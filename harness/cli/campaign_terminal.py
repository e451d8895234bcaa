"""The answers of a campaign on a terminal, never wider than 80 columns."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table as Grid

from harness.analysis.rows import number
from harness.campaign.questions import QUESTIONS, difference, ratio
from harness.campaign.summary import Cell, Summary, Table
from harness.cli.terminal import plain
from harness.files.wording import counted

WIDTH = 80
NAME_WIDTH = 16
"""A longer label goes on in the next line."""

SHOWN_WORST = 5
LEGEND = "length: median/p95; clear: least, runs below the wanted; planner: p50/p99/max"


def print_summary(summary: Summary, all_tables: bool = False) -> None:
    """Prints the answers on standard output.

    Args:
        summary: the answers.
        all_tables: every table, not the first alone.
    """
    console = Console()
    width = min(WIDTH, console.width)
    ended = ", ".join(f"{plain(outcome)} {count}" for outcome, count in summary.outcomes.items())
    runs = (
        f"{summary.total.runs} of {counted(summary.planned or 0, 'run')}"
        if summary.missing
        else counted(summary.total.runs, "run")
    )
    console.print(f"{plain(summary.name)}: {runs}" + (f": {ended}" if ended else ""))
    if summary.missing:
        are, them = ("is missing", "it") if summary.missing == 1 else ("are missing", "them")
        console.print(f"[bold yellow]not complete[/]: {summary.missing} {are}, --resume flies {them}")
    if not summary.total.runs:
        return
    shown = summary.tables if all_tables else summary.tables[:1]
    for table in shown:
        console.print(_grid(table, summary.total), width=width)
    if not shown:
        grid = _columns("")
        grid.add_row("all runs", *_cells(summary.total))
        console.print(grid, width=width)
    console.print(f" {LEGEND}", style="dim", highlight=False, width=width)
    for duel in summary.duels:
        console.print(
            f"{plain(duel.first)} against {plain(duel.second)} in {counted(duel.pairs, 'pair')} of flights: goals "
            f"reached {difference(duel.success)} points ({duel.only_first} by {plain(duel.first)} alone, "
            f"{duel.only_second} by {plain(duel.second)} alone); length {ratio(duel.length)} times, where both "
            f"reached ({duel.both_reached})",
            highlight=False,
            width=width,
        )
    failed = [run for run in summary.worst if run.outcome != "reached"]
    for run in failed[:SHOWN_WORST]:
        near = "" if run.min_clearance_m is None else f", least clearance {number(run.min_clearance_m)} m"
        console.print(
            f"[bold red]{plain(run.outcome)}[/] run {run.run} ({plain(run.name)}){near}",
            highlight=False,
            width=width,
        )
    if failed:
        console.print(plain(f"again: {failed[0].command}"), highlight=False, soft_wrap=True)
    kept = next((run for run in summary.worst if run.view), None)
    if kept is not None:
        console.print(plain(f"view: {kept.view}"), highlight=False, soft_wrap=True)


def _columns(title: str) -> Grid:
    grid = Grid(title=plain(title), box=box.SIMPLE, title_justify="left", padding=0, pad_edge=False)
    grid.add_column("", min_width=NAME_WIDTH, max_width=NAME_WIDTH, overflow="fold")
    for name in ("runs", *(question.short for question in QUESTIONS)):
        grid.add_column(name, justify="right", no_wrap=True)
    return grid


def _cells(cell: Cell) -> list[str]:
    return [str(cell.runs), *(question.brief(cell) if cell.runs else "" for question in QUESTIONS)]


def _grid(table: Table, total: Cell) -> Grid:
    """A line a cell; with two keys, the first one's value stands above the lines of the second."""
    keys = [table.rows.key] + ([table.columns.key] if table.columns else [])
    grid = _columns(" x ".join(keys))
    for label, cells in zip(table.rows.labels, table.cells, strict=True):
        if table.columns is None:
            grid.add_row(plain(label), *_cells(cells[0]))
            continue
        grid.add_row(f"[bold]{plain(label)}[/]")
        for name, cell in zip(table.columns.labels, cells, strict=True):
            grid.add_row(f" {plain(name)}", *_cells(cell))
    grid.add_section()
    grid.add_row("all runs", *_cells(total))
    return grid
