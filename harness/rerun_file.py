"""The file of a recording, written in a way that a full disk cannot stop.

rerun's own file sink gives up for ever at the first write that fails: whoever flushes or ends the recording then
waits without end. So rerun writes into a pipe, and a thread of ours moves what comes out into the file.
"""

from __future__ import annotations

import os
import threading
from pathlib import Path

import rerun as rr
from rerun.blueprint import Blueprint

_AT_ONCE_BYTES = 1 << 20


class RecordingFile:
    """Where a recording goes. `end` must be called, also when the flight breaks off.

    Args:
        rec: the recording, before anything is logged.
        path: the file; its folder must exist.
        default_blueprint: the layout that the file carries.

    Raises:
        OSError: the file cannot be made.
    """

    def __init__(self, rec: rr.RecordingStream, path: Path, default_blueprint: Blueprint) -> None:
        self._rec, self._path = rec, path
        self._file = path.open("wb", buffering=0)
        self._out, into = os.pipe()
        self._fault: OSError | None = None
        self._mover = threading.Thread(target=self._move, name="recording", daemon=True)
        self._mover.start()
        try:
            rec.save(f"/dev/fd/{into}", default_blueprint=default_blueprint)
        finally:
            os.close(into)  # rerun has opened the pipe for itself

    def flush(self) -> None:
        """Has rerun write out what was logged.

        Raises:
            OSError: some of the recording could not be written.
        """
        self._rec.flush()
        self._check()

    def end(self) -> None:
        """Ends the recording; again it does nothing.

        Raises:
            OSError: some of it could not be written.
        """
        if not self._file.closed:
            self._rec.disconnect()
            self._mover.join()
            self._file.close()
        self._check()

    def _move(self) -> None:
        while data := os.read(self._out, _AT_ONCE_BYTES):
            # After a fault the pipe is emptied all the same: rerun must never wait.
            while data and self._fault is None:
                try:
                    data = data[self._file.write(data) :]
                except OSError as error:
                    self._fault = error
        os.close(self._out)

    def _check(self) -> None:
        if self._fault is not None:
            raise OSError(self._fault.errno, self._fault.strerror, str(self._path))
