"""The command `compare`: planners side by side, and its table in 80 columns."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from harness.cli.options import (
    FAILED,
    AircraftOption,
    ConditionsOption,
    JsonOption,
    NoRecordingOption,
    SeedOption,
    SettingsOption,
    TurbulenceOption,
    WindOption,
    WorkersOption,
    faults_told,
    flag,
    load,
    marked_incomplete,
    overrides,
    print_json,
    sources,
)
from harness.cli.standard_output import say

if TYPE_CHECKING:
    from harness.analysis.rows import Row

LEGEND: Final = (
    "ratio: length over the optimum; clear: least clearance; κ·R: tightest planned turn, above 1 too tight; "
    "tracks: all legs trackable; tse: total system error, m; p99: planner time"
)


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
    no_recording: NoRecordingOption = False,
    as_json: JsonOption = False,
) -> int:
    """Flies every planner (under every guidance law) through every scenario: table, figures, report, overlays.

    For example: wayproof compare paper_circles --planners rolling_window,bug2

    Exit status:

    0 every planner reached every goal

    1 one did not, or the software failed in a flight

    2 bad input or usage, nothing flown
    """
    from harness.cli.terminal import step_bar
    from harness.comparison.comparison import INDEX, SCHEMA, Setup, fly_and_compare
    from harness.files.errors import WriteError
    from harness.run_files.run_folder import OVERLAY
    from harness.scenario.sections import SHIELDED

    kinds = [kind.strip() for kind in planners.split(",")]
    laws = [law.strip() for law in guidance.split(",")] if guidance is not None else [None]
    fixed = overrides(
        settings, aircraft=aircraft, wind=wind, turbulence=turbulence, seed=seed, conditions=conditions
    )
    variants = [[*overrides(planner=kind, guidance=law), *fixed] for kind in kinds for law in laws]
    loaded = [load(scenario, each) for scenario in scenarios for each in variants]
    setup = Setup(
        recording=not no_recording,
        kinematic=kinematic,
        workers=workers or os.cpu_count() or 1,
        sources=sources(*kinds),
        law_sources=sources(*laws),
        shielded=tuple(kind.endswith(SHIELDED) for _ in scenarios for kind in kinds for _ in laws),
    )
    over = 0
    try:
        with faults_told(marked_incomplete("comparison", out, INDEX, SCHEMA)), step_bar() as bar:

            def report(told: str) -> None:
                nonlocal over
                over += 1
                bar(over, len(loaded), told)

            comparison = fly_and_compare(loaded, out, setup, report)
    except OSError as error:
        raise WriteError.of("the comparison", out, error) from error
    if as_json:
        print_json(comparison.plain())
    else:
        print_comparison(comparison.rows)
        say(f"report: {out / 'report.html'}")
        overlays = [out / each.name / OVERLAY for each in loaded]
        for overlay in [each for each in overlays if each.is_file()][:1]:
            say(f"view: {shlex.join(['wayproof', 'view', str(overlay)])}")
    return 0 if comparison.all_reached else FAILED


def print_comparison(rows: Sequence[Row]) -> None:
    """One table a scenario on standard output, what its headings mean, and the errors of the software.

    Where one planner flew under several guidance laws, the rows are called after the laws, and the planner is in the
    title.
    """
    from harness.analysis.metric import ERROR
    from harness.analysis.registry import METRICS
    from harness.analysis.rows import DASH, ON_TERMINAL
    from harness.cli.terminal import coloured, plain, print_line, print_table

    shown = [next(figure for figure in METRICS if figure.short == short) for short in ON_TERMINAL]
    for name in dict.fromkeys(row.scenario for row in rows):
        own = [row for row in rows if row.scenario == name]
        by_law = all(row.guidance for row in own) and len({row.planner for row in own}) == 1
        lines = [
            [
                plain(row.guidance if by_law else "\n ".join(filter(None, (row.planner, row.guidance)))),
                coloured(row.outcome),
                *(plain(row.text(figure)) or DASH for figure in shown[1:]),
            ]
            for row in own
        ]
        title = f"{name}, {own[0].planner}" if by_law else name
        heads = ("guidance" if by_law else "planner", *(figure.short for figure in shown))
        print_table(title, lines, heads)
    print_line(LEGEND, style="dim")
    for row in rows:
        if row.outcome == ERROR:
            say(f"{row.label}, error: {row.reason}")
