"""Flies the runs of a campaign that are missing: jobs out to workers, answers into the folder."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from harness.analysis.metric import ERROR
from harness.campaign.flight import Answer, Job
from harness.campaign.folder import CampaignFolder
from harness.campaign.results import RUNS
from harness.campaign.runs import CampaignRuns
from harness.campaign.workers import Workers
from harness.files.wording import counted
from harness.flight.signals import held_back

TABLES_EVERY_S: Final = 30.0
TABLES_SHARE: Final = 0.01
"""Tables are made anew at least this far apart, and so seldom that it takes at most this share of the time."""

INTERRUPT_S: Final = 0.1
"""How often it is looked whether the process was asked to end, at the least."""

FIRST_LEFT: Final = 5
"""Runs that are named of those that the machine kept from their ends."""


def fly_missing(
    runs: CampaignRuns,
    folder: CampaignFolder,
    workers: Workers,
    progress: Callable[[Answer], None] | None = None,
    enough: Callable[[], bool] = lambda: False,
) -> list[int]:
    """Flies what is missing; whatever ends it, what is done is in the folder's tables.

    `enough`: asked before every look whether what is over answers the question; what still flies is given up then.

    Returns:
        Numbers of the runs that the machine kept from their ends, as their process was killed or there was no memory.
        They are no results, and flown when the campaign is gone on with.
    """
    left: list[int] = []
    tables_due = time.monotonic()

    def over(run: int, answer: Answer | None) -> None:
        if answer is None or answer.row["outcome"] == ERROR:
            # What a crash has left is no whole run folder.
            shutil.rmtree(folder.path / RUNS / str(run), ignore_errors=True)
        if answer is None:
            left.append(run)
            return
        folder.append(replace(answer, row={**runs.run(run).cells(), **answer.row}))
        if progress is not None:
            progress(answer)

    def write_at_times() -> None:
        nonlocal tables_due
        begun = time.monotonic()
        if folder.over and begun >= tables_due:
            folder.write_tables()
            tables_due = time.monotonic() + max(TABLES_EVERY_S, (time.monotonic() - begun) / TABLES_SHARE)

    try:
        missing = (runs.job(run, folder.path) for run in range(len(runs)) if run not in folder.over)
        fly_jobs(missing, workers, over, write_at_times, enough)
    finally:
        if folder.over or left:
            folder.write_tables()
    return sorted(left)


def fly_jobs(
    jobs: Iterator[Job],
    workers: Workers,
    over: Callable[[int, Answer | None], None],
    between: Callable[[], None] = lambda: None,
    enough: Callable[[], bool] = lambda: False,
) -> None:
    """Hands out jobs until none is left; an OSError where a run folder cannot be written, or who flies has gone.

    `over`: told of every job that is over, by its number; None where the machine kept it from its end.
    """
    ahead, flying = next(jobs, None), 0
    # An interrupt that is raised inside `concurrent.futures` leaves a future locked, and who ends the workers waits for
    # it without end.
    with held_back() as let_interrupt_through:
        while (ahead is not None or flying) and not enough():
            let_interrupt_through()
            while ahead is not None and workers.free() > 0:
                workers.start(ahead)
                flying += 1
                ahead = next(jobs, None)
            for run, answer in workers.over(INTERRUPT_S):
                flying -= 1
                over(run, answer)
            between()


def told_left(runs: Sequence[int]) -> str:
    """A sentence on the runs that the machine kept from their ends."""
    first = ", ".join(map(str, runs[:FIRST_LEFT])) + (", ..." if len(runs) > FIRST_LEFT else "")
    were, them = ("was", "it") if len(runs) == 1 else ("were", "them")
    return (
        f"{counted(len(runs), 'run')} {were} not flown to the end ({first}): the process died, or had no memory, each "
        f"time that it was tried; --resume flies {them}"
    )
