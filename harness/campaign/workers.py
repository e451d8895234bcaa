"""Who flies the runs of a campaign: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import ipaddress
import logging
import multiprocessing
import os
import re
import signal
import socket
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from typing import Any, Final, Protocol, TypeAlias

from harness.campaign.flight import Answer, Job, NoMemoryError, fly_job
from harness.files.errors import RunFolderError
from harness.files.spawning import open_standard_files, without_main
from harness.files.strict_yaml import InputError
from harness.files.versions import versions
from planner.compiled import own_this_process

ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "ARROW_IO_THREADS"), "1"
)
"""Environment of a worker: one flight a processor, and no threads of numpy or Arrow beside it."""

CONNECT_S: Final = 10.0
SCHEDULER_PORT: Final = 8786
JOBS_EACH: Final = 2
"""Jobs handed out for each that can be flown at a time: nobody waits for the next while an answer is written down."""


TRIES: Final = 2
"""A run whose process dies is tried this often."""

Flown: TypeAlias = tuple[int, Answer | None]
"""Number of a run that is over, and what came of it; None where the machine kept it from its end."""


class SchedulerGoneError(OSError):
    """Nobody hands out jobs any more."""

    def __init__(self) -> None:
        super().__init__("the Dask scheduler has gone")


class Workers(Protocol):
    """Who flies."""

    def free(self) -> int:
        """How many jobs more may be handed out now; 0 or less for none."""
        ...

    def start(self, job: Job) -> None:
        """Hands out a job."""
        ...

    def over(self, timeout_s: float) -> Sequence[Flown]:
        """The jobs that have come to an end since, waited for at most so long.

        Raises:
            OSError: a run folder cannot be written, or who flies has gone.
        """
        ...


def finished(futures: Collection[Future[Answer]], timeout_s: float) -> set[Future[Answer]]:
    """Those that are done, waited for until the first is."""
    if not futures:
        time.sleep(timeout_s)
    return wait(futures, timeout_s, FIRST_COMPLETED).done


def _answer(future: Future[Answer]) -> Answer | None:
    try:
        return future.result()
    except NoMemoryError:
        return None
    except RunFolderError as error:
        raise OSError(str(error)) from error


class _Process:
    """One process and the jobs that it was handed, the first of which it flies: when it dies, it is known of what."""

    def __init__(self) -> None:
        self.jobs: deque[tuple[Job, Future[Answer]]] = deque()
        self._pool: ProcessPoolExecutor | None = None
        self._tries = TRIES

    def start(self, job: Job) -> None:
        with without_main():
            try:
                flown = self._begun().submit(fly_job, job)
            except BrokenProcessPool:  # it died while it had nothing to do
                self.end()
                flown = self._begun().submit(fly_job, job)
        self.jobs.append((job, flown))

    def over(self) -> list[Flown]:
        """What came of the first job, which is done; nothing where it is tried once more."""
        job, flown = self.jobs[0]
        try:
            found = [(job.run, _answer(flown))]
        except BrokenProcessPool:
            self.end()
            self._tries -= 1
            found = [] if self._tries else [(job.run, None)]
            again = [each for each, _ in self.jobs]
            self.jobs.clear()
            for each in again[len(found) :]:
                self.start(each)
        else:
            self.jobs.popleft()
        if found:
            self._tries = TRIES
        return found

    def end(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None

    def _begun(self) -> ProcessPoolExecutor:
        if self._pool is None:
            spawn = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, mp_context=spawn, initializer=_begin)
        return self._pool


class LocalWorkers:
    """Processes of this machine."""

    def __init__(self, number: int) -> None:
        self._processes = [_Process() for _ in range(number)]

    def free(self) -> int:
        """Room for a job that flies and one that waits for each process."""
        return sum(JOBS_EACH - len(each.jobs) for each in self._processes)

    def start(self, job: Job) -> None:
        """Hands a job to the process that has the fewest."""
        min(self._processes, key=lambda each: len(each.jobs)).start(job)

    def over(self, timeout_s: float) -> list[Flown]:
        """The jobs that have come to an end."""
        flying = {each.jobs[0][1]: each for each in self._processes if each.jobs}
        return [flown for future in finished(flying, timeout_s) for flown in flying[future].over()]

    def end(self) -> None:
        """Waits for what handed out jobs, once the processes have ended: at its end Python wakes it without a lock."""
        for each in self._processes:
            each.end()


@contextmanager
def local_workers(number: int) -> Iterator[Workers]:
    """So many processes of this machine; they end with the context, in mid-flight if need be."""
    open_standard_files()
    before = set(multiprocessing.active_children())
    kept = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    workers = LocalWorkers(number)
    try:
        yield workers
    finally:
        for name, value in kept.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()
            child.join()
        workers.end()


@contextmanager
def dask_workers(
    address: str, unencrypted: bool = False, tell: Callable[[str], None] = warnings.warn
) -> Iterator[Workers]:
    """The workers of a Dask cluster, as many as there are at any time.

    A job whose worker dies is flown again by another one; after the scheduler's `allowed-failures` it is given
    up. Scheduler and workers are trusted: Dask sends pickles, which run code, in both directions.

    `address`: of the scheduler, as tcp://127.0.0.1:8786 or tls://host:8786.
    `unencrypted`: whether an address beyond this machine may lead there without TLS, where whoever can change
    what is sent can run code on both ends.

    Raises:
        InputError: the address leads beyond this machine without TLS and may not, Dask is not installed, no
            scheduler answers, or a worker has other versions than we.
    """
    if not re.fullmatch(r"[a-z]+://.+", address):
        raise InputError(
            f"wayproof: --scheduler {address}: is no address; give it as tcp://HOST:PORT, or beyond this machine as "
            "tls://HOST:PORT"
        )
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address, parse_host_port
    except ImportError as error:
        raise InputError("wayproof: --scheduler needs Dask; pip install 'wayproof[cluster]'") from error
    for logger in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(logger).setLevel(logging.CRITICAL)
    try:
        scheme, place = parse_address(address)
        host, port = parse_host_port(place, SCHEDULER_PORT)
        if scheme not in ("tls", "wss", "inproc") and not unencrypted and not _is_here(host):
            raise InputError(
                f"wayproof: {address} leads beyond this machine without encryption: whoever can change what is sent "
                "can run code here; give tls://HOST:PORT, or --unencrypted in a network that is trusted"
            )
        if scheme != "inproc":  # a Client that finds nobody prints a traceback when it is thrown away
            socket.create_connection((host, port), CONNECT_S).close()
        client: Any = Client(address, timeout=CONNECT_S, set_as_default=False)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise InputError(f"wayproof: no Dask scheduler answers at {address}; start one there") from error
    with client:
        ours = versions()
        if not client.nthreads():
            raise InputError(f"wayproof: {address} has no workers; start some, as `dask worker {address}`")
        for worker, theirs in client.run(versions).items():
            if theirs != ours:
                raise InputError(f"wayproof: the worker {worker} has {theirs}; must have {ours}")
        yield DaskWorkers(client, tell)


def _is_here(host: str) -> bool:
    """Whether a host is this machine, as far as its address says; a name may lead anywhere."""
    with suppress(ValueError):
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    return False


class DaskWorkers:
    """The workers of a Dask cluster."""

    def __init__(self, client: Any, tell: Callable[[str], None]) -> None:
        self._client, self._tell = client, tell
        self._executor = client.get_executor(pure=False)
        self._flying: dict[Future[Answer], int] = {}
        self._known = set(client.nthreads())

    def free(self) -> int:
        """Room for jobs that fly and for as many that wait."""
        try:
            threads_of = self._client.nthreads()
        except OSError as error:
            raise SchedulerGoneError from error
        for gone in sorted(self._known - set(threads_of)):
            self._tell(f"the Dask worker {gone} has gone; others fly its runs again")
        self._known = set(threads_of)
        threads: int = sum(threads_of.values())
        return JOBS_EACH * threads - len(self._flying)

    def start(self, job: Job) -> None:
        """Hands a job to the scheduler."""
        self._flying[self._executor.submit(fly_job, job)] = job.run

    def over(self, timeout_s: float) -> list[Flown]:
        """The jobs that have come to an end."""
        from distributed import KilledWorker

        found: list[Flown] = []
        for future in finished(self._flying, timeout_s):
            run = self._flying.pop(future)
            if future.cancelled():
                raise SchedulerGoneError
            found.append((run, None if isinstance(future.exception(), KilledWorker) else _answer(future)))
        return found


def _begin() -> None:
    """What a process of ours does first."""
    # An interrupt reaches the whole process group; the parent decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Standard output is the parent's alone: what a planner prints goes to standard error.
    os.dup2(2, 1)
    own_this_process()
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.join,), daemon=True).start()


def _end_with(joined: Callable[[], None]) -> None:
    """A parent that is killed takes its processes along."""
    joined()
    os._exit(1)
