"""The breaking point: flies a scenario under ever harder conditions until the mildest is known that makes it fail.

The folder holds `falsify.json`, the result and every flight; and, where something failed, `falsified.yaml`, the whole
scenario that does. They are written when the search ends.
"""

from __future__ import annotations

import itertools
import json
import math
import shlex
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from harness.analysis.claims import Claim, holds
from harness.campaign.folder import claim_folder
from harness.campaign.sampling import takes_whole_numbers
from harness.falsify.search import Search, Values, Vary
from harness.files.crash import sentence
from harness.files.errors import WriteError
from harness.files.strict_yaml import InputError, as_spelt, loc_of
from harness.files.whole_file import replace_text
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
Flown: TypeAlias = Callable[[Scenario], Mapping[str, Any]]
"""Flies a scenario and gives the content of its `metrics.json`."""


@dataclass(frozen=True)
class Trial:
    """One flight.

    Attributes:
        displacement: of each key, from 0 (mild) to 1 (hard).
        figures: those of `FIGURES`; the outcome is `error` where the software failed.
    """

    displacement: tuple[float, ...]
    values: Values
    failed: bool
    figures: Mapping[str, Any]


@dataclass(frozen=True)
class Breaking:
    """What was found.

    Attributes:
        claim: a flight fails where this does not hold of it.
        steps: number of equal steps of the scan; a failing range narrower than one may have been missed.
        settled: whether the answer was narrowed down to the tolerance within the flights that were allowed.
        passes: values of the hardest condition that passed and is no harder in any key.
    """

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
    trials: tuple[Trial, ...]

    def plain(self) -> dict[str, Any]:
        """The content of `falsify.json`."""
        command = shlex.join(["wayproof", *sys.argv[1:]])
        return {"schema": SCHEMA, "complete": True, "command": command, **asdict(self)}


def vary_of(
    load: Load, given: Sequence[tuple[str, float, float]], fixed: Sequence[str] = (), tolerance: float = 0.01
) -> tuple[Vary, ...]:
    """The keys to vary, once every combination of their ends has been found to be a scenario.

    `given`: key path, mild end and hard end of each.
    `tolerance`: a displacement is narrowed down to this share of its range; values are flown rounded to a
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
    _check_ranges(given, valued)
    base = load([(key, number_text(mild)) for key, mild, _ in given])
    vary = tuple(
        Vary(key, mild, hard, takes_whole_numbers(base, loc_of(key)), _decimals(abs(hard - mild) * tolerance))
        for key, mild, hard in given
    )
    ends = itertools.product(*((each.mild, each.hard) for each in vary))
    diagonal = (tuple(each.value(step / 8) for each in vary) for step in range(9))
    for values in dict.fromkeys([*ends, *diagonal]):
        scenario_at(load, vary, values)
    return vary


def _check_ranges(given: Sequence[tuple[str, float, float]], valued: Collection[str]) -> None:
    """Refuses a key that is varied twice, has a value or no range, and the seed."""
    for number, (key, mild, hard) in enumerate(given):
        if key == "seed":
            raise InputError("command line: --vary seed: a seed is no condition; --seed gives another")
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
    flown: Flown,
    claim: Claim = "reached",
    conditions: int = 40,
    tolerance: float = 0.01,
    progress: Callable[[int, int, str], None] | None = None,
) -> Breaking:
    """Searches, and writes the folder.

    `claim`: a flight fails where this does not hold of it.
    `tolerance`: a displacement is narrowed down to this share of its range.
    `progress`: told after each flight how many there were, of how many, and what became of it.

    Raises:
        InputError: a condition is no scenario, or cannot be flown; the folder is as it was.
        RunFolderError: the folder holds something else, or another process writes to it.
        WriteError: it cannot be written.
    """
    trials: dict[Values, Trial] = {}

    def judge(values: Values) -> bool:
        figures = _flown(flown, scenario_at(load, vary, values))
        failed = not holds(claim, figures)
        kept = {name: figures.get(name) for name in FIGURES}
        trials[values] = Trial(search.hardness(values), values, failed, kept)
        if progress is not None:
            told = ", ".join(f"{value:.4g}" for value in values)
            progress(len(trials), conditions, f"{told}: {figures['outcome']}")
        return failed

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


def _flown(flown: Flown, scenario: Scenario) -> Mapping[str, Any]:
    """The figures of a flight; a crash of it is a failure, an aircraft that cannot begin it is not."""
    from aircraft.airframes import AircraftError

    try:
        return flown(scenario)
    except AircraftError as error:
        raise InputError(f"wayproof: cannot fly this condition: {error}") from error
    except Exception as error:
        return {"outcome": "error", "reason": sentence(error), "trackable": None}


def _write(out: Path, result: Mapping[str, Any], failing: Scenario | None) -> None:
    """Replaces an earlier search, all of which goes; what fails comes before the index that names it."""
    try:
        (out / FALSIFIED).unlink(missing_ok=True)
        if failing is not None:
            replace_text(out / FALSIFIED, dump_scenario(failing))
        replace_text(out / INDEX, json.dumps(result, indent=2, allow_nan=False) + "\n")
    except OSError as error:
        raise WriteError(f"cannot write the search in {out}: {error.strerror or error}") from error
