"""Signals that ask a process to end, taken like Ctrl-C, so that whatever it is doing can say so and clean up.

In flight they are held back to where no machine code is at work.
"""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

ENDING_SIGNALS: Final = (signal.SIGTERM, signal.SIGHUP)  # taken like Ctrl-C
HELD_SIGNALS: Final = (signal.SIGINT, *ENDING_SIGNALS)  # held back where machine code may be at work
REPEAT_S: Final = 2.0  # a signal again within this is the same; one held for longer is let through


@contextmanager
def signals_as_interrupt() -> Iterator[list[int]]:
    """Lets SIGTERM and SIGHUP raise KeyboardInterrupt in the block; gives the list of those that came.

    A signal that somebody has made to be ignored (`nohup`) or handles already is left as it is; outside the
    main thread, where Python takes no signals, all are. One that comes again within `REPEAT_S` (`timeout` sends to the
    process and to its group) is the same: it does not end the cleaning up.
    """
    signals: list[int] = []
    first_s = -math.inf

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal first_s
        if time.monotonic() - first_s < REPEAT_S:
            return
        first_s = time.monotonic()
        signals.append(number)
        raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    taken = [each for each in ENDING_SIGNALS if main and signal.getsignal(each) is signal.SIG_DFL]
    for each in taken:
        signal.signal(each, end)
    try:
        yield signals
    finally:
        for each in taken:
            signal.signal(each, signal.SIG_DFL)


@contextmanager
def held_back() -> Iterator[Callable[[], None]]:
    """Holds back signals that Python handles until the block calls for them, or ends.

    A handler runs, and raises, wherever the process is; numba, in its first calls, makes another error or a crash of
    what is raised there. A block that has not called `REPEAT_S` after the signal may never call, as one with a planner
    that hangs: then the signal is let through wherever the block is. Machine code that hangs is not interrupted: Python
    takes signals between two of its own instructions. Outside the main thread, where Python takes no signals, nothing
    is held.
    """
    held: list[int] = []
    timers: list[threading.Timer] = []
    first_s = math.inf

    def hold(number: int, frame: FrameType | None) -> None:
        nonlocal first_s
        first_s = min(first_s, time.monotonic())
        held.append(number)
        if time.monotonic() - first_s >= REPEAT_S:
            let_through()
        elif not timers:
            # A signal itself, not `interrupt_main`: it wakes a planner that sleeps or waits.
            timers.append(threading.Timer(REPEAT_S, signal.pthread_kill, (main_thread, number)))
            timers[0].daemon = True
            timers[0].start()

    def let_through() -> None:
        if not (timers or held):  # as nearly always
            return
        for timer in timers:
            timer.cancel()
        timers.clear()
        if held:
            number = held[0]
            held.clear()
            handlers[signal.Signals(number)](number, None)

    main = threading.current_thread() is threading.main_thread()
    main_thread = threading.get_ident()
    found = {each: signal.getsignal(each) for each in HELD_SIGNALS if main}
    handlers = {each: handler for each, handler in found.items() if callable(handler)}
    for each in handlers:
        signal.signal(each, hold)
    try:
        yield let_through
    finally:
        for each, handler in handlers.items():
            signal.signal(each, handler)
        let_through()
