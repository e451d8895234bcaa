"""Which of what is seen moves, and how: by comparing scans.

A return from a place that two scans of some seconds before looked through tells of something that moves there, or that
has just appeared. The run of returns about it is followed from scan to scan: the translation that lays the
outline seen first upon the one seen now (`harness.registration`) grows in proportion to time where it moves, and not
at all where it only appeared. Assumed: obstacles that move do so without turning, no faster than `MOST_MPS`. What
draws straight back from the sensor comes to no place that was looked through: it is left to the map, where it fades.

Where ranges err much (`is_free`), what comes to a place that was ever seen to be free is told at once, as the map
takes long to. A parabola is laid through its returns before it is followed; it is followed from more of them
as it comes into view.

Points are complex: east + i north, m.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.range_sensor import RangeScan, all_round, clockwise_from, supported
from harness.registration import (
    FEWEST,
    STIFF,
    STIFF_IN_NOISE,
    Outline,
    ends_of,
    register,
)
from planner.interface import BoolArray, ComplexArray, FloatArray, IntArray, MovingEdges

COMPARED_S = 12.0
"""Scans are compared with those taken so long before,"""
SLOW_MPS = 5.0
"""and as much longer as something so slow takes to leave the noise."""
NOWHERE = np.zeros((0, 2))
LOOK_EVERY_S = 3.0
LOOK_EVERY = 0.6
"""What has come in is looked for that often, or as often as the fastest moves on by this share of the clearance."""
MISSING = 3
"""A run of returns goes on where no more of them in a row are lost."""
ABREAST = 2
"""A place was looked through if so many rays to either side went further, too: one or two may be lost returns."""
LEAST_MPS = 0.5
"""What is slower than this stands still."""
MOST_MPS = 30.0
DECIDED_S = 5.0
"""Whether something moves is decided after so long at the soonest, and when it is sure."""
SURE = 4.0
"""In standard errors of the velocity."""
VAGUE_MPS = 1.5
"""With a velocity that errs more than this it is not told where a thing will be."""
UNDECIDED_S = 30.0
"""What cannot be told to move for so long is taken to stand still."""
LOST_S = 2.0
"""What may move and is not seen for so long is not followed any more."""
COASTS_S = 15.0
"""What is known to move is believed to move on for so long."""
NEW_OUTLINE_S = 12.0
"""Outlines are compared with one no older than this."""
GROWN = 1.3
"""What comes out from behind something is compared with a new outline whenever it has grown by so much."""
NO_STEP = 0.25
"""Share of the clearance: returns of neighbouring rays that lie nearer to each other are of one thing."""
HISTORY_S = 40.0
"""Velocity is that of so long a time."""
FEWEST_SHIFTS = 4
"""Velocity is told by so many at least."""


@dataclass(eq=False)
class _Track:
    """One run of returns that is followed.

    Attributes:
        outline: as it was at `outline_s`.
        begun_s: when it was seen first.
        base: translation from its first outline to this one.
        shifts: (time, translation) from the first outline on.
        velocity: east + i north, m/s.
        error_mps: standard error of it.
        seen_s: when it was last seen.
        moves: it is known to.
    """

    outline: Outline
    outline_s: float
    begun_s: float = field(init=False)
    base: complex = 0j
    shifts: deque[tuple[float, complex]] = field(init=False)
    velocity: complex = 0j
    error_mps: float = math.inf
    seen_s: float = field(init=False)
    moves: bool = False

    def __post_init__(self) -> None:
        self.begun_s = self.seen_s = self.outline_s
        self.shifts = deque([(self.outline_s, self.base)])

    def at(self, time_s: float) -> Outline:
        """The outline where it is at a time."""
        return self.outline.moved(self.velocity * (time_s - self.outline_s))

    def note(self, time_s: float, further: complex) -> None:
        """Takes in that the outline was found elsewhere than expected by a shift."""
        moved = self.base + self.velocity * (time_s - self.outline_s) + further
        self.shifts.append((time_s, moved))
        while time_s - self.shifts[0][0] > HISTORY_S:
            self.shifts.popleft()
        if len(self.shifts) >= FEWEST_SHIFTS:
            self._measure()

    def renew(self, outline: Outline, time_s: float) -> None:
        """Goes on with an outline as it was just found."""
        self.outline, self.outline_s, self.base = outline, time_s, self.shifts[-1][1]

    def decide(self, sure_m: float) -> None:
        """Decides whether it moves: surely, and further than returns err."""
        moved_m = abs(self.shifts[-1][1] - self.shifts[0][1])
        sure = self.error_mps < VAGUE_MPS and abs(self.velocity) >= LEAST_MPS + SURE * self.error_mps
        self.moves = self.moves or (sure and moved_m > sure_m)

    def surely_stands(self) -> bool:
        """Whether its velocity is surely too little."""
        return abs(self.velocity) + SURE * self.error_mps < LEAST_MPS

    def _measure(self) -> None:
        """Velocity: the slope of the shifts over time."""
        times, shifts = (np.array(each) for each in zip(*self.shifts, strict=True))
        times = times - times.mean()
        spread = float((times * times).sum())
        velocity = complex((times * shifts).sum() / spread)
        off = shifts - shifts.mean() - velocity * times
        self.error_mps = math.sqrt(float((np.abs(off) ** 2).sum()) / (len(off) - 2) / spread)
        if self.error_mps > VAGUE_MPS:
            velocity = 0j
        # The outline stays where it has been found.
        last_s, last = self.shifts[-1]
        base = last - velocity * (last_s - self.outline_s)
        self.outline, self.base = self.outline.moved(base - self.base), base
        self.velocity = velocity * min(1.0, MOST_MPS / max(abs(velocity), MOST_MPS))


class MovingObstacles:
    """Finds and follows what moves.

    In a still world this costs a look at one scan every few seconds; ranges of others are not read.

    Args:
        clearance_m: wanted distance from obstacles; runs of returns break where they are further apart.
        noise_m: standard deviation of ranges.
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
    ) -> None:
        self._noise, self._false_returns, self._is_free = noise_m, false_returns, is_free
        self._clearance = clearance_m
        self._apart = clearance_m + 6.0 * noise_m
        self._sure = 4.0 * noise_m + 0.02 * clearance_m
        self._compared_s = 0.0 if is_free else COMPARED_S + self._sure / SLOW_MPS
        self._gate = max(0.5 * clearance_m, 3.0 * noise_m)
        self._before: deque[RangeScan] = deque()
        self._look_every_s = max(LOOK_EVERY_S, LOOK_EVERY * clearance_m / MOST_MPS)
        self._looked_s = -math.inf
        self._tracks: list[_Track] = []
        self._new: list[_Track] = []
        self._time_s = 0.0

    @property
    def found(self) -> tuple[MovingEdges, ...]:
        """What is known to move, or has just appeared, as it was at the time of the last scan."""
        if not self._tracks:
            return ()
        return tuple(
            MovingEdges(
                self._time_s,
                _pairs(track.at(self._time_s).points),
                (track.velocity.real, track.velocity.imag) if track.moves else (0.0, 0.0),
            )
            for track in self._tracks
            if track.moves or self._is_free
        )

    @property
    def trail_m(self) -> FloatArray:
        """(k, 2) places, one a gate, where what the last scan showed to move was before; mostly none."""
        if not self._new:
            return NOWHERE
        step_s = [self._gate / max(abs(track.velocity), LEAST_MPS) for track in self._new]
        past = [
            track.at(time_s).points
            for track, step in zip(self._new, step_s, strict=True)
            for time_s in np.arange(self._time_s, track.begun_s - self._compared_s - step, -step)
        ]
        points = _pairs(np.concatenate(past))
        return points[np.unique(np.floor(points / self._gate), axis=0, return_index=True)[1]]

    def update(self, scan: RangeScan) -> BoolArray | None:
        """Takes in one scan: (n,) which of its rays met something that moves; None where none did."""
        self._time_s = scan.time_s
        self._new = []
        moving = self._follow(scan) if self._tracks else None
        if self._is_free:
            if scan.nearest_m < math.inf:
                self._look_at_free(scan, moving, self._is_free)
        elif scan.time_s - self._looked_s >= self._look_every_s:
            self._looked_s = scan.time_s
            while len(self._before) > 2 and self._before[1].time_s <= scan.time_s - self._compared_s:
                self._before.popleft()
            if len(self._before) >= 2 and scan.nearest_m < math.inf:
                self._look(scan, moving)
            self._before.append(scan.kept())
        return moving

    def _look(self, scan: RangeScan, moving: BoolArray | None) -> None:
        """Begins to follow what has come to places that were looked through before."""
        hits = self._returned(scan)
        # Of as many in a row as it takes one is among these.
        sample = hits[::FEWEST]
        if not len(sample) or not _looked_through(self._before[0], scan.ends_m(sample), self._sure).any():
            return
        places = scan.ends_m(hits)
        appeared = np.ones(len(hits), dtype=np.bool_) if moving is None else ~moving[hits]
        for before in (self._before[0], self._before[1]):
            appeared[appeared] = _looked_through(before, places[appeared], self._sure)
        if np.count_nonzero(appeared) < FEWEST:
            return
        closed = all_round(scan) and hits[0] + len(scan.ranges_m) - hits[-1] <= 2
        for run in _runs(hits, places, self._apart, closed):
            if _in_a_row(appeared[run]) >= FEWEST and not self._is_followed(places[run], scan.time_s):
                self._tracks.append(_Track(self._outline(scan, hits[run], places[run]), scan.time_s))

    def _look_at_free(
        self, scan: RangeScan, moving: BoolArray | None, is_free: Callable[[FloatArray], BoolArray]
    ) -> None:
        """Begins to follow what has come to places that were seen to be free."""
        hits = self._returned(scan)
        places = scan.ends_m(hits)
        appeared = is_free(_pairs(places))
        if moving is not None:
            appeared &= ~moving[hits]
        hits, places = hits[appeared], places[appeared]
        if len(hits) < FEWEST:
            return
        closed = all_round(scan) and hits[0] + len(scan.ranges_m) - hits[-1] <= 2
        for run in _runs(hits, places, self._apart, closed):
            if len(run) >= FEWEST and not self._is_followed(places[run], scan.time_s):
                self._tracks.append(_Track(self._outline(scan, hits[run], places[run]), scan.time_s))

    def _returned(self, scan: RangeScan) -> IntArray:
        """Rays that returned something, but for false returns."""
        returned = supported(scan, self._apart) if self._false_returns else scan.ranges_m < math.inf
        hits: IntArray = returned.nonzero()[0]
        return hits

    def _outline(self, scan: RangeScan, hits: IntArray, places: ComplexArray) -> Outline:
        """The outline that neighbouring returns show: where they lie closer than they err, means of several."""
        if self._is_free:
            return Outline(
                _bow(places, NO_STEP * self._clearance),
                ends_of(scan, int(hits[0]), int(hits[-1]), self._apart),
            )
        away = np.abs(places - complex(scan.east_m, scan.north_m)).mean()
        several = math.ceil(2.0 * self._noise / max(scan.spacing_rad * float(away), 1e-9))
        points = places
        if several > 1:
            first = np.arange(0, len(places), several)
            means = np.add.reduceat(places, first) / np.diff(np.append(first, len(places)))
            points = np.concatenate((places[:1], means, places[-1:]))
        return Outline(points, ends_of(scan, int(hits[0]), int(hits[-1]), self._apart))

    def _is_followed(self, places: ComplexArray, time_s: float) -> bool:
        middle = places[len(places) // 2]
        return any(np.abs(track.at(time_s).points - middle).min() < self._gate for track in self._tracks)

    def _follow(self, scan: RangeScan) -> BoolArray | None:
        """Moves the tracks on; which rays met one that moves."""
        hits = self._returned(scan)
        places = scan.ends_m(hits)
        moving = np.zeros(len(scan.ranges_m), dtype=np.bool_)
        kept: list[_Track] = []
        for track in self._tracks:
            mine = self._found_again(track, hits, places, scan)
            if scan.time_s - track.seen_s > (COASTS_S if track.moves else LOST_S):
                continue
            age_s, known = scan.time_s - track.begun_s, track.moves
            if age_s >= DECIDED_S:
                track.decide(self._sure)
                if track.surely_stands() or (age_s > UNDECIDED_S and not track.moves):
                    continue
            kept.append(track)
            if track.moves:
                moving[hits[mine]] = True
                for end in mine[[0, -1]] if len(mine) else ():
                    # What is seen at a glance beyond its ends is its, too.
                    moving[hits[np.abs(places - places[end]) < self._gate]] = True
                self._new += [] if known else [track]
        self._tracks = kept
        return moving if moving.any() else None

    def _found_again(self, track: _Track, hits: IntArray, places: ComplexArray, scan: RangeScan) -> IntArray:
        """Finds an outline in a scan; which of the places belong to it."""
        unknown_mps = 0.0 if len(track.shifts) >= FEWEST_SHIFTS else MOST_MPS
        gate = self._gate + unknown_mps * (scan.time_s - track.seen_s)
        stiff = STIFF_IN_NOISE if self._is_free else STIFF
        laid = register(track.at(scan.time_s), hits, places, scan, gate, self._apart, stiff)
        if laid is None:
            return np.zeros(0, dtype=np.intp)
        track.note(scan.time_s, laid.shift)
        mine = laid.members
        if len(mine) >= FEWEST:
            track.seen_s = scan.time_s
            whole = self._grown(mine, hits, places) if self._is_free else mine
            more = _extent(places[whole]) > GROWN * _extent(track.outline.points)
            if scan.time_s - track.outline_s > NEW_OUTLINE_S or (self._is_free and more):
                track.renew(self._outline(scan, hits[whole], places[whole]), scan.time_s)
        return mine

    def _grown(self, mine: IntArray, hits: IntArray, places: ComplexArray) -> IntArray:
        """Returns that belong to an outline, and those that go on from its ends without a step."""
        near = (np.diff(hits) <= MISSING + 1) & (np.abs(np.diff(places)) < NO_STEP * self._clearance)
        first, last = int(mine[0]), int(mine[-1])
        if first > last:
            return mine  # it lies behind, where the fan begins and ends
        while first > 0 and near[first - 1]:
            first -= 1
        while last < len(hits) - 1 and near[last]:
            last += 1
        return np.arange(first, last + 1)


def _extent(points: ComplexArray) -> float:
    """How far the ends of an outline lie apart."""
    return float(abs(points[-1] - points[0]))


def _bow(places: ComplexArray, apart_m: float) -> ComplexArray:
    """The parabola that suits (k,) places best, from end to end: points no further apart than some distance."""
    chord = places[-1] - places[0]
    chord /= max(abs(chord), 1e-9)
    turned = (places - places[0]) * chord.conjugate()
    start, end = float(turned.real.min()), float(turned.real.max())
    if end - start < 1e-3 * apart_m:
        return places  # all at one distance along the chord: no curve lies through them
    along = np.linspace(start, end, max(math.ceil((end - start) / apart_m), FEWEST + 1) + 1)
    across = np.polyval(np.polyfit(turned.real, turned.imag, 2), along)
    bow: ComplexArray = places[0] + chord * (along + 1j * across)
    return bow


def _looked_through(scan: RangeScan, places: ComplexArray, sure_m: float) -> BoolArray:
    """(k,) whether a scan looked through places, surely: with the ray towards each and two to either side."""
    offsets = places - complex(scan.east_m, scan.north_m)
    distance = np.abs(offsets)
    rays = len(scan.ranges_m)
    bearing = clockwise_from(scan.start_rad, offsets.real.copy(), offsets.imag.copy())
    ray = np.rint(bearing / scan.spacing_rad).astype(np.int64)
    beyond = np.minimum(scan.least_beside_m(ABREAST).take(ray, mode="wrap"), scan.max_range_m)
    through: BoolArray = beyond > distance + sure_m
    if not all_round(scan):
        through &= (ray >= ABREAST) & (ray < rays - ABREAST)
    return through


def _runs(hits: IntArray, places: ComplexArray, apart_m: float, closed: bool) -> list[IntArray]:
    """Returns of neighbouring rays that lie near to each other, run by run."""
    breaks = ((np.abs(np.diff(places)) > apart_m) | (np.diff(hits) > MISSING + 1)).nonzero()[0] + 1
    runs = np.split(np.arange(len(hits)), breaks)
    if closed and len(runs) > 1 and abs(places[-1] - places[0]) <= apart_m:
        runs = [np.concatenate((runs[-1], runs[0])), *runs[1:-1]]
    return runs


def _in_a_row(flags: Sequence[bool] | BoolArray) -> int:
    """The longest row of true ones."""
    longest = row = 0
    for flag in flags:
        row = row + 1 if flag else 0
        longest = max(longest, row)
    return longest


def _pairs(points: ComplexArray) -> FloatArray:
    """(k, 2) east and north of points."""
    return np.column_stack((points.real, points.imag))
