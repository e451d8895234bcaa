"""Figures of a comparison for papers and reports: the paper's Figures 2 and 3 from our own runs.

The style of all figures stands in `figure_style`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from matplotlib import patches
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from harness.analysis.metric import round_length_m
from harness.analysis.smoothness import Profile, flown_lengths, flown_profile, planned_profile, window_m
from harness.report.figure_style import BEHIND_TEXT, DASHES, WIDTH_IN, beside, colour, styled
from harness.world.obstacle import Circle, Obstacle

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from harness.flight.record import AcceptedPlan, FloatArray, Track
    from harness.run_files.run_tables import PlanRow

STANDING_STYLE: dict[str, Any] = {"fc": "0.85", "ec": "0.45", "lw": 0.7}  # style of standing obstacles
CHANGING_STYLE = STANDING_STYLE | {"ls": "--"}
"""Style of obstacles that move or stand for a time, drawn where they are at first."""

NEAREST_MARK: dict[str, Any] = {"marker": "s", "mfc": "none", "mec": "0.2", "mew": 1.2, "ms": 7, "zorder": 8}
"""Mark of the place where a flight was nearest to an obstacle, and too near, in the flight's colour."""

LEGEND_ROW_IN, WORDS_IN = 0.19, 3.4  # height of a row of the legend; width of a map with the wind in one line
TALLEST_MAP_IN = 6.0  # a map is at most this high
TICK_IN = 0.5, 0.25  # a tick of the map's axes has at least this much room, east and north

SPARE_FACTOR = 1.35
"""A curvature plot reaches up to this many times the turn limit or, where that is more, the flown curve."""


@dataclass(frozen=True, eq=False)
class DrawnRun:
    """One planner's flight, ready to be drawn; the plan of rows with `plan_index` i is `plans[i]`."""

    planner: str
    outcome: str
    track: Track
    plans: Sequence[AcceptedPlan | PlanRow]
    turn_radius_m: float

    def nearest(self, clearance_m: float) -> int | None:
        """Returns the row where it was nearest to an obstacle, or hit it; None if never below the wanted clearance."""
        if not (below := self.track.clearance_m < clearance_m).any():
            return None
        # A contact between the last two rows is nearer than any row.
        if self.outcome == "collision" and below[-1]:
            return len(below) - 1
        return int(np.nanargmin(self.track.clearance_m))


@dataclass(frozen=True, eq=False)
class FigureScene:
    """The part of a scenario that all its flights have in common, the true obstacles among it.

    `optimum_m` is the clairvoyant shortest path (k, 2), empty where there is none. `wind` has where it blows
    from (degrees), and its words, empty in calm air.
    """

    name: str
    bounds_m: tuple[float, float, float, float]
    obstacles: tuple[Obstacle, ...]
    start_m: tuple[float, float]
    goal_m: tuple[float, float]
    goal_radius_m: float
    clearance_m: float
    turn_radius_m: float
    optimum_m: FloatArray
    wind: tuple[float, str] = (0.0, "")
    navigation_margin_m: float = 0.0


Numbered: TypeAlias = Sequence[tuple[int, DrawnRun]]
"""Flights with the numbers of their planners, which give their colours in every figure."""


def overview(scene: FigureScene, runs: Numbered) -> Figure:
    """Draws the map with the tracks of all planners."""
    marks = legend_marks(scene, [run for _, run in runs])
    with styled(map_height_in(scene) + LEGEND_ROW_IN * math.ceil((2 + len(runs) + len(marks)) / 2)) as figure:
        axes = figure.add_subplot()
        legend = draw_map(axes, scene)
        for index, run in runs:
            legend.append(draw_flown(axes, scene, run, index, DASHES[index % len(DASHES)]))
        axes.set_title(scene.name)
        figure.legend(handles=legend + marks, loc="outside lower center", ncols=2, frameon=False)
    return figure


def profiles(runs: Numbered) -> Figure:
    """Draws curvature and cross-track error along the way, two strips a planner."""
    with styled(0.9 + 2.1 * len(runs)) as figure:
        strips = figure.subplots(2 * len(runs), 1, sharex=True, squeeze=False)[:, 0]
        for place, (index, run) in enumerate(runs):
            bend, cross = strips[2 * place], strips[2 * place + 1]
            distance, corner_m = distance_m(run.track) / 1e3, window_m(run.track)
            planned = _steps(planned_profile(run.track, run.plans, corner_m), run.turn_radius_m, corner_m)
            flown = _steps(flown_profile(run.track), run.turn_radius_m)
            most = float(np.abs(planned[1]).max(initial=0.0))
            bend.plot(*planned, color="0.55", lw=0.8, label=f"planned, up to {most:.3g}")
            bend.plot(*flown, color=colour(index), lw=0.9, label="flown")
            for limit in (-1.0, 1.0):
                bend.axhline(limit, color="0.35", lw=0.7, ls="--")
            bend.axhline(0.0, color="0.8", lw=0.6)
            reach = SPARE_FACTOR * max(1.0, float(np.abs(flown[1]).max(initial=0.0)))  # corners may leave it
            bend.set_ylim(-reach, reach)
            bend.set_ylabel("curvature · R")
            bend.set_title(run.planner, loc="left", color=colour(index))
            bend.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, borderpad=0)
            cross.axhline(0.0, color="0.8", lw=0.6)
            cross.plot(distance, run.track.cross_track_m, color=colour(index), lw=0.9)
            cross.set_ylabel("cross-\ntrack, m")
        strips[-1].set_xlabel("distance flown, km")
        figure.align_ylabels()
    return figure


def map_height_in(scene: FigureScene) -> float:
    """Returns the height of a map as wide as a figure, with title and axis labels."""
    return 0.8 + _map_in(scene)[1]


def _map_in(scene: FigureScene) -> tuple[float, float]:
    """Returns width and height of a map, as wide as a figure or as high as it may be."""
    xmin, ymin, xmax, ymax = scene.bounds_m
    scale = min((WIDTH_IN - 0.6) / (xmax - xmin), TALLEST_MAP_IN / (ymax - ymin))
    return scale * (xmax - xmin), scale * (ymax - ymin)


def draw_map(axes: Axes, scene: FigureScene, ends: bool = True) -> list[Any]:
    """Draws obstacles and area, and if `ends` start, goal, straight line and optimum; returns the legend's begin."""
    xmin, ymin, xmax, ymax = (edge / 1e3 for edge in scene.bounds_m)
    for obstacle in scene.obstacles:
        for grown, style in (
            (scene.clearance_m, {"fill": False, "ec": "0.6", "lw": 0.5, "ls": ":"}),
            (0.0, STANDING_STYLE if obstacle.stands_for_ever else CHANGING_STYLE),
        ):
            # The limits are set below, and nothing is drawn beyond them: layouts need not measure thousands of these.
            axes.add_artist(outline(obstacle, grown, **style)).set_in_layout(False)
    axes.set(xlim=(xmin, xmax), ylim=(ymin, ymax), aspect="equal")
    _mark_scale_and_wind(axes, scene)
    if not ends:
        return []
    (east, north), (goal_east, goal_north) = np.array(scene.start_m) / 1e3, np.array(scene.goal_m) / 1e3
    ends_km = [east, goal_east], [north, goal_north]
    legend: list[Any] = axes.plot(*ends_km, color="0.3", lw=0.7, ls="--", label="straight line")
    if len(scene.optimum_m):
        legend += axes.plot(
            *scene.optimum_m.T / 1e3, color="black", lw=0.9, ls=":", label="clairvoyant optimum", zorder=4
        )
    axes.add_patch(patches.Circle((goal_east, goal_north), scene.goal_radius_m / 1e3, fill=False, lw=0.8))
    for place, name in (((east, north), "S"), ((goal_east, goal_north), "G")):
        axes.plot(*place, "o", color="black", ms=3.5, zorder=6)
        low = place[1] < ymin + 0.75 * (ymax - ymin)
        axes.annotate(
            name, place, (0, 6 if low else -6), textcoords="offset points", ha="center",
            va="bottom" if low else "top", weight="bold", zorder=7,
        )  # fmt: skip
    return legend


def _mark_scale_and_wind(axes: Axes, scene: FigureScene) -> None:
    """Draws ticks, a bar of a round length, and an arrow with the wind in words that points where it blows to."""
    xmin, ymin, xmax, ymax = (edge / 1e3 for edge in scene.bounds_m)
    unit, factor = ("m", 1e3) if max(xmax - xmin, ymax - ymin) < 3.0 else ("km", 1.0)
    sides = zip((axes.xaxis, axes.yaxis), ("east", "north"), _map_in(scene), TICK_IN, strict=True)
    for axis, name, long_in, tick_in in sides:
        most = min(max(int(long_in / tick_in), 1), 6)
        axis.set_major_locator(MaxNLocator(most, min_n_ticks=min(most, 3)))
        axis.set_major_formatter(lambda at, _: f"{factor * at:.6g}".replace("-", "\N{MINUS SIGN}"))
        axis.set_label_text(f"{name}, {unit}")
    bar_m = round_length_m((scene.bounds_m[2] - scene.bounds_m[0]) / 6)
    label = f"{bar_m / 1e3:g} km" if bar_m >= 1e3 else f"{bar_m:g} m"
    right, low = xmax - 0.04 * (xmax - xmin), ymin + 0.03 * (ymax - ymin)
    axes.plot([right - bar_m / 1e3, right], [low, low], color="black", lw=2, solid_capstyle="butt", zorder=9)
    above: dict[str, Any] = {"fontsize": 8, "zorder": 9, "bbox": BEHIND_TEXT}
    axes.annotate(label, (right, low), (0, 4), textcoords="offset points", ha="right", **above)
    from_deg, blows = scene.wind
    if not blows:
        return
    middle, back = np.array((16.0, -14.0)), math.radians(from_deg)
    along = 12.0 * np.array((math.sin(back), math.cos(back)))
    tip, tail = beside(axes, *(middle - along)), beside(axes, *(middle + along))
    arrow = {"arrowstyle": "-|>", "color": "#0B5C8C", "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (0, 1), (0, 1), tip, tail, arrowprops=arrow, zorder=9)
    words = blows if _map_in(scene)[0] > WORDS_IN else blows.replace(" from", "\nfrom").replace(" at", "\nat")
    axes.text(0, 1, words, transform=beside(axes, 32, -9), va="top", **above)


def outline(obstacle: Obstacle, grown_m: float, at_s: float | None = None, **style: Any) -> patches.Patch:
    """Returns the patch of an obstacle grown by a distance, displaced to where it is at a time; None: not displaced."""
    shape = obstacle.shape
    moved = np.array((0.0, 0.0) if at_s is None else obstacle.displacement_m(at_s)) / 1e3
    if isinstance(shape, Circle):
        east, north = np.array(shape.center_m) / 1e3 + moved
        return patches.Circle((float(east), float(north)), (shape.radius_m + grown_m) / 1e3, **style)
    import shapely

    solid = shapely.Polygon(shape.vertices_m, shape.holes_m)
    # Rings of holes run the other way round, which is how they stay empty.
    solid = shapely.orient_polygons(solid.buffer(grown_m) if grown_m > 0 else solid)
    edges = (solid.exterior, *solid.interiors)
    rings = [Path(np.array(ring.coords) / 1e3 + moved, closed=True) for ring in edges]
    return patches.PathPatch(Path.make_compound_path(*rings), **style)


def draw_flown(axes: Axes, scene: FigureScene, run: DrawnRun, index: int, dashes: Any = "-") -> Line2D:
    """Draws a track with the marks that `legend_marks` explains; the first planner's lies on top."""
    points = np.column_stack((run.track.east_m, run.track.north_m))
    style: dict[str, Any] = {"color": colour(index), "lw": 1.5, "ls": dashes, "zorder": 5 + 1 / (1 + index)}
    (line,) = axes.plot(*points.T / 1e3, label=run.planner, **style)
    if run.outcome != "reached":
        axes.plot(*points[-1] / 1e3, "X", color=colour(index), ms=7, mec="white", mew=0.6, zorder=7)
    if (nearest := run.nearest(scene.clearance_m)) is not None:
        place = run.track.east_m[nearest] / 1e3, run.track.north_m[nearest] / 1e3
        axes.plot(*place, ls="", **NEAREST_MARK | {"mec": colour(index)})
    return line


def changing_marks(scene: FigureScene) -> list[Any]:
    """Returns the legend's entry for obstacles that move or stand for a time, if there are any."""
    if all(obstacle.stands_for_ever for obstacle in scene.obstacles):
        return []
    return [patches.Patch(**CHANGING_STYLE, label="moves, or stands for a time")]


def legend_marks(scene: FigureScene, runs: Sequence[DrawnRun]) -> list[Any]:
    """Returns the legend's entries for marks that only some flights have."""
    marks: list[Any] = changing_marks(scene)
    if any(run.outcome != "reached" for run in runs):
        marks += [Line2D([], [], ls="", marker="X", color="0.2", ms=7, mec="white", label="ended, not at G")]
    if any(run.nearest(scene.clearance_m) is not None for run in runs):
        marks.append(Line2D([], [], ls="", label="nearest to an obstacle", **NEAREST_MARK))
    return marks


def distance_m(track: Track) -> FloatArray:
    """(n,) distance flown up to each row."""
    return np.append(0.0, np.cumsum(flown_lengths(track)))


def _steps(profile: Profile, radius_m: float, corner_m: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Returns a curvature profile as a curve: distance along it, km, and curvature times a radius.

    A corner, which counts as `corner_m` long, is a peak without a length: what follows is where it was flown.
    """
    lengths = np.where(profile.length_m == corner_m, 0.0, profile.length_m)
    ends = np.cumsum(lengths)
    along = np.column_stack((ends - lengths, ends)).ravel() / 1e3
    return along, radius_m * np.repeat(profile.curvature_1pm, 2)
