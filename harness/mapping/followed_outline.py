"""One outline that is followed from scan to scan: where it is, how fast, and whether it is known to move.

Points are complex: east + i north, m.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from harness.mapping.scan_matching import FEWEST, Outline
from planner.interface import ComplexArray, FloatArray

LEAST_MPS = 0.5  # an obstacle slower than this counts as standing still
MOST_MPS = 30.0  # no obstacle is taken to be faster
SURE_SIGMAS = 8.0
"""A speed is known to be above or below a limit if it is this many of its standard errors away."""
VAGUE_MPS = 1.5  # a velocity with a larger standard error than this is not used to predict
FACE_FACTOR = 5.0
"""If only a straight face is seen, it must have come this many times further, across the face, to count as moving."""
HISTORY_S = 40.0  # the velocity is fitted to the shifts of this last time
FEWEST_SHIFTS = 4  # the velocity is fitted to at least this many shifts


@dataclass(eq=False)
class FollowedOutline:
    """One run of returns that is followed."""

    outline: Outline  # as it was at `outline_s`
    outline_s: float
    begun_s: float = field(init=False)  # when it was seen first
    base: complex = 0j  # translation from its first outline to this one
    shifts: deque[tuple[float, complex]] = field(init=False)  # (time, translation) from the first outline on
    velocity: complex = 0j  # east + i north, m/s
    error_mps: float = math.inf  # standard error of it
    seen_s: float = field(init=False)  # when it was last seen
    moves: bool = False  # it is known to
    shown: ComplexArray | None = None  # all that was seen of it at `seen_s`; None: the outline

    def __post_init__(self) -> None:
        self.begun_s = self.seen_s = self.outline_s
        self.shifts = deque([(self.outline_s, self.base)])

    def at(self, time_s: float) -> Outline:
        """Returns the outline where it is at a time."""
        return self.outline.moved(self.velocity * (time_s - self.outline_s))

    def shown_at(self, time_s: float) -> ComplexArray:
        """Returns all points known of it where they are at a time."""
        if self.shown is None:
            return self.at(time_s).points
        return self.shown + self.velocity * (time_s - self.seen_s)

    def note(self, time_s: float, further: complex) -> None:
        """Takes in that the outline was found away from its expected place by the shift `further`."""
        self.shifts.append((time_s, self.base + self.velocity * (time_s - self.outline_s) + further))
        while time_s - self.shifts[0][0] > HISTORY_S:
            self.shifts.popleft()
        if len(self.shifts) >= FEWEST_SHIFTS:
            self._measure()

    def renew(self, outline: Outline, time_s: float) -> None:
        """Replaces the outline by one as it was just found.

        Where the one before showed nothing of shifts along its face, and this one does, only what is found from now on
        tells the velocity.
        """
        if outline.is_definite and not self.outline.is_definite:
            self.shifts, self.error_mps = deque([self.shifts[-1]]), math.inf
        self.outline, self.outline_s, self.base = outline, time_s, self.shifts[-1][1]

    @property
    def moved(self) -> complex:
        """The shift from the first remembered place to the last."""
        return self.shifts[-1][1] - self.shifts[0][1]

    def seems_to_move(self, sure_m: float) -> bool:
        """Tells whether it has moved surely, and further than returns err.

        Of a straight face without both of its ends other parts come into view along it. There only motion across it
        counts, and only if it is far.
        """
        if len(self.shifts) < FEWEST_SHIFTS or self.error_mps >= VAGUE_MPS:
            return False
        moved, velocity, error_mps, further_m = self.moved, self.velocity, self.error_mps, sure_m
        if not self.outline.is_definite:
            back = self.outline.along.conjugate()
            times_s, shifts = self._history()
            _, error_mps = _slope(times_s, (shifts * back).imag)
            moved, velocity, further_m = (moved * back).imag, (velocity * back).imag, FACE_FACTOR * sure_m
        return abs(velocity) >= LEAST_MPS + SURE_SIGMAS * error_mps and abs(moved) > further_m

    def surely_stands(self) -> bool:
        """Tells whether its speed is surely below `LEAST_MPS`."""
        return abs(self.velocity) + SURE_SIGMAS * self.error_mps < LEAST_MPS

    def _measure(self) -> None:
        """Sets the velocity to the slope of the shifts, up to `MOST_MPS`; where that is vague it stays, or is 0."""
        velocity, self.error_mps = _slope(*self._history())
        if self.error_mps > VAGUE_MPS:
            velocity = self.velocity if self.moves else 0j
        # The outline stays where it has been found.
        last_s, last = self.shifts[-1]
        base = last - velocity * (last_s - self.outline_s)
        self.outline, self.base = self.outline.moved(base - self.base), base
        self.velocity = velocity * min(1.0, MOST_MPS / max(abs(velocity), MOST_MPS))

    def _history(self) -> tuple[FloatArray, ComplexArray]:
        """Returns the times (s) at which it was found, and the shifts from its first place."""
        times, shifts = zip(*self.shifts, strict=True)
        return np.array(times), np.array(shifts)


def _slope(times_s: FloatArray, shifts: FloatArray | ComplexArray) -> tuple[complex, float]:
    """Fits a slope over time to shifts by least squares; returns it and its standard error."""
    times = times_s - times_s.mean()
    spread = float((times * times).sum())
    slope = (times * shifts).sum() / spread
    off = shifts - shifts.mean() - slope * times
    return complex(slope), math.sqrt(float((np.abs(off) ** 2).sum()) / (len(off) - 2) / spread)


def extent_m(points: ComplexArray) -> float:
    """Returns the distance between the ends of an outline."""
    return float(abs(points[-1] - points[0]))


def bow(places: ComplexArray, apart_m: float) -> ComplexArray:
    """Fits a parabola to (k,) places and returns points on it, end to end, at most `apart_m` apart."""
    chord = places[-1] - places[0]
    chord /= max(abs(chord), 1e-9)
    turned = (places - places[0]) * chord.conjugate()
    start, end = float(turned.real.min()), float(turned.real.max())
    if end - start < 1e-3 * apart_m:
        return places  # all at one distance along the chord: no curve lies through them
    along = np.linspace(start, end, max(math.ceil((end - start) / apart_m), FEWEST + 1) + 1)
    # With `full`, nothing is said where they are too few for one parabola: the flattest is taken.
    across = np.polyval(np.polyfit(turned.real, turned.imag, 2, full=True)[0], along)
    return np.asarray(places[0] + chord * (along + 1j * across))
