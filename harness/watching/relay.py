"""The process between a flight and the viewer that follows it: whatever becomes of the viewer, the flight goes on.

rerun waits for a viewer that does not take what it is sent, at the latest when the process ends, and all of Python
waits with it. So that happens in a process of its own, which can be ended.
"""

from __future__ import annotations

import multiprocessing
import os
import queue
import signal
import threading
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any, Final, NamedTuple

from harness.files.spawning import without_main

GONE: Final = 3
"""Exit status: the viewer has gone."""
READY_S: Final = 60.0
"""Wall time within which the process is up; it imports rerun."""
LAST_S: Final = 10.0
"""Wall time that the viewer has for what is left when the flight is over."""


class Opening(NamedTuple):
    """What is told first."""

    url: str
    scene: Any
    identity: str


class Call(NamedTuple):
    """A call of the recording's, and what it takes."""

    method: str
    arguments: tuple[Any, ...]
    moving: tuple[Any, ...] = ()
    """What the map takes to move at a scan."""


def show(pipe: Connection) -> None:
    """Sends a flight to a viewer until the pipe is closed, which gives an `Opening`, and then lists of `Call`.

    The viewer has each list before the next is read; an answer of one byte says so.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(2, 1)
    os.environ["RUST_LOG"] = "off"  # rerun's own words on a viewer that has gone
    from harness.recording.log import RerunLog

    moving: tuple[Any, ...] = ()
    log: Any = None
    try:
        opening: Opening = pipe.recv()
        log = RerunLog(opening.url, opening.scene, opening.identity, moving=lambda: moving)
        pipe.send_bytes(b"+")
        while True:
            for call in pipe.recv():
                moving = call.moving
                getattr(log, call.method)(*call.arguments)
            log.flush()
            pipe.send_bytes(b"+")
    except EOFError:
        if log is not None:
            log.end()
    except OSError:  # the viewer has gone, or the flight
        os._exit(GONE)


class RelayProcess:
    """The process, and a thread that waits for it: who hands something over never does. `end` must be called.

    `gone` is told once if the viewer goes away before the end.
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
