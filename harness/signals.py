"""Signals that ask a process to end, taken like Ctrl-C, so that whatever it is doing can say so and clean up."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

ENDING: Final = (signal.SIGTERM, signal.SIGHUP)


@contextmanager
def taken_as_interrupt() -> Iterator[list[int]]:
    """Lets SIGTERM and SIGHUP raise KeyboardInterrupt in the block; gives the list of those that came.

    A signal that somebody has made to be ignored (`nohup`) or handles already is left as it is; outside the
    main thread, where Python takes no signals, all are.
    """
    came: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
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
