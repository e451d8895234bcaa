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
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, Final, Protocol

from harness.campaign.flight import Answer, Job, fly_job
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


class WorkerDiedError(Exception):
    """The process that flew a run ended before the flight did, as often as it was tried."""


class SchedulerGoneError(OSError):
    """Nobody hands out jobs any more."""

    def __init__(self) -> None:
        super().__init__("the Dask scheduler has gone")


class Workers(Protocol):
    """Who flies."""

    def free(self) -> int:
        """How many jobs more may be handed out now; 0 or less for none."""
        ...

    def start(self, job: Job) -> Future[Answer]:
        """Hands out a job; its future may raise WorkerDiedError or SchedulerGoneError."""
        ...


class _Line:
    """Jobs that wait for a process, the first that came first."""

    def __init__(self) -> None:
        self.changing = threading.Lock()
        self.waiting: deque[tuple[Job, Future[Answer]]] = deque()


class _Lane:
    """One process, one job at a time: when it dies, it is known of what."""

    TRIES: Final = 2

    def __init__(self, line: _Line) -> None:
        self.busy = False
        self._line = line
        self._closed = False
        self._pool: ProcessPoolExecutor | None = None
        self._broken: ProcessPoolExecutor | None = None

    def go_on(self, *, over: bool = False) -> None:
        """Takes the next job of the line, unless one is being flown that is not `over`."""
        with self._line.changing:
            if self.busy and not over:
                return
            self.busy = bool(self._line.waiting)
            if not self.busy:
                return
            job, answer = self._line.waiting.popleft()
        self._try(job, answer, self.TRIES)

    def _try(self, job: Job, answer: Future[Answer], tries: int) -> None:
        try:
            flown = self._submitted(job)
        except (OSError, RuntimeError) as error:
            # No process can be begun.
            answer.set_exception(error)
            return
        flown.add_done_callback(lambda flown: self._over(flown, job, answer, tries - 1))

    def _submitted(self, job: Job) -> Future[Answer]:
        with without_main():
            try:
                return self._process().submit(fly_job, job)
            except BrokenProcessPool:
                # It died while it had nothing to do.
                self._pool = None
                return self._process().submit(fly_job, job)

    def _process(self) -> ProcessPoolExecutor:
        if self._pool is None:
            spawn = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, mp_context=spawn, initializer=_begin)
        return self._pool

    def _over(self, flown: Future[Answer], job: Job, answer: Future[Answer], tries: int) -> None:
        if self._closed or flown.cancelled():
            answer.cancel()
            return
        error = flown.exception()
        if isinstance(error, BrokenProcessPool):
            # It is this pool that calls, and Python 3.13 has locked it for that: nobody may let go of it now.
            self._broken, self._pool = self._pool, None
            if tries:
                self._try(job, answer, tries)
                return
            error = WorkerDiedError()
        self.go_on(over=True)
        if error is None:
            answer.set_result(flown.result())
        else:
            answer.set_exception(error)

    def close(self) -> None:
        self._closed = True

    def end(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None


class LocalWorkers:
    """Processes of this machine."""

    def __init__(self, number: int) -> None:
        self._line = _Line()
        self._lanes = [_Lane(self._line) for _ in range(number)]

    def free(self) -> int:
        """Room for a job that flies and one that waits for each process."""
        with self._line.changing:
            out = len(self._line.waiting) + sum(lane.busy for lane in self._lanes)
        return JOBS_EACH * len(self._lanes) - out

    def start(self, job: Job) -> Future[Answer]:
        """Hands a job to an idle process, or to the first that will be."""
        answer: Future[Answer] = Future()
        self._line.waiting.append((job, answer))
        for lane in self._lanes:
            lane.go_on()
        return answer

    def close(self) -> None:
        """Takes no more jobs."""
        self._line.waiting.clear()
        for lane in self._lanes:
            lane.close()

    def end(self) -> None:
        """Waits for what handed out jobs, once the processes have ended: at its end Python wakes it without a lock."""
        for lane in self._lanes:
            lane.end()


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
        workers.close()
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

    Args:
        address: of the scheduler, as tcp://127.0.0.1:8786 or tls://host:8786.
        unencrypted: whether an address beyond this machine may lead there without TLS, where whoever can change
            what is sent can run code on both ends.
        tell: told when a worker has gone.

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
    except ImportError as error:
        raise InputError("wayproof: --scheduler needs Dask; pip install 'wayproof[cluster]'") from error
    for logger in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(logger).setLevel(logging.CRITICAL)
    if not unencrypted and _is_open(address):
        raise InputError(
            f"wayproof: {address} leads beyond this machine without encryption: whoever can change what is sent can "
            "run code here; give tls://HOST:PORT, or --unencrypted in a network that is trusted"
        )
    try:
        _knock(address)
        client: Any = Client(address, timeout=CONNECT_S, set_as_default=False)
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


def _knock(address: str) -> None:
    """Tries whether anybody listens: a Client that finds nobody prints a traceback when it is thrown away.

    Raises:
        OSError: nobody does.
        ValueError: it is no address.
    """
    from distributed.comm.addressing import parse_address, parse_host_port

    scheme, place = parse_address(address)
    if scheme in ("tcp", "tls"):
        socket.create_connection(parse_host_port(place, SCHEDULER_PORT), CONNECT_S).close()


def _is_open(address: str) -> bool:
    """Whether an address leads beyond this machine without TLS."""
    from distributed.comm.addressing import parse_address, parse_host_port

    try:
        scheme, place = parse_address(address)
        host, _ = parse_host_port(place, SCHEDULER_PORT)
        own = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name, or no address at all
        own = False
    return not own and scheme not in ("tls", "wss", "inproc")


class DaskWorkers:
    """The workers of a Dask cluster."""

    def __init__(self, client: Any, tell: Callable[[str], None]) -> None:
        self._client, self._tell = client, tell
        self._executor = client.get_executor(pure=False)
        self._flying = 0
        self._counted = threading.Lock()
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
        return JOBS_EACH * threads - self._flying

    def start(self, job: Job) -> Future[Answer]:
        """Hands a job to the scheduler."""
        from distributed import KilledWorker

        answer: Future[Answer] = Future()
        self._count(1)

        def over(flown: Future[Answer]) -> None:
            self._count(-1)
            if flown.cancelled():
                answer.set_exception(SchedulerGoneError())
            elif error := flown.exception():
                answer.set_exception(WorkerDiedError() if isinstance(error, KilledWorker) else error)
            else:
                answer.set_result(flown.result())

        self._executor.submit(fly_job, job).add_done_callback(over)
        return answer

    def _count(self, more: int) -> None:
        with self._counted:
            self._flying += more


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
