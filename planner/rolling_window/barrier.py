"""Proof that no way exists: a closed chain of seen edges between start and goal.

Two edge points nearer to each other than twice the clearance let nothing through between them, nor do an edge point and
the border of the area that is nearer to it than the clearance (and what is to be kept from the border). A closed chain
of such lines that crosses the straight line from start to goal an odd number of times parts the two (Jordan curve
theorem, modulo 2); the border closes chains outside of the area. Union-find with the parity of the crossings notices
the first link that closes such a chain.
"""

from __future__ import annotations

import numpy as np

from planner.geometry.curves import Point
from planner.interface import FloatArray, Mission
from planner.kernels.chains import link_all
from planner.memory import ObstacleMemory

POINTS_A_CALL = 500
"""Most edge points that a proof takes in at one call (2,000 take a millisecond); after a removal it takes in all."""

THINNING_SHARE = 0.1
"""One point is taken in per square of this share of the clearance. Fewer points prove less, but nothing false."""

MOST_ERROR_SHARE = 1.0 / 3.0
"""Nothing is proved where edge points may be further off than this share of the clearance: a gap that is wide enough
may then lie within three beams, of which the map takes one without a return for a wall."""

NODE_LISTS = 4096  # number of lists that nodes are put into by the square in which they lie (a hash table)


class Barrier:
    """Watches for a closed chain of edge points between two places."""

    def __init__(
        self,
        start: Point,
        goal: Point,
        bounds_m: tuple[float, float, float, float],
        clearance_m: float,
        border_m: float = 0.0,
    ) -> None:
        self._ends, self._bounds = np.array((start, goal)), np.array(bounds_m)
        self._clearance, self._border = clearance_m, border_m
        self._thinned: set[tuple[int, int]] = set()
        self._places = np.zeros((1, 2))
        self._parent, self._before = np.zeros(1, dtype=np.intp), np.zeros(1, dtype=np.intp)
        self._parity = np.zeros(1, dtype=np.bool_)
        self._last = np.zeros(NODE_LISTS, dtype=np.intp)
        self.closed = False

    def add(self, points_m: FloatArray) -> None:
        """Takes in (k, 2) edge points, one a square of the thinning, and sets `closed` once they close a chain."""
        known, fresh = len(self._places), []
        places = np.floor(points_m / (THINNING_SHARE * self._clearance)).astype(np.int64).tolist()
        for i, (column, row) in enumerate(places):
            if (column, row) not in self._thinned:
                self._thinned.add((column, row))
                fresh.append(i)
        if not fresh:
            return
        more = np.zeros(len(fresh), dtype=np.intp)
        self._places = np.concatenate((self._places, points_m[fresh]))
        self._parent = np.concatenate((self._parent, more))
        self._before = np.concatenate((self._before, more))
        self._parity = np.concatenate((self._parity, more.astype(np.bool_)))
        nodes = (self._parent, self._parity, self._last, self._before)
        keeps = (self._clearance, self._border)
        self.closed |= link_all(self._places, known, *nodes, self._ends, self._bounds, *keeps)


class Proof:
    """Proves, as edge points come in, that those remembered leave no way to the goal."""

    def __init__(
        self,
        mission: Mission,
        memory: ObstacleMemory,
        keeps_m: float,
        border_m: float = 0.0,
        with_refused: bool = False,
    ) -> None:
        self._mission, self._memory, self._with_refused = mission, memory, with_refused
        self._keeps_m, self._border_m = keeps_m, border_m
        self._ends: tuple[Point, Point] | None = None
        self._begin()

    def keep(self, keeps_m: float) -> None:
        """Begins anew, for another distance."""
        self._keeps_m = keeps_m
        self._begin()

    def _begin(self) -> None:
        """Begins the proof anew, with no point taken in."""
        self._barrier: Barrier | None = None
        self._taken = 0
        self._begun_at = self._gone = self._memory.cleared

    def closed(self, position: Point, most: int = POINTS_A_CALL) -> bool:
        """Takes in at most `most` more points; returns whether they close all ways from the first position given."""
        # Where the aircraft was first: by a way that it found it can go back, be it narrower than this.
        self._ends = self._ends or (position, self._mission.goal_m)
        if (closed := self._take_points(self._ends, most)) and self._begun_at != self._memory.cleared:
            # Some points that close it may have been let go of since: those left have to close it as well.
            self._begin()
            return self._take_points(self._ends, self._memory.known)
        return closed

    def _take_points(self, ends: tuple[Point, Point], most: int) -> bool:
        """Takes in at most `most` more points, none near the ends of the way; returns whether they close all ways."""
        memory, keeps_m = self._memory, self._keeps_m
        if self._barrier is None:
            self._barrier = Barrier(*ends, self._mission.bounds_m, keeps_m, self._border_m)
        self._taken = max(self._taken - (memory.cleared - self._gone), 0)
        self._gone = memory.cleared
        more = memory.genuine_m[self._taken :][:most]
        self._taken += len(more)
        if self._with_refused:
            more = np.concatenate((memory.refused_m, more))
        for east, north in ends:
            more = more[np.hypot(more[:, 0] - east, more[:, 1] - north) >= keeps_m]
        self._barrier.add(more)
        return self._barrier.closed


class Proofs:
    """The proofs that a planner makes from the edge points seen.

    `no_way`: no vehicle can pass at the clearance, wherever edge points lie that may be off: no gap is wider than
    `no_way_gap_m`. That takes points that are `exact`. `none_to_find`: the search counts no gap as open, for none looks
    wider than `closed_gap_m`; that proves nothing. `no_room_to_turn`: no vehicle can pass that keeps a hold radius
    beside the clearance (`turning_gap_m`). `only_given_up`: none is to be found but through places that were given up.
    """

    def __init__(self, mission: Mission, memory: ObstacleMemory, least_keeps_m: float) -> None:
        clearance_m = mission.clearance_m
        turns_keep_m = clearance_m + mission.hold_radius_m
        error_m = min(mission.edge_error_m, MOST_ERROR_SHARE * clearance_m)
        self.exact, self.surely_m = error_m == mission.edge_error_m, clearance_m - error_m
        self.no_way = Proof(mission, memory, self.surely_m)
        self.none_to_find = Proof(mission, memory, least_keeps_m)
        self.no_room_to_turn = Proof(mission, memory, turns_keep_m, mission.hold_radius_m)
        self.only_given_up = Proof(mission, memory, least_keeps_m, with_refused=True)
        self.no_way_gap_m, self.turning_gap_m = 2.0 * clearance_m, 2.0 * turns_keep_m
        self.closed_gap_m = 2.0 * least_keeps_m

    def find_down_to(self, least_keeps_m: float) -> None:
        """The search finds ways that keep no more than this from now on."""
        self.closed_gap_m = 2.0 * least_keeps_m
        self.none_to_find.keep(least_keeps_m)
        self.only_given_up.keep(least_keeps_m)
