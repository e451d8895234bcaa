"""The breaking point: flies a scenario under ever other conditions until the mildest is known that makes it fail.

The folder holds `falsify.csv`, a line for every flight; `falsify.json`, the result, which says whether it is
complete; and, where something failed, `falsified.yaml`, the whole scenario that does.
"""

from __future__ import annotations

import itertools
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Literal, TypeAlias

from harness.falsify.folder import FALSIFIED, SCHEMA, SearchFolder, Trial, write_index
from harness.falsify.keys import Load, Vary, scenario_at
from harness.falsify.search import Judge, Point, Searched, search
from harness.files.crash import sentence
from harness.files.strict_yaml import InputError
from harness.files.whole_file import replace_text
from harness.scenario.scenario import Scenario, dump_scenario

Until: TypeAlias = Literal["failed", "untrackable"]
"""What is looked for: an outcome other than `reached`, or a leg that was not tracked (or such an outcome)."""

Flown: TypeAlias = Callable[[Scenario], Mapping[str, Any]]
"""Flies a scenario and gives the content of its `metrics.json`."""


@dataclass(frozen=True)
class TriedBand:
    """Conditions of one key that were tried one beside the other and had the same outcome.

    Attributes:
        failed: whether they failed.
        mildest: the value of the mildest.
        hardest: the value of the hardest.
        conditions: how many.
    """

    failed: bool
    mildest: float
    hardest: float
    conditions: int


@dataclass(frozen=True)
class Breaking:
    """What was found.

    Attributes:
        scenario: its name.
        planner: what planned.
        aircraft: what flew.
        until: what was looked for.
        vary: the keys.
        tolerance: a displacement was narrowed down to this.
        allowed: at most so many conditions were to be tried.
        conditions: how many were tried. Fewer than allowed where nothing was left to try.
        settled: whether the search did all its steps within its conditions, and narrowed down what failed.
        verdict: `found`, `not_found` or `fails_at_the_mild_end`.
        found: the flight that failed under the mildest condition of those tried.
        passes: values of the hardest condition that passed and is no harder in any key.
        passes_above: values of the hardest condition that passed and is no milder in any key.
        milder: how many milder conditions were tried. All passed.
        widest_gap: with one key, the two neighbouring values with most room between them that no flight has
            tried, of all up to the mildest failure.
        not_monotone: how many pairs there are of a condition that failed and one, harder or equal in every
            key, that passed.
        example: values of such a pair.
        trials: every flight, in order.
    """

    scenario: str
    planner: str
    aircraft: str
    until: Until
    vary: tuple[Vary, ...]
    tolerance: float
    allowed: int
    conditions: int
    settled: bool
    verdict: Literal["found", "not_found", "fails_at_the_mild_end"]
    found: Trial | None
    passes: tuple[float, ...] | None
    passes_above: tuple[float, ...] | None
    milder: int
    widest_gap: tuple[float, float] | None
    not_monotone: int
    example: tuple[tuple[float, ...], tuple[float, ...]] | None
    trials: tuple[Trial, ...]

    @property
    def bands(self) -> tuple[TriedBand, ...]:
        """With one key, every condition tried: neighbours with the same outcome make a band, mild ones first."""
        verdicts: dict[tuple[Point, float], bool] = {}
        for each in self.trials:
            condition = each.displacement, each.values[0]
            verdicts[condition] = verdicts.get(condition, False) or each.failed
        bands = []
        for failed, group in itertools.groupby(sorted(verdicts.items()), key=lambda item: item[1]):
            values = [value for (_, value), _ in group]
            bands.append(TriedBand(failed, values[0], values[-1], len(values)))
        return tuple(bands)

    def plain(self) -> dict[str, Any]:
        """The content of `falsify.json`: all but the flights, which are in `falsify.csv`."""
        content = {name: value for name, value in asdict(self).items() if name != "trials"}
        command = shlex.join(["wayproof", *sys.argv[1:]])
        return {
            "schema": SCHEMA,
            "complete": True,
            "command": command,
            **content,
            "bands": [asdict(each) for each in self.bands] if len(self.vary) == 1 else None,
            "flights": len(self.trials),
        }


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
    numbers = itertools.count()

    def judge(point: Point) -> bool:
        scenario = scenario_at(load, vary, point)
        condition = next(numbers)
        values = tuple(each.value(place) for each, place in zip(vary, point, strict=True))
        for seed in range(base.seed, base.seed + seeds):
            figures = _flown(flown, scenario.model_copy(update={"seed": seed}))
            failed = figures["outcome"] != "reached" or (until == "untrackable" and not figures["trackable"])
            trial = Trial(len(trials), condition, point, values, seed, failed, **_columns(figures))
            trials.append(trial)
            folder.write(trial)
            if progress is not None:
                told = ", ".join(f"{value:.4g}" for value in values)
                progress(condition + 1, conditions, f"{told}: {trial.outcome}")
            if failed:
                return True
        return False

    with SearchFolder(out, vary) as folder:
        searched = _searched(judge, vary, conditions, tolerance, base.seed)
        folder.take_over()
        result = _breaking(base, vary, until, conditions, tolerance, searched, trials)
        if result.found is not None:
            failing = scenario_at(load, vary, result.found.displacement)
            text = dump_scenario(failing.model_copy(update={"seed": result.found.seed}))
            replace_text(out / FALSIFIED, text)
        write_index(out, result.plain())
    return result


def _searched(judge: Judge, vary: Sequence[Vary], conditions: int, tolerance: float, seed: int) -> Searched:
    def snap(point: Point) -> Point:
        return tuple(each.snapped(place) for each, place in zip(vary, point, strict=True))

    return search(len(vary), judge, conditions, tolerance, seed, snap)


def _flown(flown: Flown, scenario: Scenario) -> Mapping[str, Any]:
    """The figures of a flight; a crash of it is a failure, an aircraft that cannot begin it is not."""
    from aircraft.airframes import AircraftError

    try:
        return flown(scenario)
    except AircraftError as error:
        raise InputError(f"wayproof: cannot fly this condition: {error}") from error
    except Exception as error:
        return {"outcome": "error", "reason": sentence(error), "trackable": None}


def _columns(figures: Mapping[str, Any]) -> dict[str, Any]:
    names = {field.name for field in fields(Trial)}
    own = {name: value for name, value in figures.items() if name in names}
    return own | {"cross_track_max_m": figures.get("cross_track_m", {}).get("max")}


def _breaking(
    base: Scenario,
    vary: Sequence[Vary],
    until: Until,
    allowed: int,
    tolerance: float,
    searched: Searched,
    trials: Sequence[Trial],
) -> Breaking:
    def values(point: Point) -> tuple[float, ...]:
        return tuple(each.value(place) for each, place in zip(vary, point, strict=True))

    mildest, passed, pairs = searched.mildest, searched.passed_below, searched.not_monotone
    above, gap = searched.passed_above, searched.widest_gap
    found = next((each for each in trials if each.failed and each.displacement == mildest), None)
    example = (values(pairs[0][0]), values(pairs[0][1])) if pairs else None
    return Breaking(
        scenario=base.name,
        planner=base.planner.label,
        aircraft=Path(base.aircraft.model).name,
        until=until,
        vary=tuple(vary),
        tolerance=tolerance,
        allowed=allowed,
        conditions=len(searched.verdicts),
        settled=searched.settled,
        verdict="not_found"
        if mildest is None
        else "found"
        if max(mildest) > 0.0
        else "fails_at_the_mild_end",
        found=found,
        passes=values(passed) if passed else None,
        passes_above=values(above) if above else None,
        milder=searched.milder,
        widest_gap=(vary[0].value(gap[0]), vary[0].value(gap[1])) if gap else None,
        not_monotone=len(pairs),
        example=example,
        trials=tuple(trials),
    )
