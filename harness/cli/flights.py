"""The commands `fly` and `bench`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from harness.cli.options import (
    FAILED,
    AircraftOption,
    ConditionsOption,
    GuidanceOption,
    JsonOption,
    OptionalScenario,
    PlannerOption,
    SeedOption,
    SettingsOption,
    TurbulenceOption,
    WindOption,
    air,
    bad_input,
    chosen,
    flag,
    law_kind,
    load,
    print_json,
    settings_of,
    straight_m,
    tell_interrupted,
    told_apart,
)
from harness.cli.review import open_viewer
from harness.cli.standard_output import say
from harness.cli.watch import (
    LiveOption,
    SpeedOption,
    Watch,
    WebOption,
    opened,
)

if TYPE_CHECKING:
    from harness.scenario.scenario import Scenario
    from harness.watching.watched_flight import Onlookers

FLY_STATUS: Final = {"reached": 0, "unreachable": 3}
"""Exit status of `fly` by outcome; FAILED for the others."""


def fly(
    scenario: OptionalScenario = None,
    planner: PlannerOption = None,
    aircraft: AircraftOption = None,
    guidance: GuidanceOption = None,
    conditions: ConditionsOption = None,
    wind: WindOption = None,
    turbulence: TurbulenceOption = None,
    seed: SeedOption = None,
    settings: SettingsOption = None,
    results: Annotated[
        Path | None,
        typer.Option("--from", metavar="FILE", help="A campaign's results.parquet, instead of SCENARIO."),
    ] = None,
    run: Annotated[int | None, typer.Option(metavar="K", help="With --from: which run.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The run folder. Default: its own in runs/SCENARIO.")
    ] = None,
    no_recording: Annotated[bool, flag("--no-recording", "Do not write flight.rrd.")] = False,
    view: Annotated[bool, flag("--view", "Open the recording after the flight.")] = False,
    live: LiveOption = False,
    speed: SpeedOption = None,
    web: WebOption = False,
    quiet: Annotated[bool, flag("--quiet", "Print nothing but errors.")] = False,
    as_json: Annotated[bool, flag("--json", "Print metrics.json, and nothing else.")] = False,
) -> int:
    """Flies a scenario with a planner, and writes a run folder.

    For example: wayproof fly paper_circles --seed 3 --set planner.clearance_m=400

    Exit status:

    0 goal reached with no collision and inside the area

    1 flown, but goal not reached; or with --from not as the campaign flew it

    2 bad input or usage, nothing flown

    3 the planner proved the goal unreachable and the aircraft is safe
    """
    if view and no_recording:
        raise typer.BadParameter("there is nothing to view with --no-recording; leave one of them out")
    watch = Watch(live, web, speed)
    watch.check()
    weather = air(wind, turbulence)
    options = [*chosen(planner, aircraft, seed, guidance, conditions), *weather]
    replaced = [
        *chosen(guidance=guidance, conditions=conditions),
        *weather,
        *settings_of(settings, options),
    ]
    given = [*chosen(planner, aircraft, seed), *replaced]
    loaded, digest = _asked(scenario, results, run, given)
    if results is not None:
        replaced += [("from", str(results.resolve())), ("run", str(run))]
    folder = out or _default_folder(loaded, told_apart(replaced))
    with opened(watch) as looking:
        metrics = _fly(loaded, folder, looking.onlookers, recording=not no_recording, silent=quiet)
        otherwise = bool(digest) and not given and metrics["digest"] != digest
        if otherwise:
            say(
                f"wayproof: run {run} was flown otherwise (digest {digest}): versions, or what the planner or the "
                "aircraft is made of, have changed since",
                err=True,
            )
        if as_json:
            print_json(metrics)
        elif not quiet:
            same = bool(digest) and not given and not otherwise
            _print_flight(loaded, metrics, folder, same)
        looking.wait()
    if view:
        open_viewer([folder])
    return FAILED if otherwise else FLY_STATUS.get(metrics["outcome"], FAILED)


def _print_flight(scenario: Scenario, metrics: dict[str, Any], folder: Path, as_the_campaign: bool) -> None:
    """The table of a flight, and where its files are."""
    from harness.cli.terminal import flight_rows, plain, print_table
    from harness.scenario.conditions import told
    from harness.world.motion_assumptions import scenario_outside_assumptions

    title = f"{scenario.name}: {scenario.planner.label}, {scenario.aircraft.model}{_law(scenario)}"
    outside = scenario_outside_assumptions(scenario)
    more = f" (and {len(outside) - 1} more: `wayproof validate` names them)" if len(outside) > 1 else ""
    not_covered = {"not covered": plain(outside[0] + more)} if outside else {}
    print_table(title, {"conditions": plain(told(scenario))} | flight_rows(metrics) | not_covered)
    if as_the_campaign:
        say("digest: as the campaign flew it")
    say(f"run folder: {folder}")


def _law(scenario: Scenario) -> str:
    """What a title adds of the guidance law."""
    usual = type(scenario.guidance)().kind
    return "" if scenario.guidance.kind == usual else f", {scenario.guidance.kind}"


def _asked(
    scenario: str | None, results: Path | None, run: int | None, overrides: list[tuple[str, str]]
) -> tuple[Scenario, str | None]:
    """What to fly, and the digest that a campaign's results have of it."""
    if (scenario is None) == (results is None):
        raise typer.BadParameter("give either a SCENARIO or --from with --run")
    if (results is None) != (run is None):
        raise typer.BadParameter("--from and --run go together")
    if scenario is not None:
        return load(scenario, overrides), None
    from harness.campaign.replay import flown_run

    assert results is not None
    assert run is not None
    return flown_run(results, run, overrides)


def bench(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            help="A file or shipped name; or the word tracking.",
            show_default=True,
        ),
    ] = "paper_circles",
    aircraft: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="With tracking: the aircraft. Default: aerosonde."),
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help="With tracking: number of courses in each air. Default: 20.",
        ),
    ] = None,
    guidance: Annotated[
        str | None, typer.Option(metavar="KIND", help="With tracking: the guidance law. Default: preview.")
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Measures the time of the closed loop on this machine over that of bare JSBSim, block by block.

    It flies the scenario up to 21 times, which takes some minutes for a long one.

    `bench tracking` measures the largest errors of an aircraft on random courses of 14 turns in calm air, wind and
    turbulence; its exit status is 1 if one is above its limit.

    For example: wayproof bench aerosonde_forest --json
    """
    if scenario == "tracking":
        return bench_tracking(aircraft or "aerosonde", seeds or 20, as_json, guidance or "preview")
    if guidance or aircraft or seeds:
        raise typer.BadParameter("--aircraft, --seeds and --guidance go with `bench tracking`")
    loaded = load(scenario)

    from aircraft.airframes import AircraftError
    from harness.bench.costs import bench as measure
    from harness.cli.terminal import bench_rows, print_table, progress_bar

    try:
        with progress_bar(straight_m(loaded)) as report:
            result = measure(loaded, report)
    except AircraftError as error:
        raise bad_input(error) from error
    if as_json:
        print_json(result)
    else:
        print_table(f"bench of {loaded.name}", bench_rows(result))
    return 0


def bench_tracking(name: str, seeds: int, as_json: bool, guidance: str = "preview") -> int:
    """The table of tracking errors of an aircraft."""
    from aircraft.airframes import AircraftError
    from aircraft.guidance.registry import guidance_kinds
    from harness.bench import tracking
    from harness.cli.terminal import print_grid, step_bar, tracking_rows

    guidance = law_kind(guidance)
    laws = sorted(guidance_kinds())
    if guidance not in laws:
        raise typer.BadParameter(f"there is no guidance law {guidance!r}; known are: {', '.join(laws)}")
    try:
        with step_bar() as report:
            result = tracking.bench_tracking(name, seeds, report, guidance)
    except AircraftError as error:
        raise bad_input(error) from error
    if as_json:
        print_json(result)
    else:
        flown = f"{result['aircraft']} under {guidance} at {result['airspeed_mps']:g} m/s"
        title = f"{flown}, worst of {seeds} courses a case"
        print_grid(title, *tracking_rows(result))
    return FAILED if any(row["kept"] is False for row in result["cases"]) else 0


def _default_folder(scenario: Scenario, apart: str = "") -> Path:
    model = Path(scenario.aircraft.model).name
    planner = scenario.planner.label.replace(":", "-")
    return Path("runs") / scenario.name / f"{planner}-{model}-{scenario.seed}{apart}"


def _fly(
    scenario: Scenario, folder: Path, onlookers: Onlookers | None, *, recording: bool, silent: bool
) -> dict[str, Any]:
    """Flies into a folder, with a progress bar where a person looks on."""
    from contextlib import nullcontext

    from aircraft.airframes import AircraftError
    from harness.cli.terminal import progress_bar
    from harness.files.errors import RunFolderError
    from harness.run.scenario_flight import fly_to_folder
    from harness.run_files.run_folder import MANIFEST, SCHEMA

    try:
        with nullcontext() if silent else progress_bar(straight_m(scenario)) as report:
            if onlookers is None:
                return fly_to_folder(scenario, folder, recording, report)
            from harness.watching.watched_flight import fly_watched

            return fly_watched(scenario, folder, recording, report, onlookers)
    except (AircraftError, RunFolderError) as error:
        raise bad_input(error) from error
    except KeyboardInterrupt:
        tell_interrupted("run", folder, MANIFEST, SCHEMA)
        raise
