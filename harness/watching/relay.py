"""The process between a flight and its viewer: the flight goes on whatever the viewer does.

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

START_TIMEOUT_S: Final = 60.0  # wall time that a flight waits for the process to start; it imports rerun
END_TIMEOUT_S: Final = 10.0  # wall time that the process has to send the rest when the flight is over


class Opening(NamedTuple):
    """The first message to the process: the viewer's address, the scene, the identity of the recording."""

    url: str
    scene: Any
    identity: str


class Call(NamedTuple):
    """A call of a method of `RerunLog` with its arguments, which the process makes."""

    method: str
    arguments: tuple[Any, ...]
    moving: tuple[Any, ...] = ()  # obstacles that the map takes to be moving at a scan


def show(pipe: Connection) -> None:
    """Sends a flight to a viewer: reads an `Opening` from the pipe, then lists of `Call` until it is closed.

    Writes one byte to the pipe when the viewer has a list; then the next is read.
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
        os._exit(3)


class RelayProcess:
    """The process, and a thread that waits for it, so that the flight never does. `end` must be called.

    `on_gone` is called once if the viewer goes away before the end.
    """

    def __init__(self, on_gone: Callable[[], None] = lambda: None) -> None:
        self._on_gone = on_gone
        self.given_up = False  # whether the viewer has gone, so that nothing more needs to be handed over
        self._waiting: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._process: Any = None
        self._sender: threading.Thread | None = None

    def begin(self, opening: Opening) -> None:
        """Starts the process; returns when the viewer shows the scene, or has gone."""
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
        ready.wait(START_TIMEOUT_S)

    def hand_over(self, calls: Sequence[Call]) -> None:
        """Queues calls, which the process makes one after another."""
        if not self.given_up:
            self._waiting.put(bytes(ForkingPickler.dumps(list(calls))))

    def end(self, within_s: float = END_TIMEOUT_S) -> None:
        """Waits at most so long for the calls handed over, and ends the process; the viewer stays open."""
        if self._sender is None:
            return
        self._waiting.put(None)
        self._sender.join(within_s)
        self._on_gone = lambda: None  # the flight is over
        self._process.join(min(within_s, 1.0))
        self._process.kill()
        self._process.join()

    def _send(self, pipe: Any, ready: threading.Event) -> None:
        """Sends what is queued through the pipe, each once the last was taken; tells when the viewer has gone."""
        try:
            while (message := self._waiting.get()) is not None:
                pipe.send_bytes(message)
                pipe.recv_bytes()
                ready.set()
        except (OSError, EOFError):
            self.given_up = True
            self._on_gone()
        finally:
            pipe.close()
            ready.set()
