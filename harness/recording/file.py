"""Sinks of a recording: its file, written so that a full disk cannot stop the flight, or a viewer that is running.

rerun's own file sink gives up for ever at the first write that fails: whoever flushes or ends the recording then
waits without end. So rerun writes into a pipe, and a thread of ours moves what comes out into the file.
"""

from __future__ import annotations

import os
import struct
import threading
from pathlib import Path
from typing import Final

import rerun as rr

from harness.files.whole_file import fresh
from harness.recording.layout import Layout

VIEWER_TIMEOUT_S: Final = 5.0  # a viewer that has not taken what was sent within this time counts as gone
_AT_ONCE_BYTES = 1 << 20  # number of bytes read from the pipe at once
_HEADER_BYTES = 12  # length of the header of an .rrd file
_MESSAGE_HEADER = struct.Struct("<QQ")
"""Header of a message in an .rrd file: its kind, and the number of bytes that follow."""


def recording_stream(recording_id: str) -> rr.RecordingStream:
    """Opens a stream for logging a recording, and frees threads and memory of streams that have ended.

    In the fork of a process that has recorded rerun cannot do that: there they stay.
    """
    try:
        rr.init("wayproof", init_logging=False)
    except RuntimeError as error:
        if "fork" not in str(error).lower():
            raise
    rec = rr.RecordingStream("wayproof", recording_id=recording_id)
    rec.set_log_time_enabled(False)
    rec.set_log_tick_enabled(False)
    return rec


class RunningViewer:
    """A sink: a viewer, or a server of rerun, that takes a recording."""

    def __init__(self, rec: rr.RecordingStream, url: str, default_blueprint: Layout) -> None:
        self._rec, self._url = rec, url
        rec.connect_grpc(url, default_blueprint=default_blueprint)
        default_blueprint.close()

    def flush(self) -> None:
        """Makes the viewer take what was logged; an OSError says that it does not."""
        try:
            self._rec.flush(timeout_sec=VIEWER_TIMEOUT_S)
        except RuntimeError as error:
            raise OSError(f"the viewer at {self._url} has gone: {error}") from error

    def end(self) -> None:
        """Ends the recording."""
        self._rec.disconnect()


class RecordingFile:
    """A sink: the file of a recording. `end` must be called, also when the flight breaks off."""

    def __init__(self, rec: rr.RecordingStream, path: Path, default_blueprint: Layout) -> None:
        self._rec, self._path = rec, path
        self._file = fresh(path)
        self._out, into = os.pipe()
        self._fault: OSError | None = None
        self._mover = threading.Thread(target=self._pipe_to_file, name="recording", daemon=True)
        self._mover.start()
        try:
            rec.save(f"/dev/fd/{into}", default_blueprint=default_blueprint)
            default_blueprint.close()
        finally:
            os.close(into)  # rerun has opened the pipe for itself

    def flush(self) -> None:
        """Makes rerun write out what was logged; an OSError says that some of it could not be written."""
        self._rec.flush()
        self._raise_fault()

    def end(self) -> None:
        """Ends the recording; a second call does nothing. An OSError says that some of it could not be written."""
        if not self._file.closed:
            self._rec.disconnect()
            self._mover.join()
            self._file.close()
        self._raise_fault()

    def _pipe_to_file(self) -> None:
        waiting = bytearray()
        begin = _HEADER_BYTES
        while data := os.read(self._out, _AT_ONCE_BYTES):
            waiting += data
            # Whole messages only: a recording that ends in the middle of one cannot be read.
            end = end_of_whole(waiting, begin)
            self._write(waiting[:end])
            del waiting[:end]
            begin = max(begin - end, 0)
        self._write(waiting)
        os.close(self._out)

    def _write(self, data: bytearray) -> None:
        """Writes to the file; after a fault it drops data, since rerun must never wait."""
        while data and self._fault is None:
            try:
                data = data[self._file.write(data) :]
            except OSError as error:
                self._fault = error

    def _raise_fault(self) -> None:
        if self._fault is not None:
            raise OSError(self._fault.errno, self._fault.strerror, str(self._path))


def end_of_whole(data: bytearray, begin: int) -> int:
    """Returns the index at which the last whole message ends, the first beginning at `begin`; 0 where none is whole."""
    end = 0
    while begin + _MESSAGE_HEADER.size <= len(data):
        _, length = _MESSAGE_HEADER.unpack_from(data, begin)
        begin += _MESSAGE_HEADER.size + length
        if begin > len(data):
            break
        end = begin
    return end
