"""The search for the mildest condition that fails: a scan from the mild end, then bisection.

All keys get harder together, in equal steps from their mild ends, until the first condition fails; bisection narrows
that step down. With several keys each key is then taken back towards its mild end while the condition still fails. A
failing range below the answer that is narrower than a step may have been missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from harness.files.strict_yaml import InputError

Values: TypeAlias = tuple[float, ...]
"""A condition: the value of each key."""

LEAST: Final = 2
"""A search needs at least the two ends of the range."""


@dataclass(frozen=True)
class Vary:
    """A key to be varied.

    Attributes:
        hard: its hard end; below `mild` where smaller is harder.
        decimals: places after the point to which a value between the ends is rounded before it is flown.
    """

    key: str
    mild: float
    hard: float
    whole: bool = False
    decimals: int = 15

    def value(self, displacement: float) -> float:
        """Its value at a displacement from 0 (mild) to 1 (hard)."""
        if displacement in (0.0, 1.0):
            return self.hard if displacement else self.mild
        value = self.mild + displacement * (self.hard - self.mild)
        return round(value) if self.whole else round(value, self.decimals)

    def displacement(self, value: float) -> float:
        """How far a value is on the way from the mild end to the hard one."""
        return (value - self.mild) / (self.hard - self.mild)


@dataclass
class Search:
    """Conditions tried, each once.

    Attributes:
        judge: whether a condition fails. It raises InputError where there is none: such a condition passes while a key
            is taken back.
        left: how many more may be tried, at least `LEAST` at the beginning.
        tolerance: a displacement is narrowed down to this.
        settled: whether the answer was narrowed down to the tolerance within the conditions that were allowed.
        verdicts: whether each condition tried failed, in order.
    """

    vary: Sequence[Vary]
    judge: Callable[[Values], bool]
    left: int
    tolerance: float
    steps: int = 1
    settled: bool = True
    verdicts: dict[Values, bool] = field(default_factory=dict)

    def run(self) -> Search:
        """Looks for the mildest condition that fails.

        Raises:
            ValueError: too few conditions, or a tolerance that is not between 0 and 1.
        """
        if self.left < LEAST or not 0.0 < self.tolerance < 1.0:
            raise ValueError(
                f"needs {LEAST} conditions or more and a tolerance between 0 and 1: {self.left}, {self.tolerance}"
            )
        steps = self.steps = self._affordable(self.left if len(self.vary) == 1 else self.left // 2)
        failing = next((step for step in range(steps + 1) if self._fails(self.at(step / steps))), None)
        if failing:
            self._narrowed(self.at, (failing - 1) / steps, failing / steps)
            found = self.mildest
            assert found is not None
            order = sorted(range(len(self.vary)), key=self.hardness(found).__getitem__, reverse=True)
            for key in order if len(order) > 1 else ():
                found = self._taken_back(found, key)
        return self

    def at(self, displacement: float) -> Values:
        """The condition with all keys at a displacement."""
        return tuple(each.value(displacement) for each in self.vary)

    def hardness(self, values: Values) -> tuple[float, ...]:
        """Displacement of each key, from 0 (mild) to 1 (hard)."""
        return tuple(each.displacement(value) for each, value in zip(self.vary, values, strict=True))

    @property
    def mildest(self) -> Values | None:
        """The failing condition whose largest displacement is least; of equal ones, that with the smallest sum."""
        failed = [values for values, failed in self.verdicts.items() if failed]
        return min(
            failed, key=lambda each: (max(self.hardness(each)), sum(self.hardness(each))), default=None
        )

    @property
    def passed_below(self) -> Values | None:
        """The hardest condition that passed and is no harder than the mildest failure in any key."""
        if (found := self.mildest) is None:
            return None
        limits = self.hardness(found)
        passed = [values for values, failed in self.verdicts.items() if not failed]
        below = [
            each for each in passed if all(a <= b for a, b in zip(self.hardness(each), limits, strict=True))
        ]
        return max(below, key=lambda each: sum(self.hardness(each)), default=None)

    def _affordable(self, conditions: int) -> int:
        """The most equal steps of the scan for which the conditions suffice, the bisection of one step included."""
        most = min(conditions - 1, math.ceil(1.0 / self.tolerance))
        halved = {steps: math.ceil(-math.log2(steps * self.tolerance)) for steps in range(1, most + 1)}
        return max((steps for steps in halved if steps + 1 + max(0, halved[steps]) <= conditions), default=1)

    def _fails(self, values: Values) -> bool:
        """Whether a condition fails; one that can no longer be tried counts as passing, and nothing is settled."""
        if values not in self.verdicts:
            if not self.left:
                self.settled = False
                return False
            self.left -= 1
            self.verdicts[values] = self.judge(values)
        return self.verdicts[values]

    def _narrowed(self, at: Callable[[float], Values], passes: float, fails: float) -> Values:
        """The mildest failing condition on a way, between a displacement that passes and one that fails."""
        while fails - passes > self.tolerance and self.settled:
            middle = 0.5 * (passes + fails)
            if at(middle) in (at(passes), at(fails)):
                break
            passes, fails = (passes, middle) if self._fails_if_any(at(middle)) else (middle, fails)
        return at(fails)

    def _taken_back(self, values: Values, key: int) -> Values:
        """A condition that fails, one of its keys as near to its mild end as that goes."""

        def at(displacement: float) -> Values:
            return (*values[:key], self.vary[key].value(displacement), *values[key + 1 :])

        hardness = self.hardness(values)[key]
        if hardness == 0.0 or self._fails_if_any(at(0.0)):
            return at(0.0)
        return self._narrowed(at, 0.0, hardness)

    def _fails_if_any(self, values: Values) -> bool:
        """Whether there is such a condition and it fails."""
        try:
            return self._fails(values)
        except InputError:
            return False
