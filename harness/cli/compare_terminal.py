"""What a person sees of a comparison on a terminal: progress while flying, a table in 80 columns after it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.table import Table

from harness.analysis.metric import ERROR
from harness.analysis.registry import METRICS
from harness.analysis.rows import DASH, ON_TERMINAL, Row
from harness.cli.terminal import plain
from harness.comparison.flights import Progress as Report
from harness.files.wording import printable
from harness.scenario.scenario import Scenario

WIDTH = 80
LEGEND = (
    "ratio: length over the optimum; clear: least clearance; κ·R: tightest planned turn, above 1 too tight; "
    "tracks: all legs trackable; tse: total system error, m; p99: planner time"
)
NAME_WIDTH = 14
"""A longer name goes on in the next line."""

_STYLE = {"reached": "bold green", "unreachable": "bold yellow"}


@contextmanager
def comparison_bar(scenarios: Sequence[Scenario]) -> Iterator[Report | None]:
    """A progress bar on standard error, or None where that is not a terminal.

    Args:
        scenarios: one a flight, in the order of the flights' indices.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (BarColumn(bar_width=20), MofNCompleteColumn(), TextColumn("flights  {task.description}"))
    straight_m = [math.dist(each.mission.start_m, each.mission.goal_m) for each in scenarios]
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=len(scenarios))

        flown: dict[int, float] = {}

        def report(index: int, time_s: float, to_go_m: float, state: str) -> None:
            each = scenarios[index]
            over = state not in ("waiting", "following", "holding")
            flown[index] = 1.0 if over else min(max(1.0 - to_go_m / straight_m[index], 0.0), 0.99)
            text = f"{each.name}, {each.planner.kind}, {each.guidance.kind}: {time_s:.0f} s, {state}"
            bar.update(task, completed=sum(flown.values()), description=plain(text))

        yield report


def print_comparison(rows: Sequence[Row]) -> None:
    """One table a scenario on standard output, what its headings mean, and the errors of the software.

    Where one planner flew under several guidance laws, the rows are called after the laws, and the planner is in the
    title.
    """
    console = Console()
    shown = [next(figure for figure in METRICS if figure.short == short) for short in ON_TERMINAL]
    for name in dict.fromkeys(row.scenario for row in rows):
        own = [row for row in rows if row.scenario == name]
        by_law = all(row.guidance for row in own) and len({row.planner for row in own}) == 1
        table = Table(
            title=plain(f"{name}, {own[0].planner}" if by_law else name),
            box=box.SIMPLE,
            show_edge=False,
            title_justify="left",
            padding=0,
        )
        heading = "guidance" if by_law else "planner"
        table.add_column(heading, min_width=NAME_WIDTH, max_width=NAME_WIDTH, no_wrap=True)
        for figure in shown:
            table.add_column(
                figure.short, justify="left" if figure.short == "outcome" else "right", no_wrap=True
            )
        for row in own:
            style = _STYLE.get(row.outcome, "bold red")
            cells = [plain(row.text(figure)) or DASH for figure in shown]
            cells[0] = f"[{style}]{cells[0]}[/]"
            table.add_row(plain("\n".join(_name_lines(row, by_law))), *cells)
        console.print(table, width=min(WIDTH, console.width))
        console.print()
    console.print(LEGEND, style="dim", highlight=False, width=min(WIDTH, console.width))
    for row in rows:
        if row.outcome == ERROR:
            console.print(f"{plain(row.label)}, error: {plain(row.reason)}", highlight=False, soft_wrap=True)


def _name_lines(row: Row, by_law: bool) -> list[str]:
    """The name of a row in lines of `NAME_WIDTH`: planner and law never share one."""
    if by_law:
        return _folded(row.guidance)
    if not row.guidance:
        return _folded(row.planner)
    return [*_folded(row.planner), *(f" {line}" for line in _folded(row.guidance, NAME_WIDTH - 1))]


def _folded(name: str, width: int = NAME_WIDTH) -> list[str]:
    """A name in lines, each as long as can be, broken between its words: after `_`, `-`, `.` or `:`.

    A word that is too long for a line is cut.
    """
    lines = [""]
    for word in re.findall(r"[^_.:-]*[_.:-]+|[^_.:-]+", printable(name)):
        if len(lines[-1]) + len(word) > width:
            lines.append("")
        lines[-1] += word
    return [line[at : at + width] for line in lines if line for at in range(0, len(line), width)]
