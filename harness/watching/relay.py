"""The process between a flight and the viewer that follows it: whatever becomes of the viewer, the flight goes on.

rerun waits for a viewer that does not take what it is sent, at the latest when the process ends, and all of Python
waits with it. So that happens in a process of its own, which can be ended.
"""

from __future__ import annotations

import os
import signal
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

GONE = 3
"""Exit status: the viewer has gone."""


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
    """Sends a flight to a viewer, as it is told of it, until the pipe is closed.

    Args:
        pipe: gives an `Opening`, and then lists of `Call`. The viewer has each list before the next is read;
            an answer of one byte says so.
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
