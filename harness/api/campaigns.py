"""Many flights from Python: `compare`, `sweep`, and reading a campaign's folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from harness.api.flights import as_input_errors, given_parts, in_python
from harness.api.results import CampaignResult, ComparisonResult
from harness.files.input_file import InputError
from harness.scenario.kinds import GUIDANCE, PLANNER, LoopPart, imported_sources, registered
from harness.scenario.scenario import Scenario

if TYPE_CHECKING:
    from harness.campaign.flight import Answer


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
    a time, by default one a processor. An InputError says that one of them cannot be used; nothing was flown.
    """
    import pyarrow as pa

    from harness.comparison.comparison import fly_and_compare

    every = [scenarios] if isinstance(scenarios, Scenario | str | Path) else scenarios
    loaded = [given_parts(each) for each in every]
    kinds = _kinds_of(planners, PLANNER, "planners")
    parts, called = [{"planner.kind": kind} for kind in kinds], f"{[each.name for each in loaded]}, {kinds}"
    if guidance is not None:
        laws = _kinds_of(guidance, GUIDANCE, "guidance")
        parts = [{**part, "guidance.kind": law} for part in parts for law in laws]
        called = f"{called}, guidance={laws}"
    with as_input_errors():
        compared = fly_and_compare(
            [each.with_(keys) for each in loaded for keys in parts],
            Path(out),
            recording=recording,
            workers=workers,
            command=in_python(f"wayproof.compare({called})"),
            sources=(imported_sources(*planners), imported_sources(*(guidance or ()))),
        )
    return ComparisonResult(pa.Table.from_pylist([row.plain() for row in compared.rows]), Path(out))


def _kinds_of(names: Sequence[str], part: LoopPart, argument: str) -> list[str]:
    """Returns the kinds of planners or laws by name; FILE.py:NAME or MODULE:NAME is imported."""
    if isinstance(names, str) or not len(names) or not all(isinstance(each, str) for each in names):
        text = f"give {argument} as a list of names, FILE.py:NAME for your own"
        raise InputError(f"wayproof: compare flies in processes of its own; {text}")
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

    `campaign` is its file, or the name of one that comes with wayproof; `out` its folder, by default `runs/NAME`.
    `workers` flights are flown at a time, by default one a processor; `scheduler` is the address of a Dask cluster that
    flies instead, such as `tls://HOST:8786`, and can run code on this machine. `resume`: only the runs missing in the
    folder are flown. `progress` is called with the answer of every run that has ended.

    Raises:
        InputError: the campaign or the folder cannot be used; nothing was flown.
        OSError: the folder cannot be written any more, or processes died; `resume=True` goes on.
    """
    from harness.campaign.campaign_file import load_campaign as read_campaign
    from harness.campaign.folder import CampaignFolder, fly_missing, unfinished_text
    from harness.campaign.runs import CampaignRuns
    from harness.campaign.summary import write_summary
    from harness.campaign.workers import dask_workers, local_workers
    from harness.scenario.shipped import campaign_path

    if scheduler and workers:
        raise InputError("wayproof: workers goes with this machine, scheduler with a cluster; give one")
    runs = CampaignRuns(read_campaign(campaign_path(str(campaign))))
    runs.check()
    folder = Path(out) if out is not None else Path("runs") / runs.campaign.name
    with (
        as_input_errors(),
        dask_workers(scheduler) if scheduler else local_workers(workers, len(runs)) as flyers,
        CampaignFolder(folder, runs, resume=resume) as claimed,
    ):
        left = fly_missing(runs, claimed, flyers, progress)
    result = CampaignResult(folder)
    write_summary(result.summary, folder)
    if left:
        raise OSError(f"wayproof: {unfinished_text(left)}")
    return result


def load_campaign(folder: str | Path) -> CampaignResult:
    """Reads the folder of a campaign, complete or not; an InputError says that it holds none, or is damaged."""
    if (path := Path(folder)).is_file():
        raise InputError(f"wayproof: {path} is a file; give the folder of a campaign, or fly it with sweep")
    result = CampaignResult(path)
    len(result.table)
    return result
