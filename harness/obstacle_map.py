"""What has been seen so far: obstacle edges and space seen to be free.

Edges are points on a square grid of cells, at most one a cell, each where a ray hit or between two such
places. Near by, where the edge of an obstacle stands out against what is behind it, a finer grid keeps more of
them: paths bend about such places. Evidence decides: a cell that was hit in two scans holds an edge; one that several scans looked
through, with neighbouring rays agreeing, does not. So one false return makes no wall and one lost return
opens none. Free space is a coarser grid, written from key scans. The grids cover the area, that of the
edges with a border, so that the map cannot outgrow them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from harness.range_sensor import RangeScan
from planner.interface import BoolArray, FloatArray

MOST_CELLS = 4_000_000
CONFIRMED = 2
"""An edge is believed from this score on; a hit adds one, a look through takes one."""
CERTAIN = 8
"""Scores do not rise above this."""
BETWEEN = np.arange(1, 8) / 8.0
"""Where points are put between two hits that are joined: no more than a cell apart from each other."""
NEAR = 5.0
"""Outlines are kept in detail up to so many clearances away."""
FINER = 4
"""Cells of the fine grid in one of the coarse one, along a side."""
LOOK_THROUGH_EVERY = 4
"""Every so many scans the points in range are asked whether they were looked through."""


class ObstacleMap:
    """The planner's only source of knowledge about obstacles (`planner.interface.SeenWorld`).

    Args:
        bounds_m: xmin, ymin, xmax, ymax of the area.
        clearance_m: wanted distance from obstacles; hits nearer to each other than twice this leave no way
            between them and are joined. Edge points lie about a quarter of it apart.
        range_m: sensing range.
    """

    def __init__(
        self, bounds_m: tuple[float, float, float, float], clearance_m: float, range_m: float
    ) -> None:
        xmin, ymin, xmax, ymax = bounds_m
        span = max(xmax - xmin, ymax - ymin) + 4.0 * clearance_m
        self._cell = max(clearance_m / 4.0, span / math.sqrt(MOST_CELLS))
        border = 2.0 * clearance_m + self._cell
        self._origin = np.array([[xmin], [ymin]]) - border
        nx, self._ny = (
            math.ceil((high - low + 2.0 * border) / self._cell) for low, high in ((xmin, xmax), (ymin, ymax))
        )
        self._shape = np.array([[nx], [self._ny]], dtype=np.uint64)
        self._coarse = nx * self._ny
        self._fine: dict[tuple[int, int], int] = {}  # fine cells that were hit, numbered after the coarse ones
        self._score = np.zeros(self._coarse + 1024, dtype=np.int8)  # by cell
        self._slot = np.full(self._coarse + 1024, -1, dtype=np.int32)  # by cell, -1 where there is no point
        self._points = np.zeros((1024, 2))  # by slot
        self._key = np.zeros(1024, dtype=np.int64)  # by slot: its cell
        self._since = np.zeros(1024, dtype=np.int64)  # by slot: revision at which it last became an edge
        self._count = 0
        self._join = 2.0 * clearance_m
        self._near_by = NEAR * clearance_m
        self._range = range_m
        self._revision = 0
        self._taken_back_at = 0
        self._scans = 0
        self._near = np.zeros(0, dtype=np.int32)
        self._near_at = (math.inf, math.inf)
        self._near_count = 0
        self._free = _FreeSpace(bounds_m, clearance_m, range_m)

    @property
    def spacing_m(self) -> float:
        """Edge points of one wall are about this far apart."""
        return self._cell

    @property
    def revision(self) -> int:
        """Grows with every change of the set of edge points."""
        return self._revision

    def update(self, scan: RangeScan) -> None:
        """Takes in one scan."""
        self._scans += 1
        hits = (scan.ranges_m < math.inf).nonzero()[0]
        if len(hits):
            self._take_in(scan, hits)
        if self._scans % LOOK_THROUGH_EVERY == 0 and self._count:
            self._look_through(scan)
        self._free.update(scan)

    @property
    def taken_back_at(self) -> int:
        """The last revision at which edge points were taken away again."""
        return self._taken_back_at

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) edge points that came in after `revision`, in the order in which they did."""
        if revision >= self._revision:
            return np.zeros((0, 2))
        slots = (self._since[: self._count] > revision).nonzero()[0]
        slots = slots[self._score[self._key[slots]] >= CONFIRMED]
        return self._points[slots[np.argsort(self._since[slots], kind="stable")]]

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points lies in space seen to be free."""
        return self._free.contains(points_m)

    def _take_in(self, scan: RangeScan, hits: NDArray[np.intp]) -> None:
        """Counts hits; where they are news, also what lies between them; and near outlines in detail.

        Most of what is in sight has been seen so often that it is certain: that is found out first.
        """
        sensor = complex(scan.east_m, scan.north_m)
        ranges = scan.ranges_m.take(hits)
        places = scan.directions.view(np.complex128).take(hits) * ranges
        cells = self._cells(places + sensor)
        if not self._holds(scan):
            inside = ((cells >= 0) & (cells < self._shape)).all(axis=1).nonzero()[0]
            hits, ranges, places, cells = hits[inside], ranges[inside], places[inside], cells[inside]
        keys = cells[:, 0] * self._ny + cells[:, 1]
        news = self._score.take(keys) < CERTAIN
        near = ranges < self._near_by
        if not (np.count_nonzero(news) or np.count_nonzero(near)):
            return
        counted, found = [keys[news]], [places[news]]
        rays = len(scan.ranges_m)
        closed = _all_round(scan) and hits[0] + rays - hits[-1] <= 2
        if closed:
            hits = np.concatenate((hits, hits[:1] + rays))
            places, news, near = (np.concatenate((each, each[:1])) for each in (places, news, near))
        step = places[1:] - places[:-1]
        gap = np.abs(step)
        # One ray may be missing between neighbours: a lost return does not open a wall.
        joined = (gap < self._join) & (hits[1:] - hits[:-1] <= 2)
        wide = (joined & (gap > self._cell) & (news[1:] | news[:-1])).nonzero()[0]
        if len(wide):
            between = (places[wide, None] + step[wide, None] * BETWEEN).ravel()
            cells = self._cells(between + sensor)
            counted.append(cells[:, 0] * self._ny + cells[:, 1])
            found.append(between)
        ends = (~joined).nonzero()[0]
        ends = np.concatenate((ends, ends + 1) if closed else (ends, ends + 1, (0, len(hits) - 1)))
        outline = places[ends[near[ends]]]
        if len(outline):
            counted.append(self._fine_keys(outline + sensor))
            found.append(outline)
        self._count_hits(np.concatenate(counted), np.concatenate(found) + sensor)

    def _cells(self, points: ComplexArray) -> NDArray[np.int64]:
        """(k, 2) column and row of each point."""
        return ((points - self._origin) / self._cell).view(np.float64).reshape(-1, 2).astype(np.int64)

    def _holds(self, scan: RangeScan) -> bool:
        """Whether all that a scan can reach lies on the grid."""
        reach, x, y = scan.max_range_m, scan.east_m - self._origin.real, scan.north_m - self._origin.imag
        width, height = self._cell * self._shape
        return reach < x < width - reach and reach < y < height - reach

    def _count_hits(self, keys: NDArray[np.int64], points: ComplexArray) -> None:
        """Counts hits: a cell gets a point with the first and is an edge from the second scan on."""
        score = self._score.take(keys)
        uncertain = (score < CERTAIN).nonzero()[0]
        if not len(uncertain):
            return
        keys, score = keys[uncertain], score[uncertain]
        self._score[keys] = score + 1  # duplicates of a cell count once a scan
        raised = keys[score == CONFIRMED - 1]
        if len(raised):
            self._revision += 1
            self._since[self._slot[raised]] = self._revision
        fresh = (score == 0).nonzero()[0]
        fresh = fresh[self._slot[keys[fresh]] < 0]  # others have a point, though no score is left
        if len(fresh):
            new_keys, first = np.unique(keys[fresh], return_index=True)
            self._grow(len(new_keys))
            new = np.arange(self._count, self._count + len(new_keys), dtype=np.int32)
            self._slot[new_keys] = new
            self._points[new] = (points[:, uncertain[fresh[first]]] + sensor).T
            self._key[new] = new_keys
            self._since[new] = 0
            self._count += len(new_keys)

    def _fine_keys(self, places: FloatArray) -> NDArray[np.int64]:
        """Numbers of the fine cells at (2, j) places, seen from the corner of the grid."""
        cells = (places * (FINER / self._cell)).astype(np.int64).T.tolist()
        keys = [self._fine.setdefault((x, y), self._coarse + len(self._fine)) for x, y in cells]
        if self._coarse + len(self._fine) > len(self._score):
            size = self._coarse + 2 * len(self._fine)
            more = size - len(self._score)
            self._score = np.concatenate((self._score, np.zeros(more, dtype=np.int8)))
            self._slot = np.concatenate((self._slot, np.full(more, -1, dtype=np.int32)))
        return np.array(keys, dtype=np.int64)

    def _grow(self, more: int) -> None:
        if self._count + more <= len(self._key):
            return
        size = max(2 * len(self._key), self._count + more)
        self._points = np.resize(self._points, (size, 2))
        self._key = np.resize(self._key, size)
        self._since = np.resize(self._since, size)

    def _look_through(self, scan: RangeScan) -> None:
        """Takes a point off every known point that three neighbouring rays looked past."""
        moved = math.hypot(scan.east_m - self._near_at[0], scan.north_m - self._near_at[1])
        if not moved < self._range / 8.0:
            near = self._points[: self._count] - (scan.east_m, scan.north_m)
            reach = 1.125 * self._range
            self._near = np.flatnonzero((near * near).sum(axis=1) < reach * reach).astype(np.int32)
            self._near_at, self._near_count = (scan.east_m, scan.north_m), self._count
        slots = self._near
        if self._near_count < self._count:
            slots = np.concatenate((slots, np.arange(self._near_count, self._count, dtype=np.int32)))
        points = self._points[slots]
        dx, dy = points[:, 0] - scan.east_m, points[:, 1] - scan.north_m
        distance = np.sqrt(dx * dx + dy * dy)
        rays = len(scan.ranges_m)
        position = (np.arctan2(dx, dy) - scan.start_rad) % math.tau / scan.spacing_rad
        ray = np.rint(position).astype(np.int64)
        # Only a ray that passes close by says anything about the point.
        aimed = (
            (np.abs(position - ray) * scan.spacing_rad * distance < 0.25 * self._cell)
            & (distance < scan.max_range_m - 2.0 * self._cell)
            & (self._score[self._key[slots]] > 0)
        )
        if _all_round(scan):
            ray %= rays
        else:
            aimed &= (ray >= 1) & (ray < rays - 1)
        chosen = np.flatnonzero(aimed)
        ray, past = ray[chosen], distance[chosen] + 1.5 * self._cell
        ranges = scan.ranges_m
        through = (ranges[ray] > past) & (ranges[ray - 1] > past) & (ranges[(ray + 1) % rays] > past)
        weaker = self._key[slots[chosen[through]]]
        if len(weaker):
            self._score[weaker] -= 1
            if (self._score[weaker] == CONFIRMED - 1).any():
                self._revision += 1
                self._taken_back_at = self._revision


class _FreeSpace:
    """Cells of space that a scan has looked through, on a grid twice as coarse as the edges'."""

    def __init__(
        self, bounds_m: tuple[float, float, float, float], clearance_m: float, range_m: float
    ) -> None:
        xmin, ymin, xmax, ymax = bounds_m
        span = max(xmax - xmin, ymax - ymin)
        self._cell = max(clearance_m / 2.0, span / math.sqrt(MOST_CELLS / 4))
        self._x0, self._y0 = xmin, ymin
        self._nx, self._ny = math.ceil((xmax - xmin) / self._cell), math.ceil((ymax - ymin) / self._cell)
        self._seen = np.zeros((self._nx, self._ny), dtype=np.bool_)
        self._clearance, self._every = clearance_m, range_m / 40.0
        self._last = (math.inf, math.inf)

    def update(self, scan: RangeScan) -> None:
        """Marks what a scan looked through, if the sensor has moved on far enough since the last time."""
        if math.hypot(scan.east_m - self._last[0], scan.north_m - self._last[1]) < self._every:
            return
        self._last = (scan.east_m, scan.north_m)
        # Beyond this range the rays are further apart than what must not be missed between them.
        reach = min(scan.max_range_m, self._clearance / scan.spacing_rad)
        x_low, x_high = self._cells(scan.east_m, reach, self._x0, self._nx)
        y_low, y_high = self._cells(scan.north_m, reach, self._y0, self._ny)
        if x_low >= x_high or y_low >= y_high:
            return
        seen = self._seen[x_low:x_high, y_low:y_high]
        x = self._x0 + (np.arange(x_low, x_high) + 0.5) * self._cell - scan.east_m
        y = self._y0 + (np.arange(y_low, y_high) + 0.5) * self._cell - scan.north_m
        square = (x * x)[:, None] + y * y
        # Most of what is in reach has been seen from the places before.
        column, row = np.nonzero((square < reach * reach) & ~seen)
        distance = np.sqrt(square[column, row])
        rays = len(scan.ranges_m)
        position = (np.arctan2(x[column], y[row]) - scan.start_rad) % math.tau / scan.spacing_rad
        ray = np.rint(position).astype(np.int64)
        # A cell is seen through only if all rays that meet it went beyond it, and one to either side.
        half = 0.75 * self._cell
        level = np.ceil(half / np.maximum(distance, half) / scan.spacing_rad) + 1.0
        if _all_round(scan):
            ray %= rays
            covered = np.ones(ray.shape, dtype=np.bool_)
        else:
            covered = (ray >= level) & (ray < rays - level)
            ray = np.minimum(ray, rays - 1)
        free_to = np.minimum(scan.ranges_m, reach) - half
        free = np.zeros(ray.shape, dtype=np.bool_)
        width = 1
        while covered.any() and width <= rays:
            free_to = _least(free_to, width, rays)
            width *= 2
            # After filters of width 1, 2, 4, ... the least of 2 width - 1 rays to either side is known.
            enough = covered & (level <= width - 1)
            free |= enough & (free_to[ray] > distance)
            covered &= ~enough
        seen[column[free], row[free]] = True

    def contains(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each point lies in a cell seen to be free."""
        ix = np.floor((points_m[:, 0] - self._x0) / self._cell).astype(np.int64)
        iy = np.floor((points_m[:, 1] - self._y0) / self._cell).astype(np.int64)
        inside = (ix >= 0) & (iy >= 0) & (ix < self._nx) & (iy < self._ny)
        out = np.zeros(len(points_m), dtype=np.bool_)
        out[inside] = self._seen[ix[inside], iy[inside]]
        return out

    def _cells(self, middle: float, reach: float, origin: float, count: int) -> tuple[int, int]:
        low = math.floor((middle - reach - origin) / self._cell)
        high = math.ceil((middle + reach - origin) / self._cell)
        return max(low, 0), min(high, count)


def _all_round(scan: RangeScan) -> bool:
    """Whether the first ray is the neighbour of the last."""
    return len(scan.ranges_m) * scan.spacing_rad > math.tau - 1e-9


def _least(ranges: FloatArray, width: int, rays: int) -> FloatArray:
    """The least of each range and those `width` rays to either side; the ends of a fan are joined."""
    width %= rays
    return np.minimum(ranges, np.minimum(np.roll(ranges, width), np.roll(ranges, -width)))
