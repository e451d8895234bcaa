"""Child processes that do not run the caller's script again."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

_starting = threading.Lock()


@contextmanager
def without_main() -> Iterator[None]:
    """In the block processes begun by `spawn` do not import this `__main__`, and have interrupts blocked at first."""
    from multiprocessing import resource_tracker  # few commands need it

    with _starting:
        resource_tracker.ensure_running()  # unblocks the interrupt when it begins its own process
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            sys.modules["__main__"] = main


def open_standard_files() -> None:
    """Opens closed file descriptors 0 to 2 to nowhere, and Python's streams: others would get such a number."""
    for number, (stream, mode) in enumerate({"stdin": "r", "stdout": "w", "stderr": "w"}.items()):
        try:
            os.fstat(number)
        except OSError:  # a file that is opened gets the lowest number that is free: this one
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
            setattr(sys, stream, open(number, mode, encoding="utf-8"))  # noqa: SIM115
