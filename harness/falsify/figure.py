"""The conditions tried of two keys, on a plane. Drawn without a screen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from harness.falsify.keys import Vary, number_text
from harness.files.whole_file import replace_bytes
from harness.report.figure_style import colour, png, styled, svg

if TYPE_CHECKING:
    from harness.falsify.breaking_point import Breaking

HEIGHT_IN = 3.6


def write_figure(breaking: Breaking, paths: Sequence[Path]) -> None:
    """Writes the figure of a search over two keys, as SVG or PNG by the name of each file."""
    figure = drawn(breaking)
    for path in paths:
        replace_bytes(path, png(figure) if path.suffix == ".png" else svg(figure))


def drawn(breaking: Breaking) -> Figure:
    """What passed, what failed, and the mildest condition that did."""
    first, second = breaking.vary
    with styled(HEIGHT_IN) as figure:
        axes = figure.add_subplot()
        failing = {each.condition for each in breaking.trials if each.failed}
        passed = [each.values for each in breaking.trials if each.condition not in failing]
        failed = [each.values for each in breaking.trials if each.failed]
        axes.plot(
            *np.array(passed).reshape(-1, 2).T, "o", mfc="none", mec=colour(0), ms=4.5, ls="", label="passed"
        )
        axes.plot(
            *np.array(failed).reshape(-1, 2).T, "x", color=colour(1), ms=5, mew=1.4, ls="", label="failed"
        )
        if breaking.found is not None:
            values = breaking.found.values
            axes.plot(*values, "*", color="black", ms=10, ls="", label="mildest that failed")
            corner = first.mild, second.mild
            width, height = values[0] - corner[0], values[1] - corner[1]
            axes.add_patch(
                Rectangle(
                    corner, width, height, fill=False, ec="0.4", lw=0.8, ls="--", label="milder in both"
                )
            )
        axes.set(xlabel=_with_ends(first), ylabel=_with_ends(second))
        axes.margins(0.05)
        axes.set_title(f"{breaking.scenario}: {breaking.planner}, {breaking.aircraft}")
        figure.legend(
            loc="outside lower center", ncols=4, frameon=False, columnspacing=1.2, handletextpad=0.4
        )
    return figure


def _with_ends(vary: Vary) -> str:
    """A key, and which of its ends is which: harder need not be more."""
    return f"{vary.key}\nmild {number_text(vary.mild)}, hard {number_text(vary.hard)}"
