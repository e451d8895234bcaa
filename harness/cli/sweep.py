"""The command `sweep`: a campaign."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli.options import (
    FAILED,
    JsonOption,
    OutOption,
    QuietOption,
    ResumeOption,
    WorkersOption,
    argument,
    completing,
    flag,
    option,
    print_json,
    resumable,
)
from harness.cli.replacing import NOTHING, Given, planner_kind, replacing, sources
from harness.cli.standard_output import say

if TYPE_CHECKING:
    from harness.campaign.runs import CampaignRuns
    from harness.campaign.workers import Workers


@replacing("guidance", "conditions", "wind", "turbulence", "seed", "settings")
def sweep(
    campaign: Annotated[
        str,
        argument(
            "CAMPAIGN",
            "A campaign file, or a shipped one's name.",
            autocompletion=completing("harness.scenario.shipped:shipped_campaigns"),
        ),
    ],
    planners: Annotated[
        str | None,
        option(
            "A,B,...", "Replaces planners: kinds, or FILE.py:NAME, MODULE:NAME.", "--planners", "--planner"
        ),
    ] = None,
    given: Given = NOTHING,
    workers: WorkersOption = None,
    scheduler: Annotated[
        str | None,
        option(
            "ADDRESS", "A Dask cluster that flies instead: tls://HOST:8786. It can run code on this machine."
        ),
    ] = None,
    unencrypted: Annotated[
        bool,
        flag("--unencrypted", "Allow a --scheduler beyond this machine without TLS, in a trusted network."),
    ] = False,
    out: OutOption = None,
    resume: ResumeOption = False,
    dry_run: Annotated[bool, flag("--dry-run", "Print the runs; fly and write nothing.")] = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> int:
    """Flies a campaign: many flights on all processors or a cluster, one row each in results.parquet.

    For example: wayproof sweep forest_planners --workers 4

    Exit status:

    0 every run was flown to its end, whatever its outcome

    1 the software failed in a run (its row has the traceback), or the disk was full or the cluster gone (--resume
    goes on)

    2 bad input or usage, nothing flown

    130 interrupted; --resume goes on
    """
    _check_usage(scheduler, workers, unencrypted)
    from harness.campaign.report import write_summary
    from harness.campaign.summary import summarise
    from harness.campaign.workers import dask_workers, local_workers
    from harness.cli.summary_table import print_summary
    from harness.scenario.shipped import campaign_path

    named = [each.strip() for each in planners.split(",")] if planners else []
    runs = checked(campaign_path(campaign), named, given.keys, given.sources[1])
    if dry_run:
        _print_runs(runs, as_json)
        return 0
    folder = out or Path("runs") / runs.campaign.name
    local = partial(local_workers, workers or os.cpu_count() or 1)
    flyers = dask_workers(scheduler, unencrypted, _warn) if scheduler else local()
    told, whole = _fly(runs, folder, flyers, resume=resume, silent=quiet)
    summary = summarise(folder)
    page = write_summary(summary, folder)
    if as_json:
        print_json({"results": str(folder / "results.parquet"), "runs": len(runs), "outcomes": told})
    elif not quiet:
        print_summary(summary)
        say(f"results: {folder / 'results.parquet'}")
        say(f"summary: {page}")
    return FAILED if "error" in told or not whole else 0


def _check_usage(scheduler: str | None, workers: int | None, unencrypted: bool) -> None:
    if scheduler and workers:
        raise typer.BadParameter("--workers goes with this machine, --scheduler with a cluster; give one")
    if unencrypted and not scheduler:
        raise typer.BadParameter("--unencrypted goes with --scheduler")


def _print_runs(runs: CampaignRuns, as_json: bool) -> None:
    from dataclasses import asdict

    from harness.cli.summary_table import print_runs

    if as_json:
        print_json([asdict(runs.run(number)) for number in range(len(runs))])
    else:
        print_runs(runs)


def _warn(text: str) -> None:
    say(f"wayproof: {text}", err=True)


def checked(
    path: Path,
    planners: Sequence[str] = (),
    settings: Sequence[tuple[str, str]] = (),
    laws: tuple[str, ...] = (),
) -> CampaignRuns:
    """The runs of a campaign file, every scenario of them made once."""
    from harness.campaign.campaign_file import is_scenario, load_campaign
    from harness.campaign.runs import CampaignRuns
    from harness.cli.terminal import step_bar
    from harness.files.strict_yaml import InputError

    try:
        kinds = [planner_kind(each) for each in planners]
        runs = CampaignRuns(load_campaign(path, kinds, settings), sources(*planners), laws)
    except InputError as error:
        if is_scenario(path):
            use = shlex.join(["wayproof", "fly", str(path)])
            raise InputError(f"{path}: this is a scenario: use `{use}`") from error
        raise
    with step_bar() as bar:
        runs.check(lambda done: bar(done, len(runs), "scenarios checked"))
    return runs


def _fly(
    runs: CampaignRuns, path: Path, workers: AbstractContextManager[Workers], *, resume: bool, silent: bool
) -> tuple[dict[str, int], bool]:
    """Flies what is missing; returns how many runs ended how, and whether all are over."""
    from harness.campaign.flight import Answer
    from harness.campaign.folder import CampaignFolder
    from harness.campaign.results import INDEX
    from harness.campaign.sweep import fly_missing, told_left
    from harness.cli.terminal import step_bar

    with (
        resumable(path, INDEX),
        workers as flyers,
        CampaignFolder(path, runs, resume=resume) as folder,
        step_bar(silent) as bar,
    ):
        over, not_reached = len(folder.done), 0

        def report(answer: Answer) -> None:
            nonlocal over, not_reached
            over += 1
            not_reached += answer.row["outcome"] != "reached"
            bar(over, len(runs), f"flights, {not_reached} not at the goal" if not_reached else "flights")

        broken_off = fly_missing(runs, folder, flyers, report)
        if broken_off:
            say(f"wayproof: {told_left(broken_off)}", err=True)
        return folder.outcomes(), not broken_off
