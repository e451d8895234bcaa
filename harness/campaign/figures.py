"""Figures of a campaign: success against a varied key, how long the ways were, every run against what was varied.

Drawn without a screen.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from harness.campaign.groups import is_direction
from harness.campaign.summary import CURVE_POINTS, Table
from harness.campaign.table import Runs
from harness.flight.record import FloatArray
from harness.report.figure_style import DASHES, colour, styled

HEIGHT_IN: Final = 2.9
LEGEND_LETTERS, KEY_LETTERS = 66, 6
"""Letters that a row of the legend has room for, and as many as the key before each name takes."""
LEGEND_ROWS, ROW_IN = 3, 0.17
"""A figure has room for this many rows of the legend; each further one makes it so much higher."""
PANEL_IN: Final = 1.5
"""Height of a panel of small multiples."""
MAX_OUTLINES: Final = 1500
"""A figure with more points than this is drawn as a picture of dots: a browser takes seconds for so many outlines."""
ROW_LETTERS: Final = 56
"""Number of letters, in names below panels, that are as wide as the figure."""
LABEL_LETTERS: Final = 32
"""A longer label of a group loses its middle, for it takes room from what is drawn."""
MAX_KEYS: Final = 4
"""Only the first this many varied numbers have a column of panels."""
ENOUGH: Final = 20
"""With at least this many runs the axis ends at percentiles of the figure, and what lies beyond is marked there."""


def success(table: Table) -> Figure:
    """Share of goals reached against the groups of a key, with Wilson intervals, a line for each planner."""
    labels = [_short(label) for label in table.rows.labels]
    planners = table.columns.labels if table.columns else ("",)
    with styled(_height_in(planners)) as figure:
        axes = figure.add_subplot()
        for index, planner in enumerate(planners):
            own = [(place, cells[index].success) for place, cells in enumerate(table.cells)]
            places = np.array([place for place, share in own if share], dtype=np.float64)
            shares = [(share.value, share.low, share.high) for _, share in own if share]
            value, low, high = 100.0 * np.array(shares).reshape(-1, 3).T
            axes.errorbar(
                places + 0.12 * (index - (len(planners) - 1) / 2),
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
        slanted = len(labels) > 5 or max(map(len, labels), default=0) > 16
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


def scatter(runs: Runs, keys: Sequence[str]) -> Figure | None:
    """Figures against every varied number, a point a run; None where no number was varied.

    Runs that did not reach the goal are crosses. A figure's axis ends at its 1st and 99th percentile where others lie
    far beyond them; those are triangles at its edge.

    Args:
        runs: of the campaign.
        keys: that were varied.
    """
    varied = [key for key in keys if _is_number(runs.values(key))][:MAX_KEYS]
    figures = {
        "clearance / wanted": runs.clearance_ratio,
        "cross-track max, m": runs.numbers("cross_track_m.max"),
        "length / optimum": runs.numbers("length_ratio"),
    }
    figures = {label: values for label, values in figures.items() if len({*values[np.isfinite(values)]}) > 1}
    if not varied or not figures:
        return None
    rows, columns = len(figures), len(varied)
    names = [_wrapped(key, ROW_LETTERS // columns) for key in varied]
    dots = rows * columns * len(runs) > MAX_OUTLINES
    with styled(0.5 + PANEL_IN * rows + ROW_IN * max(name.count("\n") for name in names)) as figure:
        grid = figure.subplots(rows, columns, sharex="col", sharey="row", squeeze=False)
        for (label, values), panels in zip(figures.items(), grid, strict=True):
            panels[0].set_ylabel(label)
            for key, axes in zip(varied, panels, strict=True):
                _panel(axes, runs.numbers(key), values, runs.reached, dots)
                if is_direction(key):
                    axes.set(xlim=(-10, 370), xticks=range(0, 361, 90))
        for name, axes in zip(names, grid[-1], strict=True):
            axes.set_xlabel(name)
    return figure


def _panel(axes: Any, numbers: FloatArray, values: FloatArray, reached: Any, dots: bool) -> None:
    low, high = _limits(values)
    if is_outlying := bool(np.any((values < low) | (values > high))):
        axes.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
    within = (values >= low) & (values <= high)
    for among, marker, shade in (
        (reached & within, ".", colour(0)),
        (~reached & within, "x", colour(1)),
        (values > high, "^", colour(3)),
        (values < low, "v", colour(3)),
    ):
        shown = np.clip(values[among], low, high) if is_outlying else values[among]
        axes.plot(numbers[among], shown, marker, ms=3.5, color=shade, alpha=0.7, rasterized=dots)
    axes.grid(color="0.9", lw=0.6)


def _limits(values: FloatArray) -> tuple[float, float]:
    """Where an axis ends: at percentiles, on a side where values lie beyond by more than what is between them."""
    known = values[np.isfinite(values)]
    low, high = np.percentile(known, (1, 99))
    beyond = high - low
    least, most = float(known.min()), float(known.max())
    if len(known) < ENOUGH or not beyond:
        return least, most
    return float(low) if low - least > beyond else least, float(high) if most - high > beyond else most


def _is_number(values: Sequence[Any]) -> bool:
    given = {value for value in map(str, values) if value != "None"}
    return len(given) > 1 and all(
        value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values
    )


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
