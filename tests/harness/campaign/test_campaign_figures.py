"""Figures of a campaign with long names and many of them: what is drawn keeps its room."""

from __future__ import annotations

import itertools
import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.campaign.figures import (
    LABEL_LETTERS,
    MOST_FAILURES,
    failures,
    lengths,
    scatter,
    success,
    where_failed,
)
from harness.campaign.groups import Axis
from harness.campaign.points import RunPoints
from harness.campaign.summary import CURVE_POINTS, Cell, Table
from harness.report.figure_style import svg
from harness.run.scenario_flight import fly_to_folder, kinematic_loop
from tests.closed_loop.conftest import world

CELL = Cell(runs=3, reached=2, success=0.67, success_low=0.2, success_high=0.9)


def names(count: int, letters: int) -> tuple[str, ...]:
    return tuple(f"{number:x<{letters - 2}}{number:02d}" for number in range(count))


def table(rows: tuple[str, ...], columns: tuple[str, ...]) -> Table:
    return Table(Axis("digest", rows), Axis("planner", columns), ((CELL,) * len(columns),) * len(rows))


@pytest.mark.flights
@pytest.mark.parametrize(
    ("rows", "columns"),
    [
        (names(1, 64), names(1, 8)),
        (names(12, 64), names(3, 20)),
        (names(6, 200), names(12, 40)),
        (names(3, 3), names(40, 60)),
    ],
)
def test_the_axes_keep_their_room(rows: tuple[str, ...], columns: tuple[str, ...]) -> None:
    curves = {name: [1.0 + 0.001 * step for step in range(CURVE_POINTS)] for name in columns}
    for figure in (success(table(rows, columns)), lengths(curves)):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            svg(figure)
        (axes,) = figure.axes
        assert axes.get_window_extent().height > 0.7 * figure.dpi
        for legend in figure.legends:
            assert 0.0 <= legend.get_window_extent().y0 < legend.get_window_extent().y1 <= figure.bbox.y1


def test_a_long_label_keeps_both_ends() -> None:
    def labels(*rows: str) -> list[str]:
        (axes,) = success(table(rows, ("bug2",))).axes
        return [label.get_text() for label in axes.get_xticklabels()]

    fits = "f" * LABEL_LETTERS
    long = [f"world_of_many_obstacles_and_a_long_name_{number}" for number in (1, 2)]
    shown = labels(fits, *long)
    assert shown == [fits, "world_of_many_..._a_long_name_1", "world_of_many_..._a_long_name_2"]


def test_names_are_drawn_as_they_are_and_without_a_word() -> None:
    """Two dollar signs are no formula, and letters that the font lacks are no warning."""
    labels = (r"a$\frac$.yaml", "\N{CJK UNIFIED IDEOGRAPH-6797}.yaml")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        svg(success(table(labels, ("bug2",))))


def test_names_below_panels_do_not_run_into_each_other() -> None:
    keys = (
        "environment.wind.speed_mps",
        "environment.wind.from_deg",
        "sensor.range_noise_m",
        "obstacles.0.n" + 30 * "x",
    )
    runs = np.arange(3.0)
    points = RunPoints(dict.fromkeys(keys, runs), {"length / optimum": runs}, np.ones(3, dtype=bool))
    figure = scatter(points)
    assert figure is not None
    svg(figure)
    boxes = [axes.xaxis.label.get_window_extent() for axes in figure.axes]
    assert all(left.x1 < right.x0 for left, right in itertools.pairwise(boxes))
    assert figure.axes[0].get_xlabel() == "environment.\nwind.speed_mps"


def test_a_thousand_runs_are_drawn_as_dots_and_a_few_as_outlines() -> None:
    """A browser takes seconds for the outlines of ten thousand marks."""
    sizes = {}
    for count in (20, 1000):
        values = np.random.default_rng(1).random(count)
        points = RunPoints(dict.fromkeys("abc", values), dict.fromkeys("xyz", values[::-1]), values < 0.7)
        figure = scatter(points)
        assert figure is not None
        content = svg(figure)
        sizes[count] = len(content)
        assert (b"<image" in content) is (count == 1000)
        again = scatter(points)
        assert again is not None
        assert svg(again) == content
    assert sizes[1000] < 600_000


@pytest.fixture
def failed(tmp_path: Path) -> tuple[Any, Path]:
    """A campaign of which two runs failed; the folder of one was kept, beside that of a run that broke off."""
    tree = {"circle": {"center_m": [3000.0, 3100.0], "radius_m": 300.0}}
    scenario = world(tree, mission={"time_limit_s": 20.0})
    fly_to_folder(scenario, tmp_path / "runs" / "3", recording=False, make=kinematic_loop)
    (tmp_path / "runs" / "4").mkdir()
    worst = [
        SimpleNamespace(run=run, outcome=outcome, folder=folder)
        for run, outcome, folder in (
            (3, "timeout", "runs/3"),
            (4, "error", "runs/4"),
            (5, "collision", ""),
            (6, "reached", "runs/3"),
        )
    ]
    return SimpleNamespace(worst=worst), tmp_path


@pytest.mark.flights
def test_where_runs_failed_is_drawn_as_far_as_they_were_kept(failed: tuple[Any, Path]) -> None:
    (one,) = failures(*failed)
    assert (one.run, one.outcome, len(one.scene.obstacles)) == (3, "timeout", 1)
    np.testing.assert_allclose(one.track_m[0], (300.0, 300.0), atol=0.01)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = where_failed([one])
        svg(figure)
        many = where_failed([replace(one, run=number) for number in range(5)])
        svg(many)
    named = where_failed([replace(one, run=99_990 + k, outcome="planner_failed") for k in range(3)])
    svg(named)
    titles = [axes.title.get_window_extent() for axes in named.axes]
    assert all(left.x1 < right.x0 for left, right in itertools.pairwise(titles))
    assert titles[-1].x1 < named.bbox.x1
    (axes,) = figure.axes
    assert axes.get_title() == "run 3: timeout"
    end: Any = axes.lines[-1]
    assert end.get_marker() == "X"
    np.testing.assert_allclose(end.get_xydata()[0], one.track_m[-1] / 1e3)
    assert [axes.get_visible() for axes in many.axes] == [True] * 5 + [False]


def test_no_more_than_some_failures_are_drawn(failed: tuple[Any, Path]) -> None:
    summary, folder = failed
    assert len(failures(SimpleNamespace(worst=summary.worst[:1] * 12), folder)) == MOST_FAILURES  # type: ignore[arg-type]
