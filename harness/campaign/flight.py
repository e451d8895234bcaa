"""One run of a campaign, flown where it was sent to: a process of its own, here or on another machine."""

from __future__ import annotations

import ctypes
import errno
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from harness.analysis.metric import ERROR, Claim, holds
from harness.campaign.results import metric_cells, time_cells
from harness.files.errors import PlannerError, RunFolderError, WriteError, sentence, trace
from harness.report.chapters import optimum_of
from harness.scenario.kinds import GUIDANCE, PLANNER, registered_source
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
        recordings: when the run folder is kept; `folders`: always, without recordings.
        again: the command that flies it again.
        varied: the keys that the campaign varies and their values in this run, for the recording's properties.
        claim: a run is a failure where this does not hold of it.
        path: a check, if a given path is flown in place of what a planner finds; `packed` is empty then.
        planners: planners that the process has to import, as FILE.py:NAME or MODULE:NAME; `laws`: likewise.
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
    """What came of a run: cells of its row and of its times, and whether the claim of the campaign holds of it."""

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
        optimum_m = optimum_of(scenario).length_m if job.optimum else None
        cells = metric_cells(metrics, scenario.planner.clearance_m, optimum_m)
    except (WriteError, RunFolderError):
        raise
    except Exception as error:
        _blame_machine(error)
        row = {"outcome": ERROR, "reason": sentence(error), "error": trace(error)}
        return Answer(job.run, row, {})
    return Answer(job.run, cells, time_cells(metrics), holds(job.claim, metrics))


def _blame_machine(error: Exception) -> None:
    """Raises what the machine did, if that made an error: no memory, or a full disk."""
    for cause in (error, error.__cause__):
        if isinstance(cause, MemoryError):
            raise NoMemoryError from None
        # Whatever the constructor of a planner raised is its own, a full disk too.
        if isinstance(cause, OSError) and cause.errno in FULL and not isinstance(error, PlannerError):
            raise cause from None


_imported = cache(registered_source)
"""Imports a planner or a law once in this process."""


def _flown(job: Job, scenario: Scenario) -> dict[str, Any]:
    """The metrics of a flight, its run folder kept as the job says."""
    if job.recordings in ("failures", "none"):
        found = _measured(job, scenario)
        if job.recordings == "none" or holds(job.claim, found):
            return found
        # Failures are few: to fly them again costs less than to record every flight.
    return _kept(job, scenario)


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
