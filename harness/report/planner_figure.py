"""The figure of one planner's path, with its near miss enlarged below the map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from harness.analysis.metric import number, round_length_m
from harness.flight.polylines import polylines
from harness.report import figures
from harness.report.figure_style import BEHIND_TEXT, colour, styled
from harness.report.figures import DrawnRun, FigureScene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from harness.flight.record import FloatArray

NEAR_MISS_HEIGHT_IN: Final = 2.3  # height of the row of the near miss, which holds a picture and a plot
CLOSE_UP_CLEARANCES: Final = 4.0  # an enlarged picture reaches this many wanted clearances to each side
PLOT_CLEARANCES: Final = 3.0
"""The plot of the clearance about a near miss reaches up to this many wanted clearances."""

PLANNED_DASHES: Any = (0, (4, 2))  # line style of planned paths


def planner_figure(scene: FigureScene, run: DrawnRun, index: int) -> Figure:
    """Draws one planner's path as in the paper's Figures 2 and 3, and its near miss, nearest to an obstacle."""
    nearest, marks = run.nearest(scene.clearance_m), figures.legend_marks(scene, [run])
    heights_in = [figures.map_height_in(scene)] + ([] if nearest is None else [NEAR_MISS_HEIGHT_IN])
    with styled(sum(heights_in) + figures.LEGEND_ROW_IN * math.ceil((4 + len(marks)) / 2)) as figure:
        # A second column without anything in it would leave a narrow map half as large.
        rows = figure.add_gridspec(len(heights_in), len(heights_in), height_ratios=heights_in)
        axes = figure.add_subplot(rows[0, :])
        legend = [*figures.draw_map(axes, scene), figures.draw_flown(axes, scene, run, index)]
        axes.set_title(f"{scene.name}: {run.planner}, {run.outcome.replace('_', ' ')}")
        if nearest is not None:
            legend.append(Line2D([], [], color="black", lw=0.9, ls=PLANNED_DASHES, label="planned (below)"))
            _near_miss(figure.add_subplot(rows[1, 0]), scene, run, index, nearest)
            _clearance(figure.add_subplot(rows[1, 1]), scene, run, index, nearest)
        figure.legend(handles=legend + marks, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _near_miss(axes: Axes, scene: FigureScene, run: DrawnRun, index: int, row: int) -> None:
    """Draws flown and planned path where it was nearest to an obstacle, and the obstacles where they were then."""
    track, half_m = run.track, _half_m(scene)
    middle, now_s = np.array((track.east_m[row], track.north_m[row])), track.time_s[row : row + 1]
    for obstacle in scene.obstacles:
        # As far as the corners of the picture; an obstacle that was not there then is infinitely far.
        if obstacle.distance(middle[None, :], now_s)[0] > 1.5 * half_m + scene.clearance_m:
            continue
        for grown, style in (
            (scene.clearance_m, {"fill": False, "ec": "0.6", "lw": 0.6, "ls": ":"}),
            (0.0, figures.STANDING_STYLE),
        ):
            axes.add_patch(figures.outline(obstacle, grown, float(now_s[0]), **style))
    plan = int(track.plan_index[row])
    axes.plot(track.east_m / 1e3, track.north_m / 1e3, color=colour(index), lw=1.8)
    for each in polylines([run.plans[plan].segments], 1e-3 * half_m) if plan >= 0 else []:
        axes.plot(*each.T / 1e3, color="black", lw=0.9, ls=PLANNED_DASHES)
    close_up(axes, middle, (half_m, half_m))
    axes.plot(*middle / 1e3, ls="", **figures.NEAREST_MARK | {"mec": colour(index)})
    hit = run.outcome == "collision" and row == len(track) - 1
    what = "its collision" if hit else f"nearest: {number(float(track.clearance_m[row]))} m"
    axes.set_title(f"{what}, at {track.time_s[row]:.1f} s")


def _clearance(axes: Axes, scene: FigureScene, run: DrawnRun, index: int, row: int) -> None:
    """Plots the clearance before and behind the place where it was least."""
    track, half_m = run.track, _half_m(scene)
    along_m = figures.distance_m(track) - figures.distance_m(track)[row]
    near = np.abs(along_m) < 2 * half_m
    axes.plot(along_m[near], track.clearance_m[near], color=colour(index), lw=1.5)
    axes.axhline(0.0, color="0.8", lw=0.6)
    axes.axhline(scene.clearance_m, color="0.35", lw=0.7, ls="--", label="wanted")
    axes.legend(loc="upper center", edgecolor="none", borderpad=0)
    axes.locator_params(axis="x", nbins=4)  # a panel of half a figure has no room for more with four digits
    most_m = PLOT_CLEARANCES * scene.clearance_m or half_m
    low_m = min(0.0, float(track.clearance_m[row])) - 0.1 * most_m
    axes.set(xlabel="along the path, m", ylim=(low_m, most_m), title="clearance, m")


def _half_m(scene: FigureScene) -> float:
    return max(CLOSE_UP_CLEARANCES * scene.clearance_m, scene.turn_radius_m)


def close_up(axes: Axes, middle_m: FloatArray, half_m: tuple[float, float]) -> None:
    """Shows a place enlarged, with a bar of a round length and no ticks."""
    (east, north), (wide, high) = middle_m / 1e3, np.array(half_m) / 1e3
    axes.set(xlim=(east - wide, east + wide), ylim=(north - high, north + high), aspect="equal")
    axes.set(xticks=[], yticks=[])
    bar_m = round_length_m(2 * half_m[1] / 3)
    left, low = east - 0.93 * wide, north - 0.88 * high
    axes.plot([left, left + bar_m / 1e3], [low, low], color="black", lw=2, solid_capstyle="butt")
    text = axes.annotate(f"{bar_m:g} m", (left, low), (0, 4), textcoords="offset points", fontsize=8)
    text.set_bbox(BEHIND_TEXT)
