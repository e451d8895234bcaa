"""The search for the mildest condition that fails: pure, seeded, and bounded by a count of conditions.

A condition is a point of the unit cube: each key's displacement from its mild end (0) to its hard end (1). Its
mildness is the largest of them. Three steps:

1. Along the diagonal, where all keys get harder together: both ends, evenly spaced points, then bisection of
   the mildest change from passing to failing. Where every key only makes it harder, no condition milder than
   the one found here fails: a failing point with largest displacement t makes (t, ..., t) fail too.
2. With several keys, each key is taken back towards its mild end while the condition still fails.
3. What is left of the conditions looks for failures that are milder still. With one key the widest gap between
   two conditions below the failure is halved, so that a failing island wider than the last such gap is found;
   with several keys Sobol points fill the cube below it. A failure found here is narrowed down like the first.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from harness.files.strict_yaml import InputError

Point: TypeAlias = tuple[float, ...]
"""Displacement of each key, from 0 (mild) to 1 (hard)."""

STEPS: Final = 8
"""The diagonal is cut into so many parts."""

LEAST: Final = 2
"""Fewer conditions than the two ends of the diagonal make no search."""

DRAWS: Final = 64
"""The search ends after this many Sobol points in a row without a new condition: whole numbers leave no others."""


Judge: TypeAlias = Callable[[Point], bool]
"""Whether a condition makes the flight fail."""
Snap: TypeAlias = Callable[[Point], Point]


@dataclass(frozen=True)
class Searched:
    """What a search found.

    Attributes:
        verdicts: whether each condition tried failed, in order.
        settled: whether steps 1 and 2 were done whole, and each later failure was narrowed down.
        spent: whether every condition that was allowed has been tried.
    """

    verdicts: Mapping[Point, bool]
    settled: bool
    spent: bool

    @property
    def mildest(self) -> Point | None:
        """The mildest condition that failed; of equally mild ones, that with the smallest sum."""
        failed = [point for point, failed in self.verdicts.items() if failed]
        return min(failed, key=lambda point: (max(point), sum(point), point), default=None)

    @property
    def passed_below(self) -> Point | None:
        """The hardest condition that passed and is no harder than the mildest failure in any key."""
        found = self.mildest
        below = [
            point
            for point, failed in self.verdicts.items()
            if found is not None and not failed and _no_harder(point, found)
        ]
        return max(below, key=lambda point: (sum(point), point), default=None)

    @property
    def passed_above(self) -> Point | None:
        """The hardest condition that passed although it is no milder in any key than the mildest failure."""
        found = self.mildest
        above = [passed for failed, passed in self.not_monotone if failed == found]
        return max(above, key=lambda point: (sum(point), point), default=None)

    @property
    def milder(self) -> int:
        """How many conditions milder than the mildest failure were tried, all of which passed."""
        found = self.mildest
        edge = math.inf if found is None else max(found)
        return sum(max(point) < edge for point in self.verdicts)

    @property
    def widest_gap(self) -> tuple[float, float] | None:
        """With one key, the widest gap between two conditions that were tried, up to the mildest failure."""
        gaps = _gaps(self.verdicts, self.mildest) if all(len(point) == 1 for point in self.verdicts) else []
        return max(gaps, key=lambda gap: (gap[1] - gap[0], gap), default=None)

    @property
    def not_monotone(self) -> tuple[tuple[Point, Point], ...]:
        """Pairs of a condition that failed and one that passed although it is no milder in any key."""
        failed = [point for point, failed in self.verdicts.items() if failed]
        passed = [point for point, failed in self.verdicts.items() if not failed]
        return tuple(pair for pair in itertools.product(failed, passed) if _no_harder(*pair))


def search(
    keys: int, judge: Judge, conditions: int, tolerance: float, seed: int, snap: Snap = lambda point: point
) -> Searched:
    """Looks for the mildest condition that fails.

    Args:
        keys: how many, at least 1.
        judge: tries a condition; called once for each. Where there is none it raises InputError: after step 1
            such a place is passed over.
        conditions: at most so many are tried, at least LEAST.
        tolerance: a displacement is narrowed down to this.
        seed: of the Sobol points.
        snap: the condition that is tried in place of a point, for keys that take whole or round numbers.

    Raises:
        ValueError: too few conditions, or a tolerance that is not between 0 and 1.
    """
    if conditions < LEAST or not 0.0 < tolerance < 1.0:
        raise ValueError(
            f"needs {LEAST} conditions or more and a tolerance between 0 and 1: {conditions}, {tolerance}"
        )
    tries = _Tries(judge, snap, conditions)
    with suppress(_SpentError):
        reached = _along_the_diagonal(keys, tries, tolerance)
        tries.off_the_diagonal = True
        if keys == 1 or reached == 0.0:
            tries.settled = True
            _between_what_passed(tries, tolerance)
        else:
            _taken_back(tries, tolerance)
            tries.settled = True
            _in_the_cube_below(keys, tries, tolerance, seed)
    return Searched(tries.verdicts, tries.settled, tries.left == 0)


class _SpentError(Exception):
    """All conditions have been tried."""


class _Tries:
    """What has been tried, each condition once."""

    def __init__(self, judge: Judge, snap: Snap, conditions: int) -> None:
        self._judge, self._snap = judge, snap
        self._none: set[Point] = set()
        self.left = conditions
        self.settled = False
        """As in `Searched`, so far."""
        self.off_the_diagonal = False
        """Set after step 1. From then on a place where there is no scenario is passed over; before it is an error."""
        self.verdicts: dict[Point, bool] = {}

    def snapped(self, point: Point) -> Point:
        return self._snap(point)

    def untried(self, points: Iterable[Point]) -> set[Point]:
        """The new conditions among some points."""
        return {self._snap(point) for point in points} - self.verdicts.keys() - self._none

    def fails(self, point: Point) -> bool:
        """Whether a condition fails, tried if it is new; raises _SpentError where that is one too many."""
        place = self._snap(point)
        if place not in self.verdicts:
            if self.left == 0:
                raise _SpentError
            if place in self._none:
                return False
            try:
                failed = self._judge(place)
            except InputError:
                if not self.off_the_diagonal:
                    raise
                self._none.add(place)
                return False
            self.left -= 1
            self.verdicts[place] = failed
        return self.verdicts[place]

    def mildest(self) -> Point | None:
        return Searched(self.verdicts, True, False).mildest

    @contextmanager
    def narrowing(self) -> Iterator[None]:
        """A failure is being narrowed down: until that has ended the search is not settled."""
        before, self.settled = self.settled, False
        yield
        self.settled = before


def _along_the_diagonal(keys: int, tries: _Tries, tolerance: float) -> float:
    """Where on the diagonal it fails first: 0 at its mild end, infinity if nowhere."""

    def fails(along: float) -> bool:
        return tries.fails((along,) * keys)

    if fails(0.0):
        return 0.0
    hard, reached = fails(1.0), math.inf
    # Where the conditions are too few for eighths, coarser steps leave some to bisect with; what is left after
    # that goes into the eighths.
    for steps in dict.fromkeys((_affordable(keys, tries), STEPS)):
        inner = [step / steps for step in range(1, steps)]
        failed = [along for along in inner if fails(along)] + [1.0] * hard
        if failed:
            reached = _bisected(
                tries, (0.0,) * keys, failed[0] - 1.0 / steps, failed[0], tolerance, range(keys)
            )
    return reached


def _affordable(keys: int, tries: _Tries) -> int:
    """The most steps, halved from STEPS down, for which there are conditions enough."""
    steps = STEPS
    while len(tries.untried((step / steps,) * keys for step in range(1, steps))) > tries.left:
        steps //= 2
    return steps


def _bisected(
    tries: _Tries, base: Point, passes: float, fails: float, tolerance: float, keys: range
) -> float:
    """Narrows some keys' common displacement down between one that passes and one that fails."""

    def at(displacement: float) -> Point:
        return tuple(displacement if key in keys else each for key, each in enumerate(base))

    while fails - passes > tolerance:
        middle = 0.5 * (passes + fails)
        if tries.snapped(at(middle)) in (tries.snapped(at(passes)), tries.snapped(at(fails))):
            break
        if tries.fails(at(middle)):
            fails = middle
        else:
            passes = middle
    return fails


def _taken_back(tries: _Tries, tolerance: float) -> None:
    """Takes each key back towards its mild end while it still fails, until none gives way by the tolerance."""
    point = tries.mildest()
    for rounds in itertools.count():
        before = point
        if before is None:
            return
        for key in sorted(range(len(before)), key=lambda each: -before[each]):
            assert point is not None
            milder = tries.snapped(_with(point, key, max(0.0, point[key] - tolerance)))
            if rounds == 0:
                point = _least(tries, point, key, tolerance)
            elif milder != point and tries.fails(milder):
                point = _least(tries, milder, key, tolerance)
        if rounds > 0 and point == before:
            return


def _least(tries: _Tries, point: Point, key: int, tolerance: float) -> Point:
    """A condition that fails, one of its keys taken back as far as that goes."""
    mild = tries.snapped(_with(point, key, 0.0))
    if mild == point or tries.fails(mild):
        return mild
    least = _bisected(tries, point, 0.0, point[key], tolerance, range(key, key + 1))
    return tries.snapped(_with(point, key, least))


def _between_what_passed(tries: _Tries, tolerance: float) -> None:
    """One key: halves the widest gap up to the mildest failure, until none is wider than the tolerance."""
    while True:
        gaps = [
            (low, high)
            for low, high in _gaps(tries.verdicts, tries.mildest())
            if high - low > tolerance and tries.untried([(0.5 * (low + high),)])
        ]
        if not gaps:
            return
        low, high = max(gaps, key=lambda gap: (gap[1] - gap[0], gap))
        middle = 0.5 * (low + high)
        if tries.fails((middle,)):
            with tries.narrowing():
                _bisected(tries, (0.0,), low, middle, tolerance, range(1))


def _gaps(verdicts: Iterable[Point], found: Point | None) -> list[tuple[float, float]]:
    """With one key, what lies between neighbouring conditions up to the mildest failure."""
    places = sorted(point[0] for point in verdicts if found is None or point <= found)
    return list(itertools.pairwise(places))


def _in_the_cube_below(keys: int, tries: _Tries, tolerance: float, seed: int) -> None:
    """Several keys: Sobol points in the cube below the mildest failure, until no new condition is left."""
    from scipy.stats import qmc

    points = qmc.Sobol(keys, rng=np.random.default_rng([seed, keys]))
    in_vain = 0
    while in_vain < DRAWS:
        found = tries.mildest()
        edge = 1.0 if found is None else max(found) - tolerance
        if edge <= 0.0:
            return
        point = tuple(float(each) for each in edge * points.random(1)[0])
        in_vain = 0 if tries.untried([point]) else in_vain + 1
        if tries.fails(point):
            with tries.narrowing():
                _taken_back(tries, tolerance)


def _with(point: Point, key: int, displacement: float) -> Point:
    return tuple(displacement if each == key else value for each, value in enumerate(point))


def _no_harder(first: Point, second: Point) -> bool:
    return all(ours <= theirs for ours, theirs in zip(first, second, strict=True))
