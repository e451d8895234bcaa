"""Figures of a campaign: success against a varied key, how long the ways were, where runs failed.

Drawn without a screen.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from harness.campaign.points import RunPoints
from harness.campaign.summary import CURVE_POINTS, Summary, Table
from harness.files.errors import RunFolderError
from harness.files.input_file import InputError
from harness.flight.record import FloatArray
from harness.report.figure_style import DASHES, WIDTH_IN, colour, styled
from harness.report.figures import FigureScene, draw_map, thinned

HEIGHT_IN = 2.9
LEGEND_LETTERS, KEY_LETTERS = 66, 6
"""Letters that a row of the legend has room for, and as many as the key before each name takes."""
LEGEND_ROWS, ROW_IN = 3, 0.17
"""Rows of the legend that a figure has room for, and how much higher each other one makes it."""
ROTATED_FROM = 5
"""From so many groups on, their labels stand slanted."""
PANEL_IN = 1.5
"""Height of a panel of small multiples."""
MAP_TITLE_PT: Final = 7
"""Letters above maps of failures, so that three titles have room beside one another."""
MAPS_A_ROW, MAP_TITLE_IN = 3, 0.45
"""Maps of failures beside one another, and what each has above and below it."""
MOST_OUTLINES: Final = 1500
"""More points than these in a figure are drawn as dots of a picture."""
MOST_FAILURES: Final = 9
"""Failures beyond these are not drawn."""
MAP_TICKS_IN = 0.3
"""What each has beside it."""
ROW_LETTERS = 56
"""Number of letters, in names below panels, that are as wide as the figure."""
LABEL_LETTERS = 32
"""A longer label of a group loses its middle, for it takes room from what is drawn."""


def success(table: Table) -> Figure:
    """Share of goals reached against the groups of a key, with Wilson intervals, a line for each planner."""
    labels = [_short(label) for label in table.rows.labels]
    planners = table.columns.labels if table.columns else ("",)
    with styled(_height_in(planners)) as figure:
        axes = figure.add_subplot()
        for index, planner in enumerate(planners):
            own = [(place, cells[index]) for place, cells in enumerate(table.cells) if cells[index].runs]
            shift = 0.12 * (index - (len(planners) - 1) / 2)
            shares = [
                (cell.success or 0.0, cell.success_low or 0.0, cell.success_high or 0.0) for _, cell in own
            ]
            value, low, high = 100.0 * np.array(shares).reshape(-1, 3).T
            axes.errorbar(
                [place + shift for place, _ in own],
                value,
                yerr=np.maximum([value - low, high - value], 0.0),
                color=colour(index),
                ls=DASHES[index % len(DASHES)] if table.rows.numeric else "",
                marker="o",
                ms=3.5,
                lw=1.0,
                capsize=2.5,
                label=planner,
            )
        slanted = len(labels) > ROTATED_FROM or max(map(len, labels), default=0) > 16
        axes.set_xticks(
            range(len(labels)), labels, rotation=30 if slanted else 0, ha="right" if slanted else "center"
        )
        axes.set(xlim=(-0.5, len(labels) - 0.5), ylim=(-3, 103), xlabel=table.rows.key, ylabel="reached, %")
        axes.grid(axis="y", color="0.9", lw=0.6)
        _legend(figure, planners)
    return figure


def lengths(curves: Mapping[str, Sequence[float]]) -> Figure:
    """Share of the goals reached with at most a length over the optimum, a line for each planner."""
    shares = np.linspace(0.0, 100.0, CURVE_POINTS)
    with styled(_height_in(tuple(curves))) as figure:
        axes = figure.add_subplot()
        for index, (planner, ratios) in enumerate(curves.items()):
            axes.plot(
                ratios, shares, color=colour(index), ls=DASHES[index % len(DASHES)], lw=1.3, label=planner
            )
        axes.set(xlabel="flown length over the clairvoyant optimum", ylabel="share of goals reached, %")
        axes.grid(color="0.9", lw=0.6)
        _legend(figure, tuple(curves))
    return figure


def scatter(points: RunPoints) -> Figure | None:
    """Every figure against every number that was varied, a point a run; None where no number was varied.

    Runs that did not reach the goal are crosses. Many points are drawn as a picture of dots: a browser takes seconds to
    draw ten thousand outlines.
    """
    if not points.varied or not points.figures:
        return None
    rows, columns = len(points.figures), len(points.varied)
    names = [_wrapped(key, ROW_LETTERS // columns) for key in points.varied]
    as_dots = rows * columns * len(points.reached) > MOST_OUTLINES
    with styled(0.5 + PANEL_IN * rows + ROW_IN * max(name.count("\n") for name in names)) as figure:
        grid = figure.subplots(rows, columns, sharex="col", sharey="row", squeeze=False)
        for row, (label, values) in enumerate(points.figures.items()):
            for column, numbers in enumerate(points.varied.values()):
                axes = grid[row][column]
                for among, marker, shade in (
                    (points.reached, ".", colour(0)),
                    (~points.reached, "x", colour(1)),
                ):
                    axes.plot(
                        numbers[among],
                        values[among],
                        marker,
                        ms=3.5,
                        color=shade,
                        alpha=0.7,
                        rasterized=as_dots,
                    )
                axes.grid(color="0.9", lw=0.6)
                if column == 0:
                    axes.set_ylabel(label)
                if row == rows - 1:
                    axes.set_xlabel(names[column])
    return figure


def where_failed(failed: Sequence[Failure]) -> Figure:
    """A map of each failure: its world, the track, and a cross where it ended."""
    columns = min(MAPS_A_ROW, len(failed))
    rows = math.ceil(len(failed) / columns)
    bounds = [each.scene.bounds_m for each in failed]
    shape = max((ymax - ymin) / (xmax - xmin) for xmin, ymin, xmax, ymax in bounds)
    with styled(rows * (min(shape, 2.0) * (WIDTH_IN / columns - MAP_TICKS_IN) + MAP_TITLE_IN)) as figure:
        grid = figure.subplots(rows, columns, squeeze=False).flat
        for each, axes in zip(failed, grid, strict=False):  # in this order: the other takes one axes too many
            draw_map(axes, each.scene)
            track_km = thinned(each.track_m, each.scene) / 1e3
            axes.plot(*track_km.T, color=colour(0), lw=1.2, zorder=5)
            axes.plot(*track_km[-1], "X", color=colour(1), ms=7, mec="white", mew=0.6, zorder=8)
            axes.set_title(f"run {each.run}: {each.outcome.replace('_', ' ')}", fontsize=MAP_TITLE_PT)
            axes.set(xlabel="", ylabel="")
            axes.tick_params(labelsize=6, length=2)
        for axes in grid:
            axes.set_visible(False)
    return figure


def _short(label: str, letters: int = LABEL_LETTERS) -> str:
    end = (letters - len("...")) // 2
    return label if len(label) <= letters else f"{label[:end]}...{label[-end:]}"


def _wrapped(key: str, letters: int) -> str:
    """A key path over several lines, broken behind its dots; names of neighbours do not run into each other."""
    lines = [""]
    for part in re.findall(r"[^.]+\.?", key):
        lines += [""] if lines[-1] and len(lines[-1] + part) > letters else []
        lines[-1] += _short(part, letters)
    return "\n".join(lines)


def _height_in(planners: Sequence[str]) -> float:
    """Of a figure with these planners in its legend."""
    return HEIGHT_IN + ROW_IN * max(math.ceil(len(planners) / _columns(planners)) - LEGEND_ROWS, 0)


def _columns(planners: Sequence[str]) -> int:
    """How many names a row of the legend has."""
    columns = LEGEND_LETTERS // (KEY_LETTERS + max(map(len, planners), default=0))
    return min(max(columns, 1), 3)


def _legend(figure: Figure, planners: Sequence[str]) -> None:
    if len(planners) > 1:
        figure.legend(loc="outside lower center", ncols=_columns(planners), frameon=False)


@dataclass(frozen=True, eq=False)
class Failure:
    """A run that did not reach the goal.

    Attributes:
        run: its number.
        outcome: how it ended.
        scene: its world.
        track_m: (n, 2) what was flown, east and north.
    """

    run: int
    outcome: str
    scene: FigureScene
    track_m: FloatArray


def failures(summary: Summary, folder: Path) -> list[Failure]:
    """The worst of the runs that failed, as far as their run folders were kept.

    Args:
        summary: of the campaign.
        folder: of the campaign.
    """
    kept = (each for each in summary.worst if each.outcome != "reached" and each.folder)
    return list(_failures([(each.run, each.outcome, folder / each.folder) for each in kept]))[:MOST_FAILURES]


def _failures(runs: list[tuple[int, str, Path]]) -> Iterator[Failure]:
    from harness.run_files.run_folder import load_run
    from harness.scenario.performance import mission_of
    from harness.scenario.scenario import parse_scenario
    from harness.scenario.validation import KeyFault
    from harness.world.world import World

    for number, outcome, folder in runs:
        try:
            run = load_run(folder)
            scenario = parse_scenario(run.scenario_yaml, str(folder), as_flown=True)
            mission = mission_of(scenario)
        except (RunFolderError, InputError, KeyFault):
            # It broke off, is of other versions, or of a guidance law that is not here: there is nothing to draw.
            continue
        scene = FigureScene(
            name=scenario.name,
            bounds_m=mission.bounds_m,
            obstacles=World.from_scenario(scenario).obstacles,
            start_m=scenario.mission.start_m,
            goal_m=mission.goal_m,
            goal_radius_m=mission.goal_radius_m,
            clearance_m=mission.clearance_m,
            turn_radius_m=mission.turn_radius_m,
            optimum_m=np.zeros((0, 2)),
        )
        yield Failure(number, outcome, scene, np.column_stack((run.track.east_m, run.track.north_m)))
