"""Many flights from Python: `compare`, `sweep`, `certify`, and reading a campaign's folder."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.api.flights import as_input_errors, in_python
from harness.api.results import CampaignResult, ComparisonResult
from harness.files.input_file import InputError
from harness.scenario.scenario import Scenario, load_scenario

if TYPE_CHECKING:
    from harness.analysis.metric import Claim
    from harness.campaign.flight import Answer
    from harness.certification.certification import Certificate, Tally
    from harness.scenario.kinds import LoopPart


def compare(
    scenarios: Scenario | str | Path | Sequence[Scenario | str | Path],
    planners: Sequence[str],
    out: str | Path = "runs/comparison",
    recording: bool = False,
    *,
    guidance: Sequence[str] | None = None,
    workers: int | None = None,
) -> ComparisonResult:
    """Flies every planner (under every guidance law) through every scenario: tables, figures, a report in `out`.

    Scenarios are objects, files, or names of those that come with wayproof; planners and laws are kinds, or
    `FILE.py:NAME`, `MODULE:NAME`. `recording` records each flight and an overlay of all. `workers` flights are flown at
    a time, by default one a processor.

    Raises:
        InputError: a scenario, planner, law or the folder cannot be used; nothing was flown.
    """
    import pyarrow as pa

    from harness.comparison.comparison import fly_and_compare
    from harness.scenario.kinds import GUIDANCE, PLANNER, is_source

    loaded = _loaded([scenarios] if isinstance(scenarios, Scenario | str | Path) else scenarios)
    told = [each.name for each in loaded]
    kinds = _named(planners, PLANNER, "planners")
    parts = [{"planner.kind": kind} for kind in kinds]
    command = f"wayproof.compare({told}, {kinds})"
    if guidance is not None:
        laws = _named(guidance, GUIDANCE, "guidance")
        parts = [{**part, "guidance.kind": law} for part in parts for law in laws]
        command = f"wayproof.compare({told}, {kinds}, guidance={laws})"
    with as_input_errors():
        compared = fly_and_compare(
            [each.with_(keys) for each in loaded for keys in parts],
            Path(out),
            recording=recording,
            workers=workers or os.cpu_count() or 1,
            command=in_python(command),
            sources=(tuple(filter(is_source, planners)), tuple(filter(is_source, guidance or ()))),
        )
    return ComparisonResult(pa.Table.from_pylist([row.plain() for row in compared.rows]), Path(out))


def _loaded(given: Sequence[Scenario | str | Path]) -> list[Scenario]:
    return [each if isinstance(each, Scenario) else load_scenario(each) for each in given]


def _named(names: Sequence[str], part: LoopPart, argument: str) -> list[str]:
    """The kinds that names mean; those given as FILE.py:NAME or MODULE:NAME are imported."""
    from harness.scenario.kinds import registered

    if isinstance(names, str) or not names or not all(isinstance(each, str) for each in names):
        raise InputError(
            f"wayproof: compare flies in processes of its own; give {argument} as a list of names, FILE.py:NAME for "
            "your own"
        )
    try:
        return [registered(each, part) for each in names]
    except ValueError as error:
        raise InputError(f"wayproof: {argument}: {error}") from error


def sweep(
    campaign: str | Path,
    out: str | Path | None = None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    progress: Callable[[Answer], None] | None = None,
) -> CampaignResult:
    """Flies a campaign on all processors, or on a Dask cluster, one row each in `results.parquet`.

    Args:
        campaign: its file, or the name of one that comes with wayproof.
        out: its folder; default: `runs/NAME`.
        workers: flights at a time; default: one a processor.
        scheduler: address of a Dask cluster, such as `tls://HOST:8786`. It can run code on this machine.
        resume: fly only the runs missing in the folder.
        progress: called with the answer of every run that has ended.

    Raises:
        InputError: the campaign or the folder cannot be used; nothing was flown.
        OSError: the folder cannot be written any more, or processes died; `resume=True` goes on.
    """
    from harness.campaign.campaign_file import load_campaign as read_campaign
    from harness.campaign.folder import CampaignFolder
    from harness.campaign.runs import CampaignRuns
    from harness.campaign.summary import write_summary
    from harness.campaign.sweep import fly_missing, told_left
    from harness.campaign.workers import dask_workers, local_workers
    from harness.scenario.shipped import campaign_path

    if scheduler and workers:
        raise InputError("wayproof: workers goes with this machine, scheduler with a cluster; give one")
    runs = CampaignRuns(read_campaign(campaign_path(str(campaign))))
    runs.check()
    folder = Path(out) if out is not None else Path("runs") / runs.campaign.name
    with (
        as_input_errors(),
        dask_workers(scheduler) if scheduler else local_workers(workers or os.cpu_count() or 1) as flyers,
        CampaignFolder(folder, runs, resume=resume) as claimed,
    ):
        left = fly_missing(runs, claimed, flyers, progress)
    result = CampaignResult(folder)
    write_summary(result.summary, folder)
    if left:
        raise OSError(f"wayproof: {told_left(left)}")
    return result


def load_campaign(folder: str | Path) -> CampaignResult:
    """Reads the folder of a campaign, complete or not; an InputError says that it holds none, or is damaged."""
    path = Path(folder)
    if path.is_file():
        raise InputError(
            f"wayproof: {path} is a file; give the folder of a campaign, or fly the file with sweep"
        )
    result = CampaignResult(path)
    len(result.table)
    return result


def certify(
    subject: Scenario | str | Path | Sequence[Sequence[float]],
    claim: Claim | None = None,
    *,
    probability: float | None = None,
    confidence: float = 0.95,
    runs: int = 1000,
    vary: Mapping[str, Any] | Sequence[str] = (),
    conditions: str | None = None,
    aircraft: str | None = None,
    scenario: str | Path | None = None,
    settings: Mapping[str, str] | None = None,
    out: str | Path | None = None,
    workers: int | None = None,
    resume: bool = False,
    progress: Callable[[Tally], None] | None = None,
) -> Certificate:
    """Flies a scenario or a given path on many days, and says how often a claim holds.

        found = wayproof.certify("aerosonde_forest", probability=0.9, vary={"environment.wind.speed_mps": (0, 8)})
        found.verdict, found.held, found.runs, found.probability_lower

    Args:
        subject: a scenario, its file or name; or a path: a file that `check` takes, or points (n, 2) in metres.
        claim: `reached`, `no-contact`, `trackable`, or of a path `as-given`. Default: `reached`, of a path `as-given`.
        probability: share of the days on which the claim is to hold; the flights end once that is shown or refuted.
            None: all `runs` days are flown, and nothing is to be shown.
        confidence: of each bound.
        runs: number of days, at most.
        vary: what is drawn anew every day: texts as `KEY=LO:HI`, `KEY=MEAN~SIGMA`, `KEY=A,B`; or by key path
            `(low, high)`, such a text without its key, or a distribution as a campaign file has it.
        conditions: replaces the scenario's.
        aircraft: likewise; of a path by default `aerosonde`.
        scenario: of a path: the world with obstacles, bounds and air.
        settings: further keys to replace, by key path; values as YAML.
        out: the folder; default: `runs/NAME/certify-CLAIM`.
        workers: flights at a time; default: one a processor. They do not change the answer.
        resume: fly only the days missing in the folder.
        progress: told of the days that count, after every day that is over.

    Raises:
        InputError: subject, claim or folder cannot be used; nothing was flown.
        OSError: the folder cannot be written any more; `resume=True` goes on.
    """
    from harness.campaign.workers import local_workers
    from harness.certification.certification import Terms
    from harness.certification.certification import certify as fly_days
    from harness.certification.days import days_of, distributions
    from harness.scenario.shipped import scenario_path

    given = {"aircraft.model": aircraft, "conditions": conditions}
    keys = [(key, json.dumps(value)) for key, value in given.items() if value is not None]
    try:
        drawn = distributions(vary)
    except ValueError as error:
        raise InputError(f"wayproof: vary: {error}") from error
    with as_input_errors():
        terms = Terms(probability, confidence)
        world = None if scenario is None else scenario_path(str(scenario))
        days = days_of(subject, [*keys, *(settings or {}).items()], drawn, claim, world, most=runs)
        days.check()
        folder = Path(out) if out is not None else Path("runs") / days.campaign.name / f"certify-{days.claim}"
        with local_workers(workers or os.cpu_count() or 1) as flyers:
            command = in_python(f"wayproof.certify({days.campaign.name!r}, {days.claim!r})")
            return fly_days(days, folder, flyers, terms, resume=resume, progress=progress, command=command)
