"""Edge points on a square grid of cells, which both maps of what stands still keep."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from harness.mapping.scan import RangeScan
from harness.mapping.scan_comparison import near_any
from planner.interface import BoolArray, ComplexArray, FloatArray, IntArray

MOST_CELLS = 16_000_000
"""A grid of edges or of free space has at most this many cells; in a larger area its cells are wider."""


class EdgePoints(ABC):
    """Points by slot, in the order in which they came, and the revision of the set of those that are edges.

    Their grid covers the area of operations (xmin, ymin, xmax, ymax) and a border; revisions count from one on.
    """

    def __init__(
        self, bounds_m: tuple[float, float, float, float], clearance_m: float, range_m: float, revision: int
    ) -> None:
        xmin, ymin, xmax, ymax = bounds_m
        span = max(xmax - xmin, ymax - ymin) + 4.0 * clearance_m
        self._cell = cell = max(clearance_m / 4.0, span / math.sqrt(MOST_CELLS))
        border = 2.0 * clearance_m + cell
        self._origin = complex(xmin - border, ymin - border)  # the lower left corner
        self._nx, self._ny = (math.ceil((far + 2.0 * border) / cell) for far in (xmax - xmin, ymax - ymin))
        self._range = range_m
        self._count = 0
        self._points = np.zeros(1024, dtype=np.complex128)
        self._since = np.zeros(1024, dtype=np.int64)  # revision at which each last became an edge
        self.revision = revision  # grows with every change of the set of edge points
        self.last_removal_revision = revision  # the last revision at which edge points were taken away again
        self._near = np.zeros(0, dtype=np.int32)
        self._near_at, self._near_count = complex(math.inf, math.inf), 0

    @property
    def spacing_m(self) -> float:
        """Edge points of one wall are about this far apart."""
        return self._cell

    @abstractmethod
    def update(self, scan: RangeScan, ignored: BoolArray | None = None) -> None:
        """Takes in one scan except the rays that are `ignored`, (n,)."""

    @abstractmethod
    def forget(self, points_m: FloatArray, within_m: float) -> None:
        """Drops every edge point within `within_m` of any of the (k, 2) points."""

    @abstractmethod
    def _are_edges(self, slots: IntArray) -> BoolArray:
        """(k,) which slots hold an edge."""

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) edge points that came in after `revision`, in the order in which they did."""
        if revision >= self.revision:
            return np.zeros((0, 2))
        slots = (self._since[: self._count] > revision).nonzero()[0]
        slots = slots[self._are_edges(slots)]
        if revision < self.revision - 1:  # else all came in at once
            slots = slots[np.argsort(self._since[slots], kind="stable")]
        return self._points[slots].view(np.float64).reshape(-1, 2)

    def _slots_within(self, points_m: FloatArray, within_m: float) -> IntArray:
        """Returns the slots of points within `within_m` of any of the (k, 2) points."""
        places = points_m[:, 0] + 1j * points_m[:, 1]
        return near_any(self._points[: self._count], places, within_m).nonzero()[0]

    def _make_room(self, slots: int, *names: str) -> None:
        """Lengthens the named arrays by slot, at least to twice their length where they are too short, with zeros."""
        for name in names:
            array = getattr(self, name)
            if slots > len(array):
                size = max(2 * len(array), slots) - len(array)
                setattr(self, name, np.concatenate((array, np.zeros((size, *array.shape[1:]), array.dtype))))

    def _note_removal(self) -> None:
        self.revision += 1
        self.last_removal_revision = self.revision

    def _column_and_row(self, places: ComplexArray) -> tuple[IntArray, IntArray, BoolArray]:
        """Returns the cells of places, seen from the corner of the grid, and which of them lie on the grid."""
        cells = (places.view(np.float64) * (1.0 / self._cell)).astype(np.int64)
        column, row = cells[::2], cells[1::2]
        return column, row, (column >= 0) & (column < self._nx) & (row >= 0) & (row < self._ny)

    def _in_reach(self, sensor: complex, renewed_m: float) -> NDArray[np.int32]:
        """Returns the slots of points within range, looked up anew once the sensor has moved by `renewed_m`."""
        if not abs(sensor - self._near_at) < renewed_m:
            near = np.abs(self._points[: self._count] - sensor) < self._range + renewed_m
            self._near = near.nonzero()[0].astype(np.int32)
            self._near_at, self._near_count = sensor, self._count
        if self._near_count < self._count:
            more = np.arange(self._near_count, self._count, dtype=np.int32)
            self._near, self._near_count = np.concatenate((self._near, more)), self._count
        return self._near
