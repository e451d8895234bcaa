"""The breaking point: flies a scenario under ever harder conditions until the mildest is known that makes it fail.

All keys get harder together, in equal steps, until a condition fails; bisection narrows that step down. With several
keys each is then taken back towards its mild end while the condition still fails. A failing range below the answer that
is narrower than a step may have been missed. When the search ends `falsify.json` is written, with every flight, and
where something failed `falsified.yaml`, the whole scenario that does.
"""

from __future__ import annotations

import itertools
import json
import math
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from aircraft.airframes import AircraftError
from harness.analysis.metric import Claim, holds
from harness.campaign.folder import claim_folder
from harness.campaign.sampling import takes_whole_numbers
from harness.files.errors import WriteError, sentence
from harness.files.strict_yaml import InputError, as_spelt, loc_of
from harness.files.whole_file import replace_text
from harness.run.scenario_flight import fly_and_measure
from harness.scenario.scenario import Scenario, dump_scenario

SCHEMA: Final = "wayproof/falsify/3"
INDEX: Final = "falsify.json"
FALSIFIED: Final = "falsified.yaml"
MAX_KEYS: Final = 6
"""At most this many keys are varied at once: every combination of their ends is made before the search."""
FIGURES: Final = (
    *("outcome", "reason", "trackable", "min_clearance_m", "flown_length_m", "flight_time_s", "digest"),
)
"""Figures of `metrics.json` that are kept of every flight."""

Load: TypeAlias = Callable[[Sequence[tuple[str, str]]], Scenario]
"""Makes the scenario with keys replaced, as `harness.scenario.scenario.load_scenario` takes them."""
Values: TypeAlias = tuple[float, ...]
"""A condition: the value of each key."""


@dataclass(frozen=True)
class Vary:
    """A key varied from its mild end to its hard one; values between are rounded to so many places before a flight."""

    key: str
    mild: float
    hard: float
    whole: bool = False
    decimals: int = 15

    def value(self, displacement: float) -> float:
        """Its value at a displacement from 0 (mild) to 1 (hard)."""
        if displacement in (0.0, 1.0):
            return self.hard if displacement else self.mild
        return round(
            self.mild + displacement * (self.hard - self.mild), None if self.whole else self.decimals
        )

    def displacement(self, value: float) -> float:
        """How far a value is on the way from the mild end to the hard one."""
        return (value - self.mild) / (self.hard - self.mild)


@dataclass
class Search:
    """Conditions tried, each once."""

    vary: Sequence[Vary]
    judge: Callable[[Values], bool]
    """Whether a condition fails; an InputError, where there is none, passes while a key is taken back."""
    left: int
    """How many more may be tried, at least 2 at the beginning."""
    tolerance: float
    """A displacement is narrowed down to this, above 0 and below 1."""
    steps: int = 1
    """Number of equal steps of the scan."""
    settled: bool = True
    """Whether the conditions sufficed to narrow the answer down."""
    verdicts: dict[Values, bool] = field(default_factory=dict)

    def run(self) -> Search:
        """Looks for the mildest condition that fails."""
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
        by_hardness = {self.hardness(each): each for each, failed in self.verdicts.items() if failed}
        least = min(by_hardness, key=lambda each: (max(each), sum(each)), default=None)
        return None if least is None else by_hardness[least]

    @property
    def passed_below(self) -> Values | None:
        """The hardest condition that passed and is no harder than the mildest failure in any key."""
        if (found := self.mildest) is None:
            return None
        limits = self.hardness(found)
        by_hardness = {self.hardness(each): each for each, failed in self.verdicts.items() if not failed}
        below = [key for key in by_hardness if all(a <= b for a, b in zip(key, limits, strict=True))]
        return by_hardness[max(below, key=sum)] if below else None

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


@dataclass(frozen=True)
class Trial:
    """One flight: the displacement of each key from 0 (mild) to 1 (hard), and `FIGURES`; `error` is a crash."""

    displacement: tuple[float, ...]
    values: Values
    failed: bool
    figures: Mapping[str, Any]


@dataclass(frozen=True)
class Breaking:
    """What was found. A flight fails where the claim does not hold of it; `steps`, `settled`: those of `Search`."""

    scenario: str
    planner: str
    aircraft: str
    seed: int
    claim: Claim
    vary: tuple[Vary, ...]
    tolerance: float
    conditions: int
    steps: int
    settled: bool
    verdict: Literal["found", "not_found", "fails_at_the_mild_end"]
    found: Trial | None
    passes: Values | None
    """The hardest condition that passed and is no harder in any key."""
    trials: tuple[Trial, ...]

    def plain(self) -> dict[str, Any]:
        """The content of `falsify.json`."""
        command = shlex.join(["wayproof", *sys.argv[1:]])
        return {"schema": SCHEMA, "complete": True, "command": command, **asdict(self)}


def vary_of(
    load: Load, given: Sequence[tuple[str, float, float]], fixed: Sequence[str] = (), tolerance: float = 0.01
) -> tuple[Vary, ...]:
    """The keys to vary, once every combination of their ends has been found to be a scenario; or an InputError.

    `given`: key path, mild end and hard end of each; `fixed`: keys that are given a value.
    `tolerance`: values are flown rounded to a hundredth of this share of a range, so that what is printed was flown.
    """
    if len(given) > MAX_KEYS:
        raise InputError(
            f"command line: --vary is given {len(given)} times; at most {MAX_KEYS} keys are varied"
        )
    valued = [_spelt("--set", each) for each in fixed]
    ranges: dict[str, tuple[float, float]] = {}
    for name, mild, hard in given:
        key = _spelt("--vary", name)
        faults = {
            "a seed is no condition; --seed gives another": key == "seed",
            "is given twice; give one range": key in ranges,
            "is given a value too, with --set; give one of them": key in valued,
            f"both ends are {mild:g}; give two, as {key}=0:{mild or 1:g}": mild == hard,
        }
        if fault := next(filter(faults.get, faults), None):
            raise InputError(f"command line: --vary {key}: {fault}")
        ranges[key] = mild, hard
    base = load([(key, number_text(mild)) for key, (mild, _) in ranges.items()])
    vary = tuple(
        Vary(key, mild, hard, takes_whole_numbers(base, loc_of(key)), _decimals(abs(hard - mild) * tolerance))
        for key, (mild, hard) in ranges.items()
    )
    ends = itertools.product(*((each.mild, each.hard) for each in vary))
    diagonal = (tuple(each.value(step / 8) for each in vary) for step in range(9))
    for values in dict.fromkeys([*ends, *diagonal]):
        scenario_at(load, vary, values)
    return vary


def scenario_at(load: Load, vary: Sequence[Vary], values: Values) -> Scenario:
    """The scenario under a condition; an InputError where there is none."""
    return load([(each.key, number_text(value)) for each, value in zip(vary, values, strict=True)])


def _spelt(option: str, key: str) -> str:
    try:
        return as_spelt(key)
    except ValueError as error:
        raise InputError(f"command line: {option}: {error}") from error


def number_text(value: float) -> str:
    """A number as YAML, a whole one without a point; it reads back the same bit for bit."""
    return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(value)


def _decimals(resolution: float) -> int:
    """Places after the point of the largest power of ten that is no larger than a hundredth of a resolution."""
    return -math.floor(math.log10(max(resolution / 100.0, sys.float_info.min)))


def falsify(
    load: Load,
    vary: Sequence[Vary],
    out: Path,
    *,
    flown: Callable[[Scenario], Mapping[str, Any]] = fly_and_measure,
    claim: Claim = "reached",
    conditions: int = 40,
    tolerance: float = 0.01,
    progress: Callable[[int, int, str], None] | None = None,
) -> Breaking:
    """Searches, and writes the folder; `progress` is told after each flight how many of how many, and its end.

    An InputError: a condition is no scenario, or cannot be flown; the folder is as it was. A RunFolderError: the folder
    holds something else, or another process writes to it. A WriteError: it cannot be written.
    """
    trials: dict[Values, Trial] = {}

    def judge(values: Values) -> bool:
        scenario = scenario_at(load, vary, values)
        try:
            figures = flown(scenario)
        except AircraftError as error:  # a crash is a failure, an aircraft that cannot begin a flight is not
            raise InputError(f"wayproof: cannot fly this condition: {error}") from error
        except Exception as error:
            figures = {"outcome": "error", "reason": sentence(error), "trackable": None}
        kept = {name: figures.get(name) for name in FIGURES}
        trials[values] = trial = Trial(search.hardness(values), values, not holds(claim, figures), kept)
        if progress is not None:
            told = ", ".join(f"{value:.4g}" for value in values)
            progress(len(trials), conditions, f"{told}: {figures['outcome']}")
        return trial.failed

    search = Search(vary, judge, conditions, tolerance)
    base = scenario_at(load, vary, search.at(0.0))
    made = [each for each in (out, *out.parents) if not each.exists()]
    lock = claim_folder(out, "search", INDEX, SCHEMA)
    try:
        mildest = search.run().mildest
        found = trials[mildest] if mildest else None
        hard = found is not None and max(found.displacement) > 0.0
        result = Breaking(
            base.name,
            base.planner.label,
            Path(base.aircraft.model).name,
            base.seed,
            claim,
            tuple(vary),
            tolerance,
            len(trials),
            search.steps,
            search.settled,
            "found" if hard else "not_found" if found is None else "fails_at_the_mild_end",
            found,
            search.passed_below,
            tuple(trials.values()),
        )
        _write(out, result.plain(), scenario_at(load, vary, mildest) if mildest else None)
    except KeyboardInterrupt:
        if trials:
            done = [asdict(each) for each in trials.values()]
            _write(out, {"schema": SCHEMA, "complete": False, "trials": done}, None)
        raise
    finally:
        lock.release()
        with suppress(OSError):  # a folder that holds anything stays
            for each in made:
                each.rmdir()
    return result


def _write(out: Path, result: Mapping[str, Any], failing: Scenario | None) -> None:
    """Replaces an earlier search, all of which goes; what fails comes before the index that names it."""
    try:
        (out / FALSIFIED).unlink(missing_ok=True)
        if failing is not None:
            replace_text(out / FALSIFIED, dump_scenario(failing))
        replace_text(out / INDEX, json.dumps(result, indent=2, allow_nan=False) + "\n")
    except OSError as error:
        raise WriteError(f"cannot write the search in {out}: {error.strerror or error}") from error
