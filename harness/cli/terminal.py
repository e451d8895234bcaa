"""What a person sees on a terminal: progress while flying, and the one table of results."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final, TypeAlias

from rich import box
from rich.console import Console, JustifyMethod
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from harness.cli.standard_output import say
from harness.files.wording import printable

FlightReport: TypeAlias = Callable[[float, float, str], None]
"""Takes simulated time (s), distance to go (m) and what is being done."""

StepReport: TypeAlias = Callable[[int, int, str], None]
"""Takes how many steps are done, of how many, and what is being done."""

LINE_EVERY_S: Final = 10.0
"""Without a terminal, progress is a line on standard error at this interval."""

MOST_COLUMNS: Final = 80
"""Tables are never wider."""

LEAST_NAME: Final = 14
"""Figures are kept in one line where they leave the first column this width."""

OUTCOME_STYLE: Final = {"reached": "bold green", "unreachable": "bold yellow"}
"""Colour of an outcome; all others are bold red."""


@contextmanager
def progress_bar(straight_m: float) -> Iterator[FlightReport]:
    """A progress bar of one flight on standard error; a line every ten seconds where that is not a terminal.

    Args:
        straight_m: distance from start to goal.
    """
    columns = (
        TextColumn("{task.fields[time_s]:7.0f} s  {task.fields[speed_up]:5.0f} x real time"),
        TextColumn("{task.fields[to_go_m]:8.0f} m to go  {task.description}"),
    )
    with _bar(*columns, time_s=0.0, speed_up=0.0, to_go_m=straight_m) as show:

        def report(time_s: float, to_go_m: float, state: str) -> None:
            left_m, told = max(0.0, to_go_m), plain(state)
            line = f"{time_s:.0f} s flown, {left_m:.0f} m to go, {told}"
            show(max(0.0, straight_m - to_go_m), straight_m, told, line, time_s=time_s, to_go_m=left_m)

        yield report


@contextmanager
def step_bar() -> Iterator[StepReport]:
    """A bar of steps done, with the time left, on standard error; without a terminal, lines likewise."""
    with _bar(TextColumn("{task.description}"), TimeRemainingColumn()) as show:

        def report(done: int, of: int, what: str) -> None:
            told = f"{done} of {of}: {plain(what)}" if what else f"{done} of {of}"
            show(done, of, told, told)

        yield report


@contextmanager
def _bar(*columns: TextColumn | TimeRemainingColumn, **fields: Any) -> Iterator[Callable[..., None]]:
    """What shows progress: it takes what is done, the whole, a description, a line for a log, and fields."""
    console = Console(stderr=True)
    if not console.is_terminal:
        state = ["starting up"]

        def note(_done: float, _whole: float, _told: str, line: str, **_fields: float) -> None:
            state[0] = line

        with _progress_lines(lambda: state[0]):
            yield note
        return
    bar = Progress(
        BarColumn(bar_width=20), *columns, console=console, transient=True, speed_estimate_period=120.0
    )
    with bar:
        task = bar.add_task("starting up", total=None, **fields)

        def show(done: float, whole: float, told: str, _line: str, **values: Any) -> None:
            if "time_s" in values:
                elapsed_s = bar.tasks[0].elapsed or 0.0
                values["speed_up"] = values["time_s"] / elapsed_s if elapsed_s > 0 else 0.0
            bar.update(task, completed=done, total=whole, description=told, **values)

        yield show


@contextmanager
def _progress_lines(state: Callable[[], str]) -> Iterator[None]:
    """Prints a line on standard error every ten seconds, for those who read a log."""
    over = threading.Event()

    def tell() -> None:
        while not over.wait(LINE_EVERY_S):
            say(f"wayproof: {state()}", err=True)

    thread = threading.Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def print_table(
    title: str, rows: Mapping[str, str] | Sequence[Sequence[str]], columns: Sequence[str] = ()
) -> None:
    """Prints a table on standard output, at most `MOST_COLUMNS` wide; what is too long goes on below itself.

    Args:
        title: text of others too: what rich takes for markup in it is shown as it is.
        rows: name and value of each row; or the cells of each, where `columns` are given. They may have markup.
        columns: heading of each column; all but the first hold figures and are aligned to the right.
    """
    console = Console()
    table = Table(
        title=plain(title), box=box.SIMPLE, show_header=bool(columns), title_justify="left", pad_edge=False
    )
    if len(columns) > 4:
        table.padding = 0
    width, lines = min(MOST_COLUMNS, console.width), list(rows.items() if isinstance(rows, Mapping) else rows)
    figures = zip(columns[1:], *(cells[1:] for cells in lines if columns and len(cells) > 1), strict=True)
    narrow = (
        sum(1 + max(Text.from_markup(cell).cell_len for cell in each) for each in figures)
        <= width - LEAST_NAME
    )
    for index, heading in enumerate(columns):
        side: JustifyMethod = "right" if index else "left"
        table.add_column(printable(heading), justify=side, overflow="fold", no_wrap=bool(index) and narrow)
    if not columns:
        table.add_column(style="dim", no_wrap=True)
        table.add_column(overflow="fold")
    for cells in lines:
        table.add_row(*map(printable, cells))
    console.print(table, width=width)


def print_line(text: str, style: str | None = None) -> None:
    """Prints a line that may have markup on standard output, wrapped at `MOST_COLUMNS`."""
    console = Console()
    console.print(printable(text), style=style, highlight=False, width=min(MOST_COLUMNS, console.width))


def coloured(outcome: str) -> str:
    """An outcome in its colour."""
    return f"[{OUTCOME_STYLE.get(outcome, 'bold red')}]{plain(outcome)}[/]"


def plain(text: str) -> str:
    """Text of others with nothing in it that rich takes for markup, or a terminal for a command."""
    return escape(printable(text))


def legible(value: float | None) -> str:
    """A number as a person reads it; a dash where there is none."""
    if value is None or value != value:
        return "-"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def spread(values: Mapping[str, float | None], names: Sequence[str] = ("rms", "p95", "max")) -> str:
    """Figures of one error, each after its name; their unit, once, comes after them."""
    return " / ".join(f"{name} {legible(values[name])}" for name in names)
