"""Tables: the path of a run as CSV, for spreadsheets, MATLAB and `wayproof check`."""

from __future__ import annotations

import csv
import io

import numpy as np

from harness.run_files.exports.exported_path import ExportedPath


def csv_text(path: ExportedPath) -> str:
    """A row a point: place in the plane and on the ellipsoid, simulated time, and what the track has beside them.

    The first three columns are those of a path that `wayproof check` reads. What there is no figure for is empty.
    """
    columns = {
        "x_m": path.points_m[:, 0],
        "y_m": path.points_m[:, 1],
        "altitude_m": path.altitude_m,
        "latitude_deg": path.latitude_deg,
        "longitude_deg": path.longitude_deg,
        "time_s": path.time_s,
        **path.attributes,
    }
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(columns)
    whole = {"plan_index"}
    for row in zip(*(column.tolist() for column in columns.values()), strict=True):
        rows.writerow(
            "" if not np.isfinite(value) else int(value) if name in whole else repr(value)
            for name, value in zip(columns, row, strict=True)
        )
    return text.getvalue()
