"""Flies the runs of a campaign that are missing: jobs out to workers, answers into the folder."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Any, Final

from harness.campaign.flight import Answer, Job, failed
from harness.campaign.folder import CampaignFolder
from harness.campaign.results import ERROR, RUNS
from harness.campaign.runs import CampaignRuns
from harness.campaign.workers import WorkerDiedError, Workers
from harness.files.errors import RunFolderError
from harness.flight.signals import held_back

TABLES_EVERY_S: Final = 30.0
TABLES_SHARE: Final = 0.01
"""Tables are made anew at least this far apart, and so seldom that it takes at most this share of the time."""

LOOK_S: Final = 2.0
"""How often it is looked whether there are more workers, where there are none."""

INTERRUPT_S: Final = 0.1
"""How often it is looked whether the process was asked to end, at the least."""

Progress = Callable[[Answer], None]


def fly_missing(
    runs: CampaignRuns,
    folder: CampaignFolder,
    workers: Workers,
    progress: Progress | None = None,
    enough: Callable[[], bool] = lambda: False,
) -> None:
    """Flies what is missing; whatever ends it, what is done is in the folder's tables.

    Args:
        runs: the campaign.
        folder: its folder, claimed.
        workers: who flies.
        progress: told of every run that is over.
        enough: asked before every look whether what is over answers the question; what still flies is given up then.

    Raises:
        OSError: the folder, or a run folder in it, cannot be written; or who flies has gone.
    """
    jobs = _jobs(runs, folder)
    ahead = next(jobs, None)
    flying: dict[Future[Answer], int] = {}
    tables_due = time.monotonic() + TABLES_EVERY_S
    # An interrupt that is raised inside `concurrent.futures` leaves a future locked, and who ends the workers waits for
    # it without end.
    with held_back() as let_interrupt_through:
        try:
            while (ahead is not None or flying) and not enough():
                let_interrupt_through()
                while ahead is not None and workers.free() > 0:
                    flying[workers.start(ahead)] = ahead.run
                    ahead = next(jobs, None)
                if not flying:
                    _sleep(LOOK_S, let_interrupt_through)
                for future in wait(flying, timeout=INTERRUPT_S, return_when=FIRST_COMPLETED).done:
                    answer = _answer(future, flying.pop(future))
                    if answer.row["outcome"] == ERROR:
                        # What a crash has left is no whole run folder.
                        shutil.rmtree(folder.path / RUNS / str(answer.run), ignore_errors=True)
                    folder.append(answer.run, _row(runs, answer), answer.times, answer.held)
                    if progress is not None:
                        progress(answer)
                if time.monotonic() >= tables_due:
                    begun = time.monotonic()
                    folder.write_tables()
                    took_s = time.monotonic() - begun
                    tables_due = time.monotonic() + max(TABLES_EVERY_S, took_s / TABLES_SHARE)
        finally:
            folder.write_tables()


def _sleep(seconds: float, let_interrupt_through: Callable[[], None]) -> None:
    """Waits, and lets an interrupt through meanwhile."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        time.sleep(INTERRUPT_S)
        let_interrupt_through()


def _jobs(runs: CampaignRuns, folder: CampaignFolder) -> Iterator[Job]:
    """What is missing, made when it is its turn."""
    for number in range(len(runs)):
        if number not in folder.done:
            yield runs.job(number, folder.path)


def _answer(future: Future[Answer], run: int) -> Answer:
    try:
        return future.result()
    except WorkerDiedError:
        reason = "the process that flew it died, each time that it was tried"
        return failed(run, reason, f"{reason}\n")
    except RunFolderError as error:
        raise OSError(str(error)) from error


def _row(runs: CampaignRuns, answer: Answer) -> dict[str, Any]:
    return {**runs.run(answer.run).cells(), **answer.row}
