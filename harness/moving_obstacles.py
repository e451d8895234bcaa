"""Which of what is seen moves, and how: by comparing scans.

A return from a place that a scan of some seconds before looked through tells of something that moves there, or that
has just appeared. The run of returns about it is followed from scan to scan: the translation that lays the
outline seen first upon the one seen now (point-to-line registration; Y. Chen and G. Medioni, "Object modelling by
registration of multiple range images", 1992) grows in proportion to time where it moves, and not at all where it
only appeared. Assumed: obstacles that move do so without turning, no faster than `MOST_MPS`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from harness.range_sensor import RangeScan, all_round, clockwise_from
from planner.interface import BoolArray, FloatArray, MovingEdges

ComplexArray = NDArray[np.complex128]

COMPARED_S = 12.0
"""Scans are compared with those taken so long before,"""
SLOW_MPS = 5.0
"""and as much longer as something so slow takes to leave the noise."""
LOOK_EVERY_S = 3.0
FEWEST = 3
"""Neighbouring rays that must tell the same."""
LEAST_MPS = 0.5
"""What is slower than this stands still."""
MOST_MPS = 30.0
DECIDED_S = 5.0
"""Whether something moves is decided after so long at the soonest, and when it is sure."""
SURE = 4.0
"""In standard errors of the velocity."""
UNDECIDED_S = 30.0
"""What cannot be told to move for so long is taken to stand still."""
NEW_OUTLINE_S = 12.0
"""Outlines are compared with one no older than this."""
HISTORY_S = 40.0
"""Velocity is that of so long a time."""
COASTS_S = 15.0
"""What is not seen any more is believed to move on for so long."""
ROUNDS = 3
"""Registrations in a row, each with the nearest points of the one before."""
STRAIGHT = 0.9
"""Cosine of the turn between neighbours: places that bend more than that are no good for registration."""
ENDS = 0.01
"""Along a flat face only its two ends tell a shift: they have this share of the weight of all that lies between."""
STIFF = 1e-4
"""So much holds the shift at the prediction."""


@dataclass
class _Track:
    """One run of returns that is followed.

    Attributes:
        outline: places at `outline_s`, in the order of the rays.
        base: translation from its first outline to this one.
        shifts: (time, translation) from the first outline on.
        velocity: east + i north.
        error_mps: standard error of it.
        seen_s: when it was last seen.
        moves: it is known to.
    """

    outline: ComplexArray
    outline_s: float
    base: complex
    begun_s: float
    shifts: deque[tuple[float, complex]]
    velocity: complex = 0j
    error_mps: float = math.inf
    seen_s: float = -math.inf
    moves: bool = False

    def at(self, time_s: float) -> ComplexArray:
        """Where the outline is at a time."""
        moved: ComplexArray = self.outline + self.velocity * (time_s - self.outline_s)
        return moved


class MovingObstacles:
    """Finds and follows what moves.

    Args:
        clearance_m: wanted distance from obstacles; runs of returns break where they are further apart.
        noise_m: standard deviation of ranges.
    """

    def __init__(self, clearance_m: float, noise_m: float) -> None:
        self._apart = clearance_m + 6.0 * noise_m
        self._sure = 4.0 * noise_m + 0.02 * clearance_m
        self._compared_s = COMPARED_S + self._sure / SLOW_MPS
        self._gate = max(0.5 * clearance_m, 3.0 * noise_m)
        self._before: deque[RangeScan] = deque()
        self._looked_s = -math.inf
        self._tracks: list[_Track] = []
        self._time_s = 0.0

    @property
    def found(self) -> tuple[MovingEdges, ...]:
        """What is known to move, as it was at the time of the last scan."""
        return tuple(
            MovingEdges(self._time_s, _pairs(track.at(self._time_s)), _pair(track.velocity))
            for track in self._tracks
            if track.moves
        )

    def update(self, scan: RangeScan) -> BoolArray | None:
        """Takes in one scan: (n,) which of its rays met something that moves; None where none did."""
        self._time_s = scan.time_s
        moving: BoolArray | None = None
        if self._tracks:
            moving = self._follow(scan)
        if scan.time_s - self._looked_s >= LOOK_EVERY_S:
            self._looked_s = scan.time_s
            self._before.append(scan)
            while len(self._before) > 1 and self._before[1].time_s <= scan.time_s - self._compared_s:
                self._before.popleft()
            self._look(scan, self._before[0], moving)
        return moving

    def _look(self, scan: RangeScan, before: RangeScan, moving: BoolArray | None) -> None:
        """Begins to follow what has come to places that were looked through before."""
        hits = (scan.ranges_m < math.inf).nonzero()[0]
        if not len(hits) or before is scan:
            return
        places = scan.from_sensor_m(hits) + complex(scan.east_m, scan.north_m)
        appeared = _looked_through(before, places, self._sure)
        if moving is not None:
            appeared &= ~moving[hits]
        if np.count_nonzero(appeared) < FEWEST:
            return
        closed = all_round(scan) and hits[0] + len(scan.ranges_m) - hits[-1] <= 2
        for run in _runs(hits, places, self._apart, closed):
            if _in_a_row(appeared[run]) >= FEWEST and not self._is_followed(places[run], scan.time_s):
                shifts = deque([(scan.time_s, 0j)])
                track = _Track(places[run], scan.time_s, 0j, scan.time_s, shifts, seen_s=scan.time_s)
                self._tracks.append(track)

    def _is_followed(self, places: ComplexArray, time_s: float) -> bool:
        middle = places[len(places) // 2]
        return any(np.abs(track.at(time_s) - middle).min() < self._gate for track in self._tracks)

    def _follow(self, scan: RangeScan) -> BoolArray | None:
        """Moves the tracks on; which rays met one that moves."""
        sensor = complex(scan.east_m, scan.north_m)
        hits = (scan.ranges_m < math.inf).nonzero()[0]
        places = scan.from_sensor_m(hits) + sensor
        moving = np.zeros(len(scan.ranges_m), dtype=np.bool_)
        kept: list[_Track] = []
        for track in self._tracks:
            mine = self._register(track, hits, places, scan)
            age = scan.time_s - track.begun_s
            if len(mine) >= FEWEST:
                track.seen_s = scan.time_s
            if scan.time_s - track.seen_s > (COASTS_S if track.moves else 2.0):
                continue
            if age >= DECIDED_S:
                doubt = SURE * track.error_mps
                if abs(track.velocity) + doubt < LEAST_MPS or (age > UNDECIDED_S and not track.moves):
                    continue
                track.moves |= abs(track.velocity) >= LEAST_MPS + doubt
            kept.append(track)
            if track.moves:
                moving[hits[mine]] = True
        self._tracks = kept
        return moving if moving.any() else None

    def _register(
        self, track: _Track, hits: NDArray[np.intp], places: ComplexArray, scan: RangeScan
    ) -> NDArray[np.intp]:
        """Finds the shift of an outline; returns which of the places belong to it."""
        outline, mine = track.at(scan.time_s), np.zeros(0, dtype=np.intp)
        gate = self._gate + (MOST_MPS * 0.5 if len(track.shifts) < 4 else 0.0)
        low_e, high_e = outline.real.min() - gate, outline.real.max() + gate
        low_n, high_n = outline.imag.min() - gate, outline.imag.max() + gate
        near = (
            (places.real > low_e) & (places.real < high_e) & (places.imag > low_n) & (places.imag < high_n)
        ).nonzero()[0]
        if len(near) < FEWEST or len(outline) < FEWEST:
            return mine
        sensor = complex(scan.east_m, scan.north_m)
        ahead = outline[len(outline) // 2] - sensor
        near = near[np.argsort(-np.angle((places[near] - sensor) * ahead.conjugate()))]  # clockwise
        along = np.empty_like(outline)
        along[1:-1] = outline[2:] - outline[:-2]
        along[0], along[-1] = outline[1] - outline[0], outline[-1] - outline[-2]
        along /= np.maximum(np.abs(along), 1e-9)
        straight = np.zeros(len(outline), dtype=np.bool_)
        straight[1:-1] = (along[2:] * along[:-2].conj()).real > STRAIGHT
        reach = 1.5 * float(np.median(np.abs(np.diff(outline)))) + 1e-6
        shift = 0j
        for _ in range(ROUNDS):
            apart = places[near, None] - (outline + shift)
            nearest = np.abs(apart).argmin(axis=1)
            off = apart[np.arange(len(near)), nearest] * along[nearest].conj()  # along + i across
            inside = (np.abs(off.imag) < gate) & (np.abs(off.real) < reach + gate * 0.2)
            inner = inside & straight[nearest] & (np.abs(off.real) < reach)
            if np.count_nonzero(inner) < FEWEST:
                return mine
            normal = 1j * along[nearest[inner]]
            across = off.imag[inner]
            a, b, c = (normal.real**2).sum(), (normal.real * normal.imag).sum(), (normal.imag**2).sum()
            right = (normal * across).sum()
            first, last = places[near[inside][[0, -1]]] - outline[[0, -1]] - shift
            hold, ends = STIFF * (a + c), ENDS * (a + c)
            right += ends * (first + last) - hold * shift
            a, c = a + hold + 2.0 * ends, c + hold + 2.0 * ends
            det = a * c - b * b
            shift += complex(c * right.real - b * right.imag, a * right.imag - b * right.real) / det
        mine = np.asarray(near[inside])
        moved = track.base + track.velocity * (scan.time_s - track.outline_s) + shift
        track.shifts.append((scan.time_s, moved))
        while track.shifts[-1][0] - track.shifts[0][0] > HISTORY_S:
            track.shifts.popleft()
        if scan.time_s - track.outline_s > NEW_OUTLINE_S and len(mine) >= FEWEST:
            track.outline, track.outline_s, track.base = places[mine], scan.time_s, moved
        self._measure(track)
        return mine

    def _measure(self, track: _Track) -> None:
        """Velocity: the slope of the shifts over time."""
        if len(track.shifts) < 4:
            return
        times, shifts = (np.array(each) for each in zip(*track.shifts, strict=True))
        times = times - times.mean()
        velocity = complex((times * shifts).sum() / (times * times).sum())
        # The outline stays where it has been found.
        last_s, last = track.shifts[-1]
        track.outline = track.outline + (last - track.base) - velocity * (last_s - track.outline_s)
        track.base = last - velocity * (last_s - track.outline_s)
        off = shifts - shifts.mean() - velocity * times
        track.error_mps = math.sqrt(float((np.abs(off) ** 2).sum() / (len(off) - 2) / (times * times).sum()))
        track.velocity = velocity if abs(velocity) <= MOST_MPS else velocity * (MOST_MPS / abs(velocity))


def _looked_through(scan: RangeScan, places: ComplexArray, sure_m: float) -> BoolArray:
    """(k,) whether a scan looked through places: with three neighbouring rays, and surely."""
    offsets = places - complex(scan.east_m, scan.north_m)
    distance = np.abs(offsets)
    rays = len(scan.ranges_m)
    bearing = clockwise_from(scan.start_rad, offsets.real.copy(), offsets.imag.copy())
    ray = np.rint(bearing / scan.spacing_rad).astype(np.int64)
    ring = np.concatenate((scan.ranges_m[-1:], scan.ranges_m, scan.ranges_m[:2]))
    beside = np.minimum(np.minimum(ring[:-2], ring[1:-1]), ring[2:])
    through = (beside.take(ray, mode="clip") > distance + sure_m) & (distance + sure_m < scan.max_range_m)
    if not all_round(scan):
        through &= (ray >= 1) & (ray < rays - 1)
    return through


def _runs(
    hits: NDArray[np.intp], places: ComplexArray, apart_m: float, closed: bool
) -> list[NDArray[np.intp]]:
    """Returns of neighbouring rays that lie near to each other, run by run."""
    breaks = ((np.abs(np.diff(places)) > apart_m) | (np.diff(hits) > 2)).nonzero()[0] + 1
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
    return np.column_stack((points.real, points.imag))


def _pair(number: complex) -> tuple[float, float]:
    return number.real, number.imag
