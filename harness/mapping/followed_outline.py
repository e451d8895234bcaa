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

LEAST_MPS = 0.5
"""What is slower than this stands still."""
MOST_MPS = 30.0
SURE = 8.0
"""A speed is known to be above or below a limit when it is so many of its standard errors away from it."""
VAGUE_MPS = 1.5
"""With a velocity that errs more than this it is not told where a thing will be."""
FAR = 5.0
"""Something of which only a straight face is seen moves when it has come so many times as far across it as another
has to."""
HISTORY_S = 40.0
"""Velocity is that of so long a time."""
FEWEST_SHIFTS = 4
"""Velocity is told by so many at least."""


@dataclass(eq=False)
class FollowedOutline:
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
        shown: all that was seen of it at `seen_s`; None: the outline.
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
    shown: ComplexArray | None = None

    def __post_init__(self) -> None:
        self.begun_s = self.seen_s = self.outline_s
        self.shifts = deque([(self.outline_s, self.base)])

    def at(self, time_s: float) -> Outline:
        """The outline where it is at a time."""
        return self.outline.moved(self.velocity * (time_s - self.outline_s))

    def shown_at(self, time_s: float) -> ComplexArray:
        """All that is known of it, where it is at a time."""
        if self.shown is None:
            return self.at(time_s).points
        return self.shown + self.velocity * (time_s - self.seen_s)

    def note(self, time_s: float, further: complex) -> None:
        """Takes in that the outline was found elsewhere than expected by a shift."""
        moved = self.base + self.velocity * (time_s - self.outline_s) + further
        self.shifts.append((time_s, moved))
        while time_s - self.shifts[0][0] > HISTORY_S:
            self.shifts.popleft()
        if len(self.shifts) >= FEWEST_SHIFTS:
            self._measure()

    def renew(self, outline: Outline, time_s: float) -> None:
        """Goes on with an outline as it was just found.

        Where the one before told nothing of shifts along its face, and this one does, only what is found from now on
        tells the velocity.
        """
        if outline.is_definite and not self.outline.is_definite:
            self.shifts, self.error_mps = deque([self.shifts[-1]]), math.inf
        self.outline, self.outline_s, self.base = outline, time_s, self.shifts[-1][1]

    @property
    def moved(self) -> complex:
        """How far it was found from where it was first, of what is remembered of it."""
        return self.shifts[-1][1] - self.shifts[0][1]

    def seems_to_move(self, sure_m: float) -> bool:
        """Whether it was found to move: surely, and further than returns err.

        Of a straight face without both of its ends other parts come into view along it: there only motion across
        it tells, and by far.
        """
        if len(self.shifts) < FEWEST_SHIFTS or self.error_mps >= VAGUE_MPS:
            return False
        moved, velocity, error_mps, further_m = self.moved, self.velocity, self.error_mps, sure_m
        if not self.outline.is_definite:
            back = self.outline.along.conjugate()
            times_s, shifts = self._remembered()
            _, error_mps = _slope(times_s, (shifts * back).imag)
            moved, velocity, further_m = (moved * back).imag, (velocity * back).imag, FAR * sure_m
        return abs(velocity) >= LEAST_MPS + SURE * error_mps and abs(moved) > further_m

    def surely_stands(self) -> bool:
        """Whether its velocity is surely too little."""
        return abs(self.velocity) + SURE * self.error_mps < LEAST_MPS

    def _measure(self) -> None:
        """Velocity: the slope of the shifts over time."""
        velocity, self.error_mps = _slope(*self._remembered())
        if self.error_mps > VAGUE_MPS:
            velocity = self.velocity if self.moves else 0j
        # The outline stays where it has been found.
        last_s, last = self.shifts[-1]
        base = last - velocity * (last_s - self.outline_s)
        self.outline, self.base = self.outline.moved(base - self.base), base
        self.velocity = velocity * min(1.0, MOST_MPS / max(abs(velocity), MOST_MPS))

    def _remembered(self) -> tuple[FloatArray, ComplexArray]:
        """When it was found, s, and how far from where it was first."""
        times, shifts = zip(*self.shifts, strict=True)
        return np.array(times), np.array(shifts)


def _slope(times_s: FloatArray, shifts: FloatArray | ComplexArray) -> tuple[complex, float]:
    """The slope of some shifts over time, by least squares, and its standard error."""
    times = times_s - times_s.mean()
    spread = float((times * times).sum())
    slope = (times * shifts).sum() / spread
    off = shifts - shifts.mean() - slope * times
    return complex(slope), math.sqrt(float((np.abs(off) ** 2).sum()) / (len(off) - 2) / spread)


def extent_m(points: ComplexArray) -> float:
    """How far the ends of an outline lie apart."""
    return float(abs(points[-1] - points[0]))


def bow(places: ComplexArray, apart_m: float) -> ComplexArray:
    """The parabola that suits (k,) places best, from end to end: points no further apart than some distance."""
    chord = places[-1] - places[0]
    chord /= max(abs(chord), 1e-9)
    turned = (places - places[0]) * chord.conjugate()
    start, end = float(turned.real.min()), float(turned.real.max())
    if end - start < 1e-3 * apart_m:
        return places  # all at one distance along the chord: no curve lies through them
    along = np.linspace(start, end, max(math.ceil((end - start) / apart_m), FEWEST + 1) + 1)
    # With `full`, nothing is said where they are too few for one parabola: the flattest is taken.
    across = np.polyval(np.polyfit(turned.real, turned.imag, 2, full=True)[0], along)
    bow: ComplexArray = places[0] + chord * (along + 1j * across)
    return bow
