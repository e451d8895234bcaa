"""The command `wayproof`. Each command is a few lines round functions that are imported when they are needed.

Standard output carries results, standard error everything else. Exit status: 0 done, 1 flown but the goal was
not reached safely, 2 bad input or usage, 3 the goal is proved unreachable, 130 interrupted.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

if TYPE_CHECKING:
    from harness.scenario import Scenario

FAILED: Final = 1
BAD_INPUT: Final = 2
INTERRUPTED: Final = 130
FLY_STATUS: Final = {"reached": 0, "unreachable": 3}
"""Exit status of `fly` by outcome; FAILED for the others."""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


def _flag(name: str, text: str) -> Any:
    """An option without a value; the empty metavar keeps the help from showing a type for it."""
    return typer.Option(name, metavar=" ", help=text)


ScenarioArgument = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A file, or a name that `wayproof list scenarios` prints.")
]
JsonOption = Annotated[bool, _flag("--json", "Print the result as JSON, and nothing else.")]


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import PackageNotFoundError, version

        try:
            typer.echo(f"wayproof {version('wayproof')}")
        except PackageNotFoundError:
            typer.echo("wayproof, run from its sources without being installed")
        raise typer.Exit


@app.callback()
def wayproof(
    version: Annotated[
        bool,
        typer.Option(
            "--version", metavar=" ", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
    debug: Annotated[bool, _flag("--debug", "Show the traceback of an error.")] = False,
) -> None:
    """Flies a path planner's waypoints with a JSBSim aircraft, in a closed loop, in an unknown world."""


@app.command()
def fly(
    scenario: ScenarioArgument,
    planner: Annotated[str | None, typer.Option(metavar="KIND", help="Replaces planner.kind.")] = None,
    aircraft: Annotated[str | None, typer.Option(metavar="NAME", help="Replaces aircraft.model.")] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Replaces seed.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY.PATH=VALUE", help="Replaces any key; can be repeated."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Default: runs/SCENARIO/PLANNER-AIRCRAFT-SEED.")
    ] = None,
    no_recording: Annotated[bool, _flag("--no-recording", "Do not write flight.rrd.")] = False,
    view: Annotated[bool, _flag("--view", "Open the recording after the flight.")] = False,
    quiet: Annotated[bool, _flag("--quiet", "Print nothing but errors.")] = False,
    as_json: Annotated[bool, _flag("--json", "Print metrics.json, and nothing else.")] = False,
) -> int:
    """One closed-loop flight, headless, into a run folder.

    Exit status:

    0 goal reached with no collision and inside the area

    1 flown, but not so

    2 bad input or usage, nothing flown

    3 the planner proved the goal unreachable and the aircraft is safe
    """
    if view and no_recording:
        raise typer.BadParameter("there is nothing to view with --no-recording; leave one of them out")
    overrides = [("planner.kind", planner), ("aircraft.model", aircraft), ("seed", seed)]
    given = [(name, str(value)) for name, value in overrides if value is not None]
    loaded = _load(scenario, [*given, *map(_setting, settings or ())])
    folder = out or _default_folder(loaded)
    metrics = _fly(loaded, folder, recording=not no_recording, silent=quiet)
    if as_json:
        _print_json(metrics)
    elif not quiet:
        from harness.terminal import flight_rows, print_table

        print_table(f"{loaded.name}: {loaded.planner.kind}, {loaded.aircraft.model}", flight_rows(metrics))
        typer.echo(f"run folder: {folder}")
    if view:
        _open_viewer([folder])
    return FLY_STATUS.get(metrics["outcome"], FAILED)


@app.command()
def compare(
    scenarios: Annotated[list[str], typer.Argument(metavar="SCENARIO...", help="Files or shipped names.")],
    planners: Annotated[str, typer.Option(metavar="A,B,...", help="Kinds of planners, in order.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The comparison's folder.")] = Path(
        "runs/comparison"
    ),
    kinematic: Annotated[
        bool, _flag("--kinematic", "Fly a point that follows every plan exactly, not the aircraft.")
    ] = False,
    workers: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Flights at a time. Default: one a processor.")
    ] = None,
    no_recording: Annotated[bool, _flag("--no-recording", "Write no recordings and no overlay.")] = False,
    as_json: Annotated[bool, _flag("--json", "Print comparison.json, and nothing else.")] = False,
) -> int:
    """Every planner on every scenario, side by side: table, figures, report, overlay recordings.

    For example: wayproof compare paper_circles --planners rolling_window,bug2

    Exit status:

    0 every planner reached every goal

    1 one did not, or crashed

    2 bad input or usage, nothing flown
    """
    kinds = [kind.strip() for kind in planners.split(",")]
    loaded = [_load(scenario, [("planner.kind", kind)]) for scenario in scenarios for kind in kinds]

    from harness.compare import compare as fly_and_compare
    from harness.compare_terminal import comparison_bar, print_comparison
    from harness.record import RunFolderError

    try:
        with comparison_bar(loaded) as report:
            comparison = fly_and_compare(
                loaded,
                out,
                recording=not no_recording,
                kinematic=kinematic,
                workers=workers or os.cpu_count() or 1,
                progress=report,
            )
    except RunFolderError as error:
        raise _bad_input(error) from error
    except KeyboardInterrupt:
        typer.echo(f"wayproof: interrupted; the comparison in {out} is marked incomplete", err=True)
        raise
    if as_json:
        _print_json(comparison.plain())
    else:
        print_comparison(comparison.rows)
        typer.echo(f"report: {out / 'report.html'}")
    return 0 if comparison.all_reached else FAILED


@app.command()
def validate(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Scenario files or shipped names.")],
) -> int:
    """Checks scenario files without flying them."""
    from harness.strict_yaml import InputError

    status = 0
    for file in files:
        try:
            loaded = _load(file)
        except InputError as error:
            typer.echo(str(error), err=True)
            status = BAD_INPUT
        else:
            typer.echo(f"{file}: {loaded.name}, {len(loaded.obstacles)} obstacles: valid")
    return status


@app.command()
def schema(
    kind: Annotated[Literal["scenario"], typer.Argument(help="The file format.")] = "scenario",
) -> int:
    """Prints the JSON Schema of a file format, for editors."""
    from harness.scenario import scenario_schema

    _print_json(scenario_schema())
    return 0


@app.command("list")
def list_names(
    what: Annotated[Literal["planners", "aircraft", "scenarios"], typer.Argument(help="Of what.")],
) -> int:
    """Prints the names that a scenario or a command can use."""
    from harness.terminal import print_columns

    print_columns(_summaries(what))
    return 0


@app.command()
def view(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN_DIR...", help="Run folders; several are overlaid.")
    ],
) -> int:
    """Opens recordings in the rerun viewer."""
    return 0 if _open_viewer(runs) else FAILED


@app.command()
def bench(scenario: ScenarioArgument = "paper_circles", as_json: JsonOption = False) -> int:
    """What the loop costs on this machine against bare JSBSim, block by block."""
    loaded = _load(scenario)

    from harness.bench import bench as measure
    from harness.terminal import bench_rows, print_table, progress_bar

    with progress_bar(_straight_m(loaded)) as report:
        result = measure(loaded, report)
    if as_json:
        _print_json(result)
    else:
        print_table(f"bench of {loaded.name}", bench_rows(result))
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit status.

    Args:
        arguments: without the program's name; default: those of the process.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in given
    try:
        status = app(
            [word for word in given if word != "--debug"], prog_name="wayproof", standalone_mode=False
        )
        sys.stdout.flush()
        return int(status or 0)
    except BrokenPipeError:
        # The reader of our output has gone; the interpreter must not find that out again when it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        if debug:
            raise
        return _report(error)


def _report(error: Exception) -> int:
    """Says on standard error what went wrong and returns the exit status."""
    from harness.strict_yaml import InputError

    if isinstance(error, InputError):
        typer.echo(str(error), err=True)
        return BAD_INPUT
    if isinstance(error, typer.TyperException):
        typer.echo(f"wayproof: {error.format_message()} (see wayproof --help)", err=True)
        return BAD_INPUT
    if isinstance(error, OSError):
        typer.echo(f"wayproof: {error}", err=True)
        return BAD_INPUT
    kind, text = type(error).__name__, " ".join(str(error).split())
    typer.echo(f"wayproof: internal error, {kind}: {text}; --debug shows where", err=True)
    return FAILED


def _load(scenario: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    from harness.scenario import load_scenario
    from harness.shipped import scenario_path

    return load_scenario(scenario_path(scenario), overrides)


def _setting(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise typer.BadParameter(f"{text!r} is not KEY.PATH=VALUE", param_hint="--set")
    return name.strip(), value


def _default_folder(scenario: Scenario) -> Path:
    model = Path(scenario.aircraft.model).name
    return Path("runs") / scenario.name / f"{scenario.planner.kind}-{model}-{scenario.seed}"


def _fly(scenario: Scenario, folder: Path, *, recording: bool, silent: bool) -> dict[str, Any]:
    """Flies into a folder, with a progress bar where a person looks on."""
    from contextlib import nullcontext

    from harness.record import RunFolderError
    from harness.run import fly_to_folder
    from harness.terminal import progress_bar

    try:
        with nullcontext() if silent else progress_bar(_straight_m(scenario)) as report:
            return fly_to_folder(scenario, folder, recording, report)
    except RunFolderError as error:
        raise _bad_input(error) from error
    except KeyboardInterrupt:
        typer.echo(f"wayproof: interrupted; the run in {folder} is marked incomplete", err=True)
        raise


def _open_viewer(runs: Sequence[Path]) -> bool:
    """Shows recordings until the viewer is closed; says on standard error why, if it cannot start."""
    from harness.record import RunFolderError
    from harness.rerun_viewer import ViewerError, open_viewer

    try:
        open_viewer(runs)
    except RunFolderError as error:
        raise _bad_input(error) from error
    except ViewerError as error:
        typer.echo(f"wayproof: {error}", err=True)
        return False
    return True


def _straight_m(scenario: Scenario) -> float:
    import math

    return math.dist(scenario.mission.start_m, scenario.mission.goal_m)


def _summaries(what: str) -> dict[str, str]:
    """What there is, by name, with a line on each."""
    if what == "planners":
        from planner.registry import planner_kinds

        return {name: kind.summary for name, kind in planner_kinds().items()}
    if what == "aircraft":
        from aircraft.airframes import aircraft_names, airframe

        return {name: airframe(name).summary for name in aircraft_names()}
    from harness.shipped import shipped_scenarios, summary

    return {name: summary(path) for name, path in shipped_scenarios().items()}


def _bad_input(error: ValueError) -> Exception:
    """A fault of what was given, as the error that ends with BAD_INPUT."""
    from harness.strict_yaml import InputError

    return InputError(f"wayproof: {error}")


def _print_json(content: Any) -> None:
    import json

    typer.echo(json.dumps(content, indent=2, ensure_ascii=False))
