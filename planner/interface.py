"""The request to a planner, its answer, and the map that it may know.

Frame: local ENU plane, x = east, y = north, metres. Directions are unit vectors, never angles.
Curvature is positive for a left (counter-clockwise) turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
ComplexArray = NDArray[np.complex128]

OFF_PATH_ERRORS = 4.0
"""An aircraft further from a path than this many tracking errors, and than 1 m, has left it."""
LEAST_CURVATURE_1PM = 1e-12
"""A smaller curvature is none: 100 km of it lie 5 mm off a straight line, and its centre is too far away to count."""
UNIT_TOLERANCE = 1e-6  # a tangent counts as a unit vector if its length differs from 1 by less than this
MOST_ROWS = 1_000_000  # a picture with an array of more rows than this is refused


def _frozen(array: FloatArray) -> FloatArray:
    copy = np.array(array, dtype=np.float64)
    copy.setflags(write=False)
    return copy


def _array_of(name: str, points: FloatArray, columns: int) -> FloatArray:
    """A read-only copy of an array of a picture; ValueError if it is not finite and of shape (n, `columns`)."""
    array = _frozen(points)
    if array.ndim != 2 or array.shape[1] != columns or len(array) > MOST_ROWS or not np.isfinite(array).all():
        must = f"finite, of shape (n, {columns}), n at most {MOST_ROWS:,}"
        raise ValueError(f"{name} of a picture has the shape {array.shape}; it must be {must}")
    return array


class PlanStatus(Enum):
    """How a call to a planner ended."""

    FOUND = "found"  # a new path to fly
    KEPT = "kept"  # the path being flown still serves; nothing was searched
    NO_BETTER = "no_better"  # a search found nothing better than the path being flown, which still serves
    NO_PATH = "no_path"  # a search found no path; the path being flown goes on
    UNREACHABLE = "unreachable"  # the edges seen so far leave no way: the goal is proved unreachable


@dataclass(frozen=True, eq=False)
class MovingEdges:
    """The seen edge of one obstacle that moves.

    At `time_s` the obstacle was at `points_m`, (k, 2), k > 0, in order from one end of the seen edge to the other.
    """

    time_s: float
    points_m: FloatArray
    velocity_mps: tuple[float, float]  # east, north; (0, 0) if it has just appeared and is not known yet

    def __post_init__(self) -> None:
        object.__setattr__(self, "points_m", _frozen(self.points_m))


class MapView(Protocol):
    """The map so far, from the scans: obstacle edges and free space. All that a planner may know of the world."""

    @property
    def spacing_m(self) -> float:
        """Edge points of one wall are about this far apart."""

    @property
    def revision(self) -> int:
        """Grows by one with every change of the set of edge points."""

    @property
    def last_removal_revision(self) -> int:
        """The last revision at which edge points were taken away again; 0 where none ever was."""

    @property
    def moving(self) -> tuple[MovingEdges, ...]:
        """The obstacles known to move; `edges_since` leaves out their edge points."""

    @property
    def last_contradiction_s(self) -> float:
        """Simulated time when an edge last appeared in space that had been seen to be free; -inf: never."""

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) edge points that came in after `revision`, oldest first; all of them after -1."""

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points lies in space seen to be free."""

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """(k,) distance of each of (k, 2) points to the nearest edge point, moving ones as last seen; +inf: none."""


@dataclass(frozen=True)
class Mission:
    """What a planner gets once for a whole flight: goal, area, aircraft and sensor."""

    goal_m: tuple[float, float]  # (east, north) of the goal
    goal_radius_m: float  # reached when inside this circle
    bounds_m: tuple[float, float, float, float]  # (xmin, ymin, xmax, ymax) of the area; must not be crossed
    clearance_m: float  # wanted distance from every obstacle edge
    turn_radius_m: float  # smallest radius a path may have
    speed_mps: float  # wanted airspeed
    roll_in_s: float  # time from wings level to 90 % of 30 degrees, or of the bank limit if that is less
    tracking_error_m: float  # largest expected distance of the aircraft from its path
    sensor_range_m: float  # radius of the sensing range (the paper's r)
    compute_latency_s: float = 0.0  # a plan takes effect this long after the request
    sensor_latency_s: float = 0.0  # a scan is known this long after it was taken
    wind_mps: float = 0.0  # the strongest steady wind to expect
    least_hold_radius_m: float | None = None
    """Smallest radius of a full turn that ends a plan; None: that of any turn."""
    least_spaced_radius_m: float | None = None
    """Smallest radius of turns with a straight between them on which the aircraft rolls; None: that of any turn."""
    edge_error_m: float = 0.0
    """An edge point may lie this far beside the edge of the obstacle that was seen."""

    @property
    def hold_radius_m(self) -> float:
        """Radius of the full turns that plans end in."""
        return self.least_hold_radius_m or self.turn_radius_m

    @property
    def spaced(self) -> Mission:
        """For a planner that leaves a straight to roll between any two turns: they may be tighter and are steeper."""
        radius_m = self.least_spaced_radius_m or self.turn_radius_m
        # A steeper turn takes longer to roll into: about as its curvature grows.
        return replace(self, turn_radius_m=radius_m, roll_in_s=self.roll_in_s * self.turn_radius_m / radius_m)

    @property
    def off_path_m(self) -> float:
        """If the aircraft is further than this from the path in effect, a new path begins at the aircraft itself."""
        return max(1.0, OFF_PATH_ERRORS * self.tracking_error_m)

    @property
    def ground_speed_mps(self) -> float:
        """Speed over the ground with the wind behind."""
        return self.speed_mps + self.wind_mps


@dataclass(frozen=True, eq=False)
class Path:
    """Joined segments of constant curvature.

    A row of `segments`, (n, 6), read-only, is start east, start north, unit tangent east, unit tangent north, curvature
    (1/m, positive = left; 0 below `LEAST_CURVATURE_1PM`) and length (m).
    """

    segments: FloatArray
    loiter: bool = False  # the last segment is a full circle to be flown for ever

    def __post_init__(self) -> None:
        rows = np.array(self.segments, dtype=np.float64, order="C").reshape(-1, 6)
        rows[np.abs(rows[:, 4]) < LEAST_CURVATURE_1PM, 4] = 0.0
        rows.setflags(write=False)
        object.__setattr__(self, "segments", rows)

    @classmethod
    def through(cls, points_m: Sequence[tuple[float, float]] | FloatArray) -> Path:
        """Straight lines through (n, 2) points, n > 1. At corners the direction jumps: an aircraft cuts them.

        Raises ValueError where there are fewer points, other columns, or two that follow one another are equal.
        """
        points = np.asarray(points_m, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2:
            raise ValueError(f"the points of a path have the shape {points.shape}; it must be (n, 2), n at least 2")
        legs = np.diff(points, axis=0)
        lengths = np.hypot(*legs.T)
        if not len(lengths) or not lengths.all():
            raise ValueError("a path goes through at least two points, each different from the one before")
        return cls(np.column_stack((points[:-1], legs / lengths[:, None], 0.0 * lengths, lengths)))

    @cached_property
    def rows(self) -> list[list[float]]:
        """The segments as lists, which are faster to read one by one."""
        rows: list[list[float]] = self.segments.tolist()
        return rows

    @cached_property
    def length_m(self) -> float:
        """Length, one turn of a closing loiter circle included."""
        return float(self.segments[:, 5].sum())

    @property
    def max_curvature_1pm(self) -> float:
        """Largest absolute curvature."""
        return float(np.abs(self.segments[:, 4]).max(initial=0.0))


class Refused(NamedTuple):
    """Why the shield does not fly the path that a planner gave last: a sentence, and (east, north) where that is."""

    place_m: tuple[float, float]
    reason: str


class PlanRequest(NamedTuple):
    """One question to a planner."""

    time_s: float  # simulated time
    position_m: tuple[float, float]  # (east, north) of the aircraft
    direction: tuple[float, float]  # unit vector of its ground velocity
    seen: MapView  # the map so far
    flown: Plan | None = None  # the plan in effect, None before the first
    arc_length_m: float = 0.0
    """Distance of the aircraft along `flown.path`; up to 0.1 s of compute latency as of the guidance update before."""
    scanned: bool = True  # a scan has come in since the last request
    refused: Refused | None = None  # why the shield refused the planner's last path; None while it is flown
    committed: Path | None = None  # under a shield: what is left of the certified path, and its turn


@dataclass(frozen=True, eq=False)
class PlanPicture:
    """A drawing of how a plan was found, for the recording alone; ValueError where a shape or number is wrong."""

    guide_m: FloatArray  # (2, 2) guide vector, from the aircraft to the point it aims at
    window_m: float = 0.0  # radius of the planning window (the paper's r1); 0: nothing bounds the search
    sectors: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))
    """(k, 4) free sectors at the aircraft: unit vectors of the right and the left edge."""
    candidates: tuple[FloatArray, ...] = ()  # polylines (m, 2) that were compared, the chosen one first
    met_m: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    """(j, 2) edge points of moving obstacles, at the places where the plan expects to meet them."""

    def __post_init__(self) -> None:
        for name, columns in (("guide_m", 2), ("sectors", 4), ("met_m", 2)):
            object.__setattr__(self, name, _array_of(name, getattr(self, name), columns))
        candidates = tuple(_array_of(f"candidates[{i}]", each, 2) for i, each in enumerate(self.candidates))
        object.__setattr__(self, "candidates", candidates)
        if len(self.guide_m) != 2 or not math.isfinite(self.window_m):
            text = f"{len(self.guide_m)} points and {self.window_m:g} m"
            raise ValueError(f"a picture has a guide vector of 2 points and a finite window; got {text}")


@dataclass(frozen=True, eq=False)
class Plan:
    """One answer of a planner; ValueError for a path with a tangent that is no unit vector."""

    status: PlanStatus  # how the call ended
    reason: str  # one sentence for the event log
    waypoints_m: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    """(k, 2) fixed-altitude waypoints, anything that numpy makes such an array of; empty unless FOUND."""
    path: Path | None = None  # the curve through the waypoints; None unless FOUND
    picture: Callable[[], PlanPicture] | None = None  # draws how the plan was found; called once if accepted
    wants_more_time: bool = False  # the search goes on: the planner wants to be asked before the next scan

    def __post_init__(self) -> None:
        object.__setattr__(self, "waypoints_m", _frozen(self.waypoints_m))
        if self.path is not None:
            lengths = np.hypot(*self.path.segments[:, 2:4].T)
            for i in np.flatnonzero(~(np.abs(lengths - 1.0) < UNIT_TOLERANCE)).tolist():
                text = f"begins with a tangent of length {lengths[i]:.9g}; tangents are unit vectors"
                raise ValueError(f"segment {i} of a plan's path {text}")


class Planner(Protocol):
    """A local planner for one flight. It is asked after every scan, in order of time.

    Between scans it is asked twice a guidance interval (20 times a second) while its last answer has `wants_more_time`.
    Its inputs are read-only; its output goes to standard error.
    """

    def plan(self, request: PlanRequest) -> Plan:
        """Answers one request. Must not use clocks or randomness of its own: same requests, same plans.

        A path that is FOUND begins at `request.position_m`, and each segment at the end of the one before. An answer
        that breaks a rule of `planner.plan_checks`, or an exception, ends the flight as `planner_failed`.
        """


class NoWayToBegin(RuntimeError):
    """No plan can be found: the space seen to be free leaves no room for one, or nothing is seen."""
