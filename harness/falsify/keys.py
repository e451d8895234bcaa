"""The keys that a search for the breaking point varies: their ranges, and the scenario under a condition."""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from harness.campaign.sampling import takes_whole_numbers
from harness.falsify.search import Point
from harness.files.strict_yaml import InputError, as_spelt, loc_of
from harness.scenario.scenario import Scenario

MAX_KEYS: Final = 6
"""At most this many keys are varied at once: every combination of their ends is made before the search."""

Load: TypeAlias = Callable[[Sequence[tuple[str, str]]], Scenario]
"""Makes the scenario with keys replaced, as `harness.scenario.scenario.load_scenario` takes them."""


@dataclass(frozen=True)
class Vary:
    """A key to be varied.

    Attributes:
        key: its path.
        mild: its mild end.
        hard: its hard end; below `mild` where smaller is harder.
        whole: whether it takes whole numbers alone.
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

    def snapped(self, displacement: float) -> float:
        """The displacement of the value that is flown."""
        if displacement in (0.0, 1.0):
            return displacement
        return (self.value(displacement) - self.mild) / (self.hard - self.mild)


def vary_of(
    load: Load, given: Sequence[tuple[str, float, float]], fixed: Sequence[str] = (), tolerance: float = 0.01
) -> tuple[Vary, ...]:
    """The keys to vary, once every combination of their ends has been found to be a scenario.

        load: makes the scenario.
        given: key path, mild end and hard end of each.
        fixed: paths of keys that have been given a value.
        tolerance: a displacement is narrowed down to this share of its range; values are flown rounded to a
            hundredth of that, so that what is printed is what was flown.

    Raises:
        InputError: too many keys, one twice, with a value or without a range, or an end that makes no scenario.
    """
    if len(given) > MAX_KEYS:
        raise InputError(
            f"command line: --vary is given {len(given)} times; at most {MAX_KEYS} keys are varied"
        )
    given = [(_spelt("--vary", key), mild, hard) for key, mild, hard in given]
    valued = {_spelt("--set", key) for key in fixed}
    for number, (key, mild, hard) in enumerate(given):
        if key == "seed":
            raise InputError("command line: --vary seed: a seed is no condition; --seeds flies several")
        if key in [other for other, _, _ in given[:number]]:
            raise InputError(f"command line: --vary {key}: is given twice; give one range")
        if key in valued:
            raise InputError(
                f"command line: {key} is given a value, and a range with --vary; give one of them"
            )
        if mild == hard:
            raise InputError(
                f"command line: --vary {key}: both ends are {mild:g}; give two, as {key}=0:{mild or 1:g}"
            )
    load([(key, number_text(mild)) for key, mild, _ in given])
    vary = tuple(
        Vary(
            key, mild, hard, takes_whole_numbers(loc_of(key)), _decimals(abs(hard - mild) * tolerance / 100.0)
        )
        for key, mild, hard in given
    )
    diagonal = [(step / 8,) * len(vary) for step in range(9)]
    for point in dict.fromkeys([*itertools.product((0.0, 1.0), repeat=len(vary)), *diagonal]):
        scenario_at(load, vary, point)
    return vary


def scenario_at(load: Load, vary: Sequence[Vary], point: Point) -> Scenario:
    """The scenario under a condition.

    Raises:
        InputError: there is none.
    """
    return load([(each.key, number_text(each.value(place))) for each, place in zip(vary, point, strict=True)])


def _spelt(option: str, key: str) -> str:
    try:
        return as_spelt(key)
    except ValueError as error:
        raise InputError(f"command line: {option}: {error}") from error


def number_text(value: float) -> str:
    """A number as YAML, a whole one without a point; it reads back the same bit for bit."""
    return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(value)


def _decimals(step: float) -> int:
    """Places after the point of the largest power of ten that is no larger than a step."""
    return -math.floor(math.log10(max(step, sys.float_info.min)))
