"""The band in which days fly a path, in the recording of a flight over it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.recording.file import RecordingFile, recording_stream
from harness.recording.layout import layout_of
from harness.recording.overlay import chunks_of, frame_of, runs_in

COLOUR = (120, 120, 120)


def add_band(recording: Path, left_m: FloatArray, right_m: FloatArray) -> None:
    """Replaces a recording by one that also shows the edges of the band, in the plan view and in the 3-D view.

    Args:
        recording: the file.
        left_m: (n, 2) east and north.
        right_m: likewise.

    Raises:
        RunFolderError: the recording cannot be read.
        OSError: it cannot be written.
    """
    chunks = chunks_of(recording)
    frame = frame_of(chunks, recording)
    entities = {chunk.entity_path for chunk in chunks}
    (identity,) = {entry.recording_id for entry in rr.chunk.RrdReader(str(recording)).recordings()}
    up_m = frame.altitude_m
    partial = recording.with_name(f"{recording.stem}.band{recording.suffix}")
    with recording_stream(identity) as rec:
        file = RecordingFile(rec, partial, layout_of(frame, entities, runs_in(entities)))
        rec.send_chunks(chunks)
        flat = [left_m, right_m]
        rec.log(f"{look.PLAN}/band", rr.LineStrips2D(flat, colors=COLOUR), static=True)
        steep = [np.column_stack((edge, np.full(len(edge), up_m))) for edge in flat]
        rec.log(f"{look.WORLD}/band", rr.LineStrips3D(steep, colors=COLOUR), static=True)
        file.end()
    partial.replace(recording)
