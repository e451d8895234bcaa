"""The figure of a campaign: every run against what was varied. Drawn without a screen."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from harness.campaign.cell import are_numbers
from harness.campaign.results import Runs
from harness.campaign.sampling import DIRECTION_ENDS
from harness.flight.record import FloatArray
from harness.report.figure_style import colour, styled

LINE_IN, PANEL_IN = 0.17, 1.5  # height of a line of small letters and of a panel, in inches
MAX_OUTLINES: Final = 1500
"""A figure with more points than this is drawn as a picture of dots, since a browser takes seconds for the outlines."""
MAX_KEYS: Final = 4  # only the first this many varied numbers have a column of panels
PERCENTILE_RUNS: Final = 20
"""With at least this many runs an axis ends at percentiles, and values beyond it are marked at its edge."""


def scatter(runs: Runs, keys: Sequence[str]) -> Figure | None:
    """Plots figures (a row of panels each) against every varied number, a point a run; None where no number was varied.

    Runs that did not reach the goal are crosses. A figure's axis ends at its 1st and 99th percentile where others lie
    far beyond them; those are triangles at its edge.
    """
    varied = [key for key in keys if are_numbers(runs.values(key)) and _vary(runs.numbers(key))][:MAX_KEYS]
    every: Mapping[str, FloatArray] = {
        "clearance / wanted": runs.clearance_ratio,
        "cross-track max, m": runs.numbers("cross_track_m.max"),
        "length / optimum": runs.numbers("length_ratio"),
    }
    figures = {label: values for label, values in every.items() if _vary(values)}
    return _draw_panels(runs, varied, figures) if varied and figures else None


def _draw_panels(runs: Runs, varied: Sequence[str], figures: Mapping[str, FloatArray]) -> Figure:
    rows, columns = len(figures), len(varied)
    names = [re.sub(r"(\.|[^.]{8,}?_(?=.{4}))", r"\1\n", key) for key in varied]
    dots = rows * columns * len(runs) > MAX_OUTLINES
    with styled(0.5 + PANEL_IN * rows + LINE_IN * max(name.count("\n") for name in names)) as figure:
        grid = figure.subplots(rows, columns, sharex="col", sharey="row", squeeze=False)
        for (label, values), panels in zip(figures.items(), grid, strict=True):
            panels[0].set_ylabel(label)
            for key, axes in zip(varied, panels, strict=True):
                _panel(axes, runs.numbers(key), values, runs.reached, dots)
                axes.xaxis.set_major_locator(MaxNLocator(max(2, 8 // columns), steps=(1, 2, 5, 10)))
                axes.xaxis.set_major_formatter("{x:g}")  # no power of ten beside it, over which the name lies
                if key.endswith(DIRECTION_ENDS):
                    axes.set(xlim=(-10, 370), xticks=range(0, 361, 90 if columns < MAX_KEYS else 180))
        for name, axes in zip(names, grid[-1], strict=True):
            axes.set_xlabel(name)
    return figure


def _vary(values: FloatArray) -> bool:
    return len({*values[np.isfinite(values)]}) > 1


def _panel(axes: Any, numbers: FloatArray, values: FloatArray, reached: Any, dots: bool) -> None:
    known = values[np.isfinite(values)]
    least, most = float(known.min()), float(known.max())
    low, high = np.percentile(known, (1, 99)) if len(known) >= PERCENTILE_RUNS else (least, most)
    # The axis ends at a percentile on a side where values lie beyond it by more than what is between the two.
    between = high - low
    low = low if 0.0 < between < low - least else least
    high = high if 0.0 < between < most - high else most
    if is_outlying := least < low or high < most:
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
