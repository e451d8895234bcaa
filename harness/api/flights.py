"""Flights from Python: `fly`, and reading back what was flown."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from harness.api.errors import as_input_errors
from harness.api.metrics import Metrics
from harness.api.results import FlightResult
from harness.files.input_file import InputError
from harness.scenario.given import registered
from harness.scenario.kinds import GUIDANCE, PLANNER, LoopPart
from harness.scenario.scenario import Scenario, load_scenario, parse_scenario

if TYPE_CHECKING:
    from harness.flight.observer import Progress


def fly(
    scenario: Scenario | str | Path,
    planner: object = None,
    guidance: object = None,
    out: str | Path | None = None,
    recording: bool = False,
    *,
    progress: Progress | None = None,
) -> FlightResult:
    """Flies a scenario to its end, closed loop.

        run = wayproof.fly("aerosonde_forest", planner=MyPlanner)

    Args:
        scenario: a scenario, its file, or the name of one that comes with wayproof.
        planner: replaces the scenario's: a kind, `FILE.py:NAME` or `MODULE:NAME`, a class or function that takes the
            mission or nothing and makes the planner, or an object with the method `plan(request)`.
        guidance: replaces the scenario's law: likewise; a class or function takes the `GuidanceLimits` or nothing, an
            object has the methods `follow(route, arc_length_m)` and `update(state)`.
        out: the run folder to write, in place of an earlier run there; None: no folder.
        recording: whether to record the flight for rerun (`run.show()`).
        progress: called every few simulated seconds with simulated time (s), distance to go (m) and the state.

    Raises:
        InputError: the scenario, planner or folder cannot be used; nothing was flown.
        PlannerError: the planner cannot be made.
        WriteError: the run could not be written to its end.
    """
    flown = given_parts(scenario, planner, guidance)
    return _flown(flown, Path(out) if out is not None else None, recording, progress)


def given_parts(scenario: Scenario | str | Path, planner: object, guidance: object) -> Scenario:
    """A scenario with a planner and a guidance law that were given, as `fly` takes them.

    Raises:
        InputError: one of them cannot be used.
    """
    given = {"planner.kind": (planner, PLANNER), "guidance.kind": (guidance, GUIDANCE)}
    kinds = {key: _name_of(*each) for key, each in given.items() if each[0] is not None}
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    return loaded.with_(kinds) if kinds else loaded


def load_run(folder: str | Path) -> FlightResult:
    """Reads a run folder back.

    Raises:
        InputError: the folder holds no run, or an incomplete or damaged one.
    """
    from harness.run_files import run_folder

    with as_input_errors():
        run = run_folder.load_run(Path(folder))
    track, plans = run_folder.tables(run.folder)
    try:
        metrics = Metrics.of(run.metrics)
    except KeyError as error:
        file = run.folder / run_folder.METRICS
        raise InputError(
            f"{file}: {error.args[0]}: is missing; another version of wayproof flew this run, or the file was changed"
        ) from error
    return FlightResult(
        parse_scenario(run.scenario_yaml, str(run.folder / run_folder.SCENARIO), as_flown=True),
        metrics,
        track,
        plans,
        run.folder,
        run.manifest,
    )


def in_python(what: str) -> str:
    """The command of a manifest, for what was done in Python: what was called, and from where."""
    main = sys.modules.get("__main__")
    script = getattr(main, "__file__", None)
    if "ipykernel" in sys.modules and script is not None and "ipykernel" in str(script):
        return f"{what} in a notebook"
    return f"{what} in {Path(script).name}" if script else f"{what} in Python"


def _name_of(given: object, part: LoopPart) -> str:
    try:
        return registered(given, part)
    except ValueError as error:
        raise InputError(f"wayproof: {part.noun}: {error}") from error


def _flown(scenario: Scenario, out: Path | None, recording: bool, progress: Progress | None) -> FlightResult:
    from harness.run.scenario_flight import fly_to_folder

    if out is None and not recording:
        return _in_memory(scenario, progress)
    scratch = TemporaryDirectory(prefix="wayproof-run-") if out is None else None
    folder = Path(scratch.name) if scratch else Path(out or "")
    named = f"{scenario.name!r}, planner={scenario.planner.kind!r}, guidance={scenario.guidance.kind!r}"
    with as_input_errors():
        fly_to_folder(scenario, folder, recording, progress, command=in_python(f"wayproof.fly({named})"))
    read: dict[str, Any] = dict(vars(load_run(folder)))
    return FlightResult(**{**read, "scenario": scenario, "_scratch": scratch})


def _in_memory(scenario: Scenario, progress: Progress | None) -> FlightResult:
    from harness.flight.closed_loop import fly as fly_loop
    from harness.run.scenario_flight import make_loop

    with as_input_errors():
        flight = fly_loop(make_loop(scenario), (), progress)
    return FlightResult.of(scenario, flight)
