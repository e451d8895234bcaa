"""Flights side by side, each in a process of its own: what one of them does cannot reach the others."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from harness.files.crash import sentence
from harness.files.spawning import without_main

if TYPE_CHECKING:
    from harness.scenario.scenario import Scenario


@dataclass(frozen=True)
class ComparedFlight:
    """One flight to be made.

    Attributes:
        scenario: what to fly, its planner included.
        folder: the run folder to write.
        recording: whether to write `flight.rrd`.
        kinematic: a point that follows the plans exactly flies instead of the aircraft.
        sources: planners that the flight's process has to import, as FILE.py:NAME or MODULE:NAME.
        law_sources: guidance laws that it has to import, likewise.
    """

    scenario: Scenario
    folder: Path
    recording: bool
    kinematic: bool
    sources: tuple[str, ...] = ()
    law_sources: tuple[str, ...] = ()


@dataclass(frozen=True)
class ComparedAnswer:
    """What a flight's process sent back.

    Attributes:
        crash: why the flight did not come to an end, a sentence; empty if it did.
    """

    crash: str = ""


Progress: TypeAlias = Callable[[int, float, float, str], None]
"""Takes a job's index, its simulated time (s), its distance to go (m) and a word on its state."""

Message: TypeAlias = ComparedAnswer | tuple[float, float, str]


def fly_all(
    jobs: Sequence[ComparedFlight], workers: int, progress: Progress | None = None
) -> list[ComparedAnswer]:
    """Makes all flights, some at a time.

    Args:
        jobs: the flights; no two write the same folder.
        workers: how many fly at the same time, at least 1; changes nothing but the time it takes.
        progress: told of every flight as it goes on.

    Returns:
        The answers, in the order of the jobs.
    """
    context = multiprocessing.get_context("spawn")
    answers: list[ComparedAnswer] = [ComparedAnswer()] * len(jobs)
    waiting = deque(range(len(jobs)))
    flying: dict[Connection, tuple[int, SpawnProcess]] = {}
    try:
        while waiting or flying:
            while waiting and len(flying) < workers:
                index = waiting.popleft()
                ours, theirs = context.Pipe(duplex=False)
                process = context.Process(target=_fly, args=(jobs[index], theirs), daemon=True)
                with without_main():
                    process.start()
                # Only the child may hold this end: then its death is the end of the stream.
                theirs.close()
                flying[ours] = index, process
            ready = wait(list(flying))
            for ours in [each for each in flying if each in ready]:
                index, process = flying[ours]
                message = _receive(ours, process)
                if isinstance(message, ComparedAnswer):
                    answers[index] = message
                    process.join()
                    ours.close()
                    del flying[ours]
                elif progress is not None:
                    progress(index, *message)
    finally:
        for _, process in flying.values():
            process.terminate()
            process.join()
    return answers


def _receive(ours: Connection, process: SpawnProcess) -> Message:
    """The next message of a child; its death is an answer too."""
    try:
        message: Message = ours.recv()
    except (EOFError, OSError):
        process.join()
        return ComparedAnswer(
            f"its process ended with {_ending(process.exitcode or 0)} before the flight did"
        )
    return message


def _ending(exitcode: int) -> str:
    if exitcode >= 0:
        return f"exit status {exitcode}"
    return f"signal {-exitcode} ({signal.strsignal(-exitcode) or 'unknown'})"


def _fly(job: ComparedFlight, theirs: Connection) -> None:
    """One flight, in the child."""
    # An interrupt reaches the whole process group; the parent decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Standard output is the parent's alone: what a planner prints goes to standard error.
    os.dup2(2, 1)
    try:
        _write(job, theirs)
        theirs.send(ComparedAnswer())
    except Exception as error:
        theirs.send(ComparedAnswer(sentence(error)))
    finally:
        theirs.close()


def _write(job: ComparedFlight, theirs: Connection) -> None:
    from harness.run.scenario_flight import fly_to_folder, kinematic_loop, make_loop
    from harness.scenario.given import GUIDANCE, registered_source
    from planner.compiled import own_this_process

    own_this_process()
    for source in job.sources:
        registered_source(source)
    for source in job.law_sources:
        registered_source(source, GUIDANCE)
    fly_to_folder(
        job.scenario,
        job.folder,
        job.recording,
        lambda time_s, to_go_m, state: theirs.send((time_s, to_go_m, state)),
        make=kinematic_loop if job.kinematic else make_loop,
    )
