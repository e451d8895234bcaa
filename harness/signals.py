"""Signals that ask a process to end, taken like Ctrl-C, so that whatever it is doing can say so and clean up."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

ENDING: Final = (signal.SIGTERM, signal.SIGHUP)
AGAIN_S: Final = 2.0


def let_interrupts_through(error: BaseException) -> None:
    """Raises KeyboardInterrupt if an error is one, or is what numba made of one that came to its first calls."""
    if isinstance(error, KeyboardInterrupt):
        raise error
    if isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt):
        raise KeyboardInterrupt from error


@contextmanager
def interruptible() -> Iterator[None]:
    """A block, or by decoration a function, that an interrupt ends as such wherever it comes."""
    try:
        yield
    except SystemError as error:
        let_interrupts_through(error)
        raise


@contextmanager
def taken_as_interrupt() -> Iterator[list[int]]:
    """Lets SIGTERM and SIGHUP raise KeyboardInterrupt in the block; gives the list of those that came.

    A signal that somebody has made to be ignored (`nohup`) or handles already is left as it is; outside the
    main thread, where Python takes no signals, all are. One that comes again within `AGAIN_S` (`timeout` sends to the
    process and to its group) is the same: it does not end the cleaning up.
    """
    came: list[int] = []
    first_s = -math.inf

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal first_s
        if time.monotonic() - first_s < AGAIN_S:
            return
        first_s = time.monotonic()
        came.append(number)
        raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    taken = [each for each in ENDING if main and signal.getsignal(each) is signal.SIG_DFL]
    for each in taken:
        signal.signal(each, end)
    try:
        yield came
    finally:
        for each in taken:
            signal.signal(each, signal.SIG_DFL)
