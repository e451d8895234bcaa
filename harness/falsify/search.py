"""The search for the mildest condition that fails: a scan from the mild end, then bisection.

A condition is a point of the unit cube: how far each key is from its mild end (0) towards its hard end (1). All keys
get harder together, in equal steps, until the first condition fails; bisection narrows that step down. With several
keys each key is then taken back towards its mild end while the condition still fails. A failing range below the answer
that is narrower than a step may have been missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from harness.files.strict_yaml import InputError

Point: TypeAlias = tuple[float, ...]
"""Displacement of each key, from 0 (mild) to 1 (hard)."""

LEAST: Final = 2
"""A search needs at least the two ends of the range."""

Judge: TypeAlias = Callable[[Point], bool]
"""Whether a condition makes the flight fail."""
Snap: TypeAlias = Callable[[Point], Point]


@dataclass(frozen=True)
class Searched:
    """What a search found.

    Attributes:
        verdicts: whether each condition tried failed, in order.
        steps: number of equal steps of the scan.
        settled: whether the answer was narrowed down to the tolerance within the conditions that were allowed.
    """

    verdicts: Mapping[Point, bool]
    steps: int
    settled: bool

    @property
    def mildest(self) -> Point | None:
        """The failing condition whose largest displacement is least; of equal ones, that with the smallest sum."""
        failed = [point for point, failed in self.verdicts.items() if failed]
        return min(failed, key=lambda point: (max(point), sum(point), point), default=None)

    @property
    def passed_below(self) -> Point | None:
        """The hardest condition that passed and is no harder than the mildest failure in any key."""
        found = self.mildest
        below = [
            point
            for point, failed in self.verdicts.items()
            if found is not None and not failed and all(a <= b for a, b in zip(point, found, strict=True))
        ]
        return max(below, key=lambda point: (sum(point), point), default=None)


def search(
    keys: int, judge: Judge, conditions: int, tolerance: float, snap: Snap = lambda point: point
) -> Searched:
    """Looks for the mildest condition that fails.

    Args:
        keys: how many, at least 1.
        judge: tries a condition; called once for each. It raises InputError where there is none: such a condition
            passes while a key is taken back.
        conditions: at most so many are tried, at least LEAST.
        tolerance: a displacement is narrowed down to this.
        snap: the condition that is tried in place of a point, for keys that take whole or round numbers.

    Raises:
        ValueError: too few conditions, or a tolerance that is not between 0 and 1.
    """
    if conditions < LEAST or not 0.0 < tolerance < 1.0:
        raise ValueError(
            f"needs {LEAST} conditions or more and a tolerance between 0 and 1: {conditions}, {tolerance}"
        )
    tries = _Tries(judge, snap, conditions, tolerance)
    steps = _affordable(conditions if keys == 1 else conditions // 2, tolerance)
    failing = next((step for step in range(steps + 1) if tries.fails((step / steps,) * keys)), None)
    if failing:
        tries.narrow((0.0,) * keys, (failing - 1) / steps, failing / steps, range(keys))
        point = Searched(tries.verdicts, steps, True).mildest
        assert point is not None
        for key in sorted(range(keys), key=point.__getitem__, reverse=True) if keys > 1 else ():
            point = tries.taken_back(point, key)
    return Searched(tries.verdicts, steps, tries.settled)


def _affordable(conditions: int, tolerance: float) -> int:
    """The most equal steps of the scan for which the conditions suffice, the bisection of one step included."""
    most = min(conditions - 1, math.ceil(1.0 / tolerance))
    halvings = (max(0, math.ceil(math.log2(1.0 / (steps * tolerance)))) for steps in range(1, most + 1))
    fit = [steps for steps, halved in enumerate(halvings, 1) if steps + 1 + halved <= conditions]
    return max(fit, default=1)


@dataclass
class _Tries:
    """Conditions tried, each once, at most `left` more."""

    judge: Judge
    snap: Snap
    left: int
    tolerance: float
    settled: bool = True
    verdicts: dict[Point, bool] = field(default_factory=dict)

    def fails(self, point: Point) -> bool:
        """Whether a condition fails; one that can no longer be tried counts as passing, and nothing is settled."""
        place = self.snap(point)
        if place not in self.verdicts:
            if not self.left:
                self.settled = False
                return False
            self.left -= 1
            self.verdicts[place] = self.judge(place)
        return self.verdicts[place]

    def narrow(self, base: Point, passes: float, fails: float, keys: range) -> float:
        """Narrows some keys' common displacement down between one that passes and one that fails."""

        def at(displacement: float) -> Point:
            return tuple(displacement if key in keys else each for key, each in enumerate(base))

        while fails - passes > self.tolerance and self.settled:
            middle = 0.5 * (passes + fails)
            if self.snap(at(middle)) in (self.snap(at(passes)), self.snap(at(fails))):
                break
            passes, fails = (passes, middle) if self._fails_if_any(at(middle)) else (middle, fails)
        return fails

    def taken_back(self, point: Point, key: int) -> Point:
        """A condition that fails, one of its keys as near to its mild end as that goes."""
        ends = range(key, key + 1)
        mild = tuple(0.0 if each == key else value for each, value in enumerate(point))
        if point[key] == 0.0 or self._fails_if_any(mild):
            return mild
        least = self.narrow(point, 0.0, point[key], ends)
        return self.snap(tuple(least if each == key else value for each, value in enumerate(point)))

    def _fails_if_any(self, point: Point) -> bool:
        """Whether there is such a condition and it fails."""
        try:
            return self.fails(point)
        except InputError:
            return False
