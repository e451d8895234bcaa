"""The breaking point: flies a scenario under ever harder conditions until the mildest is known that makes it fail.

All keys get harder together, in equal steps, until a condition fails; bisection narrows that step down. A failing range
below the answer that is narrower than a step may have been missed. When the search ends `falsify.json` is written, with
every flight, and where something failed `falsified.yaml`, the whole scenario that does.
"""

from __future__ import annotations

import json
import math
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from aircraft.airframes import AircraftError
from harness.analysis.metric import Claim, holds
from harness.campaign.sampling import as_flown, takes_whole_numbers
from harness.files.errors import WriteError, sentence
from harness.files.folder_lock import claim_folder
from harness.files.strict_yaml import InputError, as_spelt, loc_of
from harness.files.whole_file import replace_text
from harness.run.scenario_flight import fly_and_measure
from harness.scenario.scenario import Scenario, dump_scenario

SCHEMA: Final = "wayproof/falsify/4"
INDEX: Final = "falsify.json"
FALSIFIED: Final = "falsified.yaml"
ROUNDING: Final = 1e-9  # a range wider than the tolerance by this share is none: 1 - 0.99 is not quite 0.01
FIGURES = ("outcome", "reason", "trackable", "min_clearance_m", "flown_length_m", "flight_time_s", "digest")
"""Figures of `metrics.json` that are kept of every flight."""
Load: TypeAlias = Callable[[Sequence[tuple[str, str]]], Scenario]
"""Makes the scenario with keys replaced, as `harness.scenario.scenario.load_scenario` takes them."""
Found: TypeAlias = Literal["found", "not_found", "fails_at_the_mild_end"]
Values: TypeAlias = tuple[float, ...]  # a condition: the value of each key


@dataclass(frozen=True)
class Vary:
    """A key varied from its mild end to its hard one; values between are rounded to `decimals` places."""

    key: str
    mild: float
    hard: float
    whole: bool = False
    decimals: int = 15

    def value(self, displacement: float) -> float:
        """Its value at a displacement from 0 (mild) to 1 (hard); a direction beyond north from 0 to 360."""
        if displacement in (0.0, 1.0):
            return as_flown(self.key, self.hard if displacement else self.mild)
        between = as_flown(self.key, self.mild + displacement * (self.hard - self.mild))
        return round(between, None if self.whole else self.decimals)


class Search:
    """Looks for the least displacement that fails, from 0 (mild) to 1 (hard).

    Args:
        at: the condition at a displacement; equal ones are tried once.
        judge: tells whether a condition fails.
        most: how many conditions may be tried, at least 2.
        tolerance: to what share of each range, in (0, 1), the answer is found.
    """

    def __init__(
        self, at: Callable[[float], Values], judge: Callable[[Values], bool], most: int, tolerance: float
    ) -> None:
        self._at, self._judge, self._most, self._tolerance = at, judge, most, tolerance
        self._failed: dict[Values, bool] = {}
        self.steps = self._affordable_steps()
        self.settled = True  # whether the conditions sufficed to narrow the answer down
        self.passes: float | None = None
        self.fails: float | None = None
        """`passes` is the greatest displacement known to pass below `fails`, the least known to fail."""

    def run(self) -> Search:
        """Scans in equal steps from the mild end, and halves the step at whose end a condition fails."""
        for step in range(self.steps + 1):
            if self._fails(step / self.steps):
                self.fails = step / self.steps
                break
            self.passes = step / self.steps
        if self.fails is not None and self.passes is not None:
            self._bisect(self.passes, self.fails)
        return self

    def _bisect(self, passes: float, fails: float) -> None:
        while fails - passes > (1.0 + ROUNDING) * self._tolerance:
            middle = 0.5 * (passes + fails)
            if self._at(middle) in (self._at(passes), self._at(fails)):
                break
            if len(self._failed) == self._most:
                self.settled = False
                break
            passes, fails = (passes, middle) if self._fails(middle) else (middle, fails)
        self.passes, self.fails = passes, fails

    def _affordable_steps(self) -> int:
        """The most equal steps of the scan for which the conditions suffice, the bisection of one step included."""
        most = min(self._most - 1, math.ceil(1.0 / self._tolerance))
        halved = {steps: math.ceil(-math.log2(steps * self._tolerance)) for steps in range(1, most + 1)}
        return max((steps for steps in halved if steps + 1 + max(0, halved[steps]) <= self._most), default=1)

    def _fails(self, displacement: float) -> bool:
        if (values := self._at(displacement)) not in self._failed:
            self._failed[values] = self._judge(values)
        return self._failed[values]


@dataclass(frozen=True)
class Trial:
    """One flight: the value of each key, and `FIGURES`; the outcome `error` is a crash."""

    values: Values
    failed: bool
    figures: Mapping[str, Any]


@dataclass(frozen=True)
class Breaking:
    """The result of a search, with its terms. A flight of which the claim does not hold fails; see also `Search`."""

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
    verdict: Found
    displacement: float | None
    """Displacement of the mildest failure, from the mild end (0) to the hard one (1); None: nothing failed."""
    found: Trial | None
    passes: Values | None  # the hardest condition below it that passed
    trials: tuple[Trial, ...]

    def plain(self) -> dict[str, Any]:
        """The content of `falsify.json`."""
        command = shlex.join(["wayproof", *sys.argv[1:]])
        return {"schema": SCHEMA, "complete": True, "command": command, **asdict(self)}


def vary_of(load: Load, given: Sequence[tuple[str, float, float]], tolerance: float = 0.01) -> tuple[Vary, ...]:
    """Returns the keys to vary, having checked that nine conditions from end to end are scenarios; or an InputError.

    `given`: key path, mild end and hard end of each.
    `tolerance`: values are flown rounded to a hundredth of this share of a range, so that what is printed was flown.
    """
    ranges: dict[str, tuple[float, float]] = {}
    for name, mild, hard in given:
        try:
            key = as_spelt(name)
        except ValueError as error:
            raise InputError(f"command line: --vary: {error}") from error
        faults = {
            "a seed is no condition; --seed gives another": key == "seed",
            "is given twice; give one range": key in ranges,
            f"both ends are {mild:g}; give two, as {key}=0:{mild or 1:g}": mild == hard,
        }
        if fault := next(filter(faults.get, faults), None):
            raise InputError(f"command line: --vary {key}: {fault}")
        ranges[key] = mild, hard
    base = load([(key, number_text(as_flown(key, mild))) for key, (mild, _) in ranges.items()])
    vary = tuple(
        Vary(key, mild, hard, takes_whole_numbers(base, loc_of(key)), _decimals(abs(hard - mild) * tolerance))
        for key, (mild, hard) in ranges.items()
    )
    for step in (8, *range(8)):
        scenario_at(load, vary, condition(vary, step / 8))
    return vary


def condition(vary: Sequence[Vary], displacement: float) -> Values:
    """The condition with all keys at a displacement from 0 (mild) to 1 (hard)."""
    return tuple(each.value(displacement) for each in vary)


def scenario_at(load: Load, vary: Sequence[Vary], values: Values) -> Scenario:
    """The scenario under a condition; an InputError where there is none."""
    return load([(each.key, number_text(value)) for each, value in zip(vary, values, strict=True)])


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
    """Searches, and writes the folder; `progress` is called after each flight: its number, of how many, how it ended.

    How many `conditions` may be tried, and the `tolerance`, are as of `Search`.

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
        shown = {name: figures.get(name) for name in FIGURES}
        trials[values] = trial = Trial(values, not holds(claim, figures), shown)
        if progress is not None:
            text = ", ".join(f"{value:.4g}" for value in values)
            progress(len(trials), conditions, f"{text}: {figures['outcome']}")
        return trial.failed

    search = Search(partial(condition, vary), judge, conditions, tolerance)
    base = scenario_at(load, vary, condition(vary, 0.0))
    made = [each for each in (out, *out.parents) if not each.exists()]
    lock = claim_folder(out, "search", INDEX, SCHEMA)
    try:
        fails = search.run().fails
        found = None if fails is None else trials[condition(vary, fails)]
        flew = base.name, base.planner.label, Path(base.aircraft.model).name, base.seed
        tried = tolerance, len(trials), search.steps, search.settled
        outcome: Found = "not_found" if fails is None else "found" if fails else "fails_at_the_mild_end"
        # Where whole numbers alone are flown, it is not where it was looked for.
        if found and len(vary) == 1 and vary[0].whole:
            fails = (found.values[0] - vary[0].mild) / (vary[0].hard - vary[0].mild)
        passes = None if fails is None or search.passes is None else condition(vary, search.passes)
        every = tuple(trials.values())
        result = Breaking(*flew, claim, tuple(vary), *tried, outcome, fails, found, passes, every)
        _write(out, result.plain(), scenario_at(load, vary, found.values) if found else None)
    finally:
        lock.close()
        with suppress(OSError):  # a folder that holds anything stays
            for each in made:
                each.rmdir()
    return result


def _write(out: Path, result: Mapping[str, Any], failing: Scenario | None) -> None:
    """Replaces an earlier search file by file; what fails comes before the index that names it, and goes after it."""
    try:
        if failing is not None:
            replace_text(out / FALSIFIED, dump_scenario(failing))
        replace_text(out / INDEX, json.dumps(result, indent=2, allow_nan=False) + "\n")
        if failing is None:
            (out / FALSIFIED).unlink(missing_ok=True)
    except OSError as error:
        raise WriteError(f"cannot write the search in {out}: {error.strerror or error}") from error
