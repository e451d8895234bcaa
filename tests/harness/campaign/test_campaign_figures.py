"""Figures of a campaign with long names and many of them: what is drawn keeps its room."""

from __future__ import annotations

import warnings

import pytest

from harness.campaign.figures import LABEL_LETTERS, lengths, success
from harness.campaign.groups import Axis
from harness.campaign.summary import CURVE_POINTS, Cell, Table
from harness.report.figure_style import svg

CELL = Cell(runs=3, reached=2, success=0.67, success_low=0.2, success_high=0.9)


def names(count: int, letters: int) -> tuple[str, ...]:
    return tuple(f"{number:x<{letters - 2}}{number:02d}" for number in range(count))


def table(rows: tuple[str, ...], columns: tuple[str, ...]) -> Table:
    return Table(Axis("digest", rows), Axis("planner", columns), ((CELL,) * len(columns),) * len(rows))


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
