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
    ConditionsOption,
    JsonOption,
    SettingsOption,
    TurbulenceOption,
    WindOption,
    WorkersOption,
    air,
    bad_input,
    chosen,
    flag,
    planner_kind,
    print_json,
    settings_of,
    sources,
)
from harness.cli.standard_output import say

if TYPE_CHECKING:
    from harness.campaign.runs import CampaignRuns
    from harness.campaign.workers import Workers


def _campaigns(incomplete: str) -> list[str]:
    """Names for the shell to complete a campaign with; files it finds itself."""
    from harness.scenario.shipped import shipped_campaigns

    return [name for name in shipped_campaigns() if name.startswith(incomplete)]


def sweep(
    campaign: Annotated[
        str,
        typer.Argument(
            metavar="CAMPAIGN", help="A campaign file, or a shipped one's name.", autocompletion=_campaigns
        ),
    ],
    planners: Annotated[
        str | None,
        typer.Option(
            "--planners",
            "--planner",
            metavar="A,B,...",
            help="Replaces planners: kinds, or FILE.py:NAME, MODULE:NAME.",
        ),
    ] = None,
    conditions: ConditionsOption = None,
    wind: WindOption = None,
    turbulence: TurbulenceOption = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Replaces the campaign's seed.")] = None,
    settings: SettingsOption = None,
    workers: WorkersOption = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="A Dask cluster that flies instead: tls://HOST:8786. It can run code on this machine.",
        ),
    ] = None,
    unencrypted: Annotated[
        bool,
        flag("--unencrypted", "Allow a --scheduler beyond this machine without TLS, in a trusted network."),
    ] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The campaign's folder. Default: runs/NAME.")
    ] = None,
    resume: Annotated[bool, flag("--resume", "Fly only the runs missing in DIR.")] = False,
    dry_run: Annotated[bool, flag("--dry-run", "Print the runs; fly and write nothing.")] = False,
    quiet: Annotated[bool, flag("--quiet", "Print nothing but errors.")] = False,
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
    if scheduler and workers:
        raise typer.BadParameter("--workers goes with this machine, --scheduler with a cluster; give one")
    if unencrypted and not scheduler:
        raise typer.BadParameter("--unencrypted goes with --scheduler")
    from harness.campaign.report import write_summary
    from harness.campaign.summary import summarise
    from harness.campaign.workers import dask_workers, local_workers
    from harness.cli.campaign_terminal import print_summary
    from harness.scenario.shipped import campaign_path

    named = [each.strip() for each in planners.split(",")] if planners else []
    options = [*chosen(seed=seed, conditions=conditions), *air(wind, turbulence)]
    fixed = [*options, *settings_of(settings, options)]
    runs = checked(campaign_path(campaign), named, fixed)
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


def _warn(text: str) -> None:
    say(f"wayproof: {text}", err=True)


def checked(
    path: Path, planners: Sequence[str] = (), settings: Sequence[tuple[str, str]] = ()
) -> CampaignRuns:
    """The runs of a campaign file, every scenario of them made once; the rest as `load_campaign` takes it."""
    from harness.campaign.campaign_file import is_scenario, load_campaign
    from harness.campaign.runs import CampaignRuns
    from harness.cli.campaign_terminal import check_bar
    from harness.files.strict_yaml import InputError

    try:
        kinds = [planner_kind(each) for each in planners]
        runs = CampaignRuns(load_campaign(path, kinds, settings), sources(*planners))
    except InputError as error:
        if is_scenario(path):
            use = shlex.join(["wayproof", "fly", str(path)])
            raise InputError(f"{path}: this is a scenario: use `{use}`") from error
        raise
    with check_bar(len(runs)) as report:
        runs.check(report)
    return runs


def _fly(
    runs: CampaignRuns, path: Path, workers: AbstractContextManager[Workers], *, resume: bool, silent: bool
) -> tuple[dict[str, int], bool]:
    """Flies what is missing; returns how many runs ended how, and whether all are over."""
    from contextlib import nullcontext

    from harness.campaign.folder import CampaignFolder
    from harness.campaign.results import INDEX
    from harness.campaign.sweep import fly_missing, told_left
    from harness.cli.campaign_terminal import sweep_bar
    from harness.files.errors import RunFolderError

    try:
        with (
            workers as flyers,
            CampaignFolder(path, runs, resume=resume) as folder,
            nullcontext() if silent else sweep_bar(len(runs), len(folder.done)) as report,
        ):
            broken_off = fly_missing(runs, folder, flyers, report)
            if broken_off:
                say(f"wayproof: {told_left(broken_off)}", err=True)
            return folder.outcomes(), not broken_off
    except RunFolderError as error:
        raise bad_input(error) from error
    except OSError as error:
        say(f"wayproof: {error}; what is done is in {path}, --resume goes on", err=True)
        raise typer.Exit(FAILED) from error
    except KeyboardInterrupt:
        begun = (path / INDEX).exists()
        left = f"what is done is in {path}, --resume goes on" if begun else "nothing was written"
        say(f"wayproof: interrupted; {left}", err=True)
        raise


def _print_runs(runs: CampaignRuns, as_json: bool) -> None:
    if as_json:
        from dataclasses import asdict

        print_json([asdict(runs.run(number)) for number in range(len(runs))])
    else:
        from harness.cli.campaign_terminal import print_runs

        print_runs(runs)
