"""Begins and ends the process that sends a flight to a viewer, and hands it what it is to send."""

from __future__ import annotations

import multiprocessing
import queue
import threading
from collections.abc import Callable, Sequence
from multiprocessing.reduction import ForkingPickler
from typing import Any, Final

from harness.files.spawning import without_main
from harness.watching.relay import Call, Opening, show

READY_S: Final = 60.0
"""Wall time within which the process is up; it imports rerun."""
LAST_S: Final = 10.0
"""Wall time that the viewer has for what is left when the flight is over."""


class RelayProcess:
    """The process, and a thread that waits for it: who hands something over never does. `end` must be called.

    Args:
        gone: is told once if the viewer goes away before the end.
    """

    def __init__(self, gone: Callable[[], None] = lambda: None) -> None:
        self._tell_gone = gone
        self.given_up = False
        """Nothing more needs to be handed over: the viewer has gone."""
        self._waiting: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._process: Any = None
        self._sender: threading.Thread | None = None

    def begin(self, opening: Opening) -> None:
        """Begins; returns when the viewer has what it shows before the flight, or has gone."""
        spawn = multiprocessing.get_context("spawn")
        ours, theirs = spawn.Pipe()
        with without_main():
            self._process = spawn.Process(target=show, args=(theirs,), daemon=True)
            self._process.start()
        theirs.close()
        ready = threading.Event()
        self._sender = threading.Thread(target=self._send, args=(ours, ready), daemon=True)
        self._sender.start()
        self._waiting.put(bytes(ForkingPickler.dumps(opening)))
        ready.wait(READY_S)

    def hand_over(self, calls: Sequence[Call]) -> None:
        """Has some calls made, some time soon."""
        if not self.given_up:
            self._waiting.put(bytes(ForkingPickler.dumps(list(calls))))

    def end(self) -> None:
        """Waits for what has been handed over, not for long; the viewer stays open."""
        if self._sender is None:
            return
        self._waiting.put(None)
        self._sender.join(LAST_S)
        self._process.join(1.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._sender = None

    def _send(self, pipe: Any, ready: threading.Event) -> None:
        """Hands on what waits, in a thread."""
        try:
            while (message := self._waiting.get()) is not None:
                pipe.send_bytes(message)
                pipe.recv_bytes()
                ready.set()
        except (OSError, EOFError):
            self.given_up = True
            self._tell_gone()
        finally:
            pipe.close()
            ready.set()
