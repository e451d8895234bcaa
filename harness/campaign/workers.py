"""Workers that fly the runs of a campaign: processes of this machine, or the workers of a Dask cluster."""

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
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from typing import Any, Final, SupportsIndex, TypeAlias

from harness.campaign.flight import Answer, Job, fly_job
from harness.files.spawning import open_standard_files, without_main
from harness.files.strict_yaml import InputError
from harness.files.versions import versions
from harness.flight.signals import held_back
from planner.compiled import compile_all, own_this_process

ONE_THREAD_ENVIRONMENT: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "ARROW_IO_THREADS"), "1"
)
"""Environment of a worker, which has one flight a processor, and no threads of numpy or Arrow beside it."""
CONNECT_S: Final = 10.0  # longest wait for a Dask scheduler
SCHEDULER_PORT: Final = 8786  # port of a scheduler whose address names none
SCHEDULER_GONE: Final = "the Dask scheduler has gone"
INTERRUPT_S: Final = 0.1  # requests to end the process are looked for at least this often
JOBS_EACH: Final = 2  # jobs handed out for each that can be flown at a time: no process waits for its next

Flown: TypeAlias = tuple[int, Answer | None]
"""Number of a run that is over, and its result; None where the machine kept it from its end."""


class Workers(ABC):
    """An executor of `concurrent.futures` that flies, and the jobs that it was handed."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self._flying: dict[Future[Answer | None], Job] = {}

    @abstractmethod
    def free(self) -> int:
        """Returns how many more jobs may be handed out now; 0 or less for none."""

    def start(self, job: Job) -> None:
        """Hands out a job."""
        self._flying[self._executor.submit(fly_job, job)] = job

    def collect(self, timeout_s: float) -> list[Flown]:
        """Returns the jobs that have ended since, waited for up to a time; an OSError as `fly_jobs` has it."""
        done = [(self._flying.pop(each).run, each) for each in finished(self._flying, timeout_s)]
        return [(run, self._answer(each)) for run, each in done]

    def _answer(self, future: Future[Answer | None]) -> Answer | None:
        return future.result()


def fly_jobs(
    jobs: Iterator[Job],
    workers: Workers,
    finish: Callable[[int, Answer | None], None],
    between: Callable[[], None] = lambda: None,
    enough: Callable[[], bool] = lambda: False,
) -> None:
    """Hands out jobs until none is left; an OSError where a run folder cannot be written, or the workers have gone.

    `finish` is called with the number of every job that is over and its answer, None where the machine gave it up.
    """
    ahead, flying = next(jobs, None), set[int]()
    # An interrupt that is raised inside `concurrent.futures` leaves a future locked, and who ends the workers waits for
    # it without end.
    with held_back() as let_interrupt_through:
        while (ahead is not None or flying) and not enough():
            let_interrupt_through()
            while ahead is not None and workers.free() > 0:
                workers.start(ahead)
                flying.add(ahead.run)
                ahead = next(jobs, None)
            for run, answer in workers.collect(INTERRUPT_S):
                if run in flying:  # else of a call that had enough
                    flying.remove(run)
                    finish(run, answer)
            between()


def finished(futures: Collection[Future[Any]], timeout_s: float) -> set[Future[Any]]:
    """Returns the futures that are done, after waiting for the first one."""
    if not futures:
        time.sleep(timeout_s)
    return wait(futures, timeout_s, FIRST_COMPLETED).done


class LocalWorkers(Workers):
    """Processes of this machine.

    When one dies the pool ends, and all jobs that were handed out are lost. They are flown again, one at a time: a job
    whose process dies once more is given up.
    """

    def __init__(self, number: int) -> None:
        self._others = set(multiprocessing.active_children())
        super().__init__(_pool(number))
        self._number = number
        self._again: deque[Job] = deque()

    def begin(self) -> None:
        """Begins all processes, which get ready to fly meanwhile."""
        with held_back(), without_main():
            for _ in range(self._number):
                self._executor.submit(compile_all)

    def free(self) -> int:
        """Returns the room for jobs: for each process one that flies and one that waits."""
        return 0 if self._again else JOBS_EACH * self._number - len(self._flying)

    def start(self, job: Job) -> None:
        """Hands a job to the pool, or to a new pool where a process died while idle."""
        with without_main():
            try:
                super().start(job)
            except BrokenProcessPool:
                self._renew()
                super().start(job)

    def collect(self, timeout_s: float) -> list[Flown]:
        """Returns the jobs that have ended, and flies those again whose process died."""
        if any(map(_has_died, done := finished(self._flying, timeout_s))):
            done = wait(self._flying).done  # the pool has ended: so do they all, at once
            self._renew()
        lost = [self._flying.pop(each) for each in done if _has_died(each)]
        found = [(self._flying.pop(each).run, self._answer(each)) for each in done if not _has_died(each)]
        if not self._again:
            self._again.extend(lost)
        elif done:  # the first of them, which flew alone
            job = self._again.popleft()
            if job in lost:
                found.append((job.run, None))
        if self._again and not self._flying:
            self.start(self._again[0])
        return found

    def end(self) -> None:
        """Ends the processes, in mid-flight if need be, and the pool: nothing is written any more."""
        for child in set(multiprocessing.active_children()) - self._others:
            child.terminate()
            child.join()
        # The pool's thread, which is waited for here, would be woken without a lock by Python's exit.
        self._executor.shutdown(cancel_futures=True)

    def _renew(self) -> None:
        self.end()
        self._executor = _pool(self._number)


def _pool(number: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(number, multiprocessing.get_context("spawn"), _begin_process)


def _has_died(future: Future[Answer | None]) -> bool:
    return isinstance(future.exception(), BrokenProcessPool)


@contextmanager
def local_workers(number: int | None, jobs: int) -> Iterator[LocalWorkers]:
    """Starts processes of this machine, None: one a processor, no more than jobs; they end with the context."""
    if not (number is None or (isinstance(number, SupportsIndex) and number > 0)):
        raise InputError(f"wayproof: workers is {number!r}; must be a whole number of at least 1")
    open_standard_files()
    saved = {name: os.environ[name] for name in ONE_THREAD_ENVIRONMENT if name in os.environ}
    os.environ.update(ONE_THREAD_ENVIRONMENT)
    workers = LocalWorkers(min(number or os.cpu_count() or 1, jobs))
    try:
        workers.begin()
        yield workers
    finally:
        for name in ONE_THREAD_ENVIRONMENT:
            os.environ.pop(name)
        os.environ.update(saved)
        workers.end()


@contextmanager
def dask_workers(
    address: str, unencrypted: bool = False, warn: Callable[[str], None] = warnings.warn
) -> Iterator[Workers]:
    """Gives the workers of a Dask cluster, as many as there are at any time; an InputError where none is like us.

    A job whose worker dies is flown again by another one; after the scheduler's `allowed-failures` it is given up.
    Scheduler and workers are trusted: Dask sends pickles, which run code, in both directions. `unencrypted`: whether an
    address beyond this machine may lead there without TLS, where whoever can change what is sent can run code.
    """
    with _client(address, unencrypted) as client:
        ours = versions()
        if not client.nthreads():
            raise InputError(f"wayproof: {address} has no workers; start some, as `dask worker {address}`")
        for worker, theirs in client.run(versions).items():
            if theirs != ours:
                raise InputError(f"wayproof: the worker {worker} has {theirs}; must have {ours}")
        yield DaskWorkers(client, warn)


def _client(address: str, unencrypted: bool) -> Any:
    """Connects to a Dask scheduler, beyond this machine with TLS unless `unencrypted`; else an InputError."""
    if not re.fullmatch(r"[a-z]+://.+", address):
        way = "give it as tcp://HOST:PORT, or beyond this machine as tls://HOST:PORT"
        raise InputError(f"wayproof: --scheduler {address}: is no address; {way}")
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
        with suppress(ValueError):  # a name, which may lead anywhere
            unencrypted = unencrypted or host == "localhost" or ipaddress.ip_address(host).is_loopback
        if scheme not in ("tls", "wss") and not unencrypted:
            raise InputError(
                f"wayproof: {address} leads beyond this machine without encryption: whoever can change what is sent "
                "can run code here; give tls://HOST:PORT, or --unencrypted in a network that is trusted"
            )
        # A Client that finds nobody prints a traceback when it is thrown away.
        socket.create_connection((host, port), CONNECT_S).close()
        return Client(address, timeout=CONNECT_S, set_as_default=False)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise InputError(f"wayproof: no Dask scheduler answers at {address}; start one there") from error


class DaskWorkers(Workers):
    """The workers of a Dask cluster."""

    def __init__(self, client: Any, warn: Callable[[str], None]) -> None:
        super().__init__(client.get_executor(pure=False))
        self._client, self._warn = client, warn
        self._known = set(client.nthreads())

    def free(self) -> int:
        """Returns the room for jobs that fly and for as many that wait; tells which workers have gone."""
        try:
            threads_of = self._client.nthreads()
        except OSError as error:
            raise OSError(SCHEDULER_GONE) from error
        for name in sorted(self._known - set(threads_of)):
            self._warn(f"the Dask worker {name} has gone; others fly its runs again")
        self._known = set(threads_of)
        threads: int = sum(threads_of.values())
        return JOBS_EACH * threads - len(self._flying)

    def _answer(self, future: Future[Answer | None]) -> Answer | None:
        from distributed import KilledWorker

        if future.cancelled():
            raise OSError(SCHEDULER_GONE)
        return None if isinstance(future.exception(), KilledWorker) else super()._answer(future)


def _begin_process() -> None:
    """Prepares a worker process: no interrupts, no standard output, and an end with its parent."""
    # An interrupt reaches the whole process group; the parent decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Standard output is the parent's alone: what a planner prints goes to standard error.
    os.dup2(2, 1)
    own_this_process()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    if parent := multiprocessing.parent_process():
        parent.join()
        os._exit(1)
