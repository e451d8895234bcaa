"""The command `sweep`: a campaign, and its answers in 80 columns."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from harness.cli.command_line import FAILED, print_json, resumable
from harness.cli.options import Json, Out, Quiet, Resume, Text, Workers, argument, flag, option
from harness.cli.replacing import NOTHING, Given, kind_of, replacing
from harness.cli.terminal import coloured, plain, print_line, print_table, say, step_bar
from harness.files.input_file import InputError
from harness.files.wording import counted

if TYPE_CHECKING:
    from harness.campaign.paired import Duel
    from harness.campaign.runs import CampaignRuns
    from harness.campaign.summary import Summary, Table
    from harness.campaign.workers import Workers as Flyers

MOST_FAILURES: Final = 5  # runs that failed are named on the terminal up to this many
LEGEND: Final = (
    "reached, below the wanted clearance, tracks: 95 % interval; length over the optimum: median/p95; plan: p99/max"
)
PLANNERS_HELP: Final = "Replaces planners: kinds, or FILE.py:NAME, MODULE:NAME."
SCHEDULER_HELP: Final = "A Dask cluster that flies instead: tls://HOST:8786. It can run code on this machine."
UNENCRYPTED_HELP: Final = "Allow a --scheduler beyond this machine without TLS, in a trusted network."


@replacing("guidance", "conditions", "wind", "turbulence", "seed", "settings")
def sweep(
    campaign: Annotated[str, argument("CAMPAIGN", "A campaign file, or a shipped one's name.")],
    planners: Annotated[Text, option("A,B,...", PLANNERS_HELP, "--planners", "--planner")] = None,
    given: Given = NOTHING,
    workers: Workers = None,
    scheduler: Annotated[Text, option("ADDRESS", SCHEDULER_HELP)] = None,
    unencrypted: Annotated[bool, flag("--unencrypted", UNENCRYPTED_HELP)] = False,
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
    if scheduler and workers:
        raise typer.BadParameter("--workers goes with this machine, --scheduler with a cluster; give one")
    if unencrypted and not scheduler:
        raise typer.BadParameter("--unencrypted goes with --scheduler")
    from harness.campaign.summary import summarise, write_summary
    from harness.campaign.workers import dask_workers, local_workers
    from harness.scenario.shipped import campaign_path

    named = [each.strip() for each in planners.split(",")] if planners else []
    runs = checked(campaign_path(campaign), named, given.keys, given.sources[1])
    folder = out or Path("runs") / runs.campaign.name

    def warn(text: str) -> None:
        say(f"wayproof: {text}", err=True)

    flyers = dask_workers(scheduler, unencrypted, warn) if scheduler else local_workers(workers, len(runs))
    outcomes, failed = _fly(runs, folder, flyers, resume=resume, silent=quiet)
    summary = summarise(folder)
    page = write_summary(summary, folder)
    if as_json:
        print_json({"results": str(folder / "results.parquet"), "runs": len(runs), "outcomes": outcomes})
    elif not quiet:
        print_summary(summary)
        say(f"results: {folder / 'results.parquet'}")
        say(f"summary: {page}")
    return FAILED if failed else 0


def checked(
    path: Path,
    planners: Sequence[str] = (),
    settings: Sequence[tuple[str, str]] = (),
    laws: tuple[str, ...] = (),
) -> CampaignRuns:
    """Returns the runs of a campaign file, after making every scenario of them once."""
    from harness.campaign.campaign_file import is_a, load_campaign
    from harness.campaign.runs import CampaignRuns
    from harness.scenario.kinds import imported_sources

    try:
        kinds = [kind_of(each) for each in planners]
        runs = CampaignRuns(load_campaign(path, kinds, settings), imported_sources(*planners), laws)
    except InputError as error:
        if is_a("scenario", path):
            use = shlex.join(["wayproof", "fly", str(path)])
            raise InputError(f"{path}: this is a scenario: use `{use}`") from error
        raise
    with step_bar() as bar:
        runs.check(lambda done: bar(done, len(runs), "scenarios checked"))
    return runs


def _fly(
    runs: CampaignRuns, path: Path, workers: AbstractContextManager[Flyers], *, resume: bool, silent: bool
) -> tuple[dict[str, int], bool]:
    """Flies the missing runs; returns the number of runs by outcome, and whether one failed or is not over."""
    from harness.campaign.flight import Answer
    from harness.campaign.folder import CampaignFolder, fly_missing, unfinished_text

    with (
        resumable(path),
        workers as flyers,
        CampaignFolder(path, runs, resume=resume) as folder,
        step_bar(silent) as bar,
    ):
        finished, not_reached = len(folder.finished), 0

        def report(answer: Answer) -> None:
            nonlocal finished, not_reached
            finished += 1
            not_reached += answer.row["outcome"] != "reached"
            bar(finished, len(runs), f"flights, {not_reached} not at the goal" if not_reached else "flights")

        if broken_off := fly_missing(runs, folder, flyers, report):
            say(f"wayproof: {unfinished_text(broken_off)}", err=True)
        return folder.outcomes(), bool(broken_off) or "error" in folder.outcomes()


def print_summary(summary: Summary, all_tables: bool = False) -> None:
    """Prints the answers on standard output, with `all_tables` every table, else the first alone."""
    from harness.campaign.cell import QUESTIONS

    _print_counts(summary)
    if not summary.total.runs:
        return
    heads = ("", "runs", *(question.short for question in QUESTIONS))
    whole = ("all runs", *summary.total.answers)
    for table in summary.tables if all_tables else summary.tables[:1]:
        keys = [table.rows.key, *([table.columns.key] if table.columns else [])]
        print_table(" x ".join(keys), [*_lines(table), whole], heads)
    if not summary.tables:
        print_table("", [whole], heads)
    print_line(LEGEND, style="dim")
    for duel in summary.duels:
        _print_duel(duel)
    _print_worst(summary)


def _print_worst(summary: Summary) -> None:
    """Prints the runs that failed, and how to fly and to see one again."""
    from harness.analysis.metric import number

    failed = [run for run in summary.worst if run.outcome != "reached"]
    for run in failed[:MOST_FAILURES]:
        near = "" if run.min_clearance_m is None else f", least clearance {number(run.min_clearance_m)} m"
        print_line(f"{coloured(run.outcome)} run {run.run} ({plain(run.name)}){near}")
    if failed and failed[0].command:
        say(f"again: {failed[0].command}")
    for view in [run.view for run in summary.worst if run.view][:1]:
        say(f"view: {view}")


def _print_counts(summary: Summary) -> None:
    total, missing = summary.total.runs, summary.missing
    runs = f"{total} of {counted(summary.planned or 0, 'run')}" if missing else counted(total, "run")
    ended = ", ".join(f"{outcome} {count}" for outcome, count in summary.outcomes.items())
    print_line(plain(f"{summary.name}: {runs}{ended and f': {ended}'}"))
    print_line(plain(f"conditions: {summary.conditions}"))
    if summary.never:
        print_line(plain(summary.never))
    if missing:
        print_line(f"[bold yellow]not complete[/]: {missing} missing, --resume flies what the journal lacks")


def _print_duel(duel: Duel) -> None:
    """Prints which figures of two planners differ beyond chance, at 5 %."""
    first, second = plain(duel.first), plain(duel.second)
    differ = [each for each in duel.figures if each.p is not None and each.p < 0.05]
    figures = "; ".join(f"{plain(each.figure)} {each.difference.text()}" for each in differ)
    none = "no figure differs at 5 %" if duel.tells else f"too few cases ({duel.cases}) to tell at 5 %"
    print_line(
        f"{first} against {second} in {counted(duel.pairs, 'pair')} of flights ({duel.only_first} reached by "
        f"{first} alone, {duel.only_second} by {second} alone): "
        + (f"figures that differ at 5 %: {figures}" if figures else none)
    )


def _lines(table: Table) -> list[Sequence[str]]:
    """Returns a line a cell; with two keys, the first one's value stands above the lines of the second."""
    lines: list[Sequence[str]] = []
    for label, cells in zip(table.rows.labels, table.cells, strict=True):
        if table.columns is None:
            lines.append((plain(label), *cells[0].answers))
            continue
        lines.append((f"[bold]{plain(label)}[/]",))
        names = zip(table.columns.labels, cells, strict=True)
        lines += [(f" {plain(name)}", *cell.answers) for name, cell in names]
    return lines
