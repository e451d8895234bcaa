"""The command `sweep`: a campaign."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from harness.cli.command_line import FAILED, at_a_time, print_json, resumable
from harness.cli.options import Json, Out, Quiet, Resume, Text, Workers, argument, flag, option
from harness.cli.replacing import NOTHING, Given, planner_kind, replacing, sources
from harness.cli.standard_output import say
from harness.cli.terminal import step_bar
from harness.files.input_file import InputError

if TYPE_CHECKING:
    from harness.campaign.runs import CampaignRuns
    from harness.campaign.workers import Workers as Flyers


CAMPAIGNS: Final = "harness.scenario.shipped:shipped_campaigns"
PLANNERS: Final = "Replaces planners: kinds, or FILE.py:NAME, MODULE:NAME."
SCHEDULER: Final = "A Dask cluster that flies instead: tls://HOST:8786. It can run code on this machine."
UNENCRYPTED: Final = "Allow a --scheduler beyond this machine without TLS, in a trusted network."


@replacing("guidance", "conditions", "wind", "turbulence", "seed", "settings")
def sweep(
    campaign: Annotated[str, argument("CAMPAIGN", "A campaign file, or a shipped one's name.", CAMPAIGNS)],
    planners: Annotated[Text, option("A,B,...", PLANNERS, "--planners", "--planner")] = None,
    given: Given = NOTHING,
    workers: Workers = None,
    scheduler: Annotated[Text, option("ADDRESS", SCHEDULER)] = None,
    unencrypted: Annotated[bool, flag("--unencrypted", UNENCRYPTED)] = False,
    out: Out = None,
    resume: Resume = False,
    quiet: Quiet = False,
    as_json: Json = False,
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
    from harness.campaign.summary import summarise, write_summary
    from harness.campaign.workers import dask_workers, local_workers
    from harness.cli.summary_table import print_summary
    from harness.scenario.shipped import campaign_path

    named = [each.strip() for each in planners.split(",")] if planners else []
    runs = checked(campaign_path(campaign), named, given.keys, given.sources[1])
    folder = out or Path("runs") / runs.campaign.name
    local = partial(local_workers, at_a_time(workers))
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
    runs: CampaignRuns, path: Path, workers: AbstractContextManager[Flyers], *, resume: bool, silent: bool
) -> tuple[dict[str, int], bool]:
    """Flies what is missing; returns how many runs ended how, and whether all are over."""
    from harness.campaign.flight import Answer
    from harness.campaign.folder import CampaignFolder
    from harness.campaign.results import INDEX
    from harness.campaign.sweep import fly_missing, told_left

    with (
        resumable(path, INDEX),
        workers as flyers,
        CampaignFolder(path, runs, resume=resume) as folder,
        step_bar(silent) as bar,
    ):
        over, not_reached = len(folder.over), 0

        def report(answer: Answer) -> None:
            nonlocal over, not_reached
            over += 1
            not_reached += answer.row["outcome"] != "reached"
            bar(over, len(runs), f"flights, {not_reached} not at the goal" if not_reached else "flights")

        broken_off = fly_missing(runs, folder, flyers, report)
        if broken_off:
            say(f"wayproof: {told_left(broken_off)}", err=True)
        return folder.outcomes(), not broken_off
