"""Planners side by side: flies every one on every scenario, writes tables, figures, overlays and a report.

The folder of a comparison holds `comparison.csv`, `comparison.md`, `comparison.json` and `report.html`, and
for each scenario a folder with its figures, `overlay.rrd` and a run folder for each planner. The index
`comparison.json` is written first and last and says whether the comparison is complete.
"""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.compare_flights import Answer, Job, Progress, fly_all
from harness.compare_rows import CRASHED, Row, number, row_of, to_csv, to_markdown
from harness.optimum import Optimum, shortest_path
from harness.record import RunFolderError
from harness.run_folder import RECORDING, REPORT, Run, load_run
from harness.scenario import Scenario, performance_of
from harness.strict_yaml import InputError
from harness.world import World

if TYPE_CHECKING:
    from harness.figures import DrawnRun, Scene
    from harness.report import Chapter, Picture

SCHEMA = "wayproof/comparison/1"
INDEX = "comparison.json"
OVERLAY = "overlay.rrd"


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
        return {"schema": SCHEMA, "complete": complete, **asdict(self)}


@dataclass(frozen=True)
class _Entry:
    """One planner on one scenario: what was asked and what came of it. `run` is None if it crashed."""

    job: Job
    answer: Answer
    run: Run | None
    row: Row

    @property
    def planner(self) -> str:
        return self.job.scenario.planner.kind


def compare(
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    recording: bool = True,
    kinematic: bool = False,
    workers: int = 1,
    progress: Progress | None = None,
) -> Comparison:
    """Flies scenarios that differ in name or planner and writes the folder of the comparison.

    Args:
        scenarios: one a flight, those of one name together; each names its planner.
        out: the folder.
        recording: whether to write recordings and overlays.
        kinematic: a point that follows the plans exactly flies instead of the aircraft.
        workers: flights at the same time.
        progress: told of every flight, by its index, as it goes on.

    Raises:
        InputError: a scenario is there twice with the same planner.
        RunFolderError: the folder holds something else or cannot be written.
    """
    jobs = [
        Job(each, out / each.name / each.planner.kind, recording, kinematic) for each in _distinct(scenarios)
    ]
    begun = Comparison(shlex.join(["wayproof", *sys.argv[1:]]), _now(), {}, kinematic, ())
    _claim(out, begun)
    answers = fly_all(jobs, workers, progress)
    optima = {name: _optimum(own[0]) for name, own in _by_name(scenarios, lambda each: each.name).items()}
    entries = [_entry(*each, optima) for each in zip(jobs, answers, strict=True)]
    runs = [each.run for each in entries if each.run]
    named = runs[0].manifest["versions"] if runs else {}
    versions = {name: version for name, version in named.items() if version}
    done = Comparison(begun.command, begun.started_utc, versions, kinematic, tuple(e.row for e in entries))
    chapters = [
        _chapter(out / name, own, optima[name])
        for name, own in _by_name(entries, lambda each: each.job.scenario.name).items()
    ]
    (out / "comparison.csv").write_text(to_csv(done.rows), encoding="utf-8")
    (out / "comparison.md").write_text(_markdown(done), encoding="utf-8")
    (out / REPORT).write_text(_report(done, chapters), encoding="utf-8")
    _write_index(out, done, complete=True)
    return done


def _by_name(things: Sequence[Any], name: Callable[[Any], str]) -> dict[str, list[Any]]:
    groups: dict[str, list[Any]] = {}
    for each in things:
        groups.setdefault(name(each), []).append(each)
    return groups


def _distinct(scenarios: Sequence[Scenario]) -> Sequence[Scenario]:
    seen = set()
    for each in scenarios:
        name, kind = flight = each.name, each.planner.kind
        if flight in seen:
            raise InputError(f"wayproof: {kind} is to fly {name} twice; leave one out or rename the scenario")
        seen.add(flight)
    return scenarios


def _claim(out: Path, begun: Comparison) -> None:
    """Makes `out` the folder of this comparison, or raises RunFolderError."""
    if out.exists() and not out.is_dir():
        raise RunFolderError(f"{out} is a file, not a folder for a comparison")
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()) and not _is_comparison(out):
            raise RunFolderError(
                f"{out} is not empty and not a comparison: choose another folder or empty it first"
            )
        _write_index(out, begun, complete=False)
        for name in ("comparison.csv", "comparison.md", REPORT):
            (out / name).unlink(missing_ok=True)
    except OSError as error:
        raise RunFolderError(f"cannot write the comparison {out}: {error.strerror or error}") from error


def _is_comparison(out: Path) -> bool:
    try:
        index = json.loads((out / INDEX).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(index, dict) and index.get("schema") == SCHEMA


def _write_index(out: Path, comparison: Comparison, *, complete: bool) -> None:
    partial = out / f"{INDEX}.partial"
    partial.write_text(
        json.dumps(comparison.plain(complete), indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    partial.replace(out / INDEX)


def _optimum(scenario: Scenario) -> Optimum:
    world, mission = World.from_scenario(scenario), scenario.mission
    return shortest_path(
        world.obstacles, world.bounds_m, mission.start_m, mission.goal_m, scenario.planner.clearance_m
    )


def _entry(job: Job, answer: Answer, optima: Mapping[str, Optimum]) -> _Entry:
    name, planner = job.scenario.name, job.scenario.planner.kind
    if answer.planned is None:
        return _Entry(
            job, answer, None, Row(name, planner, CRASHED, answer.crash, optimum_m=optima[name].length_m)
        )
    run = load_run(job.folder)
    row = row_of(
        name,
        planner,
        run.metrics,
        optimum_m=optima[name].length_m,
        turn_radius_m=performance_of(job.scenario).turn_radius_m,
        tightest_1pm=answer.planned.tightest_1pm,
        kinematic=job.kinematic,
    )
    return _Entry(job, answer, run, row)


def _chapter(folder: Path, entries: Sequence[_Entry], optimum: Optimum) -> Chapter:
    """Writes a scenario's figures and overlay; returns its part of the report."""
    from harness import figures
    from harness.report import Chapter

    folder.mkdir(exist_ok=True)
    scene = _scene(entries[0].job.scenario, optimum)
    numbered = [(index, drawn) for index, each in enumerate(entries) if (drawn := _drawn(each))]
    pictures: list[Picture] = []
    if numbered:
        _overlay(folder, entries)
        tracks = figures.overview(scene, numbered)
        pictures.append(
            _picture(folder / "map", tracks, f"{scene.name}: the tracks of all planners, from S to G.")
        )
        for index, drawn in numbered:
            path = figures.planner_figure(scene, drawn, index)
            pictures.append(
                _picture(folder / f"path-{drawn.planner}", path, f"{drawn.planner} on {scene.name}, alone.")
            )
        strips = figures.profiles(scene, numbered)
        caption = "Curvature, as a multiple of the aircraft's limit, and cross-track error along the way."
        pictures.append(_picture(folder / "profiles", strips, caption))
    return Chapter(
        scene.name, _facts(scene, optimum), [each.row for each in entries], pictures, optimum.reason
    )


def _scene(scenario: Scenario, optimum: Optimum) -> Scene:
    from harness.figures import Scene

    mission = scenario.mission
    return Scene(
        name=scenario.name,
        bounds_m=scenario.area.bounds_m,
        obstacles=World.from_scenario(scenario).obstacles,
        start_m=mission.start_m,
        goal_m=mission.goal_m,
        goal_radius_m=mission.goal_radius_m,
        clearance_m=scenario.planner.clearance_m,
        turn_radius_m=performance_of(scenario).turn_radius_m,
        optimum_m=optimum.points_m,
    )


def _drawn(entry: _Entry) -> DrawnRun | None:
    from harness.figures import DrawnRun

    if entry.run is None or entry.answer.planned is None:
        return None
    return DrawnRun(entry.planner, entry.row.outcome, entry.run.track, entry.answer.planned)


def _overlay(folder: Path, entries: Sequence[_Entry]) -> None:
    recorded = [each for each in entries if each.run and (each.run.folder / RECORDING).exists()]
    (folder / OVERLAY).unlink(missing_ok=True)
    if recorded:
        from harness.rerun_overlay import write_overlay

        write_overlay(
            [each.job.folder / RECORDING for each in recorded],
            [each.planner for each in recorded],
            folder / OVERLAY,
        )


def _picture(stem: Path, figure: Any, caption: str) -> Picture:
    """Writes a figure as SVG and PNG."""
    from harness.figures import png, svg
    from harness.report import Picture

    content = svg(figure)
    stem.with_name(f"{stem.name}.svg").write_bytes(content)
    stem.with_name(f"{stem.name}.png").write_bytes(png(figure))
    return Picture(content, caption, caption)


def _facts(scene: Scene, optimum: Optimum) -> dict[str, str]:
    def km(value_m: float | None) -> str:
        return f"{number(value_m, 1e-3)} km" if value_m is not None else "none"

    (east, north), (goal_east, goal_north) = scene.start_m, scene.goal_m
    return {
        "straight line": km(((goal_east - east) ** 2 + (goal_north - north) ** 2) ** 0.5),
        "clairvoyant optimum": km(optimum.length_m),
        "obstacles": str(len(scene.obstacles)),
        "wanted clearance": f"{number(scene.clearance_m)} m",
        "turn radius R": f"{number(scene.turn_radius_m)} m",
    }


def _markdown(comparison: Comparison) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in comparison.versions.items())
    repeat = f"## How to repeat it\n\n    {comparison.command}\n\n{versions}\n"
    return f"# Planners side by side\n\n{to_markdown(comparison.rows)}\n{repeat}"


def _report(comparison: Comparison, chapters: Sequence[Chapter]) -> str:
    from harness.report import report_html

    return report_html(
        chapters,
        comparison.command,
        comparison.versions,
        comparison.started_utc,
        comparison.kinematic,
    )


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
