"""Planners side by side: flies every one on every scenario, writes tables, figures, overlays and a report.

The folder of a comparison holds `comparison.csv`, `comparison.json` and `report.html`, and for each scenario a folder
with its figures, `overlay.rrd` and a run folder for each planner. The index `comparison.json` is written first and last
and says whether the comparison is complete.
"""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from harness.analysis.metric import ERROR
from harness.analysis.rows import COMPARED, Row, to_csv
from harness.campaign.flight import Answer, Job
from harness.campaign.paired import TESTED, Duel, duels
from harness.campaign.sweep import fly_jobs
from harness.campaign.workers import local_workers
from harness.files.errors import RunFolderError
from harness.files.folder_lock import FolderLock
from harness.files.input_file import read_index
from harness.files.strict_yaml import InputError
from harness.files.whole_file import replace_text
from harness.report.chapters import ReportedFlight, chapter, entry, optimum_of
from harness.report.page import report_html
from harness.run_files.run_folder import OVERLAY, RECORDING, REPORT, load_run
from harness.scenario.scenario import Scenario, packed
from harness.world.optimum import Optimum

SCHEMA = "wayproof/comparison/1"
INDEX, CSV = "comparison.json", "comparison.csv"


@dataclass(frozen=True)
class Comparison:
    """What was compared.

    Attributes:
        command: the command line.
        started_utc: date and time, ISO 8601.
        versions: what flew, by name; empty where nothing came to an end.
        kinematic: a point flew instead of the aircraft.
        rows: scenario after scenario, planner after planner.
    """

    command: str
    started_utc: str
    versions: Mapping[str, str]
    kinematic: bool
    rows: tuple[Row, ...]

    @property
    def all_reached(self) -> bool:
        """Whether every planner reached every goal."""
        return all(row.outcome == "reached" for row in self.rows)

    def plain(self, complete: bool = True) -> dict[str, Any]:
        """The content of `comparison.json`."""
        return {
            "schema": SCHEMA,
            "complete": complete,
            **vars(self),
            "rows": [row.plain() for row in self.rows],
        }


@dataclass(frozen=True)
class Setup:
    """How a comparison is flown.

    Attributes:
        recording: whether to write recordings and overlays.
        kinematic: a point that follows the plans exactly flies in place of the aircraft.
        workers: flights at the same time; they change nothing but the time it takes.
        command: what the report says was called; default: the command line.
        sources: planners among them that are given as FILE.py:NAME or MODULE:NAME.
        law_sources: guidance laws among them that are given likewise.
        shielded: of each flight, whether its planner was put under the shield and is called so; empty: of none.
    """

    recording: bool = True
    kinematic: bool = False
    workers: int = 1
    command: str | None = None
    sources: tuple[str, ...] = ()
    law_sources: tuple[str, ...] = ()
    shielded: tuple[bool, ...] = ()

    def planner(self, number: int, scenario: Scenario) -> str:
        """What the planner of a flight is called."""
        shielded = bool(self.shielded) and self.shielded[number]
        return f"{scenario.planner.kind}+shield" if shielded else scenario.planner.kind


def fly_and_compare(
    scenarios: Sequence[Scenario],
    out: Path,
    setup: Setup,
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Flies scenarios that differ in name or planner and writes the folder of the comparison.

    Args:
        scenarios: one a flight, those of one name together; each names its planner.
        out: the folder.
        setup: how they are flown.
        progress: told of every flight that is over how it ended.

    Raises:
        InputError: a scenario is there twice with the same planner and guidance, or is called as a file of the
            comparison is.
        RunFolderError: the folder holds something else or cannot be written.
    """
    planners = [setup.planner(number, each) for number, each in enumerate(scenarios)]
    laws = _laws(scenarios)
    names = [f"{each}-{law}" if law else each for each, law in zip(planners, laws, strict=True)]
    _check(scenarios, names)
    jobs = [
        Job(
            number,
            packed(each),
            (out / each.name / names[number]).resolve(),
            "all" if setup.recording else "folders",
            optimum=False,
            again=setup.command or "",
            planners=setup.sources,
            laws=setup.law_sources,
            kinematic=setup.kinematic,
        )
        for number, each in enumerate(scenarios)
    ]
    command = setup.command or shlex.join(["wayproof", *sys.argv[1:]])
    begun = Comparison(command, datetime.now(UTC).isoformat(timespec="seconds"), {}, setup.kinematic, ())
    lock = _claim(out, begun)
    try:
        return _compared(jobs, scenarios, planners, out, begun, setup.workers, progress)
    finally:
        lock.release()


def _compared(
    jobs: Sequence[Job],
    scenarios: Sequence[Scenario],
    planners: Sequence[str],
    out: Path,
    begun: Comparison,
    workers: int,
    progress: Callable[[str], None] | None,
) -> Comparison:
    """Flies and writes everything, the folder being ours."""
    reasons: dict[int, str] = {}

    def over(number: int, answer: Answer | None) -> None:
        outcome = ERROR if answer is None else answer.row["outcome"]
        if answer is None:
            reasons[number] = "the process that flew it died, or had no memory, each time that it was tried"
        elif outcome == ERROR:
            reasons[number] = answer.row["reason"]
        if progress is not None:
            progress(f"{scenarios[number].name}, {planners[number]}: {outcome}")

    with local_workers(min(workers, len(jobs))) as flyers:
        fly_jobs(iter(jobs), flyers, over)
    first = {each.name: each for each in reversed(scenarios)}
    names = list(dict.fromkeys(each.name for each in scenarios))
    optima = {name: optimum_of(first[name]) for name in names}
    laws = _laws(scenarios)
    entries = [
        _entry(each, jobs[number], planners[number], reasons.get(number), optima[each.name], laws[number])
        for number, each in enumerate(scenarios)
    ]
    runs = [each.run for each in entries if each.run]
    named = runs[0].manifest["versions"] if runs else {}
    versions = {name: version for name, version in named.items() if version}
    done = replace(begun, versions=versions, rows=tuple(each.row for each in entries))
    chapters = []
    for name in names:
        flights = [each for each in entries if each.row.scenario == name]
        if (out / name).is_symlink():  # of a folder that somebody sent
            (out / name).unlink()
        (out / name).mkdir(exist_ok=True)
        _overlay(out / name, flights)
        chapters.append(chapter(out / name, first[name], flights, optima[name]))
    replace_text(out / CSV, to_csv(done.rows))
    page = report_html(
        chapters, done.command, done.versions, done.started_utc, done.kinematic, _duels(done.rows)
    )
    replace_text(out / REPORT, page)
    _write_index(out, done, complete=True)
    return done


def _laws(scenarios: Sequence[Scenario]) -> list[str]:
    """The guidance law of every flight; empty where all fly under the same one."""
    kinds = [each.guidance.kind for each in scenarios]
    return kinds if len(set(kinds)) > 1 else ["" for _ in kinds]


def _check(scenarios: Sequence[Scenario], names: Sequence[str]) -> None:
    """Refuses two flights of one name, and a scenario that is called as a file of the comparison is."""
    seen = set()
    for each, called in zip(scenarios, names, strict=True):
        if (each.name, called) in seen:
            under = f" under {each.guidance.kind}" if any(_laws(scenarios)) else ""
            raise InputError(
                f"wayproof: {each.planner.kind} is to fly {each.name} twice{under}; leave one out or rename the "
                "scenario"
            )
        if each.name in (INDEX, CSV, REPORT):
            raise InputError(
                f"wayproof: a scenario is called {each.name}, as a file of the comparison; rename it"
            )
        seen.add((each.name, called))


def read_rows(folder: Path) -> list[Row]:
    """The rows of a comparison that is complete.

    Raises:
        InputError: the folder holds none.
    """
    index = read_index(folder / INDEX, SCHEMA)
    if index is None or not index.get("complete"):
        raise InputError(f"{folder}: is not the folder of a campaign or of a complete comparison")
    own = ("scenario", "planner", "outcome", "reason", "guidance")
    known = [{key: row[key] for key in (*own, *COMPARED) if key in row} for row in index["rows"]]
    return [Row(**row) for row in known]


def _claim(out: Path, begun: Comparison) -> FolderLock:
    """Makes `out` the folder of this comparison alone, or raises RunFolderError."""
    if out.exists() and not out.is_dir():
        raise RunFolderError(f"{out} is a file, not a folder for a comparison")
    try:
        out.mkdir(parents=True, exist_ok=True)
        lock = FolderLock(out)
        if any(out.iterdir()) and read_index(out / INDEX, SCHEMA) is None:
            lock.release()
            raise RunFolderError(
                f"{out} is not empty and not a comparison: choose another folder or empty it first"
            )
        _write_index(out, begun, complete=False)
        for name in (CSV, REPORT):
            (out / name).unlink(missing_ok=True)
        return lock
    except OSError as error:
        raise RunFolderError(f"cannot write the comparison {out}: {error.strerror or error}") from error


def _write_index(out: Path, comparison: Comparison, *, complete: bool) -> None:
    replace_text(out / INDEX, json.dumps(comparison.plain(complete), indent=2, allow_nan=False) + "\n")


def _entry(
    scenario: Scenario, job: Job, planner: str, crash: str | None, optimum: Optimum, law: str
) -> ReportedFlight:
    if crash is not None:
        return ReportedFlight(
            Row(scenario.name, planner, ERROR, crash, optimum_m=optimum.length_m, guidance=law)
        )
    found = entry(scenario, load_run(job.folder), optimum, job.kinematic, law)
    row = found.row
    return replace(found, row=Row(row.scenario, planner, reason=row.reason, guidance=law, **row.figures))


def _overlay(folder: Path, entries: Sequence[ReportedFlight]) -> None:
    recorded = [each for each in entries if each.run and (each.run.folder / RECORDING).exists()]
    (folder / OVERLAY).unlink(missing_ok=True)
    if recorded:
        from harness.recording.overlay import write_overlay

        write_overlay(
            [each.run.folder / RECORDING for each in recorded if each.run],
            [each.row.label for each in recorded],
            folder / OVERLAY,
        )


def _duels(rows: Sequence[Row]) -> tuple[Duel, ...]:
    """Planners in pairs over the scenarios; none with a single scenario, of which the table says it all."""
    if len({row.scenario for row in rows}) < 2:
        return ()
    figures = {
        each.name: np.array([row.figures[each.name] for row in rows], dtype=np.float64) for each in TESTED
    }
    reached = [row.outcome == "reached" for row in rows]
    return duels([row.label for row in rows], [(row.scenario,) for row in rows], reached, figures)
