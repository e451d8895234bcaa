"""The breaking point: flies a scenario under ever harder conditions until the mildest is known that makes it fail.

The folder holds `falsify.json`, the result and every flight; and, where something failed, `falsified.yaml`, the whole
scenario that does. They are written when the search ends.
"""

from __future__ import annotations

import itertools
import json
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from harness.falsify.keys import Load, Vary, scenario_at
from harness.falsify.search import Point, search
from harness.files.crash import sentence
from harness.files.errors import RunFolderError
from harness.files.folder_lock import FolderLock
from harness.files.input_file import read_index
from harness.files.strict_yaml import InputError
from harness.files.whole_file import PARTIAL, replace_text
from harness.scenario.scenario import Scenario, dump_scenario

SCHEMA: Final = "wayproof/falsify/2"
INDEX: Final = "falsify.json"
FALSIFIED: Final = "falsified.yaml"

Until: TypeAlias = Literal["failed", "untrackable"]
"""What is looked for: an outcome other than `reached`, or a leg that was not tracked (or such an outcome)."""

Flown: TypeAlias = Callable[[Scenario], Mapping[str, Any]]
"""Flies a scenario and gives the content of its `metrics.json`."""


FIGURES: Final = (
    "outcome",
    "reason",
    "trackable",
    "min_clearance_m",
    "flown_length_m",
    "flight_time_s",
    "digest",
)
"""Figures of `metrics.json` that are kept of every flight."""


@dataclass(frozen=True)
class Trial:
    """One flight.

    Attributes:
        displacement: of each key, from 0 (mild) to 1 (hard).
        values: of each key.
        seed: root seed of the flight; flights of one condition differ in it.
        failed: whether it did what was looked for.
        figures: those of `FIGURES`; the outcome is `error` where the software failed.
    """

    displacement: Point
    values: tuple[float, ...]
    seed: int
    failed: bool
    figures: Mapping[str, Any]


@dataclass(frozen=True)
class Breaking:
    """What was found.

    Attributes:
        until: what was looked for.
        tolerance: a displacement was narrowed down to this.
        conditions: how many were tried.
        steps: number of equal steps of the scan; a failing range narrower than one may have been missed.
        settled: whether the answer was narrowed down to the tolerance within the conditions that were allowed.
        found: the flight that failed under the mildest condition of those tried.
        passes: values of the hardest condition that passed and is no harder in any key.
        trials: every flight, in order.
    """

    scenario: str
    planner: str
    aircraft: str
    until: Until
    vary: tuple[Vary, ...]
    tolerance: float
    conditions: int
    steps: int
    settled: bool
    verdict: Literal["found", "not_found", "fails_at_the_mild_end"]
    found: Trial | None
    passes: tuple[float, ...] | None
    trials: tuple[Trial, ...]

    def plain(self) -> dict[str, Any]:
        """The content of `falsify.json`."""
        command = shlex.join(["wayproof", *sys.argv[1:]])
        return {"schema": SCHEMA, "complete": True, "command": command, **asdict(self)}


def falsify(
    load: Load,
    vary: Sequence[Vary],
    out: Path,
    *,
    flown: Flown,
    until: Until = "failed",
    conditions: int = 40,
    seeds: int = 1,
    tolerance: float = 0.01,
    progress: Callable[[int, int, str], None] | None = None,
) -> Breaking:
    """Searches, and writes the folder.

    Args:
        load: makes the scenario.
        vary: the keys, as `vary_of` gives them.
        out: the folder, made where missing.
        flown: flies a scenario.
        until: what is looked for.
        conditions: at most so many are tried.
        seeds: flights of a condition, from the scenario's seed on; it fails as soon as one does.
        tolerance: a displacement is narrowed down to this share of its range.
        progress: told after each flight how many conditions have begun, of how many, and what became of it.

    Raises:
        InputError: a condition is no scenario, or cannot be flown; the folder is as it was.
        RunFolderError: the folder holds something else, another process writes to it, or it cannot be written.
    """
    base = scenario_at(load, vary, (0.0,) * len(vary))
    trials: list[Trial] = []
    begun = itertools.count(1)

    def values(point: Point) -> tuple[float, ...]:
        return tuple(each.value(place) for each, place in zip(vary, point, strict=True))

    def judge(point: Point) -> bool:
        scenario = scenario_at(load, vary, point)
        condition = next(begun)
        for seed in range(base.seed, base.seed + seeds):
            figures = _flown(flown, scenario.model_copy(update={"seed": seed}))
            failed = figures["outcome"] != "reached" or (until == "untrackable" and not figures["trackable"])
            kept = {name: figures.get(name) for name in FIGURES}
            trials.append(Trial(point, values(point), seed, failed, kept))
            if progress is not None:
                told = ", ".join(f"{value:.4g}" for value in values(point))
                progress(condition, conditions, f"{told}: {figures['outcome']}")
            if failed:
                return True
        return False

    def snap(point: Point) -> Point:
        return tuple(each.snapped(place) for each, place in zip(vary, point, strict=True))

    with _claimed(out):
        try:
            searched = search(len(vary), judge, conditions, tolerance, snap)
        except KeyboardInterrupt:
            if trials:
                told = {"schema": SCHEMA, "complete": False, "trials": [asdict(each) for each in trials]}
                _write(out, told, None)
            raise
        mildest, passed = searched.mildest, searched.passed_below
        verdict: Literal["found", "fails_at_the_mild_end"] = (
            "found" if mildest and max(mildest) > 0.0 else "fails_at_the_mild_end"
        )
        found = next((each for each in trials if each.failed and each.displacement == mildest), None)
        result = Breaking(
            scenario=base.name,
            planner=base.planner.label,
            aircraft=Path(base.aircraft.model).name,
            until=until,
            vary=tuple(vary),
            tolerance=tolerance,
            conditions=len(searched.verdicts),
            steps=searched.steps,
            settled=searched.settled,
            verdict="not_found" if found is None else verdict,
            found=found,
            passes=values(passed) if passed else None,
            trials=tuple(trials),
        )
        failing = None
        if found is not None:
            failing = scenario_at(load, vary, found.displacement).model_copy(update={"seed": found.seed})
        _write(out, result.plain(), failing)
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


@contextmanager
def _claimed(out: Path) -> Iterator[None]:
    """Holds the folder of a search, made where missing; what was made goes again where nothing was written."""
    if out.exists() and not out.is_dir():
        raise RunFolderError(f"{out} is a file, not a folder for a search")
    made = [each for each in (out, *out.parents) if not each.exists()]
    try:
        out.mkdir(parents=True, exist_ok=True)
        lock = FolderLock(out)
        try:
            others = {each.name for each in out.iterdir() if not each.name.endswith(PARTIAL)}
            if others and read_index(out / INDEX, SCHEMA) is None:
                raise RunFolderError(
                    f"{out} is not empty and not a search: choose another folder or empty it first"
                )
            yield
        finally:
            lock.release()
    except OSError as error:
        raise RunFolderError(f"cannot write the search in {out}: {error.strerror or error}") from error
    finally:
        with suppress(OSError):  # a folder that holds anything stays
            for each in made:
                each.rmdir()


def _write(out: Path, result: Mapping[str, Any], failing: Scenario | None) -> None:
    """Replaces an earlier search, all of which goes; what fails comes before the index that names it."""
    (out / FALSIFIED).unlink(missing_ok=True)
    if failing is not None:
        replace_text(out / FALSIFIED, dump_scenario(failing))
    replace_text(out / INDEX, json.dumps(result, indent=2, allow_nan=False) + "\n")
