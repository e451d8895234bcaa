"""The figure of a replay: both tracks from above, with the corners of the mission."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from harness.report.figure_style import COLOURS, WIDTH_IN, beside, styled

if TYPE_CHECKING:
    from harness.replays.measures import Replay


def replay_figure(found: Replay) -> Figure:
    """Draws a replay."""
    with styled(WIDTH_IN) as figure:
        axes = figure.subplots()
        corners = np.vstack((found.corners_m, found.corners_m[:1]))
        axes.plot(*corners.T, color="0.7", lw=1.0, marker="s", ms=4, label="corners of the mission")
        axes.plot(found.flown["east_m"], found.flown["north_m"], color="0.2", lw=1.4, label="flown")
        east, north = found.simulated["east_m"], found.simulated["north_m"]
        axes.plot(east, north, color=COLOURS[1], lw=1.2, ls=(0, (6, 1.5)), label="simulated")
        wind = found.results["wind"]
        towards = math.radians(wind["from_deg"]) + math.pi
        half = 24.0 * np.array((math.sin(towards), math.cos(towards)))
        tip, tail, text = beside(axes, *half), beside(axes, *-half), f"wind {wind['speed_mps']:.1f} m/s"
        arrow, style = {"arrowstyle": "->", "color": "0.4"}, {"color": "0.4", "ha": "center", "va": "center"}
        axes.annotate(text, (0.5, 0.5), (0.5, 0.5), tip, tail, arrowprops=arrow).set(**style)
        axes.set(aspect="equal", xlabel="east, m", ylabel="north, m")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, frameon=False)
    return figure
