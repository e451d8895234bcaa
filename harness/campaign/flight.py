"""Flies one run of a campaign, in a process of its own, here or on another machine."""

from __future__ import annotations

import ctypes
import errno
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal

from aircraft.model_files import TrimError
from harness.analysis.metric import ERROR, Claim, cause_of, holds, margin
from harness.campaign.results import metric_cells, time_cells
from harness.files.errors import PlannerError, RunFolderError, WriteError, sentence, trace
from harness.flight.record import Outcome
from harness.run.path_check import fly_check
from harness.run.path_flight import PathCheck
from harness.run.scenario_flight import RunNames, fly_and_measure, fly_to_folder
from harness.scenario.kinds import GUIDANCE, PLANNER, LoopPart, registered_source, source_digests
from harness.scenario.scenario import Scenario, unpacked
from harness.world.optimum import optimum_of

DISK_FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""Errors of a disk that takes no more, for which a run is not to blame."""


@dataclass(frozen=True)
class Job:
    """One run to be flown."""

    run: int
    packed: bytes
    """The scenario to fly (`harness.scenario.scenario.packed`); empty where a given `path` is flown."""
    folder: Path
    recordings: Literal["all", "thin", "failures", "none", "folders"]
    """Which run folders are kept; with `folders` all are, without recordings."""
    optimum: bool
    again: str = ""  # the command that flies it again
    varied: Mapping[str, str | float | int | bool] = field(default_factory=dict)
    """The keys that the campaign varies and their values in this run, for the recording's properties."""
    claim: Claim = "reached"  # the run is a failure where this does not hold of it
    path: PathCheck | None = None
    cannot_fly: str = ""  # why the drawn aircraft cannot begin the flight: control is lost at once then
    planners: tuple[str, ...] = ()
    """Planners that the process has to import, as FILE.py:NAME or MODULE:NAME; likewise `laws`."""
    laws: tuple[str, ...] = ()
    identity: str = ""  # identifies the recording among others; where empty, `fly_to_folder` chooses


@dataclass(frozen=True)
class Answer:
    """The result of a run: cells of its row and of its times, and whether the campaign's claim holds of it."""

    run: int
    row: dict[str, Any]
    times: dict[str, Any]
    held: bool = False


def fly_job(job: Job) -> Answer | None:
    """Flies a job. A fault of the flight is an answer too; None without memory; OSError if nothing can be written."""
    if job.cannot_fly:
        return Answer(job.run, {"outcome": Outcome.LOST_CONTROL.value, "reason": job.cannot_fly}, {})
    try:
        for part, sources in ((PLANNER, job.planners), (GUIDANCE, job.laws)):
            for source in sources:
                _import(source, part, *source_digests([source]).values())
        scenario = unpacked(job.packed) if job.path is None else job.path.scenario
        metrics = _fly(job, scenario)
        wanted_m = metrics["check"]["clearance_m"] if "check" in metrics else scenario.planner.clearance_m
        cells = metric_cells(metrics, wanted_m, optimum_of(scenario).length_m if job.optimum else None)
    except WriteError:
        raise
    except RunFolderError as error:
        raise OSError(str(error)) from error
    except TrimError as error:
        return Answer(job.run, {"outcome": Outcome.LOST_CONTROL.value, "reason": str(error)}, {})
    except Exception as error:
        if _is_out_of_memory(error):
            return None
        return Answer(job.run, {"outcome": ERROR, "reason": sentence(error), "error": trace(error)}, {})
    cells |= {"margin": margin(job.claim, metrics), "cause": cause_of(job.claim, metrics)}
    return Answer(job.run, cells, time_cells(metrics), holds(job.claim, metrics))


def _is_out_of_memory(error: Exception) -> bool:
    """Tells whether memory ran out; raises the error of a full disk, for which a run is not to blame either."""
    for cause in (error, error.__cause__):
        # Whatever the constructor of a planner raised is its own, a full disk too.
        if isinstance(cause, OSError) and cause.errno in DISK_FULL and not isinstance(error, PlannerError):
            raise cause from None
    return any(isinstance(cause, MemoryError) for cause in (error, error.__cause__))


@cache
def _import(source: str, part: LoopPart, *_digest: str) -> None:
    """Imports a planner or a law, once in this process for each content of its file: a cluster's workers live long."""
    registered_source(source, part)


def _fly(job: Job, scenario: Scenario) -> dict[str, Any]:
    """Flies a job and returns its metrics; keeps its run folder as the job says, for which a failure is flown again."""
    if job.recordings in ("failures", "none"):
        found = fly_and_measure(scenario) if job.path is None else fly_check(job.path)
        if job.recordings == "none" or holds(job.claim, found):
            return found
        # Failures are few: to fly them again costs less than to record every flight.
    return _fly_to_folder(job, scenario)


def _fly_to_folder(job: Job, scenario: Scenario) -> dict[str, Any]:
    recording, again = job.recordings != "folders", job.again or None
    if job.path is not None:
        return fly_check(job.path, job.folder, recording, command=again)
    try:
        named = RunNames(again, job.identity or None, job.varied, job.recordings == "thin")
        return fly_to_folder(scenario, job.folder, recording, named=named)
    finally:
        # What is free goes to the system, where C's library is glibc: a process that records keeps growing otherwise.
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if recording and trim is not None:
            trim(0)
