"""What a person sees of a campaign on a terminal: what would be flown, progress, and how the runs ended."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from rich import box
from rich.console import Console
from rich.markup import escape
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

from harness.campaign_cells import Run
from harness.campaign_runs import CampaignRuns
from harness.strict_yaml import Scalar
from harness.sweep_flight import Answer
from harness.wording import counted

FIRST, LAST = 15, 5
"""Of more runs than both, so many are shown."""

WIDTH: Final = 400
"""A table of runs may be this wide; a terminal that is not goes on in the next line."""

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
    """What would be flown, a line a run, those in the middle left out where there are many."""
    campaign, console = runs.campaign, Console(width=WIDTH)
    console.print(
        f"{campaign.name}: {counted(len(runs), 'run')} of {counted(runs.cases, 'case')}, "
        f"root seed {campaign.seed}, recordings: {campaign.recordings}",
        highlight=False,
        markup=False,
    )
    table = Table(box=box.SIMPLE, padding=(0, 1, 0, 0), pad_edge=False)
    for name in ("run", "case"):
        table.add_column(name, justify="right", no_wrap=True)
    for name in ("scenario", "world", "planner", "aircraft"):
        table.add_column(name, no_wrap=True)
    for name in runs.varied:
        table.add_column(escape(name.replace(".", ".\n")), justify="right", no_wrap=True)
    table.add_column("seed", justify="right", no_wrap=True)
    many = len(runs) > FIRST + LAST
    for number in range(FIRST if many else len(runs)):
        table.add_row(*_cells(runs.run(number)))
    if many:
        table.add_row(*["..."] * len(table.columns))
        for number in range(len(runs) - LAST, len(runs)):
            table.add_row(*_cells(runs.run(number)))
    console.print(table)


def _cells(run: Run) -> list[str]:
    varied = [_shown(value) for value in run.varied.values()]
    words = [run.scenario, run.world, run.planner, run.aircraft, *varied]
    return [str(run.run), str(run.case), *map(escape, words), str(run.seed)]


def _shown(value: Scalar) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else "none" if value is None else str(value)
    return text if len(text) <= CELL else f"{text[: CELL - 3]}..."
