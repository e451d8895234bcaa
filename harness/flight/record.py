"""What a flight leaves behind, as values: the track row by row, the accepted plans, the outcome.

Everything is SI; angles are degrees in the track, because the track is a file format. Frame: local ENU plane,
x = east, y = north, z = up above mean sea level; course and heading clockwise from north.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from aircraft.interface import AircraftState
from planner.interface import Plan

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

Clearance = Callable[[FloatArray, FloatArray], FloatArray]
"""(k, 2) points and (k,) times -> (k,) true distance to the nearest active obstacle edge, m."""

COLUMNS = (
    "time_s",
    "east_m",
    "north_m",
    "up_m",
    "course_deg",
    "heading_deg",
    "roll_deg",
    "pitch_deg",
    "airspeed_mps",
    "groundspeed_mps",
    "load_factor",
    "roll_command_deg",
    "cross_track_m",
    "clearance_m",
    "plan_index",
)
"""Columns of `track.parquet` that the digest covers, in its order."""

BLOCK_ROWS = 6000
"""Rows that are handed on together: ten minutes of flight, which is less than a second of the loop."""

ROW = len(AircraftState._fields) + 4
"""Numbers in a row: a state, roll command, cross-track error and arc length, plan index."""
THROTTLE = AircraftState._fields.index("throttle")
"""What comes before it in a row is finite while the aircraft is under control."""


class Outcome(Enum):
    """How a flight ended."""

    REACHED = "reached"
    UNREACHABLE = "unreachable"
    COLLISION = "collision"
    OUT_OF_BOUNDS = "out_of_bounds"
    TIMEOUT = "timeout"
    LOST_CONTROL = "lost_control"
    PLANNER_FAILED = "planner_failed"


@dataclass(frozen=True, eq=False)
class Track:
    """The flown track, one row per log tick. All columns are read-only and equally long.

    Attributes:
        time_s: simulated time.
        east_m: position in the local plane.
        north_m: position in the local plane.
        up_m: altitude above mean sea level.
        course_deg: direction of the ground velocity, in [0, 360).
        heading_deg: direction of the nose, in [0, 360).
        roll_deg: positive right wing down.
        pitch_deg: positive nose up.
        airspeed_mps: true airspeed.
        groundspeed_mps: horizontal speed over the ground.
        load_factor: normal load factor, 1 in level flight.
        roll_command_deg: what guidance asked of the inner loops.
        cross_track_m: distance from the plan being flown, positive right of it; NaN before the first plan.
        clearance_m: true distance to the nearest active obstacle edge, negative inside, inf with none.
        plan_index: row of `plans.parquet` being flown, -1 before the first.
        arc_length_m: distance along that plan; NaN before the first plan.
        throttle: throttle command, 0 to 1; NaN for a flight model without an engine.
        altitude_above_ground_m: height above the true ground; NaN where that is not known, the default.
    """

    time_s: FloatArray
    east_m: FloatArray
    north_m: FloatArray
    up_m: FloatArray
    course_deg: FloatArray
    heading_deg: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray
    airspeed_mps: FloatArray
    groundspeed_mps: FloatArray
    load_factor: FloatArray
    roll_command_deg: FloatArray
    cross_track_m: FloatArray
    clearance_m: FloatArray
    plan_index: IntArray
    arc_length_m: FloatArray
    throttle: FloatArray
    altitude_above_ground_m: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.altitude_above_ground_m is None:
            object.__setattr__(self, "altitude_above_ground_m", np.full(len(self.time_s), math.nan))
        for name in TRACK_FIELDS:
            column = np.array(getattr(self, name), dtype="<i8" if name == "plan_index" else "<f8")
            if column.shape != (len(self.time_s),):
                raise ValueError(
                    f"track column {name} has shape {column.shape}, time_s has {len(self.time_s)} rows"
                )
            column.setflags(write=False)
            object.__setattr__(self, name, column)

    def __len__(self) -> int:
        return len(self.time_s)

    def part(self, first: int, stop: int) -> Track:
        """Some of its rows."""
        part = object.__new__(Track)
        part.__dict__.update({name: column[first:stop] for name, column in vars(self).items()})
        return part

    @staticmethod
    def joined(blocks: Sequence[Track]) -> Track:
        """One track of consecutive blocks; an empty sequence gives an empty track."""
        return Track(
            **{name: np.concatenate([[], *(getattr(b, name) for b in blocks)]) for name in TRACK_FIELDS}
        )


TRACK_FIELDS = (*COLUMNS, "arc_length_m", "throttle", "altitude_above_ground_m")
"""All columns of `track.parquet`."""


def digest(track: Track) -> str:
    """SHA-256 (hex) over the little-endian bytes of every column of `COLUMNS`, one column after the other."""
    sha = hashlib.sha256()
    for name in COLUMNS:
        sha.update(getattr(track, name).tobytes())
    return sha.hexdigest()


class TrackLog:
    """Collects the track of one flight and hands it on in blocks while flying.

    The true clearance is filled in block by block, not row by row.

    Args:
        clearance: distance to the nearest obstacle edge, vectorised.
        ground: height of the ground at east and north, vectorised; None where it is not known.
        sinks: each is called with every finished block, in order.
        block_rows: rows a block.
    """

    def __init__(
        self,
        clearance: Clearance,
        sinks: Iterable[Callable[[Track], None]] = (),
        block_rows: int = BLOCK_ROWS,
        ground: Callable[[FloatArray, FloatArray], FloatArray] | None = None,
    ) -> None:
        self._clearance, self._ground = clearance, ground
        self._sinks = tuple(sinks)
        self._table = np.zeros((block_rows, ROW))  # no more objects while flying than now
        self._row = 0
        self.commanded = 0.0, math.nan, math.nan
        """Roll command, cross-track error and arc length of the last update; 0 and NaN before the first."""
        self._blocks: list[Track] = []

    def add(
        self,
        state: AircraftState,
        roll_command_rad: float,
        cross_track_m: float,
        arc_length_m: float,
        plan_index: int,
    ) -> None:
        """Adds one row; without a plan, `cross_track_m` and `arc_length_m` are NaN and `plan_index` is -1.

        A state that is not finite, with which control is lost, is no row of the track.
        """
        self._table[self._row] = (*state, roll_command_rad, cross_track_m, arc_length_m, plan_index)
        self._row += 1
        if self._row == len(self._table):
            self._cut()

    def close(self) -> Track:
        """Hands on the last block and returns the whole track."""
        if self._row:
            self._cut()
        return Track.joined(self._blocks)

    def _cut(self) -> None:
        rows = np.ascontiguousarray(self._table[: self._row].T)
        rows = rows[:, np.isfinite(rows[:THROTTLE]).all(axis=0)]
        self._row = 0
        if not rows.size:
            return
        time, east, north, up, east_mps, north_mps, _, heading, roll, pitch = rows[:10]
        airspeed, load_factor, throttle, roll_command, cross_track, station, plan_index = rows[10:]
        block = Track(
            time_s=time,
            east_m=east,
            north_m=north,
            up_m=up,
            course_deg=np.degrees(np.arctan2(east_mps, north_mps)) % 360.0,
            heading_deg=np.degrees(heading) % 360.0,
            roll_deg=np.degrees(roll),
            pitch_deg=np.degrees(pitch),
            airspeed_mps=airspeed,
            groundspeed_mps=np.hypot(east_mps, north_mps),
            load_factor=load_factor,
            roll_command_deg=np.degrees(roll_command),
            cross_track_m=cross_track,
            clearance_m=self._clearance(np.column_stack((east, north)), time),
            plan_index=plan_index,
            arc_length_m=station,
            throttle=throttle,
            altitude_above_ground_m=None if self._ground is None else up - self._ground(east, north),
        )
        self._blocks.append(block)
        for sink in self._sinks:
            sink(block)


@dataclass(frozen=True, eq=False)
class AcceptedPlan:
    """A plan that was flown.

    Attributes:
        plan_index: 0 for the first; row of `plans.parquet`.
        time_s: in effect from this simulated time on.
        compute_ms: wall-clock time of the call that found it.
        plan: the planner's answer; its `path` is not None.
    """

    plan_index: int
    time_s: float
    compute_ms: float
    plan: Plan

    def __post_init__(self) -> None:
        if self.plan.path is None:
            raise ValueError(f"accepted plan {self.plan_index} has no path")

    @property
    def segments(self) -> FloatArray:
        """(n, 6) segments of the path, as in `planner.interface.Path`."""
        assert self.plan.path is not None
        return self.plan.path.segments

    @property
    def loiter(self) -> bool:
        """Whether the last segment is a full circle, flown for ever."""
        return self.plan.path is not None and self.plan.path.loiter


@dataclass(frozen=True, eq=False)
class Flight:
    """One flight, over.

    Attributes:
        track: every log tick from the start to the end, or to the last state that was finite.
        plans: the plans flown, in order; `plans[i].plan_index == i`.
        outcome: how it ended.
        reason: the same as one sentence.
        compute_ms: wall-clock time of every call in which the planner searched, also where it found nothing new.
        sim_s: simulated time flown.
        wall_s: wall-clock time that took.
        error: the traceback of what the planner or the guidance law raised; None where neither did.
        contact_m: clearance at a contact between the last two rows; +inf without.
    """

    track: Track
    plans: tuple[AcceptedPlan, ...]
    outcome: Outcome
    reason: str
    compute_ms: tuple[float, ...]
    sim_s: float
    wall_s: float
    error: str | None = None
    contact_m: float = math.inf
