"""The style of all figures, and how they become files.

Drawn without a screen. The same values give the same files: SVG carries no date and its ids no chance.
"""

from __future__ import annotations

import io
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.transforms import Transform, offset_copy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours of the planners in order. Any colour vision tells them apart (Okabe and Ito, 2008)."""

DASHES: tuple[Any, ...] = ("-", (0, (6, 1.5)), (0, (3, 1)), (0, (6, 1, 1, 1)), (0, (1, 1)))
"""Line styles of the planners in order: they differ in print too."""

STYLE: dict[Any, Any] = {  # matplotlib's settings of all figures
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "legend.fontsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "font.family": "DejaVu Sans",
    "axes.linewidth": 0.7,
    "lines.solid_capstyle": "round",
    "text.parse_math": False,
    "svg.hashsalt": "wayproof",
    "svg.fonttype": "path",
    "path.simplify": True,
}
BEHIND_TEXT: dict[str, Any] = {"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1.0}
"""Box behind text that lies on a map."""

WIDTH_IN = 4.8
"""Width of all figures, so narrow that the letters stay legible on a phone and in a column of a paper."""
TITLE_LETTERS = 50  # a line of a title has at most so many, and fits


def colour(index: int) -> str:
    """Returns the colour of a planner by its number."""
    return COLOURS[index % len(COLOURS)]


def beside(axes: Axes, right_pt: float, up_pt: float) -> Transform:
    """Returns shares of the axes moved by points: directions among such places are true on a map of any shape."""
    return offset_copy(axes.transAxes, axes.get_figure(root=True), right_pt, up_pt, units="points")


def svg(figure: Figure) -> bytes:
    """Returns a figure as SVG; dots drawn as pictures have 150 an inch."""
    return _save(figure, "svg", dpi=150, metadata={"Date": None, "Creator": None})


def png(figure: Figure) -> bytes:
    """Returns a figure as PNG, 200 dots an inch."""
    return _save(figure, "png", dpi=200, metadata={"Software": None})


def _save(figure: Figure, kind: str, **options: Any) -> bytes:
    file = io.BytesIO()
    for axes in figure.axes:
        axes.title.set_text(textwrap.fill(axes.get_title(), TITLE_LETTERS))
    with mpl.rc_context(STYLE), warnings.catch_warnings():
        # A letter that the font lacks is drawn as a box.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        # A map of fixed shape gives room back only once it has been laid out; what has been keeps its places, as
        # does a narrow map that gives back too much.
        warnings.filterwarnings("ignore", message="constrained_layout not applied")
        if (engine := figure.get_layout_engine()) is not None:
            for _ in range(2):
                engine.execute(figure)
            figure.set_layout_engine("none")
        figure.savefig(file, format=kind, **options)
    return file.getvalue()


@contextmanager
def styled(height_in: float) -> Iterator[Figure]:
    """A figure in our style, as wide as all of them."""
    with mpl.rc_context(STYLE):
        yield Figure(figsize=(WIDTH_IN, height_in), layout="compressed")
