"""Figures of a campaign with long names and many of them: what is drawn keeps its room."""

import itertools
from typing import Any

import numpy as np
import pyarrow as pa

from harness.campaign.figures import scatter
from harness.campaign.results import Runs
from harness.report.figure_style import svg


def runs_of(varied: dict[str, Any], ratios: Any) -> Runs:
    """Runs that reached their goals, each with its length over the optimum."""
    count = len(ratios)
    names = {name: ["x"] * count for name in ("planner", "aircraft", "world", "scenario")}
    numbers = {name: list(range(count)) for name in ("run", "case", "seed")}
    return Runs(pa.table(names | varied | numbers | {"outcome": ["reached"] * count, "length_ratio": ratios}))


def test_what_stands_below_panels_does_not_run_into_each_other() -> None:
    few, keys = np.arange(3.0), ("uncertainty.centre_of_gravity_m", "a.from_deg", "sensor.range_m", "a.name")
    figure = scatter(runs_of(dict(zip(keys, (5e-6 * few, few, 5e4 * few, few), strict=True)), few), keys)
    assert figure is not None
    svg(figure)
    numbers = [axes.get_xticklabels() for axes in figure.axes]
    for texts in ([axes.xaxis.label for axes in figure.axes], *numbers):
        boxes = [each.get_window_extent() for each in texts]
        assert all(left.x1 < right.x0 for left, right in itertools.pairwise(boxes))
    assert {"1e\N{MINUS SIGN}05", "180", "360"} <= {each.get_text() for texts in numbers for each in texts}
    assert figure.axes[0].get_xlabel() == "uncertainty.\ncentre_of_\ngravity_m"


def test_a_thousand_runs_are_drawn_as_dots_and_a_few_as_outlines() -> None:
    """A browser takes seconds for the outlines of ten thousand marks."""
    for count in (20, 2000):
        values = np.random.default_rng(1).random(count)
        figure = scatter(runs_of({"a": values}, values[::-1]), ["a"])
        assert figure is not None
        content = svg(figure)
        assert (b"<image" in content) is (count == 2000)
        assert len(content) < 600_000


def test_an_axis_ends_where_the_runs_are_and_marks_those_beyond() -> None:
    figure = scatter(runs_of({"a": np.arange(101.0)}, np.append(np.linspace(1.0, 1.2, 100), 40.0)), ["a"])
    assert figure is not None
    (axes,) = figure.axes
    assert axes.get_ylim()[1] < 1.3
    (beyond,) = [line for line in axes.lines if line.get_marker() == "^"]
    assert np.asarray(beyond.get_xdata()).tolist() == [100.0]
    assert np.asarray(beyond.get_ydata())[0] < axes.get_ylim()[1]
    assert scatter(runs_of({"a": np.ones(5)}, np.arange(5.0)), ["a"]) is None, "one value is no plot"
    assert scatter(runs_of({"a": np.arange(5.0)}, np.ones(5)), ["a"]) is None
