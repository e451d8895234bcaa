"""The layouts of recordings: views and panels, whole, thin and overlaid. Nothing here depends on a flight."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from typing import Any, Final, Literal

import rerun as rr
import rerun.blueprint as rrb

from harness.recording import blueprint as look
from harness.recording.blueprint import NAVIGATION, PLAN, SERIES, STATES, WORLD, Frame

PLOTS: Final = (
    (4, ("cross_track", "altitude_error", NAVIGATION, "speed", look.THROTTLE)),
    (4, ("clearance", "search", look.PLAN_DELAY)),
    (5, ("bank",)),
)
"""Rows of the time series: share of the height, and names of the series."""
THIN_SERIES: Final = ("cross_track", "clearance", "bank")  # time series of a thin recording
WHOLE_ONLY_SERIES: Final = tuple(name for _, names in PLOTS for name in names if name not in THIN_SERIES)


class Layout(rrb.Blueprint):
    """A blueprint whose stream can be closed.

    rerun 0.41 keeps what it writes one to for as long as the process lives: two threads and 3 MB each
    (rerun-io/rerun#2116).
    """

    _stream: rr.RecordingStream | None = None

    def _log_to_stream(self, stream: rr.RecordingStream) -> None:
        self._stream = stream
        # Wall clock and count beside the time line of layouts would take 12 kB of the file.
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        super()._log_to_stream(stream)

    def close(self) -> None:
        """Closes the stream, once the blueprint has been sent."""
        if self._stream is not None:
            self._stream.disconnect()
            self._stream = None


def blueprint(
    frame: Frame,
    runs: Sequence[str] = ("",),
    without: Sequence[str] = (NAVIGATION,),
    plays: Literal["paused", "following"] = "paused",
    lanes: int | None = None,
) -> Layout:
    """The layout: plan view and 3-D flight, states, events and summary, time series.

    `runs` are entities of runs below PLAN and WORLD, ending in a slash: of a single recording "", of a thin one none.
    `without` names time series that have nothing to show. `plays`: whether the cursor follows a flight that goes on.
    `lanes`: how many lanes of states there are; default: those of `runs`.
    """
    plan = plan_view(frame, runs)
    states = rrb.StateTimelineView(origin=STATES, name="States", time_view=whole_flight())
    # Events in one column, without the time: the text of each says it.
    time = rrb.encodings.TimelineColumn(look.TIMELINE, visible=False)
    columns = rrb.TextLogColumns(timeline_columns=[time], text_log_columns=["Body"])
    below: list[rrb.Container | rrb.View] = [
        rrb.TextLogView(origin=look.EVENTS, name="Events", columns=columns),
        rrb.TextDocumentView(origin=look.SUMMARY, name="Summary"),
        *([rrb.TextDocumentView(origin=look.COLOURS, name="Colours")] if len(runs) == 1 else []),
    ]
    if lanes is None:
        lanes = 3 if len(runs) == 1 else 2 * len(runs)
    # Shares of a window 768 pixels high: 700 of them are for rows, a lane takes 40 and the rest of the states 52.
    states_share = min((52 + 40 * lanes) / 700, 0.45) if lanes else 0.0
    return Layout(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Horizontal(plan, flight_view(frame, runs), column_shares=[1, 1]),
                *([states] if lanes else []),
                rrb.Horizontal(*below, column_shares=[5, 4, 4][: len(below)]),
                row_shares=[0.77 - states_share, *([states_share] if lanes else []), 0.23],
            ),
            _plots(frame, runs, without),
            column_shares=[13, 6],
        ),
        rrb.TimePanel(timeline=look.TIMELINE, play_state=plays, state="collapsed", playback_speed=60.0),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def layout_of(frame: Frame, entities: Collection[str], runs: Sequence[str] = ("",)) -> Layout:
    """Returns the layout of a recording, or of an overlay, by the entities in it."""
    lanes = sum(each.startswith(f"/{STATES}/") for each in entities)
    runs = runs if lanes or len(runs) > 1 else ()
    drawn = {each.split("/")[2] for each in entities if each.startswith(f"/{SERIES}/")}
    without = [name for _, names in PLOTS for name in names if name not in drawn]
    return blueprint(frame, runs, without, lanes=lanes)


def plan_view(frame: Frame, trails: Sequence[str]) -> rrb.Spatial2DView:
    """Returns the plan view, north up, framed on the area.

    A 2-D view counts its second axis downwards; the transform at PLAN turns it round.
    """
    xmin, ymin, xmax, ymax = frame.bounds_m
    margin = 0.03 * frame.span_m
    return rrb.Spatial2DView(
        origin="/",
        contents=[f"/{PLAN}/**"],
        name="Plan view (north up)",
        background=list(look.BACKGROUND),
        visual_bounds=rrb.VisualBounds2D(
            x_range=[xmin - margin, xmax + margin], y_range=[-ymax - margin, -ymin + margin]
        ),
        overrides=_up_to_cursor(PLAN, trails),
    )


def flight_view(frame: Frame, trails: Sequence[str]) -> rrb.Spatial3DView:
    """Returns the 3-D view of the whole area, seen from the south-west and above."""
    xmin, ymin, xmax, ymax = frame.bounds_m
    middle = (0.5 * (xmin + xmax), 0.5 * (ymin + ymax), frame.altitude_m)
    away = 1.25 * frame.span_m
    azimuth, elevation = math.radians(-97.0), math.radians(45.0)
    eye = (
        middle[0] + away * math.cos(elevation) * math.cos(azimuth),
        middle[1] + away * math.cos(elevation) * math.sin(azimuth),
        middle[2] + away * math.sin(elevation),
    )
    return rrb.Spatial3DView(
        origin=WORLD,
        contents=[f"/{WORLD}/**"],
        name="3-D flight",
        background=list(look.BACKGROUND),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=eye, look_target=middle, eye_up=(0.0, 0.0, 1.0)
        ),
        overrides=_up_to_cursor(WORLD, trails),
    )


def _plots(frame: Frame, runs: Sequence[str], without: Sequence[str]) -> rrb.Vertical:
    """Returns three plots, the others in tabs behind them, so that each is high enough for numbers on its axis.

    rerun numbers an axis at powers of ten that are 20 pixels apart; a bank of 45 degrees to both sides needs 210.
    """
    titles = _titles(frame, runs, NAVIGATION not in without)
    wanted = frame.clearance_m
    most_deg = 1.1 * (frame.bank_limit_deg or 50.0)  # the nearer to the limit, the more room for numbers
    ranges = {"clearance": (-0.25 * wanted, 6.0 * wanted)} if wanted else {}
    ranges |= {look.THROTTLE: (-5.0, 105.0), "bank": (-most_deg, most_deg)}
    rows: list[rrb.Container | rrb.View] = []
    shares: list[int] = []
    for share, names in PLOTS:
        views = [
            rrb.TimeSeriesView(
                origin=f"{SERIES}/{name}",
                name=titles[name],
                background=rrb.archetypes.PlotBackground(color=list(look.BACKGROUND), show_grid=True),
                axis_x=whole_flight(),
                axis_y=rrb.ScalarAxis(range=ranges[name]) if name in ranges else None,
                plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=len(runs) > 1 and name == "cross_track"),
            )
            for name in names
            if name not in without
        ]
        if views:
            rows.append(views[0] if len(views) == 1 else rrb.Tabs(*views, active_tab=0))
            shares.append(share)
    return rrb.Vertical(*rows, row_shares=shares)


def _titles(frame: Frame, runs: Sequence[str], believes: bool) -> dict[str, str]:
    """Returns the titles of the time series.

    What the colours of a single flight's lines are stands in the title: a legend would cover the end of the curves. So
    does the limit of the bank: the axis of a low plot, as an overlay of many may have, has no number but 0.
    """
    same = {
        "altitude_error": "Altitude error, m",
        NAVIGATION: "Navigation error, m",
        look.THROTTLE: "Throttle, %",
        "search": "Search, ms",
        look.PLAN_DELAY: "Plan delay, s",
    }
    if len(runs) > 1:
        several = {"clearance": "Clearance, m", "speed": "Airspeed, m/s", "bank": "Bank, deg (right +)"}
        return same | several | {"cross_track": "Cross-track error, m"}
    limit = "" if frame.bank_limit_deg is None else f" {frame.bank_limit_deg:g}"
    wanted = f" {frame.clearance_m:g}" if frame.clearances_alike else ""
    return same | {
        "cross_track": "Cross-track, m; blue: believed" if runs and believes else "Cross-track error, m",
        "clearance": "Clearance, m" + (f"; red: wanted{wanted}" if frame.clearance_m else ""),
        "speed": "Speed, m/s; blue: over ground",
        "bank": f"Bank, deg; blue: command, red: limit{limit}{', violet: pitch' if runs else ''}",
    }


def whole_flight() -> rrb.TimeAxis:
    """Returns the time axis from 0 to the end of what is shown; by default rerun shows a minute about the cursor."""
    begin, end = rr.TimeRangeBoundary.absolute(seconds=0.0), rr.TimeRangeBoundary.infinite()
    return rrb.TimeAxis(view_range=rr.TimeRange(start=begin, end=end))


def _up_to_cursor(top: str, trails: Sequence[str]) -> dict[Any, Any]:
    """Shows of trails and what was sensed all there was up to the time cursor, not only the latest."""
    start, end = rr.TimeRangeBoundary.infinite(), rr.TimeRangeBoundary.cursor_relative()
    shown = rrb.VisibleTimeRanges(timeline=look.TIMELINE, start=start, end=end)
    entities = itertools.product(trails, (look.FLOWN, look.BELIEVED, look.SENSED))
    return {f"{top}/{run}{each}": shown for run, each in entities}
