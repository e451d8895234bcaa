"""How recordings look: entities, colours, views and panels. Nothing here depends on a flight."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

if TYPE_CHECKING:
    from harness.analysis.trackability import FlightLimits
    from harness.flight.record import FloatArray
    from harness.world.obstacle import Obstacle
    from planner.interface import Mission

TIMELINE = "sim_time"

WORLD = "world"
PLAN = "plan"
SERIES = "series"
STATES = "states"
ATTITUDE = "attitude"
EVENTS = "events"
SUMMARY = "summary"
FRAME = "frame"
"""Property of the recording that holds the `Frame`."""
WHOLE = "whole_track"
FLOWN = "flown"
"""Below WORLD and PLAN: the trail, one piece a time stamp; the views show all pieces up to the cursor."""
SENSED = "sensed"
"""Below WORLD and PLAN: places on edges, each when it was sensed first; shown up to the cursor as well."""
TRUE = "true_obstacles"
"""Below WORLD: the standing obstacles as solids from the start on; hidden but in overlays."""

PLANNER_LANE, BANK_LANE, TRACKING_LANE = "planner", "saturation", "tracking"
"""Lanes of the state timeline, below STATES; shown in the order of their names."""

Colour = tuple[int, int, int]

BACKGROUND: Colour = (17, 19, 24)
BOUNDS: Colour = (128, 134, 146)
OUTLINE: Colour = (62, 67, 78)
OBSTACLE: Colour = (84, 91, 106)
EDGE: Colour = (214, 218, 226)
MOVING: Colour = (176, 116, 92)
MOVES: Colour = (255, 150, 96)
"""Of what the map takes to move."""
MET: Colour = (196, 124, 232)
MOVING_DIM: Colour = (96, 68, 56)
START: Colour = (225, 228, 235)
GOAL: Colour = (96, 211, 130)
GOAL_DIM: Colour = (48, 112, 72)
AIRCRAFT: Colour = (255, 255, 255)
TRACK: Colour = (255, 179, 64)
WHOLE_TRACK: Colour = (92, 72, 40)
CHOSEN: Colour = (64, 196, 255)
CANDIDATE: Colour = (54, 112, 148)
GUIDE: Colour = (236, 112, 214)
SECTOR: Colour = (74, 148, 98)
WINDOW: Colour = (146, 130, 236)
SENSING: Colour = (92, 98, 110)
HIT: Colour = (255, 92, 92)
WANTED: Colour = (255, 92, 92)
CALM: Colour = (58, 64, 74)
HOLD: Colour = (156, 84, 60)
MODES: tuple[Colour, ...] = ((36, 98, 130), (88, 76, 148), (34, 112, 104), (122, 66, 116), (96, 104, 52))
"""Of the planner's states, in the order in which they come up; dark, for white letters."""
AXES: tuple[Colour, ...] = ((255, 84, 84), (96, 211, 130), (92, 148, 255))
"""Of the body axes: ahead, to the left, up."""

ERROR_COLOURS: tuple[Colour, ...] = ((255, 214, 92), (255, 138, 48), (255, 44, 84))
"""Of the flown track: on the plan, half the way, and at or beyond the error from which on it is not tracked."""

TOLD_PLAN: Colour = (58, 150, 214)
TOLD: Colour = (134, 142, 156)
"""Of the lines of the event log: legible on black and on white."""

SERIES_STYLE: dict[str, tuple[str, Colour, float]] = {
    "cross_track/flown": ("cross-track error", TRACK, 1.5),
    "clearance/flown": ("clearance", TRACK, 1.5),
    "clearance/wanted": ("wanted", WANTED, 1.0),
    "bank/commanded": ("commanded", CHOSEN, 1.0),
    "bank/flown": ("flown", TRACK, 1.5),
    "bank/limit_right": ("limit", WANTED, 1.0),
    "bank/limit_left": ("limit", WANTED, 1.0),
    "bank/pitch": ("pitch", WINDOW, 1.0),
    "speed/ground": ("over the ground", CHOSEN, 1.0),
    "speed/flown": ("true airspeed", TRACK, 1.5),
    "altitude_error/flown": ("altitude error", TRACK, 1.5),
}
"""Name, colour and width of every line of the time series, by its entity below SERIES; of overlaid runs, only
those called `flown` are drawn."""
SEARCH = "search/flown"
"""Below SERIES: time of the search of each plan, drawn as points."""

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


def error_colours(share: FloatArray) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """(n, 3) colours of the track for errors, as shares of the one from which on it is not tracked."""
    scale = np.array(ERROR_COLOURS, dtype=np.float64).T
    place = 0.5 * np.arange(len(ERROR_COLOURS))
    return np.column_stack([np.interp(share, place, part) for part in scale]).astype(np.uint8)


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
        limits: altitude to be held, bank limit, and the error from which on a plan is not tracked.
        obstacles: the true obstacles.
        scenario_yaml: the scenario as flown, for the summary.
    """

    name: str
    mission: Mission
    start_m: tuple[float, float]
    limits: FlightLimits
    obstacles: tuple[Obstacle, ...]
    scenario_yaml: str = ""

    @property
    def altitude_m(self) -> float:
        """Altitude to be held, above mean sea level."""
        return self.limits.altitude_m

    @property
    def frame(self) -> Frame:
        """What the views are framed on."""
        return Frame(self.mission.bounds_m, self.altitude_m, self.mission.clearance_m)

    @property
    def obstacle_top_m(self) -> float:
        """How high obstacles are drawn: above the flight altitude, and high enough to be seen from afar."""
        return max(1.3 * self.altitude_m, self.altitude_m + 0.012 * self.frame.span_m)


def time_column(time_s: FloatArray) -> rr.TimeColumn:
    """Simulated time, rounded to nanoseconds (rerun truncates floats)."""
    return rr.TimeColumn(TIMELINE, duration=np.round(time_s * 1e9).astype("timedelta64[ns]"))


class Layout(rrb.Blueprint):
    """A blueprint that can be let go of.

    rerun 0.41 keeps what it writes one to for as long as the process lives: two threads and 3 MB each
    (rerun-io/rerun#2116).
    """

    _stream: rr.RecordingStream | None = None

    def _log_to_stream(self, stream: rr.RecordingStream) -> None:
        self._stream = stream
        super()._log_to_stream(stream)

    def let_go(self) -> None:
        """Once it has been sent."""
        if self._stream is not None:
            self._stream.disconnect()
            self._stream = None


def blueprint(frame: Frame, runs: Sequence[str] = ("",)) -> Layout:
    """The layout: plan view and 3-D flight, states, events and summary, time series.

    Args:
        frame: what to frame the views on.
        runs: entity of each run below PLAN and WORLD, ending in a slash; of a single recording the empty
            string.
    """
    events = rrb.TextLogView(
        origin=EVENTS,
        name="Events",
        columns=rrb.TextLogColumns(
            timeline_columns=[rrb.encodings.TimelineColumn(TIMELINE, visible=False)],
            text_log_columns=["Body"],
        ),
    )
    about = rrb.TextDocumentView(origin=SUMMARY, name="Summary")
    states = rrb.StateTimelineView(origin=STATES, name="States", time_view=_whole_flight())
    below = [events, about, *([attitude_view()] if len(runs) == 1 else [])]
    return Layout(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Horizontal(plan_view(frame, runs), flight_view(frame, runs), column_shares=[1, 1]),
                states,
                rrb.Horizontal(*below, column_shares=[5, 4, 3][: len(below)]),
                row_shares=[12, 1.5 + 0.85 * (3 if len(runs) == 1 else 2 * len(runs)), 5],
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


THIN_SERIES: Final = ("cross_track", "clearance", "bank")
"""Time series of a thin recording."""


def thin_blueprint(frame: Frame) -> Layout:
    """The layout of a thin recording: plan view and 3-D flight, events and summary, three time series."""
    events = rrb.TextLogView(origin=EVENTS, name="Events")
    about = rrb.TextDocumentView(origin=SUMMARY, name="Summary")
    return Layout(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Horizontal(plan_view(frame, ("",)), flight_view(frame, ("",))),
                rrb.Horizontal(events, about),
                row_shares=[12, 5],
            ),
            rrb.Vertical(*series_views(frame, ("",), THIN_SERIES)),
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
        overrides={f"{PLAN}/{run}{each}": _up_to_cursor() for run in runs for each in (FLOWN, SENSED)},
    )


def flight_view(frame: Frame, runs: Sequence[str]) -> rrb.Spatial3DView:
    """The 3-D view: the whole area, seen from the south-west and above."""
    xmin, ymin, xmax, ymax = frame.bounds_m
    middle = (0.5 * (xmin + xmax), 0.5 * (ymin + ymax), frame.altitude_m)
    away = 1.25 * frame.span_m
    azimuth, elevation = math.radians(-97.0), math.radians(45.0)
    eye = (
        middle[0] + away * math.cos(elevation) * math.cos(azimuth),
        middle[1] + away * math.cos(elevation) * math.sin(azimuth),
        middle[2] + away * math.sin(elevation),
    )
    contents = [f"/{WORLD}/**"]
    if len(runs) == 1:
        contents.append(f"- /{WORLD}/{TRUE}/**")
    return rrb.Spatial3DView(
        origin=WORLD,
        contents=contents,
        name="3-D flight",
        background=list(BACKGROUND),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=eye, look_target=middle, eye_up=(0.0, 0.0, 1.0)
        ),
        overrides={f"{WORLD}/{run}{each}": _up_to_cursor() for run in runs for each in (FLOWN, SENSED)},
    )


def attitude_view() -> rrb.Spatial3DView:
    """Bank and pitch of the aircraft, seen from behind."""
    return rrb.Spatial3DView(
        origin=ATTITUDE,
        name="Attitude, from behind",
        background=list(BACKGROUND),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=(0.0, -2.9, 1.1),
            look_target=(0.0, 0.0, 0.1),
            eye_up=(0.0, 0.0, 1.0),
        ),
    )


def series_views(
    frame: Frame, runs: Sequence[str], only: Sequence[str] | None = None
) -> list[rrb.TimeSeriesView]:
    """The time series, one a question, each over the whole flight.

    Args:
        frame: what to frame the views on.
        runs: as in `blueprint`.
        only: names of the series shown; default: all.
    """
    wanted = max(frame.clearance_m, 1.0)
    lines = Counter(line.split("/")[0] for line in SERIES_STYLE)
    bank = "Attitude and saturation: bank and pitch, deg (right +, up +)"
    if len(runs) > 1:
        bank = "Attitude: bank, deg (right +)"
    rows: list[tuple[str, str, tuple[float, float] | None]] = [
        ("cross_track", "Tracking: cross-track error, m (right +)", None),
        ("clearance", "Safety: clearance to the nearest edge, m", (-0.5 * wanted, 6.0 * wanted)),
        ("bank", bank, None),
        ("speed", "Speed, m/s", None),
        ("altitude_error", "Altitude error, m (high +)", None),
        ("search", "Planner: one point a plan, time of its search, ms", None),
    ]
    return [
        rrb.TimeSeriesView(
            origin=f"{SERIES}/{entity}",
            name=title,
            background=rrb.archetypes.PlotBackground(color=list(BACKGROUND), show_grid=True),
            axis_x=_whole_flight(),
            axis_y=rrb.ScalarAxis(range=limits) if limits else None,
            plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=max(lines[entity], 1) * len(runs) > 1),
        )
        for entity, title, limits in rows
        if only is None or entity in only
    ]


def _whole_flight() -> rrb.TimeAxis:
    return rrb.TimeAxis(
        view_range=rr.TimeRange(
            start=rr.TimeRangeBoundary.absolute(seconds=0.0), end=rr.TimeRangeBoundary.infinite()
        )
    )


def _up_to_cursor() -> rrb.VisibleTimeRanges:
    """Shows all there was of an entity up to the time cursor, not only the latest."""
    return rrb.VisibleTimeRanges(
        timeline=TIMELINE, start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.cursor_relative()
    )
