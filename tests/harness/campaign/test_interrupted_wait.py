"""An interrupt of a campaign leaves no future locked: whoever ends the workers would wait for it without end."""

import signal
import threading
import time
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.campaign.flight import Answer
from harness.campaign.folder import fly_missing
from harness.campaign.workers import LocalWorkers, finished

FLYING = 3000  # so many futures that most of the time goes to locking and unlocking them


class Runs:
    """A campaign of so many runs beside the first, which is over."""

    def __len__(self) -> int:
        return FLYING + 1

    def job(self, number: int, folder: Path) -> SimpleNamespace:
        return SimpleNamespace(run=number)

    def cells(self, number: int) -> dict[str, Any]:
        return {}


class Crowd:
    """Workers whose answers come one by one, all the time."""

    def __init__(self) -> None:
        self.given: list[Future[Answer]] = []
        self._told = 0
        self._over = threading.Event()
        self._answering = threading.Thread(target=self._answer, daemon=True)

    def free(self) -> int:
        return FLYING - len(self.given)

    def start(self, job: Any) -> None:
        self.given.append(Future())
        if len(self.given) == FLYING:
            self._answering.start()

    def collect(self, timeout_s: float) -> list[tuple[int, Answer | None]]:
        left = self.given[self._told :]
        done = [each.result() for each in left[: len(finished(left, timeout_s))]]
        self._told += len(done)
        return [(each.run, each) for each in done]

    def _answer(self) -> None:
        for number, future in enumerate(self.given):
            if self._over.wait(0.001):
                return
            try:
                future.set_result(Answer(number, {"outcome": "reached"}, {}))
            except InvalidStateError:
                return

    def end(self) -> None:
        self._over.set()
        self._answering.join(10.0)  # in mid-answer it holds a future itself


def locked(futures: list[Future[Answer]]) -> int:
    """How many futures nobody else can take: asked from another thread, since the locks are their holder's own."""
    found = []

    def look() -> None:
        for future in futures:
            if future._condition.acquire(blocking=False):
                future._condition.release()
            else:
                found.append(future)

    looking = threading.Thread(target=look)
    looking.start()
    looking.join()
    return len(found)


@pytest.mark.parametrize("delay_s", [0.05, 0.17, 0.31])
def test_an_interrupt_leaves_no_future_locked(delay_s: float, tmp_path: Path) -> None:
    runs: Any = Runs()
    tables: list[float] = []
    folder: Any = SimpleNamespace(
        finished={0: None},
        path=tmp_path,
        append=lambda *row: None,
        write_tables=lambda: tables.append(time.monotonic()),
    )
    crowd: Any = Crowd()

    def interrupt() -> None:
        while len(crowd.given) < FLYING:
            time.sleep(0.001)
        time.sleep(delay_s)
        signal.pthread_kill(main, signal.SIGINT)

    main = threading.get_ident()
    threading.Thread(target=interrupt, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        fly_missing(runs, folder, crowd)
    crowd.end()
    assert locked(crowd.given) == 0
    assert tables, "what is done is in the tables"


def test_a_job_that_is_given_up_in_mid_flight_writes_no_more(tmp_path: Path) -> None:
    """As a day that is in flight when a claim is decided: its folder would stand among those of failures."""
    workers = LocalWorkers(1)
    workers._executor.submit(_fly_slowly, tmp_path)
    while not (tmp_path / "begun").exists():
        time.sleep(0.01)
    workers.end()
    assert [each.name for each in tmp_path.iterdir()] == ["begun"]


def _fly_slowly(folder: Path) -> None:
    (folder / "begun").touch()
    time.sleep(2.0)
    (folder / "written").touch()
