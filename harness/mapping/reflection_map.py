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

from harness.mapping.edge_grid import EdgePoints
from harness.mapping.scan import RangeScan, all_round, clockwise_from
from planner.compiled import BOOL, FLOAT, FLOATS, compiled
from planner.interface import BoolArray, FloatArray, IntArray

LEAST_STOPPED_RAYS = 5.0  # a cell is an edge only if it stopped at least this many rays
SHORT_SHARE = 0.25
"""A ray that ended before a cell, within two standard deviations, counts as this share of a ray that ended in it."""
REFLECTED_SHARE = 0.25
"""A cell is an edge only if it stops at least this share of the rays, if the noise is at most the size of a cell."""
HAZARD_SHARE = 0.5
"""With noise above a cell's size the share is this times size over noise: the hazard half a sigma before a wall."""
KEEP_SHARE = 0.3  # a cell that is an edge remains one as long as it keeps this share of both bounds
HALVE_AT = 48.0  # counts of rays are halved when they reach this number, so that a wall that has gone fades
STOOD_S = 20.0
"""A cell that has been an edge for this time belongs to an obstacle that stands: a moving one has left it by then."""

SLOTS, FLAGS = "Array(int32, 1, 'C', readonly=True)", "Array(boolean, 1, 'C', readonly=True)"
COUNTED_OUT = "float32[:, ::1]"  # (cells, 3) counts of rays, changed


class ReflectionMap(EdgePoints):
    """Obstacles that stand still, from a sensor with noisy ranges; `noise_m` is their stated standard deviation."""

    def __init__(
        self,
        bounds_m: tuple[float, float, float, float],
        clearance_m: float,
        range_m: float,
        noise_m: float,
        revision: int = 0,
    ) -> None:
        super().__init__(bounds_m, clearance_m, range_m, revision)
        self._noise = noise_m
        self._least_share = min(REFLECTED_SHARE, HAZARD_SHARE * self._cell / noise_m)
        self._slot = np.full(self._nx * self._ny, -1, dtype=np.int32)  # by cell; points are middles of cells
        # For each slot: rays that it stopped, let through, that ended before it; whether it is an edge, since when.
        self._counts = np.zeros((1024, 3), dtype=np.float32)
        self._edge = np.zeros(1024, dtype=np.bool_)
        self._since_s = np.zeros(1024)
        self._time_s = 0.0

    def _are_edges(self, slots: IntArray) -> BoolArray:
        return self._edge[slots]

    def stands(self, points_m: FloatArray, since_s: float = STOOD_S) -> BoolArray:
        """(k,) which of (k, 2) places lie within the noise of a cell that has been an edge for `since_s`."""
        reach = math.ceil(self._noise / self._cell)
        around = np.arange(-reach, reach + 1)
        at = np.floor((points_m - (self._origin.real, self._origin.imag)) / self._cell).astype(np.int64)
        column, row = np.clip(at.T[:, :, None] + around, 0, [[[self._nx - 1]], [[self._ny - 1]]])
        long = self._edge[: self._count] & (self._since_s[: self._count] <= self._time_s - since_s)
        slots = self._slot[column[:, :, None] * self._ny + row[:, None, :]]
        return np.asarray(np.append(long, False)[slots].any(axis=(1, 2)))

    def update(self, scan: RangeScan, ignored: BoolArray | None = None) -> None:
        """Takes in one scan except the rays that are `ignored`, (n,)."""
        self._time_s = scan.time_s
        taken = scan.ranges_m < math.inf
        self._add_cells(scan, (taken if ignored is None else taken & ~ignored).nonzero()[0])
        if self._count:
            self._ask_cells(scan, ignored)

    def forget(self, points_m: FloatArray, within_m: float) -> None:
        """Drops every edge point within `within_m` of any of the (k, 2) points."""
        if len(slots := self._slots_within(points_m, within_m)):
            self._counts[slots] = 0.0
            self._edge[slots] = False
            self._note_removal()

    def _add_cells(self, scan: RangeScan, hits: IntArray) -> None:
        """Gives a slot to each cell that returned a ray for the first time."""
        places = scan.from_sensor_m(hits) + (complex(scan.east_m, scan.north_m) - self._origin)
        column, row, on_grid = self._column_and_row(places)
        keys = np.unique(column[on_grid] * self._ny + row[on_grid])
        fresh = keys[self._slot.take(keys) < 0]
        end = self._count + len(fresh)
        self._make_room(end, "_points", "_since", "_counts", "_edge", "_since_s")
        new = np.arange(self._count, end, dtype=np.int32)
        self._slot[fresh] = new
        column, row = np.divmod(fresh, self._ny)
        self._points[new] = self._origin + self._cell * (column + 0.5 + 1j * (row + 0.5))
        self._count = end

    def _ask_cells(self, scan: RangeScan, ignored: BoolArray | None) -> None:
        """Counts what the rays towards known cells did, and decides anew which cells are edges."""
        slots = self._in_reach(complex(scan.east_m, scan.north_m), self._range / 16.0)
        offsets = self._points.take(slots) - complex(scan.east_m, scan.north_m)
        self._decide(
            _count_rays(
                slots,
                np.abs(offsets),
                clockwise_from(scan.start_rad, offsets.real.copy(), offsets.imag.copy()) / scan.spacing_rad,
                scan.ranges_m,
                np.zeros(len(scan.ranges_m), np.bool_) if ignored is None else ignored,
                self._counts,
                0.5 * self._cell,
                scan.spacing_rad,
                # Beyond, a return is lost where noise takes it out of range.
                scan.max_range_m - 2.0 * self._noise,
                self._noise,
                HALVE_AT,
                all_round(scan),
            )
        )

    def _decide(self, slots: NDArray[np.int32]) -> None:
        """Decides which cells of the slots are edges now."""
        counts, was = self._counts[slots], self._edge[slots]
        stopped = counts[:, 0] + np.float32(SHORT_SHARE) * counts[:, 2]
        reached, share = stopped + counts[:, 1], np.where(was, KEEP_SHARE, 1.0)
        now = (stopped >= share * LEAST_STOPPED_RAYS) & (stopped >= share * self._least_share * reached)
        if len(changed := (now != was).nonzero()[0]):
            self.revision += 1
            self._edge[slots[changed]] = now[changed]
            self._since[slots[changed]], self._since_s[slots[changed]] = self.revision, self._time_s
            if was[changed].any():
                self.last_removal_revision = self.revision


@compiled(COUNTED_OUT, "int32", FLOAT, FLOAT, FLOAT, rare=True, inner=True)
def _count(counts: NDArray[np.float32], slot: int, beyond: float, half: float, noise: float) -> None:
    """Counts a ray that went `beyond` (m) a cell's middle: the cell stopped it, let it pass, or it ended before."""
    if abs(beyond) <= half:
        counts[slot, 0] += np.float32(1.0)
    elif beyond > half:
        counts[slot, 1] += np.float32(1.0)
    elif beyond > -half - 2.0 * noise:
        counts[slot, 2] += np.float32(1.0)


@compiled(SLOTS, FLOATS, FLOATS, FLOATS, FLAGS, COUNTED_OUT, *[FLOAT] * 5, BOOL, rare=True)
def _count_rays(
    slots: NDArray[np.int32],
    distances: FloatArray,
    positions: FloatArray,
    ranges: FloatArray,
    ignored: BoolArray,
    counts: NDArray[np.float32],
    half: float,
    spacing_rad: float,
    within: float,
    noise: float,
    forget_at: float,
    closed: bool,
) -> NDArray[np.int32]:
    """Counts what the rays towards cells did; near by, where several meet a cell, two more of them.

    `slots` are the cells that are tested; by cell are `distances` (m) and `positions`, bearings in rays from the
    first on, and by slot `counts` (n, 3), which are written: rays that the cell stopped, that it let through, that
    ended before it. A cell whose own ray is `ignored` is not tested, nor one beyond `within`. `half` is half the
    width of a cell; counts are halved from `forget_at` on.

    Returns:
        (k,) the slots that a ray was aimed at.
    """
    counted, rays, many = np.empty(len(slots), dtype=np.int32), len(ranges), 0
    for i in range(len(slots)):
        distance, ray = distances[i], int(np.rint(positions[i]))
        if not (abs(positions[i] - ray) * spacing_rad * distance < half and distance < within):
            continue
        if not closed and ray >= rays:
            continue
        ray %= rays
        if ignored[ray]:
            continue
        slot = slots[i]
        counted[many] = slot
        many += 1
        aside = int(0.7 * half / spacing_rad / max(distance, half))
        _count(counts, slot, ranges[ray] - distance, half, noise)
        if aside >= 1:
            for beside in (ray - aside, ray + aside):
                other = beside % rays if closed else min(max(beside, 0), rays - 1)
                _count(counts, slot, ranges[other] - distance, half, noise)
        if counts[slot, 0] + counts[slot, 1] + counts[slot, 2] > forget_at:
            counts[slot, 0] *= np.float32(0.5)
            counts[slot, 1] *= np.float32(0.5)
            counts[slot, 2] *= np.float32(0.5)
    return counted[:many]
