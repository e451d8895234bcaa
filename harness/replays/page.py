"""The page of a replay: both tracks, and what differs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from harness.replays.replay_figure import replay_figure
from harness.report.page import Picture, rendered

if TYPE_CHECKING:
    from harness.replays.replay import Replay

FIGURES = {
    "outside_p95_m": "outside the corners, p95, m",
    "outside_max_mean_m": "mean of the largest of each lap, m",
    "lap_mean_s": "time of a lap, s",
    "bank_p95_deg": "bank, p95, deg",
    "roll_rate_p95_degps": "roll rate, p95, deg/s",
    "height_error_p95_m": "height error, p95, m",
    "airspeed_mean_mps": "airspeed, mean, m/s",
    "airspeed_p95_mps": "airspeed, p95, m/s",
}
"""Figures of `flown` and `simulated` in `replay.json`, with what people call them."""


def rows_of(told: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Name, flown, simulated and difference of each figure."""
    rows = []
    for name, label in FIGURES.items():
        flown, simulated = told["flown"].get(name), told["simulated"].get(name)
        if flown is None or simulated is None:
            continue
        share = f"{100 * (simulated / flown - 1):+.1f} %" if flown else "-"
        rows.append((label, f"{flown:.2f}", f"{simulated:.2f}", share))
    return rows


def replay_html(found: Replay) -> str:
    """The text of the page."""
    from harness.report.figure_style import svg

    told = found.told
    between = told["distance_between_m"]
    caption = (
        f"The settled laps {', '.join(map(str, told['settled_laps']))}: flown and simulated, "
        f"{between['p50']:.1f} m apart in the median, {between['p95']:.1f} m at 95 %."
    )
    return rendered(
        "replay.html",
        told=told,
        rows=rows_of(told),
        picture=Picture(svg(replay_figure(found)), "Flown and simulated track from above", caption),
    )
