"""The figure of one planner's path, with its near miss and its tightest planned turn enlarged below the map."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from harness.analysis.metric import number
from harness.report.figure_style import colour, round_length_m, styled
from harness.report.figures import (
    BEHIND_TEXT,
    LEGEND_ROW_IN,
    NEAREST,
    SOLID,
    DrawnRun,
    FigureScene,
    distance_m,
    draw_flown,
    draw_map,
    flown_curvature,
    legend_marks,
    map_height_in,
    outline,
    turn_limits,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from harness.flight.record import FloatArray

CLOSE_UP_IN: Final = 2.3
CLOSE_UP_RADII: Final = 4.0
CLOSE_UP_CLEARANCES: Final = 4.0
"""A picture that enlarges reaches so many turn radii, or wanted clearances, to each side."""
CLEARANCES_SHOWN: Final = 3.0
"""The plot of the clearance about a near miss reaches so many wanted clearances up."""

PLANNED_DASHES: Any = (0, (4, 2))


def planner_figure(scene: FigureScene, run: DrawnRun, index: int) -> Figure:
    """One planner's path as in the paper's Figures 2 and 3, and what of it deserves a nearer look.

    That is the place nearest to an obstacle, where it was below the wanted clearance, and then the place where the plan
    bends most.

    Args:
        scene: the scenario.
        run: the flight.
        index: number of the planner, for its colour.
    """
    nearest, tightest = run.nearest(scene.clearance_m), run.planned.tightest
    below: list[Callable[[Axes, Axes], None]] = []
    if nearest is not None:
        below.append(lambda left, right: _near_miss(left, right, scene, run, index, nearest))
    if tightest is not None:
        below.append(lambda left, right: _tightest_turn(left, right, scene, run, index, tightest))
    map_in, marks = map_height_in(scene), legend_marks(scene, [run])
    heights_in = [map_in, *(CLOSE_UP_IN for _ in below)]
    with styled(sum(heights_in) + LEGEND_ROW_IN * math.ceil((4 + len(marks)) / 2)) as figure:
        rows = figure.add_gridspec(len(heights_in), 2, height_ratios=heights_in)
        axes = figure.add_subplot(rows[0, :])
        legend = draw_map(axes, scene)
        legend.append(draw_flown(axes, scene, run, index))
        axes.set_title(f"{scene.name}: {run.planner}, {run.outcome.replace('_', ' ')}")
        if below:
            planned = Line2D([], [], color="black", lw=0.9, ls=PLANNED_DASHES, label="planned (below)")
            legend.append(planned)
        for place, draw in enumerate(below, 1):
            draw(figure.add_subplot(rows[place, 0]), figure.add_subplot(rows[place, 1]))
        figure.legend(handles=legend + marks, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _near_miss(left: Axes, right: Axes, scene: FigureScene, run: DrawnRun, index: int, row: int) -> None:
    """Where it was nearest to an obstacle, or hit it: the paths there, and the clearance before and behind."""
    track, half_m = run.track, max(CLOSE_UP_CLEARANCES * scene.clearance_m, scene.turn_radius_m)
    place = np.array((track.east_m[row], track.north_m[row]))
    _enlarged(left, scene, run, index, row, place, half_m)
    left.plot(*place / 1e3, ls="", **NEAREST | {"mec": colour(index)})
    hit = run.outcome == "collision" and row == len(track) - 1
    what = "its collision" if hit else f"nearest: {number(float(track.clearance_m[row]))} m"
    left.set_title(f"{what}, at {track.time_s[row]:.1f} s")
    along_m, near = _along(run, row, half_m)
    right.plot(along_m[near], track.clearance_m[near], color=colour(index), lw=1.5)
    right.axhline(0.0, color="0.8", lw=0.6)
    right.axhline(scene.clearance_m, color="0.35", lw=0.7, ls="--", label="wanted")
    right.legend(loc="upper center", edgecolor="none", borderpad=0)
    _label_along(right)
    most_m = CLEARANCES_SHOWN * scene.clearance_m or half_m
    right.set_ylim(min(0.0, float(track.clearance_m[row])) - 0.1 * most_m, most_m)
    right.set_title("clearance, m")


def _tightest_turn(left: Axes, right: Axes, scene: FigureScene, run: DrawnRun, index: int, row: int) -> None:
    """Where the plan bends most: the paths there, and the curvature before and behind."""
    half_m = CLOSE_UP_RADII * scene.turn_radius_m
    place = np.array((run.planned.east_m[row], run.planned.north_m[row]))
    _enlarged(left, scene, run, index, row, place, half_m)
    left.set_title("its tightest planned turn")
    along_m, near = _along(run, row, half_m)
    flown = (flown_curvature(run.track) * scene.turn_radius_m)[near]
    planned = (run.planned.curvature_1pm * scene.turn_radius_m)[near]
    right.plot(along_m[near], flown, color=colour(index), lw=1.5)
    right.plot(along_m[near], planned, color="black", lw=0.9, ls=PLANNED_DASHES)
    turn_limits(right, flown)
    most = float(np.nanmax(np.abs(planned), initial=0.0))
    text = right.annotate(f"planned up to {most:.3g}", (0.03, 0.04), xycoords="axes fraction", fontsize=8)
    text.set_bbox(BEHIND_TEXT)
    _label_along(right)
    right.set_title("curvature · turn radius")


def _along(run: DrawnRun, row: int, half_m: float) -> tuple[FloatArray, Any]:
    """(n,) distance along the path from a row, and which rows lie within twice `half_m`."""
    distance = distance_m(run.track)
    along_m: FloatArray = distance - distance[row]
    return along_m, np.abs(along_m) < 2 * half_m


def _label_along(axes: Axes) -> None:
    """Few ticks: a panel of half a figure has no room for more with four digits."""
    axes.locator_params(axis="x", nbins=4)
    axes.set_xlabel("along the path, m")


def _enlarged(
    axes: Axes, scene: FigureScene, run: DrawnRun, index: int, row: int, middle: FloatArray, half_m: float
) -> None:
    """Planned and flown path about a place, and the obstacles where they were at a row."""
    now_s = run.track.time_s[row : row + 1]
    for obstacle in scene.obstacles:
        # As far as the corners of the picture; an obstacle that was not there then is infinitely far.
        if obstacle.distance(middle[None, :], now_s)[0] > 1.5 * half_m + scene.clearance_m:
            continue
        for grown, style in (
            (scene.clearance_m, {"fill": False, "ec": "0.6", "lw": 0.6, "ls": ":"}),
            (0.0, SOLID),
        ):
            axes.add_patch(outline(obstacle, grown, float(now_s[0]), **style))
    planned = np.column_stack((run.planned.east_m, run.planned.north_m))
    flown = np.column_stack((run.track.east_m, run.track.north_m))
    for points, ink, width, dashes in (
        (flown, colour(index), 1.8, "-"),
        (planned, "black", 0.9, PLANNED_DASHES),
    ):
        near = np.abs(points - middle).max(axis=1) < 2 * half_m
        axes.plot(*np.where(near[:, None], points, np.nan).T / 1e3, color=ink, lw=width, ls=dashes)
    (east, north), half_km = middle / 1e3, half_m / 1e3
    axes.set(xlim=(east - half_km, east + half_km), ylim=(north - half_km, north + half_km), aspect="equal")
    axes.set_xticks([])
    axes.set_yticks([])
    bar_m = round_length_m(half_m)
    left, low = east - 0.9 * half_km, north - 0.88 * half_km
    axes.plot([left, left + bar_m / 1e3], [low, low], color="black", lw=2, solid_capstyle="butt")
    text = axes.annotate(f"{bar_m:g} m", (left, low), (0, 4), textcoords="offset points", fontsize=8)
    text.set_bbox(BEHIND_TEXT)
