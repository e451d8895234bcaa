"""Flights from Python: `fly`, and reading back what was flown."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

from aircraft.airframes import AircraftError
from harness.api.metrics import Metrics
from harness.api.results import FlightResult
from harness.files.errors import RunFolderError
from harness.files.input_file import InputError
from harness.scenario.kinds import GUIDANCE, PLANNER, registered
from harness.scenario.scenario import Scenario, load_scenario, parse_scenario
from harness.scenario.validation import KeyFault

if TYPE_CHECKING:
    from harness.flight.observer import Progress

REQUIRED_FIGURES: Final = (
    *("outcome", "reason", "flown_length_m", "cross_track_m", "trackable", "trackability", "digest"),
)
"""Figures that every run has; a run folder without one of them was written by another version."""


@contextmanager
def as_input_errors() -> Iterator[None]:
    """Lets an error about an aircraft or a folder come out as an InputError with the text of the command line."""
    try:
        yield
    except KeyFault as error:
        raise InputError(f"wayproof: {'.'.join(map(str, error.loc))}: {error}") from error
    except (AircraftError, RunFolderError) as error:
        raise InputError(f"wayproof: {error}") from error


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

    `scenario`: a scenario, its file, or the name of one that comes with wayproof.
    `planner` replaces the scenario's: a kind, `FILE.py:NAME` or `MODULE:NAME`, a class or function that takes the
    mission or nothing and makes the planner, or an object with the method `plan(request)`.
    `guidance` replaces its law: likewise; a class or function takes the `GuidanceLimits` or nothing, an object has the
    methods `follow(route, arc_length_m)` and `update(state)`.
    `out`: the run folder to write, in place of an earlier run there; None: no folder.
    `recording`: whether to record the flight for rerun (`run.show()`).
    `progress`: called every few simulated seconds with simulated time (s), distance to go (m) and the state.

    Raises:
        InputError: the scenario, planner or folder cannot be used; nothing was flown.
        PlannerError: the planner cannot be made.
        WriteError: the run could not be written to its end.
    """
    from harness.flight.closed_loop import fly as fly_loop
    from harness.run.scenario_flight import RunNames, fly_to_folder, make_loop

    flown = given_parts(scenario, planner, guidance)
    if out is None and not recording:
        with as_input_errors():
            return FlightResult.of(flown, fly_loop(make_loop(flown), (), progress))
    called = f"fly({flown.name!r}, planner={flown.planner.kind!r}, guidance={flown.guidance.kind!r})"
    named = RunNames(in_python(f"wayproof.{called}"))
    return flown_into(out, flown, lambda to: fly_to_folder(flown, to, recording, progress, named=named))


def given_parts(scenario: Scenario | str | Path, planner: object = None, guidance: object = None) -> Scenario:
    """A scenario with a planner and a law as `fly` takes them; an InputError says which cannot be used."""
    kinds = {}
    for key, given, part in (("planner.kind", planner, PLANNER), ("guidance.kind", guidance, GUIDANCE)):
        if given is not None:
            try:
                kinds[key] = registered(given, part)
            except ValueError as error:
                raise InputError(f"wayproof: {part.noun}: {error}") from error
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    return loaded.with_(kinds) if kinds else loaded


def flown_into(out: str | Path | None, scenario: Scenario, fly_to: Callable[[Path], object]) -> FlightResult:
    """Flies (`fly_to`) into the folder `out`, or a temporary one that lives as long as the result it returns."""
    scratch = TemporaryDirectory(prefix="wayproof-run-") if out is None else None
    folder = Path(scratch.name if scratch else out or "")
    place = folder.absolute()
    with as_input_errors():
        fly_to(folder)
    run = load_run(folder if folder.absolute() == place else place)
    return replace(run, scenario=scenario, _scratch=scratch)


def load_run(folder: str | Path) -> FlightResult:
    """Reads a run folder back; an InputError says that it holds no run, or an incomplete or damaged one."""
    from harness.run_files import run_folder

    with as_input_errors():
        run = run_folder.load_run(Path(folder))
    if missing := [name for name in REQUIRED_FIGURES if name not in run.metrics]:
        reason = "is missing; another version of wayproof flew this run, or the file was changed"
        raise InputError(f"{run.folder / run_folder.METRICS}: {missing[0]}: {reason}")
    flown = parse_scenario(run.scenario_yaml, str(run.folder / run_folder.SCENARIO), as_flown=True)
    return FlightResult(flown, Metrics(run.metrics), *run_folder.tables(run.folder), run.folder, run.manifest)


def in_python(what: str) -> str:
    """Returns the command of a manifest for a call in Python: the call `what`, and the script it came from."""
    script = getattr(sys.modules.get("__main__"), "__file__", None)
    if "ipykernel" in sys.modules and script is not None and "ipykernel" in str(script):
        return f"{what} in a notebook"
    return f"{what} in {Path(script).name}" if script else f"{what} in Python"
