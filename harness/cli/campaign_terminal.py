"""What a person sees of a campaign on a terminal: what would be flown, progress, and the answers in 80 columns."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Final

from rich import box
from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from harness.analysis.metric import number
from harness.campaign.flight import Answer
from harness.campaign.questions import QUESTIONS, difference, ratio
from harness.campaign.runs import CampaignRuns
from harness.campaign.summary import Cell, Summary
from harness.campaign.summary import Table as Answers
from harness.cli.terminal import plain, progress_lines
from harness.files.strict_yaml import Scalar
from harness.files.wording import counted, printable

FIRST, LAST = 15, 5
"""Numbers of the first and last runs that are shown where there are more runs than both together."""

WIDTH: Final = 400
"""A table of runs may be this wide where it does not go to a terminal."""

NAMES: Final = ("scenario", "world", "planner", "aircraft")
"""Columns that begin at the left."""

CELL: Final = 28
"""A longer value is cut short."""

SUMMARY_WIDTH: Final = 80
"""The answers are never wider."""

NAME_WIDTH = 16
"""A longer label goes on in the next line."""

SHOWN_WORST = 5
LEGEND = "length: median/p95; clear: least, runs below the wanted; planner: p50/p99/max"

_STYLE: Final = {"reached": "bold green", "unreachable": "bold yellow"}


class _Rate(ProgressColumn):
    """Steps a second."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.2f}/s" if task.speed else "")


@contextmanager
def check_bar(number: int) -> Iterator[Callable[[int], None] | None]:
    """A bar of scenarios that have been checked, on standard error; None where that is not a terminal."""
    with _bar("checked") as bar:
        if bar is None:
            yield None
            return
        task = bar.add_task("", total=number)
        yield lambda done: bar.update(task, completed=done)


@contextmanager
def sweep_bar(number: int, done: int) -> Iterator[Callable[[Answer], None]]:
    """A bar of runs that are over, with rate and time left, on standard error; without a terminal a line at times.

    Args:
        number: all runs.
        done: how many of them are over already.
    """
    over, not_reached = done, 0
    with _bar("flights") as bar:
        task = None if bar is None else bar.add_task("", total=number, completed=done)

        def told() -> str:
            return f"{not_reached} not at the goal" if not_reached else ""

        def report(answer: Answer) -> None:
            nonlocal not_reached, over
            over += 1
            not_reached += answer.row["outcome"] != "reached"
            if bar is not None and task is not None:
                bar.update(task, advance=1, description=told())

        def line() -> str:
            return ", ".join(filter(None, (f"{over} of {counted(number, 'flight')}", told())))

        with progress_lines(line) if bar is None else nullcontext():
            yield report


@contextmanager
def _bar(unit: str) -> Iterator[Progress | None]:
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TextColumn(unit),
        _Rate(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=console, transient=True, speed_estimate_period=120.0) as bar:
        yield bar


def print_runs(runs: CampaignRuns) -> None:
    """What would be flown, a line a run, those in the middle left out where there are many.

    Where the terminal is too narrow, columns that do not fit go on below, the number of the run before them.
    """
    campaign, console = runs.campaign, Console()
    if not console.is_terminal:
        console.width = WIDTH
    console.print(
        f"{printable(campaign.name)}: {counted(len(runs), 'run')} of {counted(runs.cases, 'case')}, "
        f"root seed {campaign.seed}, recordings: {campaign.recordings}",
        highlight=False,
        markup=False,
    )
    number, columns = _columns(runs)
    room = console.width - _wide(number) - 1
    while columns:
        widths = itertools.accumulate(map(_wide, columns))
        fit = max(sum(wide <= room for wide in widths), 1)
        table = Table(box=box.SIMPLE, padding=(0, 1, 0, 0), pad_edge=False)
        for head, _ in (number, *columns[:fit]):
            justify: JustifyMethod = "left" if head in NAMES else "right"
            table.add_column(plain(head), justify=justify, no_wrap=True)
        for row in zip(number[1], *(cells for _, cells in columns[:fit]), strict=True):
            table.add_row(*map(plain, row))
        console.print(table)
        columns = columns[fit:]


Column = tuple[str, list[str]]
"""Head, and a cell a line."""


def _columns(runs: CampaignRuns) -> tuple[Column, list[Column]]:
    """The numbers of the runs to be shown, and the other columns."""
    many = len(runs) > FIRST + LAST
    numbers = [*range(FIRST), *range(len(runs) - LAST, len(runs))] if many else range(len(runs))
    told = [runs.run(number) for number in numbers]
    lines = [{name: _shown(value) for name, value in each.cells().items()} for each in told]
    for cells in lines:
        cells["seed"] = cells.pop("seed")  # last
    if many:
        lines.insert(FIRST, dict.fromkeys(lines[0], "..."))
    number, *others = ((name.replace(".", ".\n"), [cells[name] for cells in lines]) for name in lines[0])
    return number, others


def _wide(column: Column) -> int:
    """Characters of a column and the two spaces after it."""
    head, cells = column
    return max(map(cell_len, (*head.split("\n"), *cells))) + 2


def _shown(value: Scalar) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else "none" if value is None else str(value)
    return text if len(text) <= CELL else f"{text[: CELL - 3]}..."


def print_summary(summary: Summary, all_tables: bool = False) -> None:
    """Prints the answers on standard output.

    Args:
        summary: the answers.
        all_tables: every table, not the first alone.
    """
    console = Console()
    width = min(SUMMARY_WIDTH, console.width)
    ended = ", ".join(f"{plain(outcome)} {count}" for outcome, count in summary.outcomes.items())
    runs = (
        f"{summary.total.runs} of {counted(summary.planned or 0, 'run')}"
        if summary.missing
        else counted(summary.total.runs, "run")
    )
    console.print(f"{plain(summary.name)}: {runs}" + (f": {ended}" if ended else ""))
    if summary.never:
        console.print(plain(summary.never), highlight=False)
    if summary.missing:
        are, them = ("is missing", "it") if summary.missing == 1 else ("are missing", "them")
        console.print(f"[bold yellow]not complete[/]: {summary.missing} {are}, --resume flies {them}")
    if not summary.total.runs:
        return
    shown = summary.tables if all_tables else summary.tables[:1]
    for table in shown:
        console.print(_grid(table, summary.total), width=width)
    if not shown:
        grid = _heads("")
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


def _heads(title: str) -> Table:
    grid = Table(title=plain(title), box=box.SIMPLE, title_justify="left", padding=0, pad_edge=False)
    grid.add_column("", min_width=NAME_WIDTH, max_width=NAME_WIDTH, overflow="fold")
    for name in ("runs", *(question.short for question in QUESTIONS)):
        grid.add_column(name, justify="right", no_wrap=True)
    return grid


def _cells(cell: Cell) -> list[str]:
    return [str(cell.runs), *(question.brief(cell) if cell.runs else "" for question in QUESTIONS)]


def _grid(table: Answers, total: Cell) -> Table:
    """A line a cell; with two keys, the first one's value stands above the lines of the second."""
    keys = [table.rows.key] + ([table.columns.key] if table.columns else [])
    grid = _heads(" x ".join(keys))
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
