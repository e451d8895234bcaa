"""The search for the mildest condition that fails: a scan from the mild end, then bisection.

A condition is a point of the unit cube: how far each key is from its mild end (0) towards its hard end (1). All keys
get harder together, in equal steps, until the first condition fails; bisection narrows that step down. With several
keys each key is then taken back towards its mild end while the condition still fails. A failing range below the answer
that is narrower than a step may have been missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from harness.files.strict_yaml import InputError

Point: TypeAlias = tuple[float, ...]
"""Displacement of each key, from 0 (mild) to 1 (hard)."""

LEAST: Final = 2
"""A search needs at least the two ends of the range."""


@dataclass
class Search:
    """Conditions tried, each once.

    Attributes:
        judge: whether a condition fails. It raises InputError where there is none: such a condition passes while a key
            is taken back.
        left: how many more may be tried, at least `LEAST` at the beginning.
        tolerance: a displacement is narrowed down to this.
        snap: the condition that is tried in place of a point, for keys that take whole or round numbers.
        steps: number of equal steps of the scan.
        settled: whether the answer was narrowed down to the tolerance within the conditions that were allowed.
        verdicts: whether each condition tried failed, in order.
    """

    judge: Callable[[Point], bool]
    left: int
    tolerance: float
    snap: Callable[[Point], Point] = lambda point: point
    steps: int = 1
    settled: bool = True
    verdicts: dict[Point, bool] = field(default_factory=dict)

    def run(self, keys: int) -> Search:
        """Looks for the mildest condition of some keys that fails.

        Raises:
            ValueError: too few conditions, or a tolerance that is not between 0 and 1.
        """
        if self.left < LEAST or not 0.0 < self.tolerance < 1.0:
            raise ValueError(
                f"needs {LEAST} conditions or more and a tolerance between 0 and 1: {self.left}, {self.tolerance}"
            )
        steps = self.steps = self._affordable(self.left if keys == 1 else self.left // 2)
        failing = next((step for step in range(steps + 1) if self._fails((step / steps,) * keys)), None)
        if failing:
            every = range(keys)
            self._narrowed((0.0,) * keys, (failing - 1) / steps, failing / steps, every)
            point = self.mildest
            assert point is not None
            for key in sorted(every, key=point.__getitem__, reverse=True) if keys > 1 else ():
                point = self._taken_back(point, key)
        return self

    @property
    def mildest(self) -> Point | None:
        """The failing condition whose largest displacement is least; of equal ones, that with the smallest sum."""
        failed = [point for point, failed in self.verdicts.items() if failed]
        return min(failed, key=lambda point: (max(point), sum(point), point), default=None)

    @property
    def passed_below(self) -> Point | None:
        """The hardest condition that passed and is no harder than the mildest failure in any key."""
        found = self.mildest or ()
        passed = [point for point, failed in self.verdicts.items() if found and not failed]
        below = [point for point in passed if all(a <= b for a, b in zip(point, found, strict=True))]
        return max(below, key=lambda point: (sum(point), point), default=None)

    def _affordable(self, conditions: int) -> int:
        """The most equal steps of the scan for which the conditions suffice, the bisection of one step included."""
        most = min(conditions - 1, math.ceil(1.0 / self.tolerance))
        halved = {
            steps: max(0, math.ceil(-math.log2(steps * self.tolerance))) for steps in range(1, most + 1)
        }
        return max((steps for steps in halved if steps + 1 + halved[steps] <= conditions), default=1)

    def _fails(self, point: Point) -> bool:
        """Whether a condition fails; one that can no longer be tried counts as passing, and nothing is settled."""
        place = self.snap(point)
        if place not in self.verdicts:
            if not self.left:
                self.settled = False
                return False
            self.left -= 1
            self.verdicts[place] = self.judge(place)
        return self.verdicts[place]

    def _narrowed(self, base: Point, passes: float, fails: float, keys: range) -> Point:
        """Narrows some keys' common displacement down between one that passes and one that fails."""

        def at(displacement: float) -> Point:
            return self.snap(tuple(displacement if key in keys else each for key, each in enumerate(base)))

        while fails - passes > self.tolerance and self.settled:
            middle = 0.5 * (passes + fails)
            if at(middle) in (at(passes), at(fails)):
                break
            passes, fails = (passes, middle) if self._fails_if_any(at(middle)) else (middle, fails)
        return at(fails)

    def _taken_back(self, point: Point, key: int) -> Point:
        """A condition that fails, one of its keys as near to its mild end as that goes."""
        mild = (*point[:key], 0.0, *point[key + 1 :])
        if point[key] == 0.0 or self._fails_if_any(mild):
            return mild
        return self._narrowed(point, 0.0, point[key], range(key, key + 1))

    def _fails_if_any(self, point: Point) -> bool:
        """Whether there is such a condition and it fails."""
        try:
            return self._fails(point)
        except InputError:
            return False
