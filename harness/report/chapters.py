"""A scenario's chapter of a report: its figures, written as files and kept for the page, its facts and its rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.analysis.band import read_band
from harness.analysis.metric import number
from harness.analysis.rows import Row, row_of
from harness.files.errors import RunFolderError
from harness.files.whole_file import replace_bytes
from harness.report import figures
from harness.report.figure_style import colour, png, svg
from harness.report.figures import DrawnRun, FigureScene
from harness.report.page import Chapter, Picture
from harness.report.path_figure import path_figure
from harness.report.planner_figure import planner_figure
from harness.run_files.given_path import GIVEN
from harness.run_files.run_folder import Run
from harness.scenario.conditions import conditions_text
from harness.scenario.performance import performance_of
from harness.scenario.scenario import Scenario
from harness.scenario.validation import KeyFault
from harness.world.optimum import Optimum
from harness.world.world import World

PROFILES = "Curvature times R, the radius that turns are planned with, and cross-track error along the way."


@dataclass(frozen=True, eq=False)
class ReportedFlight:
    """The figures of one planner on one scenario, and what was flown; None if the software failed."""

    row: Row
    run: Run | None = None


def entry(scenario: Scenario, run: Run, optimum: Optimum, guidance: str = "") -> ReportedFlight:
    """Returns the report's entry for a flight that came to an end."""
    row = row_of(
        scenario.name,
        GIVEN if "check" in run.metrics else scenario.planner.label,
        run.metrics,
        optimum_m=optimum.length_m,
        turn_radius_m=_turn_radius_m(scenario, run),
        guidance=guidance,
    )
    return ReportedFlight(row, run)


def chapter(
    folder: Path, scenarios: Sequence[Scenario], entries: Sequence[ReportedFlight], optima: Sequence[Optimum]
) -> Chapter:
    """Writes the figures of planners side by side; returns the scenario's chapter of the report.

    Scenario and optimum are given for each flight: under another law clearance and turn radius may be others.
    """
    world = World.from_scenario(scenarios[0])
    of_flights = zip(scenarios, optima, entries, strict=True)
    scenes = [_scene(scenario, world, optimum, each.run) for scenario, optimum, each in of_flights]
    scene = scenes[0]
    numbered = [(place, _drawn_run(each.row, each.run)) for place, each in enumerate(entries) if each.run]
    pictures: list[Picture] = []
    if numbered:
        caption = f"{scene.name}: the tracks of all planners, from S to G."
        pictures.append(_picture(folder / "map", figures.overview(scene, numbered), caption))
        for place, drawn in numbered:
            stem = folder / f"path-{drawn.planner.replace(', ', '-')}"
            caption = f"{drawn.planner} on {scene.name}, alone{_inset_text(scenes[place], drawn)}."
            pictures.append(_picture(stem, planner_figure(scenes[place], drawn, place), caption))
        pictures.append(_picture(folder / "profiles", figures.profiles(numbered), PROFILES))
    of_each = [_facts(*of) for of in zip(scenes, optima, strict=True)]
    told = {name: " or ".join(dict.fromkeys(facts[name] for facts in of_each)) for name in of_each[0]}
    facts = {"conditions": conditions_text(scenarios[0])} | told
    reasons = dict.fromkeys(each.reason for each in optima if each.reason)
    return Chapter(scene.name, facts, [each.row for each in entries], pictures, "; ".join(reasons))


def run_chapter(scenario: Scenario, flight: ReportedFlight, optimum: Optimum) -> Chapter:
    """Writes the figures of a single run into its folder; returns its chapter of the report."""
    assert flight.run is not None
    run, folder, metrics = flight.run, flight.run.folder, flight.run.metrics
    scene, drawn = _scene(scenario, World.from_scenario(scenario), optimum, run), _drawn_run(flight.row, run)
    if "check" in metrics:
        path = path_figure(scene, drawn, run.plans[0].waypoints_m, metrics)
        caption = f"The path of {scene.name} as given, and the track that was flown over it; enlarged: the worst place."
        if (band := read_band(folder / "days")) is not None:
            days, left_m, right_m = band
            for axes in path.axes[:2]:
                ring_km = np.concatenate((left_m, right_m[::-1])) / 1e3
                axes.fill(*ring_km.T, color=colour(0), alpha=0.3, lw=0, zorder=4)
            caption += f" Blue area: where 95 % of {days} days fly."
    else:
        path = planner_figure(scene, drawn, 0)
        caption = f"The track from S to G in {scene.name}{_inset_text(scene, drawn)}."
    strips = figures.profiles([(0, drawn)])
    pictures = [_picture(folder / "path", path, caption), _picture(folder / "profiles", strips, PROFILES)]
    facts = {"conditions": conditions_text(scenario)} | _facts(scene, optimum)
    if "check" in metrics:  # a path that was given is compared with no other
        del facts["clairvoyant optimum"]
        if not scene.obstacles:
            del facts["obstacles"]
        if not scene.obstacles or not scene.clearance_m:
            del facts["wanted clearance"]
    return Chapter(scene.name, facts, [flight.row], pictures, optimum.reason)


def _inset_text(scene: FigureScene, drawn: DrawnRun) -> str:
    """Names the enlarged part in the figure of a planner, as the end of a sentence."""
    near = drawn.nearest(scene.clearance_m) is not None
    return "; enlarged: where it came nearest to an obstacle" if near else ""


def _turn_radius_m(scenario: Scenario, run: Run | None) -> float:
    """Returns the smallest radius that a plan may ask for, from the run if it tells; its law may be missing here."""
    radius_m = run.manifest.get("turn_radius_m") if run is not None else None
    if isinstance(radius_m, int | float) and radius_m > 0.0:
        return float(radius_m)
    try:
        return performance_of(scenario).turn_radius_m
    except KeyFault as error:
        raise RunFolderError(f"{'.'.join(map(str, error.loc))}: {error}") from error


def _scene(scenario: Scenario, world: World, optimum: Optimum, run: Run | None) -> FigureScene:
    mission, wind = scenario.mission, scenario.environment.wind
    check = run.metrics.get("check") if run else None
    return FigureScene(
        name=scenario.name,
        bounds_m=scenario.area.bounds_m,
        obstacles=world.obstacles,
        start_m=mission.start_m,
        goal_m=mission.goal_m,
        goal_radius_m=mission.goal_radius_m,
        clearance_m=check.get("clearance_m") or 0.0 if check else scenario.planner.clearance_m,
        turn_radius_m=_turn_radius_m(scenario, run),
        optimum_m=optimum.points_m,
        wind=(wind.from_deg, wind.text) if wind else (0.0, ""),
        navigation_margin_m=(not check and scenario.navigation.margin_m) or 0.0,  # a given path keeps none
    )


def _drawn_run(row: Row, run: Run) -> DrawnRun:
    return DrawnRun(row.label, row.outcome, run.track, run.plans, row.turn_radius_m)


def _picture(stem: Path, figure: Any, caption: str) -> Picture:
    content = svg(figure)
    replace_bytes(stem.with_name(f"{stem.name}.svg"), content)
    replace_bytes(stem.with_name(f"{stem.name}.png"), png(figure))
    return Picture(content, caption, caption)


def _facts(scene: FigureScene, optimum: Optimum) -> dict[str, str]:
    def km(value_m: float | None) -> str:
        return f"{number(value_m, 1e-3)} km" if value_m is not None else "none"

    margin = scene.navigation_margin_m
    beyond = f" + {number(margin)} m for the navigation error" if margin > 0.0 else ""
    return {
        "straight line": km(math.dist(scene.start_m, scene.goal_m)),
        "clairvoyant optimum": km(optimum.length_m),
        "obstacles": str(len(scene.obstacles)),
        "wanted clearance": f"{number(scene.clearance_m)} m{beyond}",
        "turn radius R": f"{number(scene.turn_radius_m)} m",
    }
