"""Space that scans have looked through, on a grid.

A beam from which nothing came back says that all of it is free, to the range of the sensor, and one that returned
something that all of it is free up to there. So a cell is free where every beam that meets it went beyond it. Beams
that touch leave nothing out. Where they do not, what is between two of them is not seen: there cells are free only as
far as the narrowest obstacle that there is cannot hide between two.
"""

from __future__ import annotations

import math

import numpy as np

from harness.mapping.cleared_space import through_cells
from harness.mapping.edge_grid import MOST_CELLS
from harness.mapping.scan import RangeScan, turned
from planner.compiled import FLOAT, GRID, ROWS, compiled
from planner.interface import BoolArray, FloatArray

NARROWEST_RAD = 1e-3  # the space that an obstacle hides is known in steps of bearing no finer than this
MISSED_CHANCE = 1e-2
"""If returns get lost, a cell is free once the scans through it all miss an obstacle with at most this probability."""
MOST_LOOKS = 255  # if a cell would need more scans than this, no space is ever seen to be free
MORE_BEAMS = 3
"""If returns get lost or err, this many more beams on each side of a cell must go beyond it to make it free."""
_NOWHERE = (math.inf, math.inf, 0.0)
TOUCHING_SHARE = 1e-6  # beams touch if at most this share of their spacing lies between two of them


class FreeSpace:
    """Cells of space that a scan has looked through: half a clearance wide, or wider where they would be too many.

    Args:
        noise_m: standard deviation of ranges, as the sensor's maker states it.
        lost: share of the returns that get lost or are false, likewise.
        least_width_m: the narrowest obstacle that there is; it counts where beams do not touch. Default: the clearance.
    """

    def __init__(
        self,
        bounds_m: tuple[float, float, float, float],
        clearance_m: float,
        range_m: float,
        noise_m: float = 0.0,
        lost: float = 0.0,
        least_width_m: float | None = None,
    ) -> None:
        xmin, ymin, xmax, ymax = bounds_m
        self._cell = max(clearance_m / 2.0, max(xmax - xmin, ymax - ymin) / math.sqrt(MOST_CELLS))
        self._x0, self._y0 = xmin, ymin
        self._nx, self._ny = math.ceil((xmax - xmin) / self._cell), math.ceil((ymax - ymin) / self._cell)
        self._free = np.zeros((self._nx, self._ny), dtype=np.bool_)
        self._every, self._noise = range_m / 32.0, noise_m
        self._least_width = clearance_m if least_width_m is None else least_width_m
        self._needed = looks_needed(lost)
        self._looks = np.zeros(self._free.shape, dtype=np.uint8)
        self._aside = MORE_BEAMS if lost > 0.0 or noise_m > 0.0 else 0
        self._last = _NOWHERE  # where the last scan was taken, and its heading (rad)
        self._reach = 0.0
        self._disc = _disc(0)  # cells in reach, about the one that the sensor is in

    def update(self, scan: RangeScan) -> None:
        """Marks what a scan looked through, if the sensor has moved on far enough since the last time, or turned."""
        moved = math.hypot(scan.east_m - self._last[0], scan.north_m - self._last[1])
        # Where looks are counted, each counts.
        same = moved < (1.0 if scan.followed else 1.5) * self._every and not turned(scan, self._last[2])
        if self._needed > MOST_LOOKS or (same and self._needed == 1):
            return
        self._last = (scan.east_m, scan.north_m, scan.heading_rad)
        # No cell lies further off than the area is wide.
        reach = min(self._reach_m(scan), self._cell * math.hypot(self._nx, self._ny))
        if self._reach != reach:
            self._reach, self._disc = reach, _disc(math.ceil(reach / self._cell) + 1)
        # The disc's corner lies at this cell; some of it may lie outside the area.
        x_first, y_first, x_low, x_high, y_low, y_high = self._window(scan, len(self._disc) // 2)
        if x_low >= x_high or y_low >= y_high:
            return
        cells = slice(x_low, x_high), slice(y_low, y_high)
        through_cells(
            self._free[cells],
            self._looks[cells],
            self._disc[x_low - x_first : x_high - x_first, y_low - y_first : y_high - y_first],
            scan.ranges_m,
            scan.beams,
            self._x0 + x_low * self._cell,
            self._y0 + y_low * self._cell,
            self._cell,
            reach,
            self._noise,
            self._aside,
            self._needed,
        )

    def _reach_m(self, scan: RangeScan) -> float:
        """Range up to which nothing as wide as the narrowest obstacle can hide between two beams."""
        if (between_rad := scan.spacing_rad - scan.beam_rad) <= TOUCHING_SHARE * scan.spacing_rad:
            return scan.max_range_m
        return min(scan.max_range_m, self._least_width / between_rad)

    def take_back(self, scan: RangeScan, edges_m: FloatArray) -> bool:
        """Takes back from free space what (k, 2) edge points of a scan stand in and what they hide.

        Returns:
            Whether any of it stands in space that was seen to be free: an edge point with free cells all about it.
        """
        edges_m = edges_m.compress(self.contains(edges_m), axis=0)
        if not len(edges_m) or not self.surrounds(edges_m).any():
            return False
        _, _, x_low, x_high, y_low, y_high = self._window(scan, math.ceil(scan.max_range_m / self._cell) + 1)
        seen = self._free[x_low:x_high, y_low:y_high]
        column, row = seen.nonzero()
        x = (column + 0.5) * self._cell + (self._x0 + x_low * self._cell - scan.east_m)
        y = (row + 0.5) * self._cell + (self._y0 + y_low * self._cell - scan.north_m)
        # Bearings are counted in slices, a whole number of them; each is hidden from the nearest edge on.
        slices = math.floor(math.tau / max(scan.spacing_rad, NARROWEST_RAD) + 1e-9)
        hidden_from = self._hidden_from(edges_m - (scan.east_m, scan.north_m), slices)
        mine = np.floor(np.arctan2(x, y) / (math.tau / slices)).astype(np.int64) % slices
        hidden = np.hypot(x, y) > hidden_from[mine] - self._cell
        seen[column[hidden], row[hidden]] = False
        self._looks[x_low:x_high, y_low:y_high][column[hidden], row[hidden]] = 0
        self._last = _NOWHERE  # what the next scan looks through is free at once
        return True

    def _hidden_from(self, offsets_m: FloatArray, slices: int) -> FloatArray:
        """(s,) the distance from which on edge points, (k, 2) from the sensor, hide each slice of the full circle."""
        width_rad = math.tau / slices
        distance = np.hypot(offsets_m[:, 0], offsets_m[:, 1])
        half_rad = np.arcsin(np.minimum(1.5 * self._cell / np.maximum(distance, self._cell), 1.0))
        bearing = np.arctan2(offsets_m[:, 0], offsets_m[:, 1])
        first = np.floor((bearing - half_rad) / width_rad).astype(np.int64)
        last = np.ceil((bearing + half_rad) / width_rad).astype(np.int64)
        hidden_from = np.full(slices, math.inf)
        for low, high, away in zip(first.tolist(), last.tolist(), distance.tolist(), strict=True):
            which = np.arange(low, high + 1) % slices
            hidden_from[which] = np.minimum(hidden_from[which], away)
        return hidden_from

    def _window(self, scan: RangeScan, across: int) -> tuple[int, int, int, int, int, int]:
        """Returns the first column and row within `across` cells of the sensor, and the spans of those on the grid."""
        x_first = math.floor((scan.east_m - self._x0) / self._cell) - across
        y_first = math.floor((scan.north_m - self._y0) / self._cell) - across
        size = 2 * across + 1
        x_low, x_high = max(x_first, 0), min(x_first + size, self._nx)
        y_low, y_high = max(y_first, 0), min(y_first + size, self._ny)
        return x_first, y_first, x_low, x_high, y_low, y_high

    def surrounds(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points lies in a free cell, with free ones to all four sides."""
        around = self._cell * np.array(((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)))
        places = (points_m[:, None] + around).reshape(-1, 2)
        return np.asarray(np.all(self.contains(places).reshape(-1, len(around)), axis=1))

    def contains(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each point lies in a cell seen to be free."""
        return _are_free(self._free, np.ascontiguousarray(points_m), self._x0, self._y0, self._cell)


def looks_needed(missed: float) -> int:
    """Returns how many scans must look through a cell to make it free if each misses with the probability `missed`."""
    if missed <= 0.0:
        return 1
    return MOST_LOOKS + 1 if missed >= 1.0 else max(math.ceil(math.log(MISSED_CHANCE) / math.log(missed)), 1)


@compiled(GRID, ROWS, FLOAT, FLOAT, FLOAT)
def _are_free(seen: BoolArray, points: FloatArray, x0: float, y0: float, cell: float) -> BoolArray:
    free = np.zeros(len(points), dtype=np.bool_)
    for i in range(len(points)):
        x, y = (points[i, 0] - x0) / cell, (points[i, 1] - y0) / cell
        if 0.0 <= x <= seen.shape[0] and 0.0 <= y <= seen.shape[1]:  # the border belongs to the area
            free[i] = seen[min(int(x), seen.shape[0] - 1), min(int(y), seen.shape[1] - 1)]
    return free


def _disc(cells: int) -> BoolArray:
    """Returns which of (2 k + 1, 2 k + 1) cells lie within k cells of the middle one."""
    away = np.arange(-cells, cells + 1)
    # Row by row, so that of a large disc nothing but the answer takes room.
    halves = np.floor(np.sqrt(cells * cells - away * away)).astype(np.int64)
    return np.asarray(np.abs(away) <= halves[:, None])
