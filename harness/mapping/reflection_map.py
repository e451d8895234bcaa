"""The obstacle map of a noisy sensor: cells of the plane by how often they reflect.

Where ranges err by more than the cells of a grid, single returns say little about where an edge is. Each cell
that ever returned a ray is therefore asked in every scan what the ray towards it did: end in the cell, pass
through, or end just before it. A cell is an edge where enough of the rays that reached it were reflected, and
where most of those aimed at it reached it. (The counting model of D. Haehnel, "Mapping with mobile robots",
2004; Thrun, Burgard and Fox, "Probabilistic Robotics", 2005, section 9.) So neither a stray return nor a lost one
changes the map, and an edge lies about half a standard deviation before the wall, on the safe side.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from harness.mapping.edge_grid import EdgeGrid
from harness.mapping.reflection_counting import count_rays, find_long
from harness.mapping.scan import RangeScan, all_round, clockwise_from
from harness.mapping.scan_comparison import near_any
from planner.interface import BoolArray, FloatArray

LEAST_STOPPED = 5.0
"""An edge stopped so many rays at least."""
STOPPED_SHORT = 0.25
"""A ray that ended before a cell, within two standard deviations, counts for so much of one that ended in it."""
REFLECTIVITY = 0.25
"""Least share of the rays that a cell stops, where the noise is no more than its size."""
HAZARD = 0.5
"""The same for more noise, times cell over noise: the hazard half a standard deviation before a wall."""
DOUBT = 0.3
"""What is an edge remains one down to this part of both."""
FORGET_AT = 48.0
"""Counts are halved from so many on: what has gone fades, what is new counts."""
STOOD_S = 20.0
"""What has been an edge for so long stands: what moves is elsewhere by then."""
NO_RAYS = np.zeros(0, dtype=np.bool_)


class ReflectionMap:
    """What stands still, as a sensor with noisy ranges shows it (`harness.mapping.sensed_map.Edges`).

    Args:
        bounds_m: xmin, ymin, xmax, ymax of the area.
        clearance_m: wanted distance from obstacles; cells are a quarter of it wide.
        range_m: sensing range.
        noise_m: standard deviation of ranges, as the sensor's maker states it; positive.
        revision: to count from, where it follows another map.
    """

    def __init__(
        self,
        bounds_m: tuple[float, float, float, float],
        clearance_m: float,
        range_m: float,
        noise_m: float,
        revision: int = 0,
    ) -> None:
        grid = EdgeGrid.over(bounds_m, clearance_m)
        self._cell, self._origin, self._nx, self._ny = grid.cell_m, grid.corner, grid.columns, grid.rows
        self._noise, self._range = noise_m, range_m
        self._least_share = min(REFLECTIVITY, HAZARD * self._cell / noise_m)
        self._slot = np.full(self._nx * self._ny, -1, dtype=np.int32)  # by cell
        self._count = 0
        self._points = np.zeros(1024, dtype=np.complex128)  # by slot, as all that follows: middle of the cell
        self._counts = np.zeros(
            (1024, 3), dtype=np.float32
        )  # rays it stopped, let through, that ended before
        self._edge = np.zeros(1024, dtype=np.bool_)
        self._since = np.zeros(1024, dtype=np.int64)  # revision at which it last became an edge
        self._since_s = np.zeros(1024)  # and when
        self._time_s = 0.0
        self.revision = self.last_removal_revision = (
            revision  # as `harness.mapping.sensed_map.Edges` has them
        )
        self._near = np.zeros(0, dtype=np.int32)
        self._near_at = complex(math.inf, math.inf)
        self._near_count = 0

    @property
    def spacing_m(self) -> float:
        """Edge points of one wall are about this far apart."""
        return self._cell

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) edge points that came in after `revision`, in the order in which they did."""
        since = self._since[: self._count]
        slots = ((since > revision) & self._edge[: self._count]).nonzero()[0]
        points = self._points[slots[np.argsort(since[slots], kind="stable")]]
        return points.view(np.float64).reshape(-1, 2)

    def stands(self, points_m: FloatArray, since_s: float = STOOD_S) -> BoolArray:
        """(k,) which of (k, 2) places lie no further than ranges err from a cell that has been an edge so long."""
        reach = math.ceil(self._noise / self._cell)
        at = np.floor((points_m - (self._origin.real, self._origin.imag)) / self._cell).astype(np.int64)
        found = np.zeros(len(points_m), dtype=np.bool_)
        find_long(found, at, self._slot, self._edge, self._since_s, self._nx, reach, self._time_s - since_s)
        return found

    def update(self, scan: RangeScan, ignored: BoolArray | None = None) -> None:
        """Takes in one scan, but for some of its rays."""
        self._time_s = scan.time_s
        taken = scan.ranges_m < math.inf
        self._add_cells(scan, (taken if ignored is None else taken & ~ignored).nonzero()[0])
        if self._count:
            self._ask_cells(scan, ignored)

    def forget(self, points_m: FloatArray, within_m: float) -> None:
        """Forgets all that is no further from some points, (k, 2)."""
        slots = near_any(
            self._points[: self._count], points_m[:, 0] + 1j * points_m[:, 1], within_m
        ).nonzero()[0]
        if len(slots):
            self._counts[slots] = 0.0
            self._edge[slots] = False
            self.revision += 1
            self.last_removal_revision = self.revision

    def _add_cells(self, scan: RangeScan, hits: NDArray[np.intp]) -> None:
        """Cells that returned a ray for the first time get a slot."""
        places = scan.from_sensor_m(hits) + (complex(scan.east_m, scan.north_m) - self._origin)
        column, row = (places.view(np.float64).reshape(-1, 2).T / self._cell).astype(np.int64)
        on_grid = (column >= 0) & (column < self._nx) & (row >= 0) & (row < self._ny)
        keys = np.unique(column[on_grid] * self._ny + row[on_grid])
        fresh = keys[self._slot.take(keys) < 0]
        end = self._count + len(fresh)
        if end > len(self._points):
            size = max(2 * len(self._points), end)
            more = size - len(self._points)
            self._points = np.concatenate((self._points, np.zeros(more, dtype=np.complex128)))
            self._counts = np.concatenate((self._counts, np.zeros((more, 3), dtype=np.float32)))
            self._edge = np.concatenate((self._edge, np.zeros(more, dtype=np.bool_)))
            self._since = np.concatenate((self._since, np.zeros(more, dtype=np.int64)))
            self._since_s = np.concatenate((self._since_s, np.zeros(more)))
        new = np.arange(self._count, end, dtype=np.int32)
        self._slot[fresh] = new
        column, row = np.divmod(fresh, self._ny)
        self._points[new] = self._origin + self._cell * (column + 0.5 + 1j * (row + 0.5))
        self._count = end

    def _ask_cells(self, scan: RangeScan, ignored: BoolArray | None) -> None:
        """Counts what the rays towards known cells did, and decides anew which cells are edges."""
        slots = self._in_range(complex(scan.east_m, scan.north_m))
        offsets = self._points.take(slots) - complex(scan.east_m, scan.north_m)
        distance = np.abs(offsets)
        position = clockwise_from(scan.start_rad, offsets.real.copy(), offsets.imag.copy()) / scan.spacing_rad
        slots = self._counted(scan, ignored, slots, distance, position)
        self._decide(slots)

    def _counted(
        self,
        scan: RangeScan,
        ignored: BoolArray | None,
        slots: NDArray[np.int32],
        distances: FloatArray,
        positions: FloatArray,
    ) -> NDArray[np.int32]:
        """Slots of the cells that a ray was aimed at, which are counted."""
        counted = np.empty(len(slots), dtype=np.int32)
        many = count_rays(
            counted,
            slots,
            distances,
            positions,
            scan.ranges_m,
            NO_RAYS if ignored is None else ignored,
            self._counts,
            0.5 * self._cell,
            scan.spacing_rad,
            # Beyond, a return is lost where noise takes it out of range.
            scan.max_range_m - 2.0 * self._noise,
            self._noise,
            FORGET_AT,
            all_round(scan),
        )
        return counted[:many]

    def _in_range(self, sensor: complex) -> NDArray[np.int32]:
        """Slots of cells that a scan from here may tell something of."""
        if not abs(sensor - self._near_at) < self._range / 16.0:
            near = np.abs(self._points[: self._count] - sensor) < 1.07 * self._range
            self._near = near.nonzero()[0].astype(np.int32)
            self._near_at, self._near_count = sensor, self._count
        slots = np.concatenate((self._near, np.arange(self._near_count, self._count, dtype=np.int32)))
        return slots

    def _decide(self, slots: NDArray[np.int32]) -> None:
        """Tells which cells are edges now."""
        counts, was = self._counts[slots], self._edge[slots]
        stopped = counts[:, 0] + np.float32(STOPPED_SHORT) * counts[:, 2]
        reached, share = stopped + counts[:, 1], np.where(was, DOUBT, 1.0)
        now = (stopped >= share * LEAST_STOPPED) & (stopped >= share * self._least_share * reached)
        changed = (now != was).nonzero()[0]
        if len(changed):
            self.revision += 1
            self._edge[slots[changed]] = now[changed]
            self._since[slots[changed]], self._since_s[slots[changed]] = self.revision, self._time_s
            if was[changed].any():
                self.last_removal_revision = self.revision
