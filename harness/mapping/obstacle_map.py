"""The edges of obstacles that have been seen so far.

Edges are points on a square grid of cells, at most one a cell, each where a ray hit or between two such
places. Near by, where the edge of an obstacle stands out against what is behind it, finer grids keep more of
them: paths bend about such places. Evidence decides: a cell that was hit holds an edge, where the sensor has false
returns one that was hit in two scans; one that several scans looked through, with neighbouring rays agreeing, does
not. So one false return makes no wall and one lost return opens none. The grids cover the area with a border, so that
the map cannot outgrow them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from harness.mapping.edge_grid import EdgePoints
from harness.mapping.hit_counting import CONFIRMED_SCORE, count_hits, ends, new_edges
from harness.mapping.scan import RangeScan, all_round, supported, turned
from harness.mapping.scan_comparison import looked_through
from planner.interface import BoolArray, ComplexArray, FloatArray, IntArray

SUPPORT_SHARE = 0.5
"""Where returns may be false, one is believed if a ray beside it met something within this share of the clearance."""
DETAIL_GRIDS = ((5.0, 4), (2.0, 16))
"""Pairs (reach in clearances, number): within the reach of the aircraft, the ends of outlines are kept in finer cells,
this number of them along the side of a usual cell."""
LEAST_RANGE_SHARE = 1.0 / 4.0
"""A scan is counted once the aircraft has moved by this share of the least range since the last counted scan."""
SENSING_RANGE_SHARE = 1.0 / 64.0
"""A scan is counted once the aircraft has moved by this share of the sensing range, however far away obstacles are."""
RANGES_READ_FACTOR = 0.75
"""The way between two counted scans is shorter by this factor if the map of free space has read the scan's ranges."""
MOVING_FACTOR = 0.25
"""The way between two counted scans is shorter by this factor while something moves, appears or vanishes."""
PLACED_ANEW = 8.0
"""If the poses of scans err, edges within this many clearances of the aircraft are moved to where they are seen now."""
NEARER_SHARE = 0.7
"""An edge is moved only if it is seen from less than this share of the least range at which it was seen before."""
OFF_SHARE = 0.01  # an edge is moved only if it is off by more than this share of the clearance
LOOK_EVERY_SCANS = 12  # once in this many scans the map looks for points that the beams went past
LOOK_AGAIN_SCANS = 2  # once in this many scans the map looks for such points after it found some


class ObstacleMap(EdgePoints):
    """Obstacles that stand still, from a sensor with exact ranges.

    Hits nearer to each other than twice the clearance leave no way between them and are joined. Edge points lie about a
    quarter of it apart.

    Args:
        doubtful: the sensor may return what is not there: a single hit is not believed.
        shifted: the poses of scans err. An edge is the more misplaced the further away it was seen from, so one that
            is seen from nearer by is moved to where it is seen now.
    """

    def __init__(
        self,
        bounds_m: tuple[float, float, float, float],
        clearance_m: float,
        range_m: float,
        doubtful: bool = True,
        revision: int = 0,
        shifted: bool = False,
    ) -> None:
        super().__init__(bounds_m, clearance_m, range_m, revision)
        self._coarse = self._nx * self._ny
        # Fine cells that were hit, numbered after the coarse ones.
        self._fine: dict[tuple[int, int, int], int] = {}
        self._score = np.zeros(self._coarse + 1024, dtype=np.int8)  # score of each cell
        self._slot = np.full(self._coarse + 1024, -1, dtype=np.int32)  # slot of each cell; -1: no point
        self._key = np.zeros(1024, dtype=np.int64)  # cell of each slot
        self._join = 2.0 * clearance_m
        self._clearance, self._near_by = clearance_m, DETAIL_GRIDS[0][0] * clearance_m
        self._doubtful, self._first_score = doubtful, 1 if doubtful else CONFIRMED_SCORE
        self._shifted, self._scanned_at = shifted, 0j  # the latter: from where the scan before was taken
        self._seen_from_m = np.zeros(0)  # least range at which each slot's point was seen, where poses err
        self._scans = 0
        self._all_stands = True  # the last look found no point that beams went past
        self._unconfirmed = False  # a cell was hit in the last scan taken in, and has yet to be believed
        self._same_view = max(SENSING_RANGE_SHARE * range_m, self._cell)
        self._taken_at, self._taken_nearest, self._taken_rad = complex(math.inf, math.inf), math.inf, 0.0

    def update(self, scan: RangeScan, ignored: BoolArray | None = None) -> None:
        """Takes in a scan, if the view has changed, except the rays `ignored`, (n,); at times looks for points gone."""
        nearest = scan.nearest_m
        if nearest < math.inf:
            sensor = complex(scan.east_m, scan.north_m)
            moved = abs(sensor - self._taken_at)
            same = min(LEAST_RANGE_SHARE * nearest, self._same_view)
            if ignored is not None or not self._all_stands:
                same *= MOVING_FACTOR
            elif scan.followed:
                same *= RANGES_READ_FACTOR
            # What is nearer than the way flown explains has only just appeared.
            fresh = nearest < self._taken_nearest - 1.001 * moved or turned(scan, self._taken_rad)
            if not moved < same or fresh or self._unconfirmed:
                self._taken_at, self._taken_nearest, self._taken_rad = sensor, nearest, scan.heading_rad
                self._take_in(scan, nearest, ignored)
        if not self._scans % (LOOK_EVERY_SCANS if self._all_stands else LOOK_AGAIN_SCANS) and self._count:
            self._all_stands = not self._look_through(scan)
        self._scans += 1

    def _are_edges(self, slots: IntArray) -> BoolArray:
        return self._score[self._key[slots]] >= CONFIRMED_SCORE

    def forget(self, points_m: FloatArray, within_m: float) -> None:
        """Drops every edge point within `within_m` of any of the (k, 2) points."""
        slots = self._slots_within(points_m, within_m)
        if len(slots := slots[self._score[self._key[slots]] > 0]):
            self._score[self._key[slots]] = 0
            self._note_removal()

    def _take_in(self, scan: RangeScan, nearest_m: float, ignored: BoolArray | None) -> None:
        """Counts hits, points between new ones, and the ends of near outlines in detail.

        Most of what is in sight has been seen so often that it is certain: that is found out first.
        """
        self._unconfirmed = False
        hits, places = self._hits(scan, ignored)
        column, row, on_grid = self._column_and_row(places)
        if not on_grid.all():
            hits, places, column, row = hits[on_grid], places[on_grid], column[on_grid], row[on_grid]
        if self._shifted:
            self._place_anew(scan, scan.ranges_m[hits], places, column * self._ny + row)
        if not len(hits):
            return
        rays, cell, join, first = len(scan.ranges_m), self._cell, self._join, self._first_score
        closed = all_round(scan) and bool(hits[0] + rays - hits[-1] <= 2)
        cells, found = new_edges(hits, places, self._score, self._slot, cell, self._ny, rays, closed, join, first)
        if nearest_m >= self._near_by:
            self._count_hits(cells, found)
            return
        corners = nearest_m < DETAIL_GRIDS[-1][0] * self._clearance
        near = ends(hits, places, scan.ranges_m, cell, closed, join, corners)
        ranges, places = scan.ranges_m[hits[near]], places[near]
        again: list[tuple[IntArray, ComplexArray]] = []
        for reach, finer in DETAIL_GRIDS:
            if len(at := places[ranges < reach * self._clearance]):
                fine = self._fine_keys(at, finer)
                cells, found = np.concatenate((cells, fine)), np.concatenate((found, at))
                if first < CONFIRMED_SCORE:
                    # Where the wall is known, this only tells where it ends: once is enough.
                    column, row, _ = self._column_and_row(at)
                    sure = self._score[column * self._ny + row] >= CONFIRMED_SCORE
                    again.append((fine[sure], at[sure]))
        for each in ((cells, found), *again):
            self._count_hits(*each)

    def _place_anew(self, scan: RangeScan, ranges_m: FloatArray, places: ComplexArray, cells: IntArray) -> None:
        """Moves edges within their cells to where they are seen now, if that is from much nearer by than before.

        Ranges, places, from the corner of the grid, and cells are those of the scan's hits.
        """
        new = self._points[len(self._seen_from_m) : self._count]  # came in with the scan before
        self._seen_from_m = np.concatenate((self._seen_from_m, np.abs(new - self._scanned_at)))
        self._scanned_at = complex(scan.east_m, scan.north_m)
        hits = (ranges_m < PLACED_ANEW * self._clearance).nonzero()[0]
        slots = self._slot[cells[hits]]
        hits, slots = hits[slots >= 0], slots[slots >= 0]
        nearer = ranges_m[hits] < NEARER_SHARE * self._seen_from_m[slots]
        if not nearer.any():
            return
        first = np.empty(self._count, dtype=np.intp)  # by slot: the first hit in its cell, which is set last
        first[slots[::-1]] = hits[::-1]
        nearer &= first[slots] == hits
        hits, slots = hits[nearer], slots[nearer]
        self._seen_from_m[slots] = ranges_m[hits]
        found = places[hits] + self._origin
        off = np.abs(self._points[slots] - found) > OFF_SHARE * self._clearance
        self._points[slots[off]] = found[off]
        if len(moved := slots[off & (self._score[self._key[slots]] >= CONFIRMED_SCORE)]):
            self.revision += 1
            self._since[moved] = self.last_removal_revision = self.revision

    def _hits(self, scan: RangeScan, ignored: BoolArray | None) -> tuple[IntArray, ComplexArray]:
        """Returns the rays that met an edge, and where they did, from the corner of the grid."""
        if ignored is None and not self._doubtful:
            return scan.returned(self._origin)
        taken = supported(scan, SUPPORT_SHARE * self._clearance) if self._doubtful else scan.ranges_m < math.inf
        hits = (taken if ignored is None else taken & ~ignored).nonzero()[0]
        return hits, scan.from_sensor_m(hits) + (complex(scan.east_m, scan.north_m) - self._origin)

    def _count_hits(self, cells: IntArray, places: ComplexArray) -> None:
        """Counts one hit in each cell; its point, an edge once believed, is the first place, from the grid's corner."""
        if not len(cells):
            return
        self._make_room(self._count + len(cells), "_points", "_key", "_since")
        by_slot = self._points, self._key, self._since, self._count
        self._count, self.revision, unconfirmed = count_hits(
            cells, places, self._score, self._slot, *by_slot, self.revision, self._first_score, self._origin
        )
        self._unconfirmed |= unconfirmed

    def _fine_keys(self, places: ComplexArray, finer: int) -> NDArray[np.int64]:
        """Returns the numbers of the cells at places on a grid with `finer` cells along a usual one."""
        cells = (places * (finer / self._cell)).view(np.float64).reshape(-1, 2).astype(np.int64).tolist()
        keys = [self._fine.setdefault((finer, x, y), self._coarse + len(self._fine)) for x, y in cells]
        if self._coarse + len(self._fine) > len(self._score):
            more = self._coarse + 2 * len(self._fine) - len(self._score)
            self._score = np.concatenate((self._score, np.zeros(more, dtype=np.int8)))
            self._slot = np.concatenate((self._slot, np.full(more, -1, dtype=np.int32)))
        return np.array(keys, dtype=np.int64)

    def _look_through(self, scan: RangeScan) -> bool:
        """Lowers the score of every known point that three neighbouring rays went past; tells whether there was any."""
        slots = self._in_reach(complex(scan.east_m, scan.north_m), self._range / 8.0)
        # Only a ray that passes close by says anything about a point.
        through = looked_through(
            scan,
            self._points.take(slots),
            1.5 * self._cell,
            abreast=1,
            aimed_m=0.25 * self._cell,
            within_m=scan.max_range_m - 2.0 * self._cell,
        )
        weaker = self._key[slots[through]]
        if len(weaker := weaker[self._score[weaker] > 0]):
            self._score[weaker] -= 1
            if (self._score[weaker] == CONFIRMED_SCORE - 1).any():
                self._note_removal()
                # What was seen from afar to be somewhere in a beam is elsewhere: the next scan tells where.
                self._taken_at = complex(math.inf, math.inf)
        return len(weaker) > 0
