"""Planners side by side: flies every one on every scenario, writes tables, figures, overlays and a report.

The folder holds for each scenario a folder with its figures, `overlay.rrd` and a run folder for each planner. The index
`comparison.json` is written first and last and says whether the comparison is complete.
"""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from harness.analysis.metric import ERROR
from harness.analysis.rows import COMPARED, Row, to_csv
from harness.campaign.flight import Answer, Job
from harness.campaign.paired import TESTED, Duel, duels
from harness.campaign.workers import Workers, fly_jobs, local_workers
from harness.files.errors import RunFolderError
from harness.files.folder_lock import claim_folder
from harness.files.input_file import read_index
from harness.files.strict_yaml import InputError
from harness.files.whole_file import replace_text
from harness.report.chapters import ReportedFlight, chapter, entry
from harness.report.page import rendered
from harness.run_files.run_folder import OVERLAY, RECORDING, REPORT, load_run
from harness.scenario.scenario import Scenario, packed
from harness.world.optimum import Optimum, optimum_of

SCHEMA = "wayproof/comparison/1"
INDEX, CSV = "comparison.json", "comparison.csv"


@dataclass(frozen=True)
class Comparison:
    """What was compared: the command, when it began (UTC, ISO 8601), versions of what flew by name, a row a flight."""

    command: str
    started_utc: str
    versions: Mapping[str, str]
    rows: tuple[Row, ...]

    @property
    def all_reached(self) -> bool:
        """Whether every planner reached every goal."""
        return all(row.outcome == "reached" for row in self.rows)

    def plain(self, complete: bool = True) -> dict[str, Any]:
        """The content of `comparison.json`."""
        rows = [row.plain() for row in self.rows]
        return {"schema": SCHEMA, "complete": complete, **vars(self), "rows": rows}

    def write(self, out: Path, *, complete: bool) -> None:
        """Writes `comparison.json` into a folder."""
        replace_text(out / INDEX, json.dumps(self.plain(complete), indent=2, allow_nan=False) + "\n")


class _Flight(NamedTuple):
    """One planner, under one law, on one scenario; `law` is empty where all fly under the same one."""

    scenario: Scenario
    planner: str
    law: str
    job: Job


def fly_and_compare(
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    recording: bool = True,
    workers: int | None = 1,
    command: str | None = None,
    sources: tuple[tuple[str, ...], tuple[str, ...]] = ((), ()),
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Flies scenarios that differ in name or planner and writes the folder of the comparison.

    `scenarios`: one a flight, those of one name together; each names its planner. `command`: what the report says was
    called, by default the command line. `sources`: planners, and laws, given as FILE.py:NAME or MODULE:NAME. An
    InputError: two flights, or a flight and a file of the comparison, would have one name; a RunFolderError: the folder
    holds something else or cannot be written.
    """
    how = Job(0, b"", out, "all" if recording else "folders", optimum=False, again=command or "")
    flights = _flights(scenarios, replace(how, planners=sources[0], laws=sources[1]))
    line = command or shlex.join(["wayproof", *sys.argv[1:]])
    begun = Comparison(line, datetime.now(UTC).isoformat(timespec="seconds"), {}, ())
    flying = local_workers(workers, len(flights))
    with flying as flyers, closing(claim_folder(out, "comparison", INDEX, SCHEMA)):
        try:
            begun.write(out, complete=False)
            for name in (CSV, REPORT):
                (out / name).unlink(missing_ok=True)
        except OSError as error:
            raise RunFolderError(f"cannot write the comparison {out}: {error.strerror or error}") from error
        return _write(flights, _fly(flights, flyers, progress), out, begun)


def _flights(scenarios: Sequence[Scenario], how: Job) -> list[_Flight]:
    """Makes the flights; an InputError: there is none, two have one name, or one that of a file of the comparison."""
    if not scenarios:
        raise InputError("wayproof: there is no scenario to fly; give one or more")
    by_law = len({each.guidance.kind for each in scenarios}) > 1
    flights: dict[Path, _Flight] = {}
    for number, each in enumerate(scenarios):
        planner, law = each.planner.label, each.guidance.kind if by_law else ""
        folder = (how.folder / each.name / (f"{planner}-{law}" if law else planner)).resolve()
        if folder in flights:
            twice = f"{planner} is to fly {each.name} twice{law and f' under {law}'}"
            raise InputError(f"wayproof: {twice}; leave one out or rename the scenario")
        if each.name in (INDEX, CSV, REPORT):
            called = f"a scenario is called {each.name}, as a file of the comparison"
            raise InputError(f"wayproof: {called}; rename it")
        job = replace(how, run=number, packed=packed(each), folder=folder)
        flights[folder] = _Flight(each, planner, law, job)
    return [*flights.values()]


def _fly(flights: Sequence[_Flight], flyers: Workers, progress: Callable[[str], None] | None) -> dict[int, str]:
    """Flies all flights; returns why a flight did not come to an end, by its number."""
    crashes: dict[int, str] = {}

    def finish(number: int, answer: Answer | None) -> None:
        outcome = ERROR if answer is None else answer.row["outcome"]
        if answer is None:
            crashes[number] = "the process that flew it died, or had no memory, each time that it was tried"
        elif outcome == ERROR:
            crashes[number] = answer.row["reason"]
        if progress is not None:
            progress(f"{flights[number].scenario.name}, {flights[number].planner}: {outcome}")

    fly_jobs((each.job for each in flights), flyers, finish)
    return crashes


def _write(flights: Sequence[_Flight], crashes: Mapping[int, str], out: Path, begun: Comparison) -> Comparison:
    """Writes overlays, table, report and index of the run folders, and returns the finished comparison."""
    by_name: dict[str, list[_Flight]] = {}
    for flight in flights:
        by_name.setdefault(flight.scenario.name, []).append(flight)
    every, chapters = [], []
    for name, own in by_name.items():
        folder = out / name
        like = {_ends(each): each.scenario for each in own}
        found = {ends: optimum_of(scenario) for ends, scenario in like.items()}
        entries = [_entry(each, crashes.get(each.job.run), found[_ends(each)]) for each in own]
        optima = [found[_ends(each)] for each in own]
        if folder.is_symlink():  # of a folder that somebody sent
            folder.unlink()
        folder.mkdir(exist_ok=True)
        _overlay(folder, entries)
        chapters.append(chapter(folder, [each.scenario for each in own], entries, optima))
        every += entries
    flown: Mapping[str, str] = next((each.run.manifest["versions"] for each in every if each.run), {})
    versions = {name: version for name, version in flown.items() if version}
    result = replace(begun, versions=versions, rows=tuple(each.row for each in every))
    replace_text(out / CSV, to_csv(result.rows))
    header = {"command": result.command, "versions": result.versions, "written": result.started_utc}
    page = rendered("comparison.html", duels=_duels(result.rows), chapters=chapters, **header)
    replace_text(out / REPORT, page)
    result.write(out, complete=True)
    return result


def read_rows(folder: Path) -> list[Row]:
    """The rows of a comparison that is complete; an InputError where the folder holds none."""
    index = read_index(folder / INDEX, SCHEMA)
    if index is None or not index.get("complete"):
        raise InputError(f"{folder}: is not the folder of a campaign or of a complete comparison")
    own = ("scenario", "planner", "outcome", "reason", "guidance")
    return [Row(**{key: row[key] for key in (*own, *COMPARED) if key in row}) for row in index["rows"]]


def _ends(flight: _Flight) -> tuple[float, float]:
    """Returns what the shortest path of a scenario's flights differs by: under another law turns may be wider."""
    return flight.scenario.planner.clearance_m, flight.scenario.mission.goal_radius_m


def _entry(flight: _Flight, crash: str | None, optimum: Optimum) -> ReportedFlight:
    scenario, planner, law, job = flight
    if crash is not None:
        return ReportedFlight(Row(scenario.name, planner, ERROR, crash, law, optimum_m=optimum.length_m))
    return entry(scenario, load_run(job.folder), optimum, law)


def _overlay(folder: Path, entries: Sequence[ReportedFlight]) -> None:
    files = {each.row.label: each.run.folder / RECORDING for each in entries if each.run}
    recorded = {label: file for label, file in files.items() if file.exists()}
    (folder / OVERLAY).unlink(missing_ok=True)
    if recorded:
        from harness.recording.overlay import write_overlay

        write_overlay([*recorded.values()], [*recorded], folder / OVERLAY)


def _duels(rows: Sequence[Row]) -> tuple[Duel, ...]:
    """Planners in pairs over the scenarios; none with a single scenario, of which the table says it all."""
    if len({row.scenario for row in rows}) < 2:
        return ()
    figures = {each.name: np.array([row.figures[each.name] for row in rows], dtype=float) for each in TESTED}
    reached = [row.outcome == "reached" for row in rows]
    return duels([row.label for row in rows], [(row.scenario,) for row in rows], reached, figures)
