"""Which of what is seen moves, and how: by comparing scans.

A return from a place that scans of some seconds before looked through tells of something that moves there, or that
has just appeared; one from behind a place where something was, of something that draws back, or of what has gone
(`harness.mapping.scan_comparison`). Scans of shortly before tell of what has just come out from behind something, those
of long before of what is slow. The run of returns about it, up to the next step in range and without what stood there
before beside it, is followed from scan to scan: the translation that lays the outline seen first upon the one seen now
(`harness.mapping.scan_matching`) grows in proportion to time where it moves, and not at all where it only appeared.
Assumed: obstacles that move do so without turning, no faster than `MOST_MPS`.

Where ranges err much (`is_free`), what comes to a place that was ever seen to be free is told at once, as the map
takes long to. A parabola is laid through its returns before it is followed; it is followed from more of them
as it comes into view.

Points are complex: east + i north, m.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from harness.mapping import followed_outline
from harness.mapping.earlier_scans import FACE_SHARE, EarlierScans, Look
from harness.mapping.followed_outline import FollowedOutline, bow, extent_m
from harness.mapping.scan import RangeScan, supported
from harness.mapping.scan_comparison import extend, in_a_row, joined, looked_through, near_any, runs_of
from harness.mapping.scan_matching import FEWEST, STIFF, STIFF_IN_NOISE, Outline, ends_of, means, register
from planner.interface import BoolArray, ComplexArray, FloatArray, IntArray, MovingEdges

NO_PLACES = np.zeros((0, 2))  # no trail
DECIDED_S = 5.0  # no outline followed for less than this time is decided to move or to stand
UNDECIDED_S = 30.0  # an outline that is not known to move after this time is taken to stand still
LOST_S = 2.0  # an outline not known to move is dropped once it has not been seen for this time
COASTS_S = 15.0  # an obstacle known to move is taken to move on for this time after it was last seen
NEW_OUTLINE_S = 12.0  # an outline is compared with one of the same obstacle that is at most this old
GROWN_FACTOR = 1.3
"""A new outline replaces the one followed if it shows this many times as much of the obstacle."""
SLANT = 4.0
"""Neighbouring returns of one face lie at most this many times as far apart as on a face across the beams."""
LATELY_S = 5.0
"""An edge that has stood for this time does not belong to an obstacle that has just come into view."""
NEAR_SIGMAS = 1.5
"""A hit within this many standard deviations of range noise of an outline stays a candidate in every matching round."""
BENT_FACTOR = 14.0
"""This times noise over spacing, to the power 2/3, is how many points a mean needs lest a straight face look bent."""
NARROW_SIGMAS = 4.0
"""A run of hits narrower than this many standard deviations of range noise is joined by all hits about it."""
MEDIAN_SIGMAS = 0.5
"""Neighbouring medians of ranges, which share returns, differ by less than this many standard deviations of noise."""
FACE_GAPS = 1.5
"""Another face of a moving obstacle is looked for within this many times the gap at which runs of returns break."""


class MovingObstacles:
    """Finds and follows what moves.

    In a still world this costs a look at one scan every few seconds; ranges of others are not read.

    Args:
        clearance_m: wanted distance from obstacles; runs of returns break where they are further apart.
        false_returns: the sensor is known to return ranges where nothing is.
        is_free: tells which of (k, 2) places were surely seen to be free. With it, what comes there is told from all
            that was ever seen, in every scan, and is found at once, standing until it is known to move.
    """

    def __init__(
        self,
        clearance_m: float,
        noise_m: float,
        false_returns: bool = True,
        is_free: Callable[[FloatArray], BoolArray] | None = None,
        stands: Callable[..., BoolArray] | None = None,
    ) -> None:
        self._noise, self._false_returns = noise_m, false_returns
        self._is_free, self._stands = is_free, stands
        self._clearance = clearance_m
        self._apart = clearance_m + 6.0 * noise_m
        self._sure = 4.0 * noise_m + 0.02 * clearance_m
        exact, flawed = noise_m == 0.0, noise_m > 0.0 or false_returns
        self._earlier = EarlierScans(clearance_m, self._sure, exact=exact, flawed=flawed)
        self._gate = max(0.5 * clearance_m, 3.0 * noise_m)
        self._tracks: list[FollowedOutline] = []
        self._new: list[FollowedOutline] = []
        self._time_s = 0.0

    @property
    def follows(self) -> bool:
        """Whether any outline is followed, which may move."""
        return len(self._tracks) > 0

    @property
    def found(self) -> tuple[MovingEdges, ...]:
        """Obstacles known to move, or just appeared, as they were at the time of the last scan."""
        return tuple(
            MovingEdges(
                self._time_s,
                _pairs(track.shown_at(self._time_s)),
                (track.velocity.real, track.velocity.imag) if track.moves else (0.0, 0.0),
            )
            for track in self._tracks
            if track.moves or self._is_free
        )

    @property
    def trail_m(self) -> FloatArray:
        """(k, 2) earlier places, about a gate apart, of obstacles that the last scan showed to move; mostly none."""
        if not self._new:
            return NO_PLACES
        step_s = [self._gate / max(abs(track.velocity), followed_outline.LEAST_MPS) for track in self._new]
        compared_s = 0.0 if self._is_free else self._earlier.compared_s
        past = [
            track.at(time_s).points
            for track, step in zip(self._new, step_s, strict=True)
            for time_s in np.arange(self._time_s, track.begun_s - compared_s - step, -step)
        ]
        points = _pairs(np.concatenate(past))
        return points[np.unique(np.floor(points / self._gate), axis=0, return_index=True)[1]]

    def update(self, scan: RangeScan) -> BoolArray | None:
        """Takes in one scan; returns (n,) which of its rays met an obstacle that moves, or None where none did."""
        self._time_s = scan.time_s
        self._new = []
        moving = self._follow(scan) if self._tracks else None
        if self._is_free:
            if scan.nearest_m < math.inf:
                self._look_at_free(scan, moving, self._is_free)
        elif self._earlier.due(scan.time_s):
            now = Look(scan.computed(), *self._returns(scan))
            self._follow_new(now, moving)
            self._earlier.keep(now)
        return moving

    def _follow_new(self, now: Look, moving: BoolArray | None) -> None:
        """Begins to follow outlines that have come to places seen through by earlier scans, or have drawn back."""
        if (changed := self._earlier.changed(now)) is None:
            return
        scan, hits, places = now
        if moving is not None:
            changed &= ~moving[hits]
        if np.count_nonzero(changed) < FEWEST:
            return
        for run in runs_of(hits, places, self._step(scan, hits), scan):
            if in_a_row(changed[run]) >= FEWEST:
                self._track_run(scan, changed[run], hits[run], places[run])

    def _track_run(self, scan: RangeScan, changed: BoolArray, hits: IntArray, places: ComplexArray) -> None:
        """Begins to follow what has changed in a run of returns, without what already stood beside it.

        All of a straight face is followed, since one that slides along itself only seems to have stood.
        """
        others = (changed | ~self._earlier.met(places)).nonzero()[0]
        for part in np.split(others, 1 + np.flatnonzero(np.abs(np.diff(places[others])) > self._clearance)):
            some = slice(int(part[0]), int(part[-1]) + 1)
            if in_a_row(changed[some]) < FEWEST or self._is_followed(places[some], scan.time_s):
                continue
            outline = self._outline(scan, hits[some], places[some])
            if not outline.is_definite:
                some = _face(places, some, outline.along, self._earlier.own_m)
                outline = self._outline(scan, hits[some], places[some])
            self._tracks.append(FollowedOutline(outline, scan.time_s))

    def _step(self, scan: RangeScan, hits: IntArray) -> FloatArray:
        """(k,) distances (m) up to which neighbouring returns belong to one face, at the range of each."""
        slanted = SLANT * scan.spacing_rad * scan.ranges_m[hits]
        return np.clip(slanted, FACE_SHARE * self._clearance + 6.0 * self._noise, self._apart)

    def _look_at_free(
        self, scan: RangeScan, moving: BoolArray | None, is_free: Callable[[FloatArray], BoolArray]
    ) -> None:
        """Begins to follow what has come to places that were seen to be free."""
        hits, places = self._not_standing(*self._returns(scan))
        appeared = is_free(_pairs(places))
        if moving is not None:
            appeared &= ~moving[hits]
        if len(rows := appeared.nonzero()[0]) < FEWEST:
            return
        for run in runs_of(hits[rows], places[rows], np.full(len(rows), self._apart), scan):
            if len(run) >= FEWEST and not self._is_followed(places[rows[run]], scan.time_s):
                whole = self._extend(rows[run], hits, places, scan)
                if extent_m(places[whole]) < NARROW_SIGMAS * self._noise:
                    whole = self._near_mean(rows[run], hits, places, scan)
                outline = self._outline(scan, hits[whole], places[whole])
                self._tracks.append(FollowedOutline(outline, scan.time_s))

    def _not_standing(self, hits: IntArray, places: ComplexArray) -> tuple[IntArray, ComplexArray]:
        """Leaves out rays whose return came from where an obstacle has long stood."""
        if not self._stands:
            return hits, places
        others = ~self._stands(_pairs(places))
        return hits[others], places[others]

    def _returns(self, scan: RangeScan) -> tuple[IntArray, ComplexArray]:
        """Returns the rays that returned something, without false returns, and the places of the returns."""
        if not self._false_returns:
            return scan.returned()
        hits = supported(scan, self._apart).nonzero()[0]
        return hits, scan.ends_m(hits)

    def _outline(self, scan: RangeScan, hits: IntArray, places: ComplexArray) -> Outline:
        """Returns the outline of neighbouring returns; a parabola, or means of several, where they err."""
        ends = ends_of(scan, hits, self._apart)
        if self._is_free:
            return Outline(bow(places, FACE_SHARE * self._clearance), ends)
        away = np.abs(places - complex(scan.east_m, scan.north_m)).mean()
        apart_m = max(scan.spacing_rad * float(away), 1e-9)
        several = max(math.ceil(2.0 * self._noise / apart_m), 1)
        points = places
        if several > 1:
            points = np.concatenate((places[:1], means(places, several), places[-1:]))
        straight_of = math.ceil((BENT_FACTOR * self._noise / apart_m) ** (2.0 / 3.0) / several)
        return Outline(points, ends, straight_of)

    def _is_followed(self, places: ComplexArray, time_s: float) -> bool:
        """Tells whether a run of returns is followed already: its middle, or any of it by an outline that moves."""
        middle = places[len(places) // 2 :][:1]
        for track in self._tracks:
            # What comes into view beside something that moves is another face of it.
            of, within_m = (places, FACE_GAPS * self._apart) if track.moves else (middle, self._gate)
            if near_any(of, track.at(time_s).points, within_m).any():
                return True
        return False

    def _follow(self, scan: RangeScan) -> BoolArray | None:
        """Moves all tracks on to a scan; returns which rays met one that moves, or None."""
        hits, places = self._not_standing(*self._returns(scan))
        moving = np.zeros(len(scan.ranges_m), dtype=np.bool_)
        followed: list[FollowedOutline] = []
        for track in self._tracks:
            mine = self._find_again(track, hits, places, scan)
            was_known = track.moves
            if not self._keeps(track, places[mine], scan):
                continue
            followed.append(track)
            if track.moves:
                moving[hits[mine]] = True
                for end in mine[[0, -1]] if len(mine) else ():
                    # Returns just beyond its ends, at a glancing angle, are of it too.
                    moving[hits[np.abs(places - places[end]) < self._gate]] = True
                self._new += [] if was_known else [track]
        self._tracks = followed
        return moving if moving.any() else None

    def _keeps(self, track: FollowedOutline, places: ComplexArray, scan: RangeScan) -> bool:
        """Tells whether to go on following a track; once it is old enough, decides whether it moves."""
        if scan.time_s - track.seen_s > (COASTS_S if track.moves else LOST_S):
            return False
        if (age_s := scan.time_s - track.begun_s) < DECIDED_S:
            return True
        if not track.moves:
            track.moves = track.seems_to_move(self._sure) and self._has_changed(track, places, scan)
        return not (track.surely_stands() or (age_s > UNDECIDED_S and not track.moves))

    def _has_changed(self, track: FollowedOutline, places: ComplexArray, scan: RangeScan) -> bool:
        """Tells whether a track is now where nothing was, or nothing is now where it was.

        Where a corner is rounded, another face comes into view little by little, as if the first one moved.
        """
        if self._is_free:
            return True
        first = track.at(scan.time_s).points - track.moved
        looks = np.count_nonzero(looked_through(scan, first, self._sure)) >= FEWEST
        return bool(looks) or self._earlier.have_appeared(places, FEWEST)

    def _find_again(self, track: FollowedOutline, hits: IntArray, places: ComplexArray, scan: RangeScan) -> IntArray:
        """Finds a track's outline in a scan and notes its shift; returns the indices of its places, if any."""
        is_measured = len(track.shifts) >= followed_outline.FEWEST_SHIFTS
        unknown_mps = 0.0 if is_measured else followed_outline.MOST_MPS
        gate = self._gate + unknown_mps * (scan.time_s - track.outline_s)
        stiff = STIFF_IN_NOISE if self._is_free else STIFF
        some = np.arange(len(places))
        if track.moves and not self._is_free:
            some = self._earlier.of_it(track, places, scan)
        own_hits, own = hits[some], places[some]
        match = register(
            track.at(scan.time_s), (own_hits, own), scan, gate, self._apart, stiff, NEAR_SIGMAS * self._noise
        )
        if match is None:
            return np.zeros(0, dtype=np.intp)
        track.note(scan.time_s, match.shift)
        return some[self._renew(track, match.members, own_hits, own, scan)]

    def _renew(
        self, track: FollowedOutline, mine: IntArray, hits: IntArray, places: ComplexArray, scan: RangeScan
    ) -> IntArray:
        """Returns which returns belong to a track found again, and renews its outline where more of it is seen."""
        track.seen_s = scan.time_s
        shows_all = track.moves and not self._is_free
        whole = self._extend(mine, hits, places, scan) if self._is_free or track.moves else mine
        if self._is_free:
            more = extent_m(places[whole]) > GROWN_FACTOR * extent_m(track.outline.points)
        else:
            more = len(whole) > GROWN_FACTOR * len(mine)
        if more or scan.time_s - track.outline_s > NEW_OUTLINE_S:
            new = whole if more or self._is_free else mine
            track.renew(self._outline(scan, hits[new], places[new]), scan.time_s)
        if shows_all:
            near = joined(places[whole], self._step(scan, hits[whole]))
            track.shown = places[whole][near] if near.any() else None
        return whole if shows_all else mine

    def _extend(self, mine: IntArray, hits: IntArray, places: ComplexArray, scan: RangeScan) -> IntArray:
        """Adds to a track's returns those that go on from their ends, except where something stood before."""
        may = np.ones(len(places), dtype=np.bool_)
        if self._stands:
            may = ~self._stands(_pairs(places), LATELY_S)
            may[mine] = True
        some = may.nonzero()[0]
        step_m = FACE_SHARE * self._clearance + MEDIAN_SIGMAS * self._noise
        return some[extend(np.searchsorted(some, mine), hits[some], places[some], step_m, scan)]

    def _near_mean(self, mine: IntArray, hits: IntArray, places: ComplexArray, scan: RangeScan) -> IntArray:
        """Returns the returns near the mean place of `mine`, clockwise, or `mine` where none is near it."""
        near = (np.abs(places - places[mine].mean()) < self._gate).nonzero()[0]
        if not len(near):
            return mine
        half = len(scan.ranges_m) // 2
        return np.asarray(near[np.argsort((hits[near] - hits[mine[0]] + half) % len(scan.ranges_m))])


def _face(places: ComplexArray, some: slice, along: complex, within_m: float) -> slice:
    """Widens a slice of a run, most of it on a line, by the places that go on from its ends in a direction."""
    off_m = (places * along.conjugate()).imag
    off_m -= np.median(off_m[some])
    bent = (np.abs(off_m) > within_m).nonzero()[0]
    before, after = bent[bent < some.start], bent[bent >= some.stop]
    return slice(int(before[-1]) + 1 if len(before) else 0, int(after[0]) if len(after) else len(places))


def _pairs(points: ComplexArray) -> FloatArray:
    return np.column_stack((points.real, points.imag))
