"""Flies days until a claim is shown, refuted, or the days are used up, and writes `certificate.json`.

The folder is that of a campaign. Days count in the order of their numbers, whoever flew them when: the answer is the
same for any number of workers.
"""

from __future__ import annotations

import json
import math
import shlex
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import reduce
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from harness.analysis.band import BAND_FILE, write_band
from harness.analysis.metric import Claim
from harness.campaign.cell import grouped
from harness.campaign.flight import Answer
from harness.campaign.folder import CampaignFolder, fly_missing, unfinished_text
from harness.campaign.results import CERTIFICATE, CERTIFICATE_SCHEMA, RUNS
from harness.campaign.workers import LocalWorkers, fly_jobs
from harness.certification.bounds import Verdict, clopper_pearson, sequential_bounds, verdict
from harness.certification.days import Days, PathDays
from harness.certification.rare import Rare, subset_simulation
from harness.files.input_file import InputError
from harness.files.versions import versions
from harness.files.whole_file import replace_text
from harness.flight.record import FloatArray, IntArray
from harness.run_files.run_folder import METRICS, TRACK
from harness.scenario.conditions import conditions_text
from harness.scenario.sections import DeviationSpec

DRAWN: Final = (
    *("environment.wind.speed_mps", "environment.wind.from_deg", "environment.vertical_gusts.start_s"),
    *(f"aircraft.deviation.{name}" for name in DeviationSpec.model_fields),
)
"""Keys of a scenario whose numbers conditions and uncertainty draw without their being varied by name."""
DEFAULT_RUNS: Final = {"counted": 1000, "rare": 10_000}
"""Default of the largest number of days to fly, by the `purpose` of `Days`: counting, or a subset simulation."""
MOST_FOLDERS: Final = 20  # at most so many failing days of a subset simulation keep their run folder
DEFAULT_CONFIDENCE: Final = 0.95  # confidence of the bounds where none is given


@dataclass(frozen=True)
class Failure:
    """Days that failed and ended alike: how many, and the first of them."""

    outcome: str
    cause: str  # as `harness.analysis.metric.cause_of` has it, or why nothing was flown; may be empty
    count: int
    runs: tuple[int, ...]


@dataclass(frozen=True)
class Explained:
    """The share, from 0 to 1, of the variance of failing that is due to the group that a varied quantity falls in."""

    key: str
    share: float
    worst: str  # the group with the largest share of failures; `failed` of its `runs` did
    failed: int
    runs: int


@dataclass(frozen=True)
class Certificate:
    """On how many of the days that count the claim held, and what follows from it: content of `certificate.json`."""

    claim: Claim
    runs: int
    held: int
    probability_lower: float
    probability_upper: float
    """Bounds of the probability that the claim holds on a day, each by itself at `confidence`."""
    confidence: float
    verdict: Verdict
    probability: float | None
    """What the verdict is about: the claim holds with at least this; None where nothing was claimed."""
    method: str  # how the bounds were derived
    most_runs: int  # number of days that were allowed
    subject: str
    planner: str  # its kind; `given` for a path
    aircraft: str
    conditions: str  # every kind of day that was drawn: `ideal or rough`
    first_day: str  # those of day 0, with what its scenario sets
    seed: int
    varied: Mapping[str, Any]
    failures: tuple[Failure, ...]
    """The most frequent first; `failing_runs` has all days on which the claim did not hold."""
    explained: tuple[Explained, ...]
    failing_runs: tuple[int, ...]
    command: str
    versions: Mapping[str, str | None]
    rare: Rare | None = None
    """The result of a subset simulation; the days were then drawn near failure, and `held` is no frequency."""

    def plain(self) -> dict[str, Any]:
        """Returns the content of `certificate.json`."""
        return {"schema": CERTIFICATE_SCHEMA, **asdict(self)}


@dataclass(frozen=True)
class Terms:
    """What is claimed: the claim holds on at least this share of the days (None: no share), at this confidence."""

    probability: float | None = None
    confidence: float = DEFAULT_CONFIDENCE

    def __post_init__(self) -> None:
        """Raises `InputError` if one is not between 0 and 1."""
        for name, value in asdict(self).items():
            if value is not None and not 0.0 < value < 1.0:
                raise InputError(f"wayproof: the {name} is {value:g}; must be above 0 and below 1")


class DayCount:
    """Days in the order of their numbers, as far as they are over without a gap, or up to the day that decided.

    `runs` days count, on `held` of which the claim held; `decided` tells whether they show or refute it.
    """

    def __init__(self, terms: Terms) -> None:
        self._terms, self._ahead = terms, dict[int, bool]()
        self.runs, self.held, self.decided = 0, 0, False

    def add(self, run: int, held: bool) -> None:
        """Counts a day that is over, once all before it are, and sees whether the claim is decided."""
        self._ahead[run] = held
        while not self.decided and self.runs in self._ahead:
            self.held += self._ahead.pop(self.runs)
            self.runs += 1
            if (claimed := self._terms.probability) is not None:
                self.decided = verdict(self.held, self.runs, claimed, self._terms.confidence) != "undecided"


def certify(
    days: Days,
    out: Path,
    workers: LocalWorkers,
    terms: Terms,
    *,
    resume: bool = False,
    progress: Callable[[DayCount], None] | None = None,
) -> Certificate:
    """Flies days and writes the folder; with `resume` keeps the days that the folder has, and flies the others.

    A RunFolderError: it holds something else, or days without `resume`; an OSError: disk or workers give out.
    """
    tally, rare = DayCount(replace(terms, probability=None) if days.rare else terms), None
    with CampaignFolder(out, days, resume=resume) as folder:
        for run, answer in folder.finished.items():
            tally.add(run, answer.held)

        def count(answer: Answer) -> None:
            tally.add(answer.run, answer.held)
            if progress is not None:
                progress(tally)

        def fly(numbers: range | None = None) -> None:
            left = fly_missing(days, folder, workers, count, lambda: tally.decided, numbers)
            if left and not tally.decided:
                raise OSError(unfinished_text(left))

        if days.rare:
            rare = _simulate(days, folder, fly, terms.confidence)
        else:
            fly()
        folder.write_tables(tally.runs)
        certificate = _certificate(days, folder, tally, terms)
        if rare is not None:
            certificate = replace(certificate, rare=rare, **_rare_verdict(rare, terms.probability))
        if days.band and not (out / BAND_FILE).exists():
            folders = (out / RUNS / str(run) for run in range(tally.runs))
            write_band(out, [each for each in folders if (each / TRACK).is_file()])
        _keep_failing(days, folder, certificate.failing_runs, workers)
        replace_text(out / CERTIFICATE, json.dumps(certificate.plain(), indent=2, allow_nan=False) + "\n")
    return certificate


def _simulate(days: Days, folder: CampaignFolder, fly: Callable[[range], None], confidence: float) -> Rare:
    """Runs a subset simulation; the margin of a day is 0 where a crash left none, infinite where nothing can be hit."""

    def margins(normals: FloatArray, seeds: IntArray) -> FloatArray:
        numbers = days.give(normals, seeds)
        fly(numbers)
        cells = [folder.finished[run].row.get("margin", 0.0) for run in numbers]
        return np.array([math.inf if cell is None else cell for cell in cells])

    return subset_simulation(margins, days.normals, len(days), days.campaign.seed, confidence)


def _keep_failing(days: Days, folder: CampaignFolder, failing: Sequence[int], workers: LocalWorkers) -> None:
    """Keeps the run folders of failing days; those that are not there and were flown to an end are flown again."""
    out, wanted = folder.path, failing[:MOST_FOLDERS] if days.rare else failing
    flown = (run for run in wanted if "digest" in folder.finished[run].row)
    missing = (run for run in flown if not (out / RUNS / str(run) / METRICS).exists())
    fly_jobs((replace(days.job(run, out), recordings="all") for run in missing), workers, lambda *_: None)
    workers.end()  # a day in flight would make its folder anew
    for each in (out / RUNS).glob("*"):  # of days that were flown ahead of the day that decided
        if each.name.isdecimal() and int(each.name) not in failing:
            shutil.rmtree(each, ignore_errors=True)


def _rare_verdict(rare: Rare, claimed: float | None) -> dict[str, Any]:
    """Returns the verdict, bounds and method of a subset simulation, which is looked at once, at its end."""
    low, high = 1.0 - rare.failure_upper, 1.0 - rare.failure_lower
    decision = "undecided" if claimed is None or claimed <= high else "refuted"
    decision = "shown" if claimed is not None and claimed <= low else decision
    return {"verdict": decision, "method": rare.method, "probability_lower": low, "probability_upper": high}


def _certificate(days: Days, folder: CampaignFolder, tally: DayCount, terms: Terms) -> Certificate:
    answers = [(run, folder.finished[run]) for run in range(tally.runs)]
    failing = [{**each.row, "run": run} for run, each in answers if not each.held]
    first = days.scenario(0)
    kinds = days.vary.get("conditions", {"choice": [first.conditions]})["choice"]
    return Certificate(
        claim=days.claim,
        runs=tally.runs,
        held=tally.held,
        confidence=terms.confidence,
        probability=terms.probability,
        **_counted_verdict(tally, terms, folder.grown),
        most_runs=len(days),
        subject=days.campaign.name,
        planner="given" if isinstance(days, PathDays) else first.planner.label,
        aircraft=Path(first.aircraft.model).name,
        conditions=" or ".join(dict.fromkeys(map(str, kinds))),
        first_day=conditions_text(first),
        seed=days.campaign.seed,
        varied=dict(days.vary),
        failures=failures(failing),
        explained=_explain(days, answers) if failing and not days.rare else (),
        failing_runs=tuple(row["run"] for row in failing),
        command=shlex.join(["wayproof", *sys.argv[1:]]),
        versions=versions(),
    )


def _explain(days: Days, answers: Sequence[tuple[int, Answer]]) -> tuple[Explained, ...]:
    flew = [each for each in answers if each[0] not in days.grounded]
    quantities = differing([days.scenario(run).model_dump(by_alias=True) for run, _ in flew])
    quantities |= {key: [each.row[key] for _, each in flew] for key in days.varied}
    return explained(np.array([not each.held for _, each in flew]), quantities)


def _counted_verdict(tally: DayCount, terms: Terms, grown: bool) -> dict[str, Any]:
    counted, decision = (tally.held, tally.runs), "undecided"
    # Who raises the number of days knows what came out: it was not fixed beforehand.
    if terms.probability is None and not grown:
        method, bounds = "Clopper-Pearson, number of runs fixed beforehand", clopper_pearson
    else:
        method, bounds = "sequential mixture test, valid at every look", sequential_bounds
    if terms.probability is not None:
        decision = verdict(*counted, terms.probability, terms.confidence)
    elif grown:
        method += ", as --resume raised the number of runs"
    low, high = bounds(*counted, terms.confidence)
    return {"verdict": decision, "method": method, "probability_lower": low, "probability_upper": high}


def failures(rows: Sequence[Mapping[str, Any]]) -> tuple[Failure, ...]:
    """Groups rows of days that failed by outcome and cause, the most frequent first, each with its first five runs."""
    alike: dict[tuple[str, str], list[int]] = {}
    for row in rows:
        alike.setdefault((row["outcome"], row.get("cause", row["reason"])), []).append(row["run"])
    ordered = sorted(alike.items(), key=lambda each: -len(each[1]))
    return tuple(Failure(*key, len(runs), tuple(runs[:5])) for key, runs in ordered)


def explained(failed: NDArray[np.bool_], quantities: Mapping[str, Sequence[Any]]) -> tuple[Explained, ...]:
    """Ranks the quantities by how much of the failures they explain; returns none where none or all failed.

    The share is epsilon squared (Kelley, Proceedings of the National Academy of Sciences 21, 1935): the correlation
    ratio of failing (n,) over the groups of a quantity (n,), less what one without influence would show.
    """
    found, count, overall = [], len(failed), float(failed.mean()) if len(failed) else 0.0
    total = float(count * overall * (1.0 - overall))
    for key, values in quantities.items() if total else ():
        axis, group = grouped(key, values, drawn=True)
        used, index = np.unique(group, return_inverse=True)
        if (groups := len(used)) < 2 or count <= groups:
            continue
        sizes, sums = np.bincount(index), np.bincount(index, failed)
        rates = sums / sizes
        between = float((sizes * (rates - overall) ** 2).sum())
        within = (total - between) / (count - groups)
        share, worst = max(0.0, (between - (groups - 1) * within) / total), int(rates.argmax())
        found.append(Explained(key, share, axis.labels[used[worst]], int(sums[worst]), int(sizes[worst])))
    return tuple(sorted(found, key=lambda each: -each.share))


def differing(days: Sequence[Any]) -> dict[str, list[Any]]:
    """Returns those numbers of plain scenarios in `DRAWN` that differ between days, one a day, by key path."""
    columns = {
        key: [reduce(lambda at, name: (at or {}).get(name), key.split("."), day) for day in days] for key in DRAWN
    }
    return {key: values for key, values in columns.items() if len({*values}) > 1}
