"""Drawings that grow with the flight, in the plan view and in the 3-D view: trails, and all that was sensed."""

from __future__ import annotations

import numpy as np
import rerun as rr

from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.recording.solids import strips_2d, strips_3d


class Trail:
    """A line below PLAN and WORLD, in pieces of `piece_rows` rows; each is joined to the one before."""

    def __init__(self, entity: str, piece_rows: int) -> None:
        self._entity, self._rows = entity, piece_rows
        self._last_m: FloatArray = np.zeros((0, 3))

    def send(
        self, rec: rr.RecordingStream, time_s: FloatArray, points_m: FloatArray, off: FloatArray | None = None
    ) -> FloatArray:
        """Sends further points (n, 3), coloured by their errors (n,) over the limit, if given, the largest of a piece.

        Returns the points drawn, (m, 3).
        """
        last_row, step = len(points_m) - 1, max(self._rows // 4, 1)
        ends = np.append(np.arange(self._rows - 1, last_row, self._rows), last_row)
        starts = np.append(0, ends[:-1] + 1)
        pieces = []
        for first, last in zip(starts.tolist(), ends.tolist(), strict=True):
            rows = np.append(np.arange(first, last, step), last)
            pieces.append(np.concatenate((self._last_m, points_m[rows])))
            self._last_m = points_m[last : last + 1]
        times = [look.time_column(time_s[ends])]
        shades = None if off is None else look.error_colours(np.maximum.reduceat(off, starts))
        flat = rr.LineStrips2D.columns(strips=strips_2d([piece[:, :2] for piece in pieces]), colors=shades)
        steep = rr.LineStrips3D.columns(strips=strips_3d(pieces), colors=shades)
        rec.send_columns(f"{look.PLAN}/{self._entity}", times, flat)
        rec.send_columns(f"{look.WORLD}/{self._entity}", times, steep)
        return np.concatenate(pieces)


class Sensed:
    """Gathers places that two scans have shown, one a cell of a square grid, as a false return is seen once."""

    def __init__(self, cell_m: float) -> None:
        self._cell_m = cell_m
        self._once: set[int] = set()
        self._known: set[int] = set()

    def new(self, points_m: FloatArray) -> FloatArray:
        """(k, 2) those of a scan's returns (n, 2) that lie in a cell for the second time."""
        cells = (np.round(points_m / self._cell_m).astype(np.int64) @ (1 << 32, 1)).tolist()
        rows = dict(zip(cells[::-1], range(len(cells))[::-1], strict=True))  # the first of each cell
        fresh = (rows.keys() & self._once) - self._known
        self._once |= rows.keys()
        self._known |= fresh
        return points_m[sorted(rows[cell] for cell in fresh)]
