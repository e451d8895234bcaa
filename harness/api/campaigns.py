"""Many flights from Python: `compare`, `sweep`, and reading a campaign's folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from harness.api.errors import as_input_errors
from harness.api.flights import in_python
from harness.api.results import CampaignResult, ComparisonResult
from harness.files.input_file import InputError
from harness.scenario.scenario import Scenario, load_scenario

if TYPE_CHECKING:
    from harness.campaign.flight import Answer
    from harness.scenario.given import LoopPart


def compare(
    scenarios: Scenario | str | Path | Sequence[Scenario | str | Path],
    planners: Sequence[str],
    out: str | Path = "runs/comparison",
    recording: bool = False,
    *,
    guidance: Sequence[str] | None = None,
    kinematic: bool = False,
    workers: int | None = None,
) -> ComparisonResult:
    """Flies every planner (under every guidance law) through every scenario: tables, figures, a report.

    Args:
        scenarios: one or more: scenarios, files, or names of those that come with wayproof.
        planners: kinds, in order; or `FILE.py:NAME`, `MODULE:NAME`.
        out: the comparison's folder.
        recording: whether to record each flight and an overlay of all.
        guidance: kinds of guidance laws, in order; or `FILE.py:NAME`, `MODULE:NAME`. Default: the scenario's own.
        kinematic: a point that follows every plan exactly flies in place of the aircraft.
        workers: flights at a time; default: one a processor.

    Raises:
        InputError: a scenario, planner, law or the folder cannot be used; nothing was flown.
    """
    import pyarrow as pa

    from harness.comparison.comparison import fly_and_compare
    from harness.scenario.given import GUIDANCE, PLANNER, is_source

    given = [scenarios] if isinstance(scenarios, Scenario | str | Path) else scenarios
    loaded = [each if isinstance(each, Scenario) else load_scenario(each) for each in given]
    kinds = _named(planners, PLANNER, "planners")
    laws = None if guidance is None else _named(guidance, GUIDANCE, "guidance")
    chosen = [{"planner.kind": kind} for kind in kinds]
    if laws is not None:
        chosen = [keys | {"guidance.kind": law} for keys in chosen for law in laws]
    of_laws = "" if laws is None else f", guidance={laws}"
    with as_input_errors():
        compared = fly_and_compare(
            [each.with_(keys) for each in loaded for keys in chosen],
            Path(out),
            recording=recording,
            kinematic=kinematic,
            workers=workers or os.cpu_count() or 1,
            command=in_python(f"wayproof.compare({[each.name for each in loaded]}, {kinds}{of_laws})"),
            sources=[each for each in planners if is_source(each)],
            law_sources=[each for each in guidance or () if is_source(each)],
        )
    return ComparisonResult(pa.Table.from_pylist([asdict(row) for row in compared.rows]), Path(out))


def _named(names: Sequence[str], part: LoopPart, argument: str) -> list[str]:
    """The kinds that names mean: those given as FILE.py:NAME or MODULE:NAME are imported.

    Raises:
        InputError: one is not a name, or cannot be imported.
    """
    from harness.scenario.given import registered

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
        scheduler: address of a Dask cluster that flies instead, such as `tls://HOST:8786`. It can run code on this
            machine.
        resume: fly only the runs missing in the folder.
        progress: called with the answer of every run that has ended.

    Raises:
        InputError: the campaign or the folder cannot be used; nothing was flown.
        OSError: the folder cannot be written any more; `resume=True` goes on.
    """
    from harness.campaign.campaign_file import load_campaign as read_campaign
    from harness.campaign.folder import CampaignFolder
    from harness.campaign.report import write_summary
    from harness.campaign.runs import CampaignRuns
    from harness.campaign.sweep import fly_missing
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
        fly_missing(runs, claimed, flyers, progress)
    result = CampaignResult(folder)
    write_summary(result.summary, folder)
    return result


def load_campaign(folder: str | Path) -> CampaignResult:
    """Reads the folder of a campaign, complete or not.

    Args:
        folder: where `sweep` wrote; not the campaign's file, which `sweep` flies.

    Raises:
        InputError: the folder holds no campaign, or a file of it cannot be read.
    """
    path = Path(folder)
    if path.is_file():
        raise InputError(
            f"wayproof: {path} is a file; give the folder of a campaign, or fly the file with sweep"
        )
    result = CampaignResult(path)
    len(result.table)
    return result
