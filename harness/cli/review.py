"""The commands that show what was flown: `view`, `report`, `replay`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from harness.cli.options import (
    FAILED,
    AircraftName,
    JsonOption,
    NoRecordingOption,
    OutOption,
    argument,
    bad_input,
    faults_told,
    flag,
    option,
    print_json,
)
from harness.cli.replacing import NOTHING, Given, replacing
from harness.cli.standard_output import say

if TYPE_CHECKING:
    from harness.analysis.paper_table import Format


def view(
    runs: Annotated[
        list[Path],
        argument(
            "RUN_DIR...", "Run folders (several are overlaid), or a campaign's folder, as a table of runs."
        ),
    ],
    web: Annotated[bool, flag("--web", "Show them in a browser, served on 127.0.0.1.")] = False,
) -> int:
    """Opens recordings in the rerun viewer.

    For example: wayproof view runs/paper_circles/rolling_window-aerosonde-1
    """
    from harness.campaign.results import INDEX, RESULTS, RUNS, fly_again
    from harness.files.input_file import InputError

    campaign = next((each for each in runs if (each / INDEX).is_file()), None)
    if campaign is not None and len(runs) > 1:
        raise InputError(
            f"{campaign}: the folder of a campaign is opened alone; its runs are in {campaign / 'runs'}"
        )
    if campaign is not None:
        return 0 if open_campaign(campaign, web) else FAILED
    for each in runs:
        folder = each.resolve().parent.parent
        is_run = each.resolve().parent.name == RUNS and each.name.isdecimal() and (folder / INDEX).is_file()
        if is_run and not each.exists():
            raise InputError(
                f"{each}: no run folder was kept; `{fly_again(folder / RESULTS, int(each.name))}` flies the run again "
                "with a recording, `recordings: thin` in the campaign's file keeps one of every run"
            )
    return 0 if open_viewer(runs, web) else FAILED


def report(
    run: Annotated[Path, argument("RUN_DIR", "The folder of a complete run, or of a campaign.")],
    by: Annotated[
        list[str] | None, option("KEY[,KEY]", "Of a campaign: a table by these keys; can be repeated.")
    ] = None,
    table: Annotated[
        Literal["latex", "csv", "markdown"] | None,
        option("FORMAT", "Of a campaign or comparison: only its table: latex, csv, markdown.", "--format"),
    ] = None,
    out: Annotated[Path | None, option("FILE", "Of --format: a file in place of standard output.")] = None,
) -> int:
    """Writes report.html, one self-contained page, into a run folder; summary.html into that of a campaign.

    Beside report.html lie its figures as SVG and PNG, and its table as CSV and Markdown.

    For example: wayproof report runs/paper_circles/rolling_window-aerosonde-1

    With --format latex, csv or markdown the table of a campaign or a comparison, for a paper: wayproof report
    runs/comparison --format latex
    """
    from harness.campaign.folder import LOCK
    from harness.campaign.results import INDEX, RESULTS
    from harness.files.errors import RunFolderError
    from harness.files.folder_lock import is_held
    from harness.files.input_file import InputError
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
        return 0
    if (run / RESULTS).is_file():
        _summary(run, keys)
        return 0
    if (run / INDEX).is_file() and is_held(run / LOCK):
        raise InputError(
            f"{run}: its campaign is being flown and has no tables yet; ask again in a minute, or when it has ended"
        )
    if (run / INDEX).is_file():
        raise InputError(
            f"{run}: its campaign was stopped before the tables were written; `wayproof sweep` with --resume makes them"
        )
    try:
        say(f"report: {write_report(run)}")
    except RunFolderError as error:
        raise bad_input(error) from error
    return 0


def _summary(folder: Path, keys: Sequence[Sequence[str]] | None) -> None:
    """The answers of a campaign once more, by other keys perhaps."""
    from harness.campaign.report import write_summary
    from harness.campaign.summary import summarise
    from harness.cli.summary_table import print_summary

    summary = summarise(folder, keys)
    page = write_summary(summary, folder)
    print_summary(summary, all_tables=keys is not None)
    say(f"summary: {page}")


def _print_table(folder: Path, keys: Sequence[Sequence[str]] | None, table: Format, out: Path | None) -> None:
    """The table of a campaign or a comparison for a paper."""
    from harness.analysis.paper_table import paper_table
    from harness.analysis.rows import legend as compared_legend
    from harness.analysis.rows import rows_for_paper as compared
    from harness.campaign.cell import legend
    from harness.campaign.report import rows_for_paper
    from harness.campaign.results import RESULTS
    from harness.campaign.summary import summarise
    from harness.comparison.comparison import read_rows
    from harness.files.errors import WriteError
    from harness.files.whole_file import replace_text

    if (folder / RESULTS).is_file():
        text = paper_table(*rows_for_paper(summarise(folder, keys)), table, legend())
    else:
        text = paper_table(*compared(read_rows(folder)), table, compared_legend())
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
    from harness.files.strict_yaml import InputError, as_spelt

    try:
        return as_spelt(key)
    except ValueError as error:
        raise InputError(f"command line: --by: {error}") from error


def open_viewer(runs: Sequence[Path], web: bool = False) -> bool:
    """Shows recordings until the viewer is closed; says on standard error why, if it cannot start."""
    from harness.recording.viewer import open_viewer

    return _opened(lambda tell: open_viewer(runs, web, tell))


def open_campaign(folder: Path, web: bool = False) -> bool:
    """The same with the recordings of a campaign as a table."""
    from harness.campaign.table import recordings_of
    from harness.files.errors import RunFolderError
    from harness.recording.catalog import open_table
    from harness.recording.properties import NO_RECORDINGS

    recordings = recordings_of(folder)
    if not recordings:
        raise bad_input(RunFolderError(NO_RECORDINGS.format(folder)))
    say(f"{len(recordings)} recordings", err=True)
    return _opened(lambda tell: open_table(folder.resolve().name, recordings, web, tell))


def _opened(shown: Callable[[Callable[[str], None]], None]) -> bool:
    from harness.files.errors import RunFolderError
    from harness.recording.viewer import ViewerError

    try:
        shown(lambda told: say(told, err=True))
    except RunFolderError as error:
        raise bad_input(error) from error
    except ViewerError as error:
        say(f"wayproof: {error}", err=True)
        return False
    return True


@replacing("guidance", "settings")
def replay(
    log: Annotated[
        Path, argument("LOG", "A table (.parquet, .csv) of flown columns, or a flight log (.ulg, .bin, ...).")
    ],
    aircraft: AircraftName,
    mission: Annotated[
        Path | None,
        option(
            "FILE", "Its mission: a file of `check`, or a JSON with its corners. Default: that of the log."
        ),
    ] = None,
    given: Given = NOTHING,
    steady_wind: Annotated[
        bool, flag("--steady-wind", "Fly one wind, not the wind as it changed in the log.")
    ] = False,
    out: OutOption = None,
    no_recording: NoRecordingOption = False,
    as_json: JsonOption = False,
) -> int:
    """Flies the mission of a flown log with the simulated aircraft, in the wind of that day, and compares the two.

    For example: wayproof replay thor75.parquet --aircraft ultrastick25e --mission thor75.json
    """
    from harness.cli.terminal import print_table
    from harness.files.errors import WriteError
    from harness.replays.page import rows_of
    from harness.replays.replay import default_folder
    from harness.replays.replay import replay as flown_anew

    folder = out or default_folder(log)
    try:
        with faults_told(lambda: f"what was written is in {folder}"):
            found = flown_anew(
                log,
                aircraft,
                folder,
                mission,
                given.keys,
                windows=not steady_wind,
                recording=not no_recording,
            )
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
