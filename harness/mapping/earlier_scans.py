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
    any_arrived,
    arrived,
    in_all,
    looked_through,
    near_any,
    near_line,
    receded,
)
from planner.interface import BoolArray, ComplexArray, IntArray

COMPARED_S = 12.0
"""A scan is compared with the last two that were looked at, and with two from at least this time before."""
SLOW_MPS = 5.0
"""The time of `COMPARED_S` is longer by that in which an obstacle of this speed moves further than the noise."""
LOOK_EVERY_S = 3.0  # looks for obstacles that have come into free space are at least this far apart
LOOK_EVERY_SHARE = 0.6
"""The time between two looks is at least that in which the fastest obstacle moves by this share of the clearance."""
FACE_SHARE = 0.25
"""Neighbouring returns nearer to each other than this share of the clearance belong to one obstacle."""
OWN_SHARE = 0.1
"""A return within this share of the clearance from where a followed obstacle was belongs to that obstacle."""
VELOCITY_SIGMAS = 3.0  # a velocity is taken to be off by at most this many standard errors


class Look(NamedTuple):
    """A scan that was looked at, its rays that returned something, and the places of these returns."""

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
        self.own_m = max(OWN_SHARE * clearance_m, sure_m)
        self._clearance, self._sure, self._exact = clearance_m, sure_m, exact
        # A scan that errs may be wrong about a place; two are not.
        self._many = 2 if flawed else 1
        self._every_s = max(LOOK_EVERY_S, LOOK_EVERY_SHARE * clearance_m / MOST_MPS)
        self._looked_s = -math.inf
        self._looks: deque[Look] = deque()

    def due(self, time_s: float) -> bool:
        """Tells whether a scan is to be looked at now; if so takes it as looked at, and drops looks of long ago."""
        if time_s - self._looked_s < self._every_s:
            return False
        self._looked_s = time_s
        while len(self._looks) > 2 and self._looks[1].scan.time_s <= time_s - self.compared_s:
            self._looks.popleft()
        return True

    def keep(self, look: Look) -> None:
        """Keeps a scan that was looked at, to compare later ones with it."""
        self._looks.append(look)

    def changed(self, now: Look) -> BoolArray | None:
        """(k,) which returns have come to places once looked through, or have drawn back; None if surely none has."""
        if len(self._looks) < 2 or now.scan.nearest_m == math.inf or not self._may_differ(now):
            return None
        scan, hits, places = now
        long_ago, of_late = (self._looks[0], self._looks[1]), (self._looks[-1], self._looks[-2])
        changed = in_all(arrived(before.scan, places, self._sure) for before in long_ago[: self._many])
        if not self._exact:
            return changed  # too little has changed of late
        late = in_all(arrived(before.scan, places, self._sure) for before in of_late[: self._many])
        late |= in_all(
            receded(before.places, scan, self._sure, MOST_MPS * (scan.time_s - before.scan.time_s))[hits]
            for before in of_late[: self._many]
        )
        if late.any():
            # Where rays are far apart an outline ends anywhere.
            changed |= late & (scan.spacing_rad * scan.ranges_m[hits] < FACE_SHARE * self._clearance)
        return changed

    def have_appeared(self, places: ComplexArray, fewest: int) -> bool:
        """Tells whether at least `fewest` of the places were looked through by one of the scans."""
        return any(np.count_nonzero(arrived(each.scan, places, self._sure)) >= fewest for each in self._looks)

    def met(self, places: ComplexArray) -> BoolArray:
        """(k,) which places are within `own_m` of the line through what the oldest of the scans met."""
        return near_line(places, self._looks[0].places, self.own_m, self._clearance)

    def of_it(self, track: FollowedOutline, places: ComplexArray, now: RangeScan) -> IntArray:
        """Returns the indices of places that may belong to a followed obstacle.

        The first of the scans met nothing else there that has not gone since, or looked through. Where the outline
        shows all of the velocity, no scan may have looked through where a place was then either, moved back by it. If
        fewer than half of the places near the obstacle pass that, the velocity is wrong, and it is not asked.
        """
        first, near_m = self._looks[0], FACE_SHARE * self._clearance
        own = near_any(first.places, track.shown_at(first.scan.time_s), self.own_m)
        stood = first.places[~own & ~looked_through(now, first.places, self._sure)]
        may = ~near_any(places, stood, near_m) | arrived(first.scan, places, self._sure)
        if not track.outline.is_definite:
            return may.nonzero()[0]
        was = may.copy()
        for before in self._looks:
            past_s = now.time_s - before.scan.time_s
            off_m = max(self._sure, near_m) + VELOCITY_SIGMAS * track.error_mps * past_s
            was &= ~looked_through(before.scan, places - track.velocity * past_s, off_m)
        near = may & near_any(places, track.at(now.time_s).points, near_m)
        return (was if 2 * np.count_nonzero(was & near) >= np.count_nonzero(near) else may).nonzero()[0]

    def _may_differ(self, now: Look) -> bool:
        """Tells whether anything may have come or drawn back since a scan before; in a still world mostly nothing."""
        if any_arrived(self._looks[0].scan, now.places, self._sure):
            return True
        late = self._looks[-1]
        return self._exact and (
            any_arrived(late.scan, now.places, self._sure) or any_arrived(now.scan, late.places, self._sure)
        )
