"""Output on a terminal: lines without foreign control characters, progress, the one table of results."""

from __future__ import annotations

import operator
import os
import shlex
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Final, TextIO, TypeAlias

import typer
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from harness.files.wording import printable

FlightReport: TypeAlias = Callable[[float, float, str], None]
"""Takes simulated time (s), distance to go (m), and a text on what is being done."""
StepReport: TypeAlias = Callable[[int, int, str], None]
"""Takes the number of steps done, of all steps, and a text on what is being done."""
LINE_EVERY_S: Final = 10.0  # without a terminal, progress is a line on standard error at this interval
MOST_COLUMNS: Final = 80  # tables are at most this many letters wide
LEAST_NAME_WIDTH: Final = 14  # figures are kept in one line where they leave the first column this width
OUTCOME_STYLE: Final = {"reached": "bold green", "unreachable": "bold yellow"}
"""Style of an outcome; all others are bold red."""


@contextmanager
def progress_bar(straight_m: float, silent: bool = False) -> Iterator[FlightReport]:
    """Shows a progress bar of one flight on standard error, or a line every ten seconds where that is no terminal."""
    with _bar(silent) as show:
        begun_s = cache(time.monotonic)  # time of the first report: what goes before it is no flight

        def report(time_s: float, to_go_m: float, state: str) -> None:
            flown = f"{time_s:.0f} s flown, {time_s / max(time.monotonic() - begun_s(), 1e-3):.0f} x real time"
            left_m = max(0.0, to_go_m)
            show(straight_m - left_m, straight_m, f"{flown}, {left_m:.0f} m to go, {plain(state)}")

        yield report


@contextmanager
def step_bar(silent: bool = False) -> Iterator[StepReport]:
    """Shows a bar of steps done, with the time left, on standard error, or lines where that is no terminal."""
    with _bar(silent, TimeRemainingColumn()) as show:

        def report(done: int, of: int, what: str) -> None:
            show(done, of, f"{done} of {of}: {plain(what)}" if what else f"{done} of {of}")

        yield report


@contextmanager
def _bar(silent: bool, *columns: ProgressColumn) -> Iterator[Callable[[float, float, str], None]]:
    """Gives a function to show progress: of the part done, the whole, and a text beside the bar or for a line."""
    console = Console(stderr=True)
    if silent:
        yield lambda *_: None
    elif console.is_interactive and sys.stderr.isatty():  # FORCE_COLOR makes a pipe the first
        shown = (BarColumn(bar_width=20), TextColumn("{task.description}"), *columns)
        with Progress(*shown, console=console, transient=True, speed_estimate_period=120.0) as bar:
            task = bar.add_task("starting up", total=None)
            yield lambda done, whole, text: bar.update(task, completed=done, total=whole, description=text)
    else:
        lines, ended = ["starting up"], threading.Event()

        def print_lines() -> None:
            while not ended.wait(LINE_EVERY_S):
                say(f"wayproof: {lines[-1]}", err=True)

        thread = threading.Thread(target=print_lines, daemon=True)
        thread.start()
        try:
            yield lambda _done, _whole, text: operator.setitem(lines, 0, text)
        finally:
            ended.set()
            thread.join()


def print_table(title: str, rows: Mapping[str, str] | Sequence[Sequence[str]], columns: Sequence[str] = ()) -> None:
    """Prints a table on standard output, at most `MOST_COLUMNS` wide; what is too long goes on below itself.

    `rows` are name and value of each row; or the cells of each, where `columns` names them, all but the first aligned
    right. Rows may have markup; what rich takes for markup in the title is shown as it is.
    """
    console = Console()
    width = min(MOST_COLUMNS, console.width)
    table = Table(title=plain(title), box=box.SIMPLE, show_header=bool(columns), title_justify="left", pad_edge=False)
    lines = [[*map(printable, cells)] for cells in (rows.items() if isinstance(rows, Mapping) else rows)]
    if columns:
        room = _add_columns(table, lines, columns, width)
        for name, *cells in lines:
            table.add_row(_broken(name, room), *cells)
    else:
        table.add_column(style="dim", no_wrap=True)
        table.add_column(overflow="fold")
        for cells in lines:
            table.add_row(*cells)
    console.print(table, width=width)


def _add_columns(table: Table, lines: Sequence[Sequence[str]], columns: Sequence[str], width: int) -> int:
    """Adds a column of names, and figures that are in one line where they fit; returns the room of a name."""
    many = len(columns) > 4
    table.padding = 0 if many else (0, 1)
    figures = zip(columns[1:], *(cells[1:] for cells in lines if len(cells) > 1), strict=True)
    widths = [max(Text.from_markup(cell).cell_len for cell in each) for each in figures]
    taken = sum(widths) + len(widths) * (1 if many else 3)
    fits = taken <= width - LEAST_NAME_WIDTH
    table.add_column(printable(columns[0]), overflow="fold")
    for heading in columns[1:]:
        table.add_column(printable(heading), justify="right", overflow="fold", no_wrap=fits)
    return width - 2 - taken if fits else LEAST_NAME_WIDTH - 4


def _broken(name: str, room: int) -> str:
    """Breaks a name longer than `room` letters behind each plus, or else each underscore; rich folds others."""
    for mark in "+_":
        if max(line.cell_len for line in Text.from_markup(name).split()) > room:
            name = name.replace(mark, f"{mark}\n ")
    return name


def print_line(text: str, style: str | None = None) -> None:
    """Prints a line that may have markup on standard output, wrapped at `MOST_COLUMNS`."""
    console = Console()
    console.print(printable(text), style=style, highlight=False, width=min(MOST_COLUMNS, console.width))


def coloured(outcome: str) -> str:
    """Returns an outcome with the markup of its colour."""
    return f"[{OUTCOME_STYLE.get(outcome, 'bold red')}]{plain(outcome)}[/]"


def plain(text: str) -> str:
    """Escapes foreign text, so that rich finds no markup in it and a terminal no command."""
    return escape(printable(text))


def legible(value: float | None) -> str:
    """Formats a number for people; a dash where there is none."""
    if value is None or value != value:
        return "-"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def spread(values: Mapping[str, float | None], names: Sequence[str] = ("rms", "p95", "max")) -> str:
    """Returns figures of one error, each after its name; their unit, once, comes after them."""
    return " / ".join(f"{name} {legible(values[name])}" for name in names)


def say(text: str, *, err: bool = False) -> None:
    """Prints a line on standard output or standard error, with control characters in it spelt out."""
    typer.echo(printable(text), err=err)


def say_view(recorded: Iterable[Path]) -> None:
    """Says how to see the first of some recordings or run folders that is there."""
    if path := next(filter(Path.exists, recorded), None):
        say(f"view: {shlex.join(['wayproof', 'view', str(path)])}")


def results_alone() -> None:
    """Reserves the standard output of the process for what this program prints as its result.

    What code of others writes past Python, from C or a process of its own, goes to standard error, so that it cannot
    get into `--json`. So does what is printed when the interpreter ends, once `results_over` was called.
    """
    try:
        results, aside = os.dup(sys.stdout.fileno()), sys.stderr.fileno()
    except (OSError, ValueError):
        return  # no file of the process, or a closed one
    sys.stdout.flush()
    os.dup2(aside, sys.stdout.fileno())
    sys.stdout = open(  # noqa: SIM115  it stays open to the end
        results,
        "w",
        encoding=sys.stdout.encoding,
        errors=sys.stdout.errors,
        buffering=1 if os.isatty(results) else -1,
    )


def results_over() -> None:
    """Flushes the result; all that is printed later goes to standard error."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        to_nowhere(sys.stdout)
    sys.stdout = sys.stderr


@contextmanager
def output_kept_up() -> Iterator[None]:
    """Lets a reader go away (`wayproof fly ... | head -1`) without changing what is done or the exit status."""
    stream = sys.stdout
    sys.stdout = _Unread(stream)
    try:
        yield
        sys.stdout.flush()
    finally:
        sys.stdout = stream


class _Unread:
    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        self._quietly(lambda: self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        self._quietly(self._stream.flush)

    def _quietly(self, action: Callable[[], object]) -> None:
        try:
            action()
        except BrokenPipeError:
            to_nowhere(self._stream)
        except OSError as error:
            to_nowhere(self._stream)
            raise OSError(error.errno, error.strerror, "standard output") from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def to_nowhere(stream: TextIO) -> None:
    """Loses all that is still to be written to a stream, so that the interpreter does not try again at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
