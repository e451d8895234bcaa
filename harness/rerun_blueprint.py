"""How recordings look: entities, colours, views and panels. Nothing here depends on a flight."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import rerun as rr
import rerun.blueprint as rrb

if TYPE_CHECKING:
    from harness.obstacle import Obstacle
    from planner.interface import Mission

TIMELINE = "sim_time"

WORLD = "world"
PLAN = "plan"
SERIES = "series"
EVENTS = "events"
SUMMARY = "summary"
FRAME = "frame"
"""Property of the recording that holds the `Frame`."""
WHOLE = "whole_track"
FLOWN = "flown"
"""Below WORLD and PLAN: the trail, one piece a time stamp; the views show all pieces up to the cursor."""

Colour = tuple[int, int, int]

BACKGROUND: Colour = (17, 19, 24)
BOUNDS: Colour = (128, 134, 146)
OBSTACLE: Colour = (108, 116, 132)
MOVING: Colour = (176, 116, 92)
START: Colour = (225, 228, 235)
GOAL: Colour = (96, 211, 130)
AIRCRAFT: Colour = (255, 255, 255)
TRACK: Colour = (255, 179, 64)
WHOLE_TRACK: Colour = (128, 94, 44)
CHOSEN: Colour = (64, 196, 255)
CANDIDATE: Colour = (48, 98, 128)
GUIDE: Colour = (236, 112, 214)
SECTOR: Colour = (74, 148, 98)
WINDOW: Colour = (146, 130, 236)
SENSING: Colour = (92, 98, 110)
HIT: Colour = (255, 92, 92)
WANTED: Colour = (255, 92, 92)

SERIES_STYLE: dict[str, tuple[str, Colour, float]] = {
    "cross_track/flown": ("cross-track error", TRACK, 1.5),
    "clearance/flown": ("clearance", TRACK, 1.5),
    "clearance/wanted": ("wanted", WANTED, 1.0),
    "bank/commanded": ("commanded", CHOSEN, 1.0),
    "bank/flown": ("flown", TRACK, 1.5),
    "speed/ground": ("over the ground", CHOSEN, 1.0),
    "speed/flown": ("true airspeed", TRACK, 1.5),
    "altitude_error/flown": ("altitude error", TRACK, 1.5),
}
"""Name, colour and width of every line of the time series, by its entity below SERIES; of overlaid runs, only
those called `flown` are drawn."""

OVERLAY: tuple[Colour, ...] = (
    TRACK,
    CHOSEN,
    GUIDE,
    GOAL,
    WINDOW,
    HIT,
    (240, 228, 66),
    (200, 200, 210),
)
"""Colours of overlaid runs, in order."""

LEGEND = (
    "Orange: flown track, dimmed where still ahead. Blue: plan in effect with its waypoints, dark the "
    "candidates it was compared with. Pink: guide vector. Green: free sectors. Violet: planning window. "
    "Grey circle: sensing range. Red: scan returns. Grey: true obstacles, brown if they move or come and go."
)
"""What the colours mean, for the summary."""


@dataclass(frozen=True)
class Frame:
    """What the views are framed on; kept in every recording, so that several can be shown in one.

    Attributes:
        bounds_m: xmin, ymin, xmax, ymax of the area.
        altitude_m: altitude to be held, above mean sea level.
        clearance_m: wanted distance from every obstacle edge.
    """

    bounds_m: tuple[float, float, float, float]
    altitude_m: float
    clearance_m: float

    @property
    def span_m(self) -> float:
        """The longer side of the area."""
        xmin, ymin, xmax, ymax = self.bounds_m
        return max(xmax - xmin, ymax - ymin)


@dataclass(frozen=True, eq=False)
class Scene:
    """What is known before the flight, true world included.

    Attributes:
        name: of the recording, for example "paper_circles, rolling_window, aerosonde, seed 1".
        mission: goal, bounds, clearance and sensing range.
        start_m: (east, north) of the start.
        altitude_m: altitude to be held, above mean sea level.
        obstacles: the true obstacles.
    """

    name: str
    mission: Mission
    start_m: tuple[float, float]
    altitude_m: float
    obstacles: tuple[Obstacle, ...]

    @property
    def frame(self) -> Frame:
        """What the views are framed on."""
        return Frame(self.mission.bounds_m, self.altitude_m, self.mission.clearance_m)

    @property
    def obstacle_top_m(self) -> float:
        """How high obstacles are drawn: above the flight altitude, and high enough to be seen from afar."""
        return max(1.3 * self.altitude_m, self.altitude_m + 0.012 * self.frame.span_m)


def blueprint(frame: Frame, runs: Sequence[str] = ("",)) -> rrb.Blueprint:
    """The layout: plan view and 3-D flight, events and summary, time series.

    Args:
        frame: what to frame the views on.
        runs: entity of each run below PLAN and WORLD, ending in a slash; of a single recording the empty
            string.
    """
    events = rrb.TextLogView(
        origin=EVENTS,
        name="Events",
        columns=rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["Body"]),
    )
    about = rrb.TextDocumentView(origin=SUMMARY, name="Summary")
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Horizontal(plan_view(frame, runs), flight_view(frame, runs), column_shares=[1, 1]),
                rrb.Horizontal(events, about, column_shares=[4, 3]) if len(runs) == 1 else about,
                row_shares=[7, 3],
            ),
            rrb.Vertical(*series_views(frame, runs)),
            column_shares=[13, 6],
        ),
        rrb.TimePanel(timeline=TIMELINE, play_state="paused", state="collapsed", playback_speed=60.0),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def plan_view(frame: Frame, runs: Sequence[str]) -> rrb.Spatial2DView:
    """The plan view, north up, framed on the area.

    A 2-D view counts its second axis downwards; the transform at PLAN turns it round.
    """
    xmin, ymin, xmax, ymax = frame.bounds_m
    margin = 0.03 * frame.span_m
    return rrb.Spatial2DView(
        origin="/",
        contents=[f"/{PLAN}/**"],
        name="Plan view (north up)",
        background=list(BACKGROUND),
        visual_bounds=rrb.VisualBounds2D(
            x_range=[xmin - margin, xmax + margin], y_range=[-ymax - margin, -ymin + margin]
        ),
        overrides={f"{PLAN}/{run}{FLOWN}": _up_to_cursor() for run in runs},
    )


def flight_view(frame: Frame, runs: Sequence[str]) -> rrb.Spatial3DView:
    """The 3-D view: the whole area, seen from the south-west and above."""
    xmin, ymin, xmax, ymax = frame.bounds_m
    middle = (0.5 * (xmin + xmax), 0.5 * (ymin + ymax), frame.altitude_m)
    away = 1.45 * frame.span_m
    azimuth, elevation = math.radians(-97.0), math.radians(45.0)
    eye = (
        middle[0] + away * math.cos(elevation) * math.cos(azimuth),
        middle[1] + away * math.cos(elevation) * math.sin(azimuth),
        middle[2] + away * math.sin(elevation),
    )
    return rrb.Spatial3DView(
        origin=WORLD,
        name="3-D flight",
        background=list(BACKGROUND),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=eye, look_target=middle, eye_up=(0.0, 0.0, 1.0)
        ),
        overrides={f"{WORLD}/{run}{FLOWN}": _up_to_cursor() for run in runs},
    )


def series_views(frame: Frame, runs: Sequence[str]) -> list[rrb.TimeSeriesView]:
    """The time series, each over the whole flight."""
    wanted = max(frame.clearance_m, 1.0)
    lines = Counter(line.split("/")[0] for line in SERIES_STYLE)
    rows: list[tuple[str, str, tuple[float, float] | None]] = [
        ("cross_track", "Cross-track error, m (right +)", None),
        ("clearance", "Clearance, m (to the nearest obstacle edge)", (-0.5 * wanted, 6.0 * wanted)),
        ("bank", "Bank, deg (right +)", None),
        ("speed", "Speed, m/s", None),
        ("altitude_error", "Altitude error, m (high +)", None),
    ]
    return [
        rrb.TimeSeriesView(
            origin=f"{SERIES}/{entity}",
            name=title,
            background=rrb.archetypes.PlotBackground(color=list(BACKGROUND), show_grid=True),
            axis_x=rrb.TimeAxis(
                view_range=rr.TimeRange(
                    start=rr.TimeRangeBoundary.absolute(seconds=0.0), end=rr.TimeRangeBoundary.infinite()
                )
            ),
            axis_y=rrb.ScalarAxis(range=limits) if limits else None,
            plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=lines[entity] * len(runs) > 1),
        )
        for entity, title, limits in rows
    ]


def _up_to_cursor() -> rrb.VisibleTimeRanges:
    """Shows all there was of an entity up to the time cursor, not only the latest."""
    return rrb.VisibleTimeRanges(
        timeline=TIMELINE, start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.cursor_relative()
    )
