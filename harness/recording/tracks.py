"""A recording of several tracks on one time line: seen from above and in space, with time series of each."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.recording.file import RecordingFile, recording_stream
from harness.recording.layout import Layout, whole_flight

MISSION: Final = f"{look.WORLD}/mission"  # outline of the mission's corners, in no recording of one flight
SERIES: Final = {
    "outside_m": "outside the corners, m",
    "roll_deg": "bank, deg",
    "airspeed_mps": "airspeed, m/s",
    "height_m": "height over that commanded, m",
}
"""Columns that are drawn over time, with the titles of their views."""


def write_tracks(name: str, corners_m: FloatArray, tracks: Mapping[str, Mapping[str, FloatArray]], path: Path) -> None:
    """Writes the recording of tracks, by label, and the mission's corners (k, 2); an OSError: it cannot be written."""
    layout = tracks_layout([f"/{look.SERIES}/{each}/{label}" for label in tracks for each in tracks[label]])
    with recording_stream(name) as rec:
        file = RecordingFile(rec, path, layout)
        try:
            rec.send_recording_name(name)
            rec.log(look.WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
            outline = np.column_stack((np.vstack((corners_m, corners_m[:1])), np.zeros(len(corners_m) + 1)))
            rec.log(MISSION, rr.LineStrips3D([outline], colors=[(160, 160, 160)]), static=True)
            for place, (label, track) in enumerate(tracks.items()):
                _send_track(rec, label, track, look.OVERLAY[place % len(look.OVERLAY)])
        finally:
            file.end()


def tracks_layout(entities: Collection[str]) -> Layout:
    """Returns the layout of a recording of tracks, by the entities in it."""
    views = [
        rrb.TimeSeriesView(origin=f"{look.SERIES}/{column}", name=label, axis_x=whole_flight())
        for column, label in SERIES.items()
        if any(each.startswith(f"/{look.SERIES}/{column}/") for each in entities)
    ]
    return Layout(
        rrb.Horizontal(rrb.Spatial3DView(origin=look.WORLD, name="tracks"), rrb.Vertical(*views)),
        rrb.TimePanel(timeline=look.TIMELINE, state="collapsed"),
        collapse_panels=True,
    )


def _send_track(rec: rr.RecordingStream, label: str, track: Mapping[str, FloatArray], colour: look.Colour) -> None:
    position = np.column_stack((track["east_m"], track["north_m"], track["height_m"]))
    times = [look.time_column(track["time_s"])]
    rec.log(f"{look.WORLD}/{label}/track", rr.LineStrips3D([position], colors=[colour]), static=True)
    entity = f"{look.WORLD}/{label}/aircraft"
    rec.log(entity, rr.Points3D.from_fields(colors=[colour], radii=[3.0], labels=[label]), static=True)
    rec.send_columns(entity, times, rr.Points3D.columns(positions=position))
    for column in SERIES:
        if column in track:
            series = f"{look.SERIES}/{column}/{label}"
            rec.log(series, look.series_lines(label, colour, 1.5), static=True)
            rec.send_columns(series, times, rr.Scalars.columns(scalars=track[column]))
