"""The command `compare`: planners side by side, and its table in 80 columns."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli.options import (
    FAILED,
    AircraftOption,
    ConditionsOption,
    JsonOption,
    SeedOption,
    SettingsOption,
    TurbulenceOption,
    WindOption,
    WorkersOption,
    air,
    bad_input,
    chosen,
    flag,
    load,
    print_json,
    settings_of,
    sources,
    tell_interrupted,
)
from harness.cli.standard_output import say
from harness.files.wording import printable

if TYPE_CHECKING:
    from harness.analysis.rows import Row

WIDTH = 80
LEGEND = (
    "ratio: length over the optimum; clear: least clearance; κ·R: tightest planned turn, above 1 too tight; "
    "tracks: all legs trackable; tse: total system error, m; p99: planner time"
)
NAME_WIDTH = 14
"""A longer name goes on in the next line."""

_STYLE = {"reached": "bold green", "unreachable": "bold yellow"}

SHIELDED = "+shield"
"""Ends the name of a planner that is to fly under the shield."""


def compare(
    scenarios: Annotated[list[str], typer.Argument(metavar="SCENARIO...", help="Files or shipped names.")],
    planners: Annotated[
        str, typer.Option(metavar="A,B,...", help="Kinds, in order; KIND+shield: under the shield.")
    ],
    guidance: Annotated[
        str | None, typer.Option(metavar="X,Y,...", help="Kinds of guidance laws. Default: the scenario's.")
    ] = None,
    aircraft: AircraftOption = None,
    conditions: ConditionsOption = None,
    wind: WindOption = None,
    turbulence: TurbulenceOption = None,
    seed: SeedOption = None,
    settings: SettingsOption = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="The comparison's folder.")] = Path(
        "runs/comparison"
    ),
    kinematic: Annotated[
        bool, flag("--kinematic", "Fly a point that follows every plan exactly, not the aircraft.")
    ] = False,
    workers: WorkersOption = None,
    no_recording: Annotated[bool, flag("--no-recording", "Write no recordings and no overlay.")] = False,
    as_json: JsonOption = False,
) -> int:
    """Flies every planner (under every guidance law) through every scenario: table, figures, report, overlays.

    For example: wayproof compare paper_circles --planners rolling_window,bug2

    Exit status:

    0 every planner reached every goal

    1 one did not, or the software failed in a flight

    2 bad input or usage, nothing flown
    """
    named = [kind.strip() for kind in planners.split(",")]
    laws = [law.strip() for law in guidance.split(",")] if guidance is not None else [None]
    options = [*chosen(None, aircraft, seed, None, conditions), *air(wind, turbulence)]
    fixed = [*options, *settings_of(settings, options)]
    variants = [
        [*chosen(kind.removesuffix(SHIELDED), guidance=law), *fixed, *_shield(kind)]
        for kind in named
        for law in laws
    ]
    loaded = [load(scenario, each) for scenario in scenarios for each in variants]

    from aircraft.airframes import AircraftError
    from harness.cli.terminal import step_bar
    from harness.comparison.comparison import INDEX, SCHEMA, Setup, fly_and_compare
    from harness.files.errors import RunFolderError, WriteError
    from harness.run_files.run_folder import OVERLAY

    setup = Setup(
        recording=not no_recording,
        kinematic=kinematic,
        workers=workers or os.cpu_count() or 1,
        sources=sources(*(kind.removesuffix(SHIELDED) for kind in named)),
        law_sources=sources(*laws),
        shielded=tuple(kind.endswith(SHIELDED) for _ in scenarios for kind in named for _ in laws),
    )
    over = 0
    try:
        with step_bar() as bar:

            def report(told: str) -> None:
                nonlocal over
                over += 1
                bar(over, len(loaded), told)

            comparison = fly_and_compare(loaded, out, setup, report)
    except (RunFolderError, AircraftError) as error:
        raise bad_input(error) from error
    except OSError as error:
        raise WriteError.of("the comparison", out, error) from error
    except KeyboardInterrupt:
        tell_interrupted("comparison", out, INDEX, SCHEMA)
        raise
    if as_json:
        print_json(comparison.plain())
    else:
        print_comparison(comparison.rows)
        say(f"report: {out / 'report.html'}")
        overlays = [out / each.name / OVERLAY for each in loaded]
        for overlay in [each for each in overlays if each.is_file()][:1]:
            say(f"view: {shlex.join(['wayproof', 'view', str(overlay)])}")
    return 0 if comparison.all_reached else FAILED


def _shield(kind: str) -> list[tuple[str, str]]:
    return [("planner.shield", "loiter")] if kind.endswith(SHIELDED) else []


def print_comparison(rows: Sequence[Row]) -> None:
    """One table a scenario on standard output, what its headings mean, and the errors of the software.

    Where one planner flew under several guidance laws, the rows are called after the laws, and the planner is in the
    title.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from harness.analysis.metric import ERROR
    from harness.analysis.registry import METRICS
    from harness.analysis.rows import DASH, ON_TERMINAL
    from harness.cli.terminal import plain

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
