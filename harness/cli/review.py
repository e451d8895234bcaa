"""The commands that show what was flown: `view`, `report`, `replay`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Final, Literal

import typer

from harness.cli.command_line import FAILED, interruptible, print_json
from harness.cli.options import AircraftName, Json, NoRecording, Out, argument, flag, option
from harness.cli.replacing import NOTHING, Given, replacing
from harness.cli.standard_output import say
from harness.cli.terminal import print_table
from harness.files.errors import RunFolderError, WriteError
from harness.files.input_file import InputError

RUN_DIRS: Final = "Run folders (several are overlaid), or a campaign's folder, as a table of runs."
BY: Final = "Of a campaign: a table by these keys; can be repeated."
FORMAT: Final = "Of a campaign or comparison: only its table: latex, csv."
LOG: Final = "A table (.parquet, .csv) of flown columns, or a flight log (.ulg, .bin, ...)."
MISSION: Final = "Its mission: a file of `check`, or a JSON with its corners. Default: that of the log."


def view(
    runs: Annotated[list[Path], argument("RUN_DIR...", RUN_DIRS)],
    web: Annotated[bool, flag("--web", "Show them in a browser, served on 127.0.0.1.")] = False,
) -> int:
    """Opens recordings in the rerun viewer.

    For example: wayproof view runs/paper_circles/rolling_window-aerosonde-1
    """
    from harness.campaign.results import INDEX

    campaign = next((each for each in runs if (each / INDEX).is_file()), None)
    if campaign is None:
        for each in runs:
            _need_folder(each)
        return 0 if open_viewer(runs, web) else FAILED
    if len(runs) > 1:
        raise InputError(
            f"{campaign}: the folder of a campaign is opened alone; its runs are in {campaign / 'runs'}"
        )
    return 0 if open_campaign(campaign, web) else FAILED


def _need_folder(run: Path) -> None:
    """Raises InputError for a run of a campaign that kept no folder of it."""
    from harness.campaign.results import INDEX, RESULTS, RUNS, fly_again

    runs = run.resolve().parent
    if runs.name == RUNS and run.name.isdecimal() and (runs.parent / INDEX).is_file() and not run.exists():
        raise InputError(
            f"{run}: no run folder was kept; `{fly_again(runs.parent / RESULTS, int(run.name))}` flies the run again "
            "with a recording, `recordings: thin` in the campaign's file keeps one of every run"
        )


def report(
    run: Annotated[Path, argument("RUN_DIR", "The folder of a complete run, or of a campaign.")],
    by: Annotated[list[str] | None, option("KEY[,KEY]", BY)] = None,
    table: Annotated[Literal["latex", "csv"] | None, option("FORMAT", FORMAT, "--format")] = None,
    out: Annotated[Path | None, option("FILE", "Of --format: a file in place of standard output.")] = None,
) -> int:
    """Writes report.html, one self-contained page, into a run folder; summary.html into that of a campaign.

    Beside report.html lie its figures as SVG and PNG, and its table as CSV.

    For example: wayproof report runs/paper_circles/rolling_window-aerosonde-1

    With --format latex or csv the table of a campaign or a comparison, for a paper: wayproof report
    runs/comparison --format latex
    """
    from harness.campaign.results import RESULTS
    from harness.report.run_report import write_report

    if out is not None and table is None:
        raise typer.BadParameter("goes with --format", param_hint="--out")
    if by and not (run / RESULTS).is_file():
        raise typer.BadParameter(
            f"{run} has no {RESULTS}; only a campaign has tables by keys", param_hint="--by"
        )
    keys = [[_column(key.strip()) for key in each.split(",")] for each in by] if by else None
    if table is not None:
        _print_table(run, keys, table, out)
    elif (run / RESULTS).is_file():
        _summary(run, keys)
    else:
        _need_run(run)
        say(f"report: {write_report(run)}")
    return 0


def _need_run(folder: Path) -> None:
    """Raises InputError for the folder of a campaign that has no tables yet."""
    from harness.campaign.folder import LOCK
    from harness.campaign.results import INDEX
    from harness.files.folder_lock import is_held

    if (folder / INDEX).is_file():
        raise InputError(
            f"{folder}: its campaign is being flown and has no tables yet; ask again in a minute, or when it has ended"
            if is_held(folder / LOCK)
            else f"{folder}: its campaign was stopped before the tables were written; `wayproof sweep` with --resume "
            "makes them"
        )


def _summary(folder: Path, keys: Sequence[Sequence[str]] | None) -> None:
    """The answers of a campaign once more, by other keys perhaps."""
    from harness.campaign.summary import summarise, write_summary
    from harness.cli.summary_table import print_summary

    summary = summarise(folder, keys)
    page = write_summary(summary, folder)
    print_summary(summary, all_tables=keys is not None)
    say(f"summary: {page}")


def _print_table(folder: Path, keys: Sequence[Sequence[str]] | None, table: str, out: Path | None) -> None:
    """The table of a campaign or a comparison for a paper."""
    from harness.analysis import rows as compared
    from harness.campaign import cell
    from harness.campaign.results import RESULTS
    from harness.campaign.summary import rows_for_paper, summarise
    from harness.comparison.comparison import read_rows
    from harness.files.whole_file import replace_text

    if (folder / RESULTS).is_file():
        heads, lines, told = *rows_for_paper(summarise(folder, keys)), cell.legend()
    else:
        heads, lines, told = compared.rows_for_paper(read_rows(folder))
    text = compared.csv_table([heads, *lines]) if table == "csv" else compared.latex(heads, lines, told)
    if out is None:
        say(text.removesuffix("\n"))
        return
    try:
        replace_text(out, text)
    except OSError as error:
        raise WriteError(f"cannot write the table {out} ({error.strerror or error})") from error
    say(f"table: {out}")


def _column(key: str) -> str:
    """The column of a key, which may be spelled as `--set` takes it: `obstacles.0.velocity_mps`."""
    from harness.files.strict_yaml import as_spelt

    try:
        return as_spelt(key)
    except ValueError as error:
        raise InputError(f"command line: --by: {error}") from error


def open_viewer(runs: Sequence[Path], web: bool = False) -> bool:
    """Shows recordings until the viewer is closed; says on standard error why, if it cannot start."""
    from harness.recording.viewer import open_viewer

    return _opened(partial(open_viewer, runs, web))


def open_campaign(folder: Path, web: bool = False) -> bool:
    """The same with the recordings of a campaign as a table."""
    from harness.campaign.results import recordings_of
    from harness.recording.catalog import open_table
    from harness.recording.properties import NO_RECORDINGS

    recordings = recordings_of(folder)
    if not recordings:
        raise RunFolderError(NO_RECORDINGS.format(folder))
    say(f"{len(recordings)} recordings", err=True)
    return _opened(partial(open_table, folder.resolve().name, recordings, web))


def _opened(shown: Callable[[Callable[[str], None]], None]) -> bool:
    from harness.recording.viewer import ViewerError

    try:
        shown(lambda told: say(told, err=True))
    except ViewerError as error:
        say(f"wayproof: {error}", err=True)
        return False
    return True


@replacing("guidance", "settings")
def replay(
    log: Annotated[Path, argument("LOG", LOG)],
    aircraft: AircraftName,
    mission: Annotated[Path | None, option("FILE", MISSION)] = None,
    given: Given = NOTHING,
    out: Out = None,
    no_recording: NoRecording = False,
    as_json: Json = False,
) -> int:
    """Flies the mission of a flown log with the simulated aircraft, in the wind of that day, and compares the two.

    For example: wayproof replay thor75.parquet --aircraft ultrastick25e --mission thor75.json
    """
    from harness.replays.measures import rows_of
    from harness.replays.replay import default_folder
    from harness.replays.replay import replay as flown_anew

    folder = out or default_folder(log)
    try:
        with interruptible(lambda: f"what was written is in {folder}"):
            found = flown_anew(log, aircraft, folder, mission, given.keys, recording=not no_recording)
    except OSError as error:
        raise WriteError.of("the replay", folder, error) from error
    if as_json:
        print_json(found.told)
        return 0
    told = found.told
    wind, between = told["wind"], told["distance_between_m"]
    say(
        f"wind: {wind['speed_mps']:.2f} m/s from {wind['from_deg']:.0f} deg, residual {wind['residual_mps']:.2f} m/s"
        f"{', flown as it changes' if told['wind_windows'] else ''}"
    )
    laps = ", ".join(map(str, told["settled_laps"]))
    print_table(f"{log.name}: laps {laps}", rows_of(told), ("", "flown", "simulated", "difference"))
    say(f"distance between the tracks: p50 {between['p50']:.2f} m, p95 {between['p95']:.2f} m")
    for note in told["notes"]:
        say(f"note: {note}")
    say(f"folder: {folder}")
    return 0
