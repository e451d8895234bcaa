"""The band in which days fly a path: at each place along it, how far to its sides 95 % of them are."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from harness.files.input_file import read_index
from harness.files.whole_file import replace_text
from harness.flight.record import FloatArray

BAND_FILE: Final = "band.json"  # file in a folder of days
SCHEMA: Final = "wayproof/band/1"
BAND_SHARE: Final = 0.95  # share of the days' tracks that lies inside the band
STATIONS, STEP_M = 400, 5.0  # the band has at most this many places along the path, at least this far apart


def band_of(tracks: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Left and right edge of the band, (n, 2) each, east and north in metres.

    `tracks` are (k, 3) of each day: distance along the path (NaN before the first plan), east and north. At each place
    the offsets are those from the median position, across its direction; the edges are their percentiles 2.5 and 97.5.
    Days that ended before a place do not count there.
    """
    known = [track[np.isfinite(track[:, 0])] for track in tracks]
    length_m = float(np.median([track[:, 0].max() for track in known]))
    stations_m = np.linspace(0.0, length_m, max(3, min(STATIONS, int(length_m / STEP_M))))
    places = np.stack([_positions_at(track, stations_m) for track in known])
    middle = np.nanmedian(places, axis=0)
    ahead = np.gradient(middle, axis=0)
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    left = np.column_stack((-ahead[:, 1], ahead[:, 0]))
    off_m = ((places - middle) * left).sum(axis=2)
    low_m, high_m = np.nanpercentile(off_m, (50 * (1 - BAND_SHARE), 50 * (1 + BAND_SHARE)), axis=0)
    return middle + high_m[:, None] * left, middle + low_m[:, None] * left


def _positions_at(track: FloatArray, stations_m: FloatArray) -> FloatArray:
    """Returns the (n, 2) positions of a day at distances along the path; NaN beyond where it ended."""
    along_m = np.maximum.accumulate(track[:, 0])
    return np.column_stack([np.interp(stations_m, along_m, track[:, k], right=np.nan) for k in (1, 2)])


def write_band(folder: Path, runs: Sequence[Path]) -> None:
    """Writes `band.json` into a folder of days, from the tracks in their run folders; none if none has a plan."""
    import pyarrow.parquet as pq

    columns = ["arc_length_m", "east_m", "north_m"]
    tables = [pq.read_table(run / "track.parquet", columns=columns) for run in runs]
    tracks = [np.column_stack([table[name].to_numpy() for name in columns]) for table in tables]
    if flown := [track for track in tracks if np.isfinite(track[:, 0]).any()]:
        left, right = band_of(flown)
        edges = {"left_m": left.tolist(), "right_m": right.tolist()}
        index = {"schema": SCHEMA, "share": BAND_SHARE, "days": len(runs), **edges}
        replace_text(folder / BAND_FILE, json.dumps(index, allow_nan=False) + "\n")


def read_band(folder: Path) -> tuple[int, FloatArray, FloatArray] | None:
    """Number of days, left and right edge, from the folder of some days; None where there is no band."""
    if (index := read_index(folder / BAND_FILE, SCHEMA)) is None:
        return None
    return int(index["days"]), np.array(index["left_m"]), np.array(index["right_m"])
