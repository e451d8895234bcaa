"""The figure of a checked path: the line as given, the flown one over it, corners, fences, and what was touched."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import patches
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from harness.files.wording import metres
from harness.report.figure_style import colour, styled
from harness.report.figures import LEGEND_ROW_IN, changing_marks, draw_map, map_height_in
from harness.report.planner_figure import NEAR_MISS_HEIGHT_IN, close_up

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from harness.flight.record import FloatArray
    from harness.report.figures import DrawnRun, FigureScene

RED, GREEN = "#A8201A", "#009E73"
GIVEN_STYLE: dict[str, Any] = {"color": "0.7", "lw": 5.0, "solid_joinstyle": "round", "zorder": 3.5}
KEPT_MARK: dict[str, Any] = {"marker": "o", "mfc": "white", "mec": GREEN, "mew": 1.4, "ms": 6.5, "zorder": 8}
CUT_MARK: dict[str, Any] = {"marker": "X", "color": RED, "mec": "white", "mew": 0.6, "ms": 9, "zorder": 8}
TOUCHED, CROSSED = CUT_MARK | {"marker": "*", "ms": 13, "zorder": 9}, CUT_MARK | {"marker": "^", "zorder": 9}
FENCE_STYLES: Mapping[str, dict[str, Any]] = {
    "exclusion": {"ec": RED, "fc": f"{RED}22", "lw": 1.0, "ls": "--"},
    "inclusion": {"ec": GREEN, "fc": "none", "lw": 1.2, "ls": "--"},
}
POINT_MARK: dict[str, Any] = {"marker": "o", "color": "0.25", "ms": 2.5, "zorder": 6}
WORST_MARK: dict[str, Any] = {"marker": "o", "mfc": "none", "mec": RED, "ms": 9, "zorder": 8}
WORST_SPANS = 3.0
"""The worst place is drawn up to this many times its error, or the allowed one, to each side; of a short path less."""
MOST_POINTS = 300
"""Only a path with at most this many points has them marked; one with more is a sampled curve."""
MARGIN_SHARE = 0.15  # the figure reaches this share of the path's span beyond it


def path_figure(scene: FigureScene, run: DrawnRun, given_m: FloatArray, metrics: Mapping[str, Any]) -> Figure:
    """Draws a checked path."""
    check = metrics["check"]
    flown = np.column_stack((run.track.east_m, run.track.north_m))
    marks = _marks(given_m, metrics)
    kinds = list(dict.fromkeys(fence["kind"] for fence in check["fences"]))
    changing = changing_marks(scene)
    lines = math.ceil((2 + len(marks) + len(kinds) + len(changing)) / 2)
    scene = _close_frame(scene, np.concatenate((given_m, flown)))
    heights_in = [map_height_in(scene), NEAR_MISS_HEIGHT_IN]
    with styled(sum(heights_in) + LEGEND_ROW_IN * (lines + 1)) as figure:
        rows = figure.add_gridspec(2, 1, height_ratios=heights_in)
        axes = figure.add_subplot(rows[0])
        _draw_worst(figure.add_subplot(rows[1]), run, given_m, check["worst"])
        draw_map(axes, scene, ends=False)
        legend: list[Any] = [*axes.plot(*given_m.T / 1e3, label="as given", **GIVEN_STYLE)]
        legend += axes.plot(*flown.T / 1e3, color=colour(0), lw=1.5, zorder=5, label="flown")
        for fence in check["fences"]:
            _draw_fence(axes, fence)
        legend += [patches.Patch(**FENCE_STYLES[kind], label=f"{kind} fence") for kind in kinds]
        for name, (style, places) in marks.items():
            axes.plot(*np.array(places).T / 1e3, ls="", **style)
            legend.append(Line2D([], [], ls="", label=name, **{**style, "zorder": 1}))
        legend += changing
        axes.set_title(f"{scene.name}: {'as given' if check['ok'] else 'not as given'}")
        figure.legend(handles=legend, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _marks(given_m: FloatArray, metrics: Mapping[str, Any]) -> dict[str, tuple[dict[str, Any], list[Any]]]:
    """Returns style and places of what is marked on a checked path, by its text in the legend."""
    corners = metrics["check"]["corners"]
    every = {
        "point given": (POINT_MARK, given_m.tolist() if len(given_m) <= MOST_POINTS else []),
        "corner cut as allowed": (KEPT_MARK, _places(each for each in corners if each["kept"])),
        "corner cut too far": (CUT_MARK, _places(each for each in corners if not each["kept"])),
        "contact": (TOUCHED, _places(metrics["contacts"])),
        "fence or bound crossed": (CROSSED, _places(metrics["breaches"])),
    }
    return {name: (style, places) for name, (style, places) in every.items() if places}


def _draw_worst(axes: Axes, run: DrawnRun, given_m: FloatArray, worst: Mapping[str, Any]) -> None:
    """Draws the place where the track is furthest off the path in relation to what is allowed there, enlarged."""
    middle = np.array((worst["east_m"], worst["north_m"]))
    off_m, allowed_m = worst["off_m"], worst["allowed_m"]
    enlarged_m = max(0.5 * WORST_SPANS * off_m, 0.125 * float(np.ptp(given_m, axis=0).max()))
    half_m = min(WORST_SPANS * max(off_m, allowed_m), enlarged_m)
    axes.plot(*given_m.T / 1e3, **GIVEN_STYLE)
    axes.plot(run.track.east_m / 1e3, run.track.north_m / 1e3, color=colour(0), lw=1.5, zorder=5)
    close_up(axes, middle, (2 * half_m, half_m))
    axes.plot(*middle / 1e3, **WORST_MARK)
    place = f"{metres(off_m, allowed_m)} off at {worst['time_s']:.0f} s"
    axes.set_title(f"worst place: {place}, {metres(allowed_m, off_m)} allowed")


def _places(entries: Iterable[Mapping[str, Any]]) -> list[tuple[float, float]]:
    return [(each["east_m"], each["north_m"]) for each in entries]


def _close_frame(scene: FigureScene, points_m: FloatArray) -> FigureScene:
    lowest, highest = points_m.min(axis=0), points_m.max(axis=0)
    middle = (lowest + highest) / 2
    span = highest - lowest
    half = (0.5 + MARGIN_SHARE) * np.maximum(span, 0.35 * span.max())
    return replace(scene, bounds_m=(*(middle - half).tolist(), *(middle + half).tolist()))


def _draw_fence(axes: Axes, fence: Mapping[str, Any]) -> None:
    style = FENCE_STYLES[fence["kind"]]
    if "center_m" in fence:
        east, north = fence["center_m"]
        axes.add_patch(patches.Circle((east / 1e3, north / 1e3), fence["radius_m"] / 1e3, zorder=3, **style))
    for ring in fence.get("rings_m", []):
        axes.add_patch(patches.Polygon(np.array(ring) / 1e3, zorder=3, **style))
