"""The time series of a recording: curves of the track, and the limits and wanted values beside them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import rerun as rr

from harness.flight.record import FloatArray, IntArray, Track
from harness.recording import blueprint as look
from harness.recording.layout import THIN_SERIES


def thin_curves(block: Track) -> dict[str, FloatArray]:
    """Returns the curves that a thin recording has, by entity below SERIES."""
    return {
        "cross_track/flown": block.cross_track_m,
        "clearance/flown": np.where(np.isfinite(block.clearance_m), block.clearance_m, np.nan),
        "bank/commanded": block.roll_command_deg,
        "bank/flown": block.roll_deg,
    }


def thin_rows(entity: str, curve: FloatArray, every: int) -> IntArray:
    """Returns the rows of a curve (n,) for a thin recording: every `every`-th, extremes between, and the last.

    Without the extreme ones a plot would show less than the figures say: a peak is shorter than the rows are apart.
    """
    size = np.nan_to_num(-curve if entity == "clearance/flown" else np.abs(curve), nan=-np.inf)
    groups = np.full((-(-len(size) // every), every), -np.inf)
    groups.flat[: len(size)] = size
    regular = np.arange(len(groups)) * every
    return np.unique(np.concatenate((regular, regular + groups.argmax(axis=1), [len(size) - 1])))


def curves(block: Track, altitude_m: FloatArray) -> dict[str, FloatArray]:
    """Returns the curves of a whole recording, by entity below SERIES."""
    return {
        **thin_curves(block),
        "bank/pitch": block.pitch_deg,
        "speed/ground": block.groundspeed_mps,
        "speed/flown": block.airspeed_mps,
        "altitude_error/flown": block.up_m - altitude_m,
        f"{look.THROTTLE}/flown": 100.0 * block.throttle,
    }


def send_curves(rec: rr.RecordingStream, values: Mapping[str, FloatArray], time_s: FloatArray) -> None:
    """Sends curves (n,) or sets of k curves (n, k) that have the same times, by entity below SERIES."""
    times = [look.time_column(time_s)]
    for entity, curve in values.items():
        rec.send_columns(f"{look.SERIES}/{entity}", times, rr.Scalars.columns(scalars=curve))


def send_levels(rec: rr.RecordingStream, scene: look.Scene, time_s: FloatArray) -> None:
    """Sends the wanted clearance and the limits of the bank, from the first of some times to the last."""
    limit_deg = math.degrees(scene.limits.bank_limit_rad)
    wanted = np.full(2, scene.limits.clearance_m)
    levels = {"clearance/wanted": wanted} if wanted.all() and "clearance" not in scene.empty_series else {}
    levels |= {"bank/limit": np.tile((-limit_deg, limit_deg), (2, 1))}
    send_curves(rec, levels, time_s[[0, -1]])


def log_series_styles(rec: rr.RecordingStream, scene: look.Scene, thin: bool) -> None:
    """Logs the styles of the time series that the recording has, since a layout is made by them."""
    empty = {*scene.empty_series, *(() if scene.believes else (look.BELIEVED_OFF,))}
    for entity, (name, colour, width) in look.SERIES_STYLE.items():
        plot = entity.partition("/")[0]
        too_much = thin and (plot not in THIN_SERIES or entity in look.WHOLE_ONLY)
        if not too_much and not empty & {plot, entity}:
            rec.log(f"{look.SERIES}/{entity}", look.series_lines(name, colour, width), static=True)
    searched = (look.SEARCH, "search"), (look.DELAYS, "plan delay")
    for entity, name in () if thin or not scene.searches else searched:
        points = rr.SeriesPoints(names=[name], colors=[look.CHOSEN], marker_sizes=[2.0])
        rec.log(f"{look.SERIES}/{entity}", points, static=True)
