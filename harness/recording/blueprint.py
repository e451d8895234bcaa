"""Names of the entities in recordings, and their colours. Nothing here depends on a flight."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

if TYPE_CHECKING:
    from harness.analysis.flight_limits import FlightLimits
    from harness.flight.record import FloatArray
    from harness.world.obstacle import Obstacle
    from harness.world_files.height_field import HeightField
    from planner.interface import Mission

TIMELINE = "sim_time"  # name of the time axis

WORLD = "world"  # entities of the 3D view
PLAN = "plan"  # entities of the plan view
SERIES = "series"  # curves over time
STATES = "states"  # lanes of states
EVENTS = "events"  # the text log
SUMMARY = "summary"  # page with the figures
COLOURS = "colours"  # entity at the top of a recording: a page that explains the colours of the views
END = "end"  # below WORLD and PLAN: the place where a flight ended that did not end at the goal
FRAME = "frame"  # property of the recording that holds the `Frame`
WHOLE = "whole_track"  # below WORLD and PLAN: the whole track
FLOWN = "flown"  # below WORLD and PLAN: the trail in pieces, which are shown up to the cursor
BELIEVED = "believed"
"""Below WORLD and PLAN: the believed positions, drawn as the trail is; only where navigation is not perfect."""
NAVIGATION = "navigation_error"  # below SERIES: the navigation error, only where navigation is not perfect
THROTTLE, PLAN_DELAY = "throttle", "plan_delay"
"""Below SERIES: throttle in per cent, and the delay with which plans took effect."""
SENSED = "sensed"
"""Below WORLD and PLAN: places that the sensor has shown, each once; drawn up to the cursor as well."""
TRUE = "true_obstacles"  # below WORLD: the standing obstacles as solids
TRACKED, MET = "tracked", "met"
"""Below PLAN: obstacles that the map knows to move (and their `velocity`), and where the plan expects to meet them."""

PLANNER_LANE, BANK_LANE, TRACKING_LANE, SHIELD_LANE = "planner", "saturation", "tracking", "shield"
"""Lanes of the state timeline, below STATES; shown in the order of their names."""

Colour = tuple[int, int, int]

BACKGROUND: Colour = (17, 19, 24)  # background of the views
BOUNDS: Colour = (128, 134, 146)  # border of the area
OUTLINE: Colour = (104, 112, 128)  # outlines of standing obstacles
OBSTACLE: Colour = (112, 120, 138)  # standing obstacles as solids
EDGE_POINTS: Colour = (214, 218, 226)  # places that the sensor has shown
MOVING: Colour = (176, 116, 92)  # filling of moving and timed obstacles, as they truly are
MOVES: Colour = (255, 150, 96)  # obstacles that the map knows to move
MET_DOTS: Colour = (196, 124, 232)  # places where the plan expects to meet what moves
MOVING_OUTLINE: Colour = (96, 68, 56)  # outlines of moving and timed obstacles
FENCES = {"exclusion": (206, 62, 62), "inclusion": (70, 156, 74)}  # fences of a checked path, by kind
GOAL: Colour = (52, 160, 92)  # goal circle
START_COLOUR: Colour = (222, 230, 244)  # dot and label at the start, arrow of the wind, and scale
GOAL_LABEL_COLOUR: Colour = (160, 246, 190)  # dot and label at the goal
END_LABEL_COLOUR: Colour = (255, 216, 210)
"""Colour of the label where a flight ended that did not end at the goal."""
TRACKED_COLOUR: Colour = (48, 112, 72)  # lane `tracking` where a leg is trackable
AIRCRAFT: Colour = (255, 255, 255)
TRACK: Colour = (255, 179, 64)  # flown track, and curves of what was flown
WHOLE_TRACK: Colour = (92, 72, 40)  # track still ahead of the cursor
CHOSEN: Colour = (64, 196, 255)  # plan in effect
CANDIDATE: Colour = (54, 112, 148)  # candidates that a plan was compared with
GUIDE: Colour = (236, 112, 214)  # guide vector
SECTOR: Colour = (74, 148, 98)  # free sectors
WINDOW: Colour = (146, 130, 236)  # planning window
SENSING: Colour = (92, 98, 110)  # circle at the sensing range
HIT: Colour = (255, 92, 92)  # returns of the last scan; untracked legs and saturated bank in the lanes
WANTED: Colour = (255, 92, 92)  # curves of limits
CALM: Colour = (58, 64, 74)  # lane where nothing is to be said
HOLD: Colour = (156, 84, 60)  # lane while a holding turn or backup is flown
MODES: tuple[Colour, ...] = ((36, 98, 130), (88, 76, 148), (34, 112, 104), (122, 66, 116), (96, 104, 52))
"""Colours of the planner's states in the order in which they come up: dark, for white letters."""

ERROR_COLOURS: tuple[Colour, ...] = ((255, 214, 92), (255, 138, 48), (255, 44, 84))
"""Colours of the flown track: on the plan, at half the error limit, and at or beyond the limit."""

TOLD_PLAN: Colour = (58, 150, 214)  # plans in the event log
TOLD: Colour = (134, 142, 156)  # other events in the event log
WARNED: Colour = (214, 120, 20)  # warnings in the event log, legible on black and white

BELIEVED_OFF = "cross_track/believed"  # below SERIES: the cross-track error that guidance sees
SERIES_STYLE: dict[str, tuple[str, Colour, float]] = {
    "cross_track/flown": ("cross-track error", TRACK, 1.5),
    "clearance/flown": ("clearance", TRACK, 1.5),
    "clearance/wanted": ("wanted", WANTED, 1.0),
    "bank/commanded": ("commanded", CHOSEN, 1.0),
    "bank/flown": ("flown", TRACK, 1.5),
    "bank/limit": ("limit", WANTED, 1.0),
    "bank/pitch": ("pitch", WINDOW, 1.0),
    "speed/ground": ("over the ground", CHOSEN, 1.0),
    "speed/flown": ("true airspeed", TRACK, 1.5),
    "altitude_error/flown": ("altitude error", TRACK, 1.5),
    f"{NAVIGATION}/flown": ("navigation error", TRACK, 1.5),
    f"{THROTTLE}/flown": ("throttle", TRACK, 1.5),
    BELIEVED_OFF: ("as believed", CHOSEN, 1.0),
}
"""Name, colour and width of each line of time series, by entity below SERIES; overlays draw those called `flown`."""
WHOLE_ONLY = ("bank/pitch", BELIEVED_OFF)  # lines that a thin recording does not have
SEARCH, DELAYS = "search/flown", f"{PLAN_DELAY}/flown"
"""Below SERIES: time of the search of each plan, and how late it took effect, drawn as points."""

OVERLAY: tuple[Colour, ...] = (TRACK, CHOSEN, GUIDE, GOAL, WINDOW, HIT, (240, 228, 66), (200, 200, 210))
"""Colours of overlaid runs, in order."""


def error_colours(share: FloatArray) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """(n, 3) colours of the track for errors, as shares of the error limit."""
    scale = np.array(ERROR_COLOURS, dtype=np.float64).T
    place = 0.5 * np.arange(len(ERROR_COLOURS))
    return np.column_stack([np.interp(share, place, part) for part in scale]).astype(np.uint8)


@dataclass(frozen=True)
class Frame:
    """The area that the views are framed on; kept in every recording, so that several can be shown in one.

    `bank_limit_deg` is None where several flights are shown; `world` is a hash of the obstacles, empty where they are
    not known.
    """

    bounds_m: tuple[float, float, float, float]
    altitude_m: float
    clearance_m: float
    bank_limit_deg: float | None = None
    world: str = ""
    clearances_alike: bool = True  # all flights shown want this clearance; else it is the largest

    @property
    def recorded(self) -> dict[str, Any]:
        """Returns the values of the frame that a recording keeps."""
        return {name: getattr(self, name) for name in ("bounds_m", "altitude_m", "clearance_m", "world")}

    @property
    def span_m(self) -> float:
        """The longer side of the area."""
        xmin, ymin, xmax, ymax = self.bounds_m
        return max(xmax - xmin, ymax - ymin)


def series_lines(name: str, colour: tuple[int, ...], width: float) -> rr.SeriesLines:
    """Returns the style of a curve; where a pixel has many values it shows the least and the greatest of them."""
    both = rr.components.AggregationPolicy.MinMax
    return rr.SeriesLines(names=[name], colors=[colour], widths=[width], aggregation_policy=both)


@dataclass(frozen=True, eq=False)
class Scene:
    """All that is known before the flight, the true obstacles and ground included.

    A planner `searches`, but not where a given path is flown; the aircraft `believes` where it does not know its state
    exactly. `profile` gives altitudes to be held at places along the path, above mean sea level; None: one all along.
    `wind` is from where it blows (deg clockwise from north), and its words, empty in calm air. Views show `shown_m`.
    """

    name: str
    mission: Mission
    start_m: tuple[float, float]
    limits: FlightLimits
    obstacles: tuple[Obstacle, ...]
    scenario_yaml: str = ""
    searches: bool = True
    ground: HeightField | None = None
    believes: bool = False
    profile: Callable[[FloatArray], FloatArray] | None = None
    wind: tuple[float, str] = (0.0, "")
    shown_m: tuple[float, float, float, float] | None = None  # xmin, ymin, xmax, ymax; None: the area

    def held_m(self, arc_length_m: FloatArray) -> FloatArray:
        """(n,) altitudes to be held at places along the path, above mean sea level."""
        if self.profile is None:
            return np.full(len(arc_length_m), self.altitude_m)
        return self.profile(np.nan_to_num(arc_length_m))

    @property
    def base_m(self) -> float:
        """Height that drawings stand on: the lowest ground, or mean sea level where it is not known."""
        return 0.0 if self.ground is None else float(np.floor(np.nanmin(self.ground.heights_m)))

    @property
    def altitude_m(self) -> float:
        """Altitude to be held, above mean sea level."""
        return self.limits.altitude_m

    @property
    def empty_series(self) -> tuple[str, ...]:
        """Names of time series with nothing to show: clearance without obstacles, search where nothing is searched."""
        shown = {"clearance": bool(self.obstacles), NAVIGATION: self.believes}
        shown |= {"search": self.searches, PLAN_DELAY: self.searches}
        return tuple(name for name, has in shown.items() if not has)

    @cached_property
    def frame(self) -> Frame:
        """The area that the views are framed on."""
        limit_deg = round(math.degrees(self.limits.bank_limit_rad), 1)
        world = hashlib.sha256(repr(self.obstacles).encode()).hexdigest()[:16]
        shown_m = self.shown_m or self.mission.bounds_m
        return Frame(shown_m, self.altitude_m, self.limits.clearance_m, limit_deg, world)

    @property
    def obstacle_top_m(self) -> float:
        """Height up to which obstacles are drawn: above the flight altitude, and visible from afar."""
        return self.altitude_m + max(0.3 * (self.altitude_m - self.base_m), 0.012 * self.frame.span_m)


def time_column(time_s: FloatArray) -> rr.TimeColumn:
    """Returns simulated times as a column, rounded to nanoseconds (rerun truncates floats)."""
    return rr.TimeColumn(TIMELINE, duration=np.round(time_s * 1e9).astype("timedelta64[ns]"))


def nanoseconds(time_s: float) -> np.timedelta64:
    """Returns a simulated time rounded to nanoseconds."""
    return np.timedelta64(round(time_s * 1e9), "ns")
