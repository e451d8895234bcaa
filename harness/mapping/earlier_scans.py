"""Scans that were looked at before, for later ones to be compared with.

The last ones tell of what has just come out from behind something, those of long before of what is slow.

Places are complex: east + i north, m.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from harness.mapping.followed_outline import MOST_MPS, FollowedOutline
from harness.mapping.scan import RangeScan
from harness.mapping.scan_comparison import (
    any_come,
    come,
    drawn_back,
    in_all,
    looked_through,
    near_any,
    near_line,
)
from planner.interface import BoolArray, ComplexArray, IntArray

COMPARED_S = 12.0
"""A scan is compared with the last two that were looked at, and with two from at least this time before."""
SLOW_MPS = 5.0
"""The time of `COMPARED_S` is longer by that in which an obstacle of this speed moves further than the noise."""
LOOK_EVERY_S = 3.0
"""Least time between two looks for obstacles that have come into free space."""
LOOK_EVERY = 0.6
"""The time between two looks is at least that in which the fastest obstacle moves by this share of the clearance."""
NO_STEP = 0.25
"""Neighbouring returns nearer to each other than this share of the clearance belong to one obstacle."""
OWN = 0.1
"""A return within this share of the clearance from where a followed obstacle was belongs to that obstacle."""
OFF = 3.0
"""A velocity is taken to be off by at most this many standard errors."""


class Look(NamedTuple):
    """A scan that was looked at, the rays that returned something, and where."""

    scan: RangeScan
    hits: IntArray
    places: ComplexArray


class EarlierScans:
    """The scans of the last seconds that were looked at.

    Args:
        clearance_m: wanted distance from obstacles.
        sure_m: places further apart are surely not the same.
        exact: ranges do not err.
        flawed: ranges err, or some returns are false.
    """

    def __init__(self, clearance_m: float, sure_m: float, *, exact: bool, flawed: bool) -> None:
        self.compared_s = COMPARED_S + sure_m / SLOW_MPS
        self.own_m = max(OWN * clearance_m, sure_m)
        self._clearance, self._sure, self._exact = clearance_m, sure_m, exact
        # A scan that errs may be wrong about a place; two are not.
        self._many = 2 if flawed else 1
        self._every_s = max(LOOK_EVERY_S, LOOK_EVERY * clearance_m / MOST_MPS)
        self._looked_s = -math.inf
        self._looks: deque[Look] = deque()

    def due(self, time_s: float) -> bool:
        """Whether it is time to look at a scan; then it is taken as looked at."""
        if time_s - self._looked_s < self._every_s:
            return False
        self._looked_s = time_s
        while len(self._looks) > 2 and self._looks[1].scan.time_s <= time_s - self.compared_s:
            self._looks.popleft()
        return True

    def keep(self, look: Look) -> None:
        """Keeps one more."""
        self._looks.append(look)

    def changed(self, now: Look) -> BoolArray | None:
        """(k,) which returns have come to places that were looked through, or have drawn back; None: surely none."""
        if len(self._looks) < 2 or now.scan.nearest_m == math.inf or not self._may_differ(now):
            return None
        scan, hits, places = now
        long_ago, of_late = (self._looks[0], self._looks[1]), (self._looks[-1], self._looks[-2])
        changed = in_all(come(before.scan, places, self._sure) for before in long_ago[: self._many])
        if not self._exact:
            return changed  # too little has changed of late
        late = in_all(come(before.scan, places, self._sure) for before in of_late[: self._many])
        late |= in_all(self._drawn_back(before, scan)[hits] for before in of_late[: self._many])
        if late.any():
            # Where rays are far apart an outline ends anywhere.
            changed |= late & (scan.spacing_rad * scan.ranges_m[hits] < NO_STEP * self._clearance)
        return changed

    def have_come(self, places: ComplexArray, fewest: int) -> bool:
        """Whether so many of some places at least were looked through by one of the scans."""
        return any(np.count_nonzero(come(each.scan, places, self._sure)) >= fewest for each in self._looks)

    def met(self, places: ComplexArray) -> BoolArray:
        """(k,) whether something was met at places by the first of the scans."""
        return near_line(places, self._looks[0].places, self.own_m, self._clearance)

    def of_it(self, track: FollowedOutline, places: ComplexArray, now: RangeScan) -> IntArray:
        """Which places may be of something that moves.

        Those where the first of the scans met nothing else that has not gone since, or looked through; and, where its
        outline tells all of its velocity, which none of the scans looked through where they would have been then, if
        they were its. If that were few of those near it, its velocity would be wrong, or it has only appeared: then
        that is not asked.
        """
        first, near_m = self._looks[0], NO_STEP * self._clearance
        own = near_any(first.places, track.shown_at(first.scan.time_s), self.own_m)
        stood = first.places[~own & ~looked_through(now, first.places, self._sure)]
        may = ~near_any(places, stood, near_m) | come(first.scan, places, self._sure)
        if not track.outline.is_definite:
            return may.nonzero()[0]
        was = may.copy()
        for before in self._looks:
            past_s = now.time_s - before.scan.time_s
            off_m = max(self._sure, near_m) + OFF * track.error_mps * past_s
            was &= ~looked_through(before.scan, places - track.velocity * past_s, off_m)
        near = may & near_any(places, track.at(now.time_s).points, near_m)
        some = was if 2 * np.count_nonzero(was & near) >= np.count_nonzero(near) else may
        return some.nonzero()[0]

    def _may_differ(self, now: Look) -> bool:
        """Whether anything at all has come since a scan before, or drawn back: in a still world mostly nothing."""
        if any_come(self._looks[0].scan, now.places, self._sure):
            return True
        late = self._looks[-1]
        return self._exact and (
            any_come(late.scan, now.places, self._sure) or any_come(now.scan, late.places, self._sure)
        )

    def _drawn_back(self, before: Look, scan: RangeScan) -> BoolArray:
        """(n,) which rays of a scan meet what may have drawn back since another."""
        most_m = MOST_MPS * (scan.time_s - before.scan.time_s)
        return drawn_back(before.places, scan, self._sure, most_m)
