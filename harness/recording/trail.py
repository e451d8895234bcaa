"""A line that grows with the flight, in the plan view and in the 3-D view: the flown track, and the believed one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import rerun as rr

from harness.flight.record import FloatArray, IntArray
from harness.recording import blueprint as look
from harness.recording.solids import strips_2d, strips_3d

Colours = np.ndarray[Any, np.dtype[np.uint8]]


class Trail:
    """Pieces, each at the time of its last point and joined to the one before.

    Args:
        entity: below PLAN and WORLD.
        piece_rows: rows of the track in a piece.
    """

    def __init__(self, entity: str, piece_rows: int) -> None:
        self._entity, self._rows = entity, piece_rows
        self._last_m: FloatArray = np.zeros((0, 3))

    def send(
        self,
        rec: rr.RecordingStream,
        time_s: FloatArray,
        points_m: FloatArray,
        colours: Callable[[IntArray], Colours],
    ) -> FloatArray:
        """Sends consecutive points (n, 3); `colours` tells (k, 3) of pieces by their first rows.

        Returns:
            What was drawn, (m, 3).
        """
        last_row, step = len(points_m) - 1, max(self._rows // 4, 1)
        ends = np.append(np.arange(self._rows - 1, last_row, self._rows), last_row)
        starts = np.append(0, ends[:-1] + 1)
        pieces = []
        for first, last in zip(starts.tolist(), ends.tolist(), strict=True):
            rows = np.append(np.arange(first, last, step), last)
            pieces.append(np.concatenate((self._last_m, points_m[rows])))
            self._last_m = points_m[last : last + 1]
        times, shades = [look.time_column(time_s[ends])], colours(starts)
        flat = rr.LineStrips2D.columns(strips=strips_2d([piece[:, :2] for piece in pieces]), colors=shades)
        steep = rr.LineStrips3D.columns(strips=strips_3d(pieces), colors=shades)
        rec.send_columns(f"{look.PLAN}/{self._entity}", times, flat)
        rec.send_columns(f"{look.WORLD}/{self._entity}", times, steep)
        return np.concatenate(pieces)
