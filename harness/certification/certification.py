"""Flies days until a claim is shown, refuted, or the days are used up, and writes the certificate.

The folder is that of a campaign: `results.parquet` has a row a day, `runs/` the run folder of every day on which the
claim does not hold, `certificate.json` the answer. Days count in the order of their numbers, whoever flew them when:
the answer is the same for any number of workers.
"""

from __future__ import annotations

import shlex
import shutil
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.analysis.band import BAND, write_band
from harness.campaign.flight import Answer
from harness.campaign.folder import CampaignFolder
from harness.campaign.journal import read_journal
from harness.campaign.results import RUNS
from harness.campaign.sweep import fly_missing, told_left
from harness.campaign.workers import Workers
from harness.certification.bounds import clopper_pearson, sequential_bounds, verdict
from harness.certification.certificate import Certificate, failures
from harness.certification.days import Days, PathDays
from harness.certification.explained import differing, explained
from harness.files.input_file import InputError
from harness.files.versions import versions
from harness.run_files.run_folder import TRACK

MOST_RUNS: Final = 1000
CONFIDENCE: Final = 0.95


@dataclass(frozen=True)
class Terms:
    """What is to be shown: the claim holds on at least a share of the days (None: nothing), at this confidence."""

    probability: float | None = None
    confidence: float = CONFIDENCE

    def __post_init__(self) -> None:
        """Raises `InputError` if one is not between 0 and 1."""
        for name, value in asdict(self).items():
            if value is not None and not 0.0 < value < 1.0:
                raise InputError(f"wayproof: the {name} is {value:g}; must be above 0 and below 1")


class Tally:
    """Days in the order of their numbers, as far as they are over without a gap.

    Attributes:
        runs: how many count: all before the first gap, or up to the day that decided.
        held: on how many of them the claim held.
        decided: whether they show or refute the claim.
    """

    def __init__(self, terms: Terms) -> None:
        self._terms, self._ahead = terms, dict[int, bool]()
        self.runs, self.held, self.decided = 0, 0, False

    def add(self, run: int, held: bool) -> None:
        """Counts a day that is over."""
        self._ahead[run] = held
        while not self.decided and self.runs in self._ahead:
            self.held += self._ahead.pop(self.runs)
            self.runs += 1
            claimed = self._terms.probability
            if claimed is not None:
                said = verdict(self.held, self.runs, claimed, self._terms.confidence)
                self.decided = said != "undecided"


def certify(
    days: Days,
    out: Path,
    workers: Workers,
    terms: Terms,
    *,
    resume: bool = False,
    progress: Callable[[Tally], None] | None = None,
    command: str | None = None,
) -> Certificate:
    """Flies days and writes the folder.

    Args:
        days: what is flown, at most.
        out: the folder.
        workers: who flies.
        terms: what is to be shown.
        resume: whether to go on with what the folder has of these days.
        progress: told after every day that is over.
        command: what the certificate says was called; default: the command line.

    Raises:
        RunFolderError: the folder holds something else, or days already without `resume`.
        OSError: it cannot be written, or who flies has gone.
    """
    tally = Tally(terms)
    with CampaignFolder(out, days, resume=resume) as folder:
        for run, over in sorted(read_journal(out).runs.items()):
            tally.add(run, over.held)

        def count(answer: Answer) -> None:
            tally.add(answer.run, answer.held)
            if progress is not None:
                progress(tally)

        left = fly_missing(days, folder, workers, count, lambda: tally.decided)
        if left and not tally.decided:
            raise OSError(told_left(left))
        folder.write_tables(tally.runs)
        certificate = _certificate(days, out, tally, terms, command)
        if days.band and not (out / BAND).exists():
            kept = (out / RUNS / str(run) for run in range(tally.runs))
            write_band(out, [each for each in kept if (each / TRACK).is_file()])
        _leave_only(out / RUNS, set(certificate.failing_runs))
        certificate.write(out)
    return certificate


def _leave_only(runs: Path, kept: set[int]) -> None:
    """Removes the run folders of days that were flown ahead of the day that decided."""
    for folder in runs.glob("*"):
        if folder.name.isdecimal() and int(folder.name) not in kept:
            shutil.rmtree(folder, ignore_errors=True)


def _certificate(days: Days, out: Path, tally: Tally, terms: Terms, command: str | None) -> Certificate:
    over = [(run, each) for run, each in sorted(read_journal(out).runs.items()) if run < tally.runs]
    failing = [{**each.row, "run": run} for run, each in over if not each.held]
    first = days.flown(0)
    quantities: dict[str, list[Any]] = {}
    if failing:
        quantities = differing([days.flown(run).model_dump(by_alias=True) for run, _ in over])
        quantities |= {key: [each.row[key] for _, each in over] for key in days.varied}
    return Certificate(
        claim=days.claim,
        runs=tally.runs,
        held=tally.held,
        confidence=terms.confidence,
        probability=terms.probability,
        **_sure(tally, terms),
        most_runs=len(days),
        subject=days.campaign.name,
        planner="given" if isinstance(days, PathDays) else first.planner.label,
        aircraft=Path(first.aircraft.model).name,
        conditions=getattr(first, "conditions", None),
        seed=days.campaign.seed,
        varied=dict(days.vary),
        failures=failures(failing),
        explained=explained(np.array([not each.held for _, each in over]), quantities),
        failing_runs=tuple(row["run"] for row in failing),
        command=command or shlex.join(["wayproof", *sys.argv[1:]]),
        versions=versions(),
    )


def _sure(tally: Tally, terms: Terms) -> dict[str, Any]:
    """Verdict, bounds and method of a certificate."""
    counted, said = (tally.held, tally.runs), "undecided"
    if terms.probability is None:
        method = "Clopper-Pearson, number of runs fixed beforehand"
        low, high = clopper_pearson(*counted, terms.confidence) if tally.runs else (0.0, 1.0)
    else:
        method = "sequential mixture test, valid at every look"
        low, high = sequential_bounds(*counted, terms.confidence)
        said = verdict(*counted, terms.probability, terms.confidence)
    return {"verdict": said, "method": method, "probability_lower": low, "probability_upper": high}
