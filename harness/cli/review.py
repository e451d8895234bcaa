"""The commands about what was flown: `view`, `report`, `replay`, `export`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Annotated, Final, Literal

import typer

from harness.cli.command_line import FAILED, interruptible, print_json, writing
from harness.cli.options import AircraftName, Json, NoRecording, Out, argument, flag, option
from harness.cli.replacing import NOTHING, Given, replacing
from harness.cli.sweep import print_summary
from harness.cli.terminal import plain, print_line, print_table, say
from harness.files.errors import RunFolderError, WriteError
from harness.files.input_file import InputError, read_index

Form = Literal["plan", "waypoints", "geojson", "kml"]
What = Literal["flown", "planned"]

NO_RECORDINGS: Final = (
    "has no recordings: `recordings: thin` in the campaign's file keeps a small one of every run, `all` a whole one, "
    "`failures` a whole one of those that failed"
)
RUN_DIRS_HELP: Final = "Run folders (several are overlaid), or a campaign's folder, as a table of runs."
BY_HELP: Final = "Of a campaign: a table by these keys; can be repeated."
FORMAT_HELP: Final = "Of a campaign or comparison: its table: latex, csv, markdown."
LOG_HELP: Final = "A table (.parquet, .csv) of flown columns, or a flight log (.ulg, .bin, ...)."
MISSION_HELP: Final = "Its mission: a file of `check`, or a JSON with its corners. Default: that of the log."


def view(
    runs: Annotated[list[Path], argument("RUN_DIR...", RUN_DIRS_HELP)],
    web: Annotated[bool, flag("--web", "Show them in a browser, served on 127.0.0.1.")] = False,
) -> int:
    """Opens recordings in the rerun viewer.

    For example: wayproof view runs/paper_circles/rolling_window-aerosonde-1
    """
    from harness.campaign.results import INDEX

    campaign = next((each for each in runs if (each / INDEX).is_file()), None)
    if campaign is not None and len(runs) > 1:
        text = f"the folder of a campaign is opened alone; its runs are in {campaign / 'runs'}"
        raise InputError(f"{campaign}: {text}")
    for each in runs if campaign is None else ():
        _need_folder(each)
    return 0 if open_viewer(runs, web, campaign) else FAILED


def _need_folder(run: Path) -> None:
    """Raises InputError for a run of a campaign that kept no folder of it."""
    from harness.campaign.results import INDEX, RESULTS, RUNS, fly_again

    runs = run.resolve().parent
    if runs.name == RUNS and run.name.isdecimal() and (runs.parent / INDEX).is_file() and not run.exists():
        raise InputError(
            f"{run}: no run folder was kept; `{fly_again(runs.parent / RESULTS, int(run.name))}` flies the run again "
            "with a recording, `recordings: thin` in the campaign's file keeps one of every run"
        )


def open_viewer(runs: Sequence[Path], web: bool = False, campaign: Path | None = None) -> bool:
    """Shows recordings, a campaign's as a table, until the viewer is closed; says why and returns False if it can't."""
    from harness.recording.viewer import ViewerError, open_viewer

    notify = partial(say, err=True)
    try:
        if campaign is None:
            open_viewer(runs, web, notify)
        else:
            from harness.campaign.results import recordings_of
            from harness.recording.catalog import open_table

            if not (recordings := recordings_of(campaign)):
                raise RunFolderError(f"{campaign} {NO_RECORDINGS}")
            notify(f"{len(recordings)} recordings")
            open_table(campaign.resolve().name, recordings, web, notify)
    except ViewerError as error:
        notify(f"wayproof: {error}")
        return False
    return True


def report(
    run: Annotated[Path, argument("RUN_DIR", "The folder of a complete run, or of a campaign.")],
    by: Annotated[list[str] | None, option("KEY[,KEY]", BY_HELP)] = None,
    table: Annotated[Literal["latex", "csv", "markdown"] | None, option("FORMAT", FORMAT_HELP, "--format")] = None,
) -> int:
    """Writes report.html, one self-contained page, into a run folder; summary.html into that of a campaign.

    Beside report.html lie its figures as SVG and PNG, and its table as CSV.

    For example: wayproof report runs/paper_circles/rolling_window-aerosonde-1

    With --format latex, csv or markdown the table of a campaign or a comparison, for a paper: wayproof report
    runs/comparison --format latex
    """
    from harness.campaign.results import CERTIFICATE, RESULTS
    from harness.campaign.summary import summarise, write_summary
    from harness.files.strict_yaml import as_spelt
    from harness.report.run_report import write_report

    if by and not (run / RESULTS).is_file():
        raise typer.BadParameter(f"{run} has no {RESULTS}; only a campaign has tables by keys", param_hint="--by")
    try:  # a key may be spelled as `--set` takes it: `obstacles.0.velocity_mps`
        keys = [[as_spelt(key.strip()) for key in each.split(",")] for each in by] if by else None
    except ValueError as error:
        raise InputError(f"command line: --by: {error}") from error
    if table is not None:
        _print_table(run, keys, table)
    elif (run / RESULTS).is_file():
        summary = summarise(run, keys)
        try:
            page = write_summary(summary, run)
        except (ArithmeticError, TypeError) as fault:  # only a certificate may hold anything
            raise InputError(f"{run / CERTIFICATE}: is damaged: {fault}; --resume makes it anew") from fault
        print_summary(summary, all_tables=keys is not None)
        say(f"summary: {page}")
    else:
        _need_run(run)
        say(f"report: {write_report(run)}")
    return 0


def _need_run(folder: Path) -> None:
    """Raises InputError for the folder of a campaign without tables yet, of a comparison, a search or a replay."""
    from harness.campaign.folder import LOCK
    from harness.campaign.results import INDEX
    from harness.comparison import comparison
    from harness.falsify import breaking_point
    from harness.files.folder_lock import is_held
    from harness.replays import replay

    if (folder / INDEX).is_file():
        flying = "is being flown and has no tables yet; ask again in a minute, or when it has ended"
        stopped = "was stopped before the tables were written; `wayproof sweep` with --resume makes them"
        raise InputError(f"{folder}: its campaign {flying if is_held(folder / LOCK) else stopped}")
    for made, what in ((comparison, "comparison"), (replay, "replay")):
        if (index := read_index(folder / made.INDEX, made.SCHEMA)) and not index.get("complete"):
            again = f"; `{index['command']}` flies it again" if "command" in index else ""
            raise InputError(f"{folder}: its {what} has not been flown to its end{again}")
    others = {comparison.INDEX: "comparison", breaking_point.INDEX: "search", replay.INDEX: "replay"}
    for name in (each for each in others if (folder / each).is_file()):
        page = folder / (name if name == breaking_point.INDEX else "report.html")
        raise InputError(f"{folder}: is the folder of a {others[name]}, not of a run; see {page}")


def _print_table(folder: Path, keys: Sequence[Sequence[str]] | None, table: str) -> None:
    from harness.analysis import rows as compared
    from harness.campaign import cell
    from harness.campaign.results import RESULTS
    from harness.campaign.summary import rows_for_paper, summarise
    from harness.comparison.comparison import read_rows

    if (folder / RESULTS).is_file():
        heads, lines, legend = *rows_for_paper(summarise(folder, keys)), cell.legend()
    else:
        heads, lines, legend = compared.rows_for_paper(read_rows(folder))
    if table == "csv":
        text = compared.csv_table([heads, *lines])
    else:
        text = (compared.latex if table == "latex" else compared.markdown)(heads, lines, legend)
    say(text.removesuffix("\n"))


@replacing("guidance", "settings")
def replay(
    log: Annotated[Path, argument("LOG", LOG_HELP)],
    aircraft: AircraftName,
    mission: Annotated[Path | None, option("FILE", MISSION_HELP)] = None,
    given: Given = NOTHING,
    out: Out = None,
    no_recording: NoRecording = False,
    as_json: Json = False,
) -> int:
    """Flies the mission of a flown log with the simulated aircraft, in the wind of that day, and compares the two.

    For example: wayproof replay thor75.parquet --aircraft ultrastick25e --mission thor75.json
    """
    from harness.replays.measures import rows_of
    from harness.replays.replay import replay as flown_anew

    folder = out or Path("runs/replay") / log.stem
    try:
        with interruptible(lambda: f"what was written is in {folder}"):
            results = flown_anew(log, aircraft, folder, mission, given.keys, not no_recording).results
    except OSError as error:
        raise WriteError.of("the replay", folder, error) from error
    if as_json:
        print_json(results)
        return 0
    wind, between = results["wind"], results["distance_between_m"]
    say(
        f"wind: {wind['speed_mps']:.2f} m/s from {wind['from_deg']:.0f} deg, residual {wind['residual_mps']:.2f} m/s"
        f"{', flown as it changes' if results['wind_windows'] else ''}"
    )
    laps = ", ".join(map(str, results["settled_laps"]))
    print_table(f"{log.name}: laps {laps}", rows_of(results), ("", "flown", "simulated", "difference"))
    say(f"distance between the tracks: p50 {between['p50']:.2f} m, p95 {between['p95']:.2f} m")
    for note in results["notes"]:
        print_line(f"note: {plain(note)}")
    say(f"folder: {folder}")
    return 0


def export(
    run_dir: Annotated[Path, argument("RUN_DIR", "A run folder.")],
    form: Annotated[Form, option("FORMAT", "plan, waypoints, geojson or kml.", "--format")],
    what: Annotated[What, option("WHAT", "flown: the track; planned: the plans in effect.")] = "flown",
    out: Annotated[Path | None, option("FILE", "Default: standard output.")] = None,
) -> int:
    """Writes a run for QGroundControl (plan), MAVLink (waypoints) or maps (geojson, kml).

    For example: wayproof export runs/my_run --format plan --out way.plan
    """
    from harness.files.whole_file import replace_bytes
    from harness.run_files.exports import export_run
    from harness.run_files.run_folder import HASHED, MANIFEST, WRONG_CONTENT, damaged, load_run

    try:
        content, notes = export_run(load_run(run_dir), form, what)
    except (InputError, RunFolderError):
        raise
    except WRONG_CONTENT as error:
        raise damaged(run_dir, error) from error
    if out is None:
        with suppress(BrokenPipeError):  # a reader that goes away is no fault
            sys.stdout.buffer.write(content)
    else:
        with writing(out, [run_dir / name for name in (MANIFEST, *HASHED)]):
            replace_bytes(out, content)
    for note in notes:
        say(note, err=True)
    return 0
