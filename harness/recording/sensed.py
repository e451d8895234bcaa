"""What the sensor has shown so far, for the recording. Frame: local ENU plane, metres."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from harness.flight.record import FloatArray
    from harness.mapping.scan import RangeScan


class Sensed:
    """Gathers places that two scans have shown, one a cell of a square grid: a false return is seen once."""

    def __init__(self, cell_m: float) -> None:
        self._cell_m = cell_m
        self._once: set[int] = set()
        self._known: set[int] = set()

    def new(self, points_m: FloatArray) -> FloatArray:
        """(k, 2) those places of the next scan, of what it returned (n, 2), that are shown for the second time."""
        cells = (np.round(points_m / self._cell_m).astype(np.int64) @ (1 << 32, 1)).tolist()
        rows = dict(
            zip(reversed(cells), range(len(cells) - 1, -1, -1), strict=True)
        )  # the first of each cell
        fresh = (rows.keys() & self._once) - self._known
        self._once |= rows.keys()
        self._known |= fresh
        shown: FloatArray = points_m[sorted(rows[cell] for cell in fresh)]
        return shown


def returns_m(scan: RangeScan) -> FloatArray:
    """(k, 2) places from which something came back."""
    if scan.nearest_m == math.inf:
        return np.zeros((0, 2))
    return scan.returned()[1].view(np.float64).reshape(-1, 2)
