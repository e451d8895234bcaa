"""The command `fly`: one flight, watched live perhaps."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import typer

from harness.cli.command_line import FAILED, distinct_suffix, flying_into, load, print_json, world_notes
from harness.cli.flight_rows import flight_rows
from harness.cli.options import Count, Json, NoRecording, Number, OptionalScenario, Out, Quiet, flag, option
from harness.cli.replacing import NOTHING, Given, replacing
from harness.cli.review import open_viewer
from harness.cli.terminal import plain, print_table, say
from harness.files.input_file import InputError

if TYPE_CHECKING:
    from harness.scenario.scenario import Scenario

FlyInto: TypeAlias = Callable[..., dict[str, Any]]
"""Flies a scenario into a folder, with or without a recording, and tells its progress; returns the figures."""
FLY_STATUS: Final = {"reached": 0, "unreachable": 3}  # exit status of `fly` by outcome; FAILED for any other
FROM_HELP: Final = "A campaign's results.parquet, instead of SCENARIO."
SPEED_HELP: Final = "With --live: simulated seconds a second. Default: as fast as it goes."


@replacing("planner", "aircraft", "guidance", "conditions", "wind", "turbulence", "seed", "settings")
def fly(
    scenario: OptionalScenario = None,
    given: Given = NOTHING,
    results: Annotated[Path | None, option("FILE", FROM_HELP, "--from")] = None,
    run: Annotated[Count, option("K", "With --from: which run.")] = None,
    out: Out = None,
    no_recording: NoRecording = False,
    view: Annotated[bool, flag("--view", "Open the recording after the flight.")] = False,
    live: Annotated[bool, flag("--live", "Show the flight in the viewer while it is flown.")] = False,
    speed: Annotated[Number, option("X", SPEED_HELP)] = None,
    web: Annotated[bool, flag("--web", "With --live: show it in a browser, served on 127.0.0.1.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Flies a scenario with a planner, and writes a run folder.

    For example: wayproof fly paper_circles --seed 3 --set planner.clearance_m=400

    Exit status:
    0 goal reached with no collision and inside the area
    1 flown, but goal not reached; or with --from not as the campaign flew it
    2 bad input or usage, nothing flown
    3 the planner proved the goal unreachable and the aircraft is safe
    """
    _check_usage(view and no_recording, live, speed, web)
    loaded, digest = _load_flight(scenario, results, run, given.keys)
    origin = [] if results is None else [("from", str(results.resolve())), ("run", str(run))]
    model, planner = Path(loaded.aircraft.model).name, loaded.planner.label.replace(":", "-")
    named = f"{planner}-{model}-{loaded.seed}{distinct_suffix([*given.keys, *origin])}"
    folder = out or Path("runs") / loaded.name / named
    with _viewer(live, web, speed) as (fly_into, wait):
        with flying_into(folder, math.dist(loaded.mission.start_m, loaded.mission.goal_m), quiet) as report:
            metrics = fly_into(loaded, folder, not no_recording, report)
        if otherwise := bool(digest) and metrics["digest"] != digest:
            say(
                f"wayproof: run {run} was flown otherwise (digest {digest}): versions, or what planner, law, "
                "aircraft or obstacles are made of, have changed since",
                err=True,
            )
        if as_json:
            print_json(metrics)
        elif not quiet:
            _print_flight(loaded, metrics, folder, bool(digest) and not otherwise)
        wait()
    if view:
        open_viewer([folder])
    return FAILED if otherwise else FLY_STATUS.get(metrics["outcome"], FAILED)


def _check_usage(views_nothing: bool, live: bool, speed: float | None, web: bool) -> None:
    if views_nothing:
        raise typer.BadParameter("there is nothing to view with --no-recording; leave one of them out")
    if speed is not None and not 0.0 < speed <= 1e6:
        raise typer.BadParameter(f"--speed is {speed:g}; must be above 0 and at most 1e6")
    for name, needs_live in (("--speed", speed is not None), ("--web", web)):
        if needs_live and not live:
            raise typer.BadParameter(f"{name} goes with --live")


def _load_flight(
    scenario: str | None, results: Path | None, run: int | None, given: list[tuple[str, str]]
) -> tuple[Scenario, str | None]:
    """Returns the scenario to fly, and the digest that a campaign's results have for exactly that flight, or None."""
    if (scenario is None) == (results is None):
        raise typer.BadParameter("give either a SCENARIO or --from with --run")
    if results is None or run is None:
        if scenario is None or run is not None:
            raise typer.BadParameter("--from and --run go together")
        return load(scenario, given), None
    from harness.campaign.runs import flown_run

    return flown_run(results, run, given)


def _print_flight(scenario: Scenario, metrics: dict[str, Any], folder: Path, as_the_campaign: bool) -> None:
    from harness.scenario.conditions import conditions_text
    from harness.world.motion_assumptions import outside_assumptions

    law = scenario.guidance.kind
    under = "" if law == type(scenario.guidance)().kind else f", {law}"
    rows = {"conditions": plain(conditions_text(scenario))} | flight_rows(metrics)
    if outside := outside_assumptions(scenario):
        more = f" (and {len(outside) - 1} more: `wayproof validate` names them)" if len(outside) > 1 else ""
        rows["not covered"] = plain(outside[0] + more)
    rows |= {name: plain(note) for name, note in world_notes(scenario).items()}
    print_table(f"{scenario.name}: {scenario.planner.label}, {scenario.aircraft.model}{under}", rows)
    if as_the_campaign:
        say("digest: as the campaign flew it")
    say(f"run folder: {folder}")


@contextmanager
def _viewer(live: bool, web: bool, speed: float | None) -> Iterator[tuple[FlyInto, Callable[[], None]]]:
    """Opens a viewer, if `live`; yields a function that flies, watched by it, and one that waits for its end.

    An InputError says that there is no screen for it.
    """
    from harness.run.scenario_flight import fly_to_folder

    if not live:
        yield fly_to_folder, lambda: None
        return
    from harness.recording.viewer import ViewerError, empty_viewer
    from harness.watching.watched_flight import Viewing, fly_watched

    text = "wayproof: the viewer has gone; the flight goes on"
    try:
        with empty_viewer(web, lambda address: say(address, err=True)) as (process, url):

            def wait() -> None:
                sys.stdout.flush()
                with suppress(KeyboardInterrupt):
                    process.wait()

            yield partial(fly_watched, viewing=Viewing(url, speed, lambda: say(text, err=True))), wait
    except ViewerError as error:
        raise InputError(f"wayproof: {error}") from error
