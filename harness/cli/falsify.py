"""The command `falsify`: the mildest condition that makes a run fail."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from harness.cli.options import (
    AircraftOption,
    JsonOption,
    PlannerOption,
    ScenarioArgument,
    SeedOption,
    SettingsOption,
    bad_input,
    chosen,
    load,
    print_json,
    settings_of,
    told_apart,
)
from harness.cli.standard_output import say

if TYPE_CHECKING:
    from harness.falsify.breaking_point import Until
    from harness.falsify.keys import Vary
    from harness.scenario.scenario import Scenario

RUNS_A_KEY: Final = 40


def falsify(
    scenario: ScenarioArgument,
    vary: Annotated[
        list[str],
        typer.Option(metavar="KEY.PATH=LO:HI", help="From the mild end LO to HI; can be repeated."),
    ],
    planner: PlannerOption = None,
    aircraft: AircraftOption = None,
    seed: SeedOption = None,
    settings: SettingsOption = None,
    until: Annotated[
        Literal["failed", "untrackable"],
        typer.Option(
            metavar="WHAT", help="failed: goal not reached; untrackable: that, or a leg not tracked."
        ),
    ] = "failed",
    runs: Annotated[
        int | None,
        typer.Option(metavar="N", min=2, help=f"Number of conditions. Default: {RUNS_A_KEY} a key."),
    ] = None,
    seeds: Annotated[
        int, typer.Option(metavar="N", min=1, help="Flights of a condition, which fails if one fails.")
    ] = 1,
    tolerance: Annotated[
        float, typer.Option(metavar="SHARE", help="Precision, as a share of each range.")
    ] = 0.01,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="The folder. Default: its own in runs/SCENARIO."),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Searches for the mildest condition that makes a flight fail, and writes it as a scenario.

    The answer is the mildest failure found. A scan in equal steps finds it; a failing range narrower than a step may be
    missed, and more --runs make the steps finer.

    LO is the mild end; LO > HI if smaller is harder. With several keys, the key furthest from its mild end counts.

    For example: wayproof falsify aerosonde_forest --vary environment.wind.speed_mps=0:20

    Exit status:

    0 searched, with or without a failure; the last line says which

    2 bad input or usage, nothing written
    """
    if not 0.0 < tolerance < 1.0:
        raise typer.BadParameter(f"is {tolerance:g}; must be between 0 and 1", param_hint="--tolerance")
    ranges = [range_of(text) for text in vary]
    options = chosen(planner, aircraft, seed)
    fixed = [*options, *settings_of(settings, options)]
    return _search(
        scenario, fixed, ranges, until, runs or RUNS_A_KEY * len(ranges), seeds, tolerance, out, as_json
    )


def _search(
    scenario: str,
    fixed: list[tuple[str, str]],
    ranges: list[tuple[str, float, float]],
    until: Until,
    runs: int,
    seeds: int,
    tolerance: float,
    out: Path | None,
    as_json: bool,
) -> int:
    from harness.cli.falsify_terminal import breaking_rows, last_line
    from harness.cli.terminal import print_table, step_bar
    from harness.falsify.breaking_point import FALSIFIED, INDEX
    from harness.falsify.breaking_point import falsify as search
    from harness.falsify.keys import vary_of
    from harness.files.errors import RunFolderError

    def loaded(replaced: Any) -> Scenario:
        return load(scenario, [*fixed, *replaced])

    varied = vary_of(loaded, ranges, [name for name, _ in fixed], tolerance)
    folder = out or Path("runs") / loaded(()).name / f"{_folder_name(varied)}{told_apart(fixed, named=())}"
    flights = 0

    def ended(*step: Any) -> None:
        nonlocal flights
        flights += 1
        if report is not None:
            report(*step)

    try:
        with step_bar() as report:
            found = search(
                loaded,
                varied,
                folder,
                flown=_flown,
                until=until,
                conditions=runs,
                seeds=seeds,
                tolerance=tolerance,
                progress=ended,
            )
    except RunFolderError as error:
        raise bad_input(error) from error
    except KeyboardInterrupt:
        told = f"the flights so far are in {folder / INDEX}" if flights else "no flight had ended yet"
        say(f"wayproof: interrupted; {told}", err=True)
        raise
    if as_json:
        print_json(found.plain())
        return 0
    print_table(f"{found.scenario}: {found.planner}, {found.aircraft}", breaking_rows(found))
    if found.found is not None:
        say(f"again: {shlex.join(['wayproof', 'fly', str(folder / FALSIFIED)])}")
    say(last_line(found))
    return 0


def _folder_name(vary: Sequence[Vary]) -> str:
    """Of the keys, their indices as `--set` takes them, which no shell takes for a pattern."""
    return "-".join(["falsify", *(each.key.replace("[", ".").replace("]", "") for each in vary)])


def _flown(scenario: Scenario) -> dict[str, Any]:
    from harness.analysis.metrics import metrics
    from harness.flight.closed_loop import fly
    from harness.run.scenario_flight import flight_limits, make_loop

    return metrics(fly(make_loop(scenario)), flight_limits(scenario))


def range_of(text: str) -> tuple[str, float, float]:
    """KEY.PATH=LO:HI as its three parts.

    Raises:
        typer.BadParameter: it is something else, or a range that no search is made over.
    """
    key, equals, ends = text.partition("=")
    low, colon, high = ends.partition(":")
    try:
        mild, hard = float(low), float(high)
    except ValueError:
        mild = hard = math.nan
    if not (key.strip() and equals and colon and math.isfinite(mild) and math.isfinite(hard)):
        raise typer.BadParameter(f"{text[:60]!r} is not KEY.PATH=LO:HI with two numbers", param_hint="--vary")
    return key.strip(), mild, hard
