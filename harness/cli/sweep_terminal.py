"""What a person sees of a campaign on a terminal: what would be flown, progress, and how the runs ended."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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

from harness.campaign.flight import Answer
from harness.campaign.runs import CampaignRuns
from harness.cli.terminal import plain
from harness.files.strict_yaml import Scalar
from harness.files.wording import counted, printable

FIRST, LAST = 15, 5
"""Of more runs than both, so many are shown."""

WIDTH: Final = 400
"""A table of runs may be this wide where it does not go to a terminal."""

NAMES: Final = ("scenario", "world", "planner", "aircraft")
"""Columns that begin at the left."""

CELL: Final = 28
"""A longer value is cut short."""

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
def sweep_bar(number: int, done: int) -> Iterator[Callable[[Answer], None] | None]:
    """A bar of runs that are over, with rate and time left, on standard error; None without a terminal.

    Args:
        number: all runs.
        done: how many of them are over already.
    """
    with _bar("flights") as bar:
        if bar is None:
            yield None
            return
        task = bar.add_task("", total=number, completed=done)
        not_reached = 0

        def report(answer: Answer) -> None:
            nonlocal not_reached
            not_reached += answer.row["outcome"] != "reached"
            bar.update(task, advance=1, description=f"{not_reached} not at the goal" if not_reached else "")

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
