"""One run of a campaign, flown where it was sent to: a process of its own, here or on another machine."""

from __future__ import annotations

import ctypes
import errno
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from harness.analysis.claims import Claim, holds
from harness.campaign.results import ERROR, metric_cells, time_cells
from harness.files.crash import PlannerError, sentence, trace
from harness.files.errors import RunFolderError, WriteError
from harness.scenario.given import registered_source
from harness.scenario.kinds import GUIDANCE, PLANNER
from harness.scenario.scenario import Scenario, unpacked

if TYPE_CHECKING:
    from harness.run.path_check import PathCheck

FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""What a disk that takes no more says, a temporary file's too: that is no fault of the run."""


@dataclass(frozen=True)
class Job:
    """One run to be flown.

    Attributes:
        packed: the scenario to fly (`harness.scenario.scenario.packed`).
        recordings: when it is kept; `folders`: always, without recordings.
        varied: the keys that the campaign varies and their values in this run, for the recording's properties.
        claim: a run is a failure where this does not hold of it.
        path: a check, if a given path is flown in place of what a planner finds; `packed` is empty then.
        planners: planners that the process has to import, as FILE.py:NAME or MODULE:NAME.
        laws: guidance laws that it has to import, likewise.
        identity: of the recording among others; empty: as `fly_to_folder` has it.
    """

    run: int
    packed: bytes
    folder: Path
    recordings: Literal["all", "thin", "failures", "none", "folders"]
    optimum: bool
    again: str = ""
    varied: Mapping[str, str | float | int | bool] = field(default_factory=dict)
    claim: Claim = "reached"
    path: PathCheck | None = None
    planners: tuple[str, ...] = ()
    laws: tuple[str, ...] = ()
    identity: str = ""


@dataclass(frozen=True)
class Answer:
    """What came of a job.

    Attributes:
        row: cells of `results.parquet`, by column; those of the job itself are left out.
    """

    run: int
    row: dict[str, Any]
    times: dict[str, Any]
    held: bool = False


class NoMemoryError(Exception):
    """There was no memory for a run: that is no fault of the run."""


def fly_job(job: Job) -> Answer:
    """Flies a job. What goes wrong in the flight is an answer too.

    Raises:
        NoMemoryError: there was none.
        OSError: the run folder cannot be written (`WriteError`), or the disk is full.
        RunFolderError: it cannot be made.
    """
    try:
        for part, sources in ((PLANNER, job.planners), (GUIDANCE, job.laws)):
            for source in sources:
                _imported(source, part)
        scenario = unpacked(job.packed) if job.path is None else job.path.scenario
        metrics = _flown(job, scenario)
        optimum_m = _optimum_m(scenario) if job.optimum else None
        cells = metric_cells(metrics, scenario.planner.clearance_m, optimum_m)
    except (WriteError, RunFolderError):
        raise
    except Exception as error:
        if isinstance(error, MemoryError) or isinstance(error.__cause__, MemoryError):
            raise NoMemoryError from None
        # Whatever the constructor of a planner raised is its own, a full disk too.
        if not isinstance(error, PlannerError) and (full := _full(error)) is not None:
            raise full from None
        row = {"outcome": ERROR, "reason": sentence(error), "error": trace(error)}
        return Answer(job.run, row, {})
    return Answer(job.run, cells, time_cells(metrics), holds(job.claim, metrics))


_imported = cache(registered_source)
"""Imports a planner or a law once in this process."""


def _full(error: Exception) -> OSError | None:
    """What the disk said, if it takes no more."""
    cause = error if isinstance(error, OSError) else error.__cause__
    return cause if isinstance(cause, OSError) and cause.errno in FULL else None


def _flown(job: Job, scenario: Scenario) -> dict[str, Any]:
    """The metrics of a flight, its run folder kept as the job says."""
    if job.recordings in ("all", "thin", "folders"):
        return _kept(job, scenario)
    found = _measured(job, scenario)
    if job.recordings == "failures" and not holds(job.claim, found):
        # Failures are few: to fly them again costs less than to record every flight.
        _kept(job, scenario)
    return found


def _measured(job: Job, scenario: Scenario) -> dict[str, Any]:
    """The metrics of a flight that leaves no run folder."""
    if job.path is not None:
        from harness.run.path_check import fly_check

        return fly_check(job.path)
    from harness.analysis.metrics import metrics
    from harness.flight.closed_loop import fly
    from harness.run.scenario_flight import flight_limits, make_loop

    return metrics(fly(make_loop(scenario)), flight_limits(scenario))


def _kept(job: Job, scenario: Scenario) -> dict[str, Any]:
    """Flies into the job's run folder."""
    recording, again = job.recordings != "folders", job.again or None
    if job.path is not None:
        from harness.run.path_check import fly_check

        return fly_check(job.path, job.folder, recording, command=again)
    from harness.run.scenario_flight import fly_to_folder

    try:
        return fly_to_folder(
            scenario,
            job.folder,
            recording=recording,
            thin=job.recordings == "thin",
            identity=job.identity or None,
            varied=job.varied,
            command=again,
        )
    finally:
        # What is free goes to the system, where C's library is glibc: a process that records keeps growing otherwise.
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if recording and trim is not None:
            trim(0)


def _optimum_m(scenario: Scenario) -> float | None:
    from harness.world.optimum import shortest_path
    from harness.world.world import World

    world, mission = World.from_scenario(scenario), scenario.mission
    return shortest_path(
        world.obstacles,
        world.bounds_m,
        mission.start_m,
        mission.goal_m,
        scenario.planner.clearance_m,
        mission.goal_radius_m,
    ).length_m
