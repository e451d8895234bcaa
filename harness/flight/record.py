"""The record of a flight as values: the track row by row, the accepted plans, the outcome.

Everything is SI; angles are degrees in the track, because the track is a file format. Frame: local ENU plane,
x = east, y = north, z = up above mean sea level; course and heading clockwise from north.
"""

# ruff: noqa: RUF009 (the functions give fields)
from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.interface import Plan
from planner.shield.intervention_log import ShieldReport

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Outcome(Enum):
    """How a flight ended."""

    REACHED = "reached"
    UNREACHABLE = "unreachable"
    COLLISION = "collision"
    OUT_OF_BOUNDS = "out_of_bounds"
    TIMEOUT = "timeout"
    LOST_CONTROL = "lost_control"
    PLANNER_FAILED = "planner_failed"


class Column(NamedTuple):
    """The properties of a column of the track."""

    doc: str  # what the column holds, in the unit that its name says
    dtype: str = "<f8"  # type of its values, as numpy writes it
    in_digest: bool = True  # whether the digest covers it
    left_out: float | None = None
    """The value of all rows where an optional column is left out; None if it may not be."""
    believed: bool = False
    """Whether it holds a believed quantity, which a track of perfect navigation does without."""


def _column(doc: str, *, digested: bool = True, **kind: Any) -> Any:
    """Declares a column of the track, as a field of `Track`."""
    column = Column(doc, in_digest=digested, **kind)
    metadata = {"column": column}
    return field(metadata=metadata) if column.left_out is None else field(default=None, metadata=metadata)


def _optional(doc: str, left_out: float = math.nan, *, believed: bool = False) -> Any:
    """Declares a column that may be left out when a track is made, which then fills it in."""
    return _column(doc, digested=False, left_out=left_out, believed=believed)


@dataclass(frozen=True, eq=False)
class Track:
    """The flown track, one row per log tick. All columns are read-only and equally long.

    Its fields are the columns of `track.parquet`, in that order; what each holds is said once, here, and written into
    the file's schema.
    """

    time_s: FloatArray = _column("simulated time")
    east_m: FloatArray = _column("position in the local plane")
    north_m: FloatArray = _column("position in the local plane")
    up_m: FloatArray = _column("altitude above mean sea level")
    course_deg: FloatArray = _column("direction of the ground velocity, in [0, 360)")
    heading_deg: FloatArray = _column("direction of the nose, in [0, 360)")
    roll_deg: FloatArray = _column("positive right wing down")
    pitch_deg: FloatArray = _column("positive nose up")
    airspeed_mps: FloatArray = _column("true airspeed")
    groundspeed_mps: FloatArray = _column("horizontal speed over the ground")
    load_factor: FloatArray = _column("normal load factor, 1 in level flight")
    roll_command_deg: FloatArray = _column("what guidance asked of the inner loops")
    cross_track_m: FloatArray = _column(
        "distance from the plan being flown, carried on beyond its ends, positive right; NaN before the first"
    )
    clearance_m: FloatArray = _column(
        "true distance to the nearest active obstacle edge, negative inside, inf with none"
    )
    plan_index: IntArray = _column("row of plans.parquet being flown, -1 before the first", dtype="<i8")
    arc_length_m: FloatArray = _column("distance along the plan being flown; NaN before the first plan", digested=False)
    throttle: FloatArray = _column("throttle command, 0 to 1; NaN for a flight model without an engine", digested=False)
    altitude_above_ground_m: FloatArray = _optional(
        "height above the true ground; NaN where that is not known, the default"
    )
    actuator_limited_s: FloatArray = _optional(
        "time since the start in which a servo was at its rate limit, each counted; 0 without such servos",
        0.0,
    )
    vertical_actuator_limited_s: FloatArray = _optional("that of elevator and throttle alone", 0.0)
    elevator: FloatArray = _optional(
        "commanded deflection of the elevator with its trim, from stop to stop -1 to 1; NaN where not known"
    )
    aileron: FloatArray = _optional("that of the ailerons, from stop to stop -1 to 1; NaN where not known")
    rudder: FloatArray = _optional("that of the rudder, from stop to stop -1 to 1; NaN where not known")
    angle_of_attack_deg: FloatArray = _optional("angle of attack; NaN where not known")
    asked_airspeed_mps: FloatArray = _optional("true airspeed that guidance asked for; NaN: the mission's")
    believed_east_m: FloatArray = _optional("where the aircraft believed to be", believed=True)
    believed_north_m: FloatArray = _optional("where the aircraft believed to be", believed=True)
    believed_up_m: FloatArray = _optional("altitude that it believed to have", believed=True)
    believed_course_deg: FloatArray = _optional(
        "direction of the ground velocity that it believed to have", believed=True
    )
    believed_cross_track_m: FloatArray = _optional(
        "distance from the plan being flown that guidance saw", believed=True
    )

    def __post_init__(self) -> None:
        for name, column in TRACK_COLUMNS.items():
            given = getattr(self, name)
            given = np.full(len(self.time_s), column.left_out) if given is None else given
            if (values := np.array(given, dtype=column.dtype)).shape != (len(self.time_s),):
                shape = f"has shape {values.shape}"
                raise ValueError(f"track column {name} {shape}, time_s has {len(self.time_s)} rows")
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def has_beliefs(self) -> bool:
        """Whether the track knows a believed state other than the true one."""
        return bool(np.isfinite(self.believed_east_m).any())

    @property
    def believed_m(self) -> FloatArray:
        """(n, 3) where the aircraft believed to be: east, north, up; NaN where that is not known."""
        return np.column_stack((self.believed_east_m, self.believed_north_m, self.believed_up_m))

    @property
    def navigation_error_m(self) -> FloatArray:
        """(n,) distance in the plane from the true position to the believed one; NaN where that is not known."""
        return np.hypot(self.believed_east_m - self.east_m, self.believed_north_m - self.north_m)

    @property
    def along_truly(self) -> Track:
        """The same with arc lengths of the true position: less by how far the believed one is ahead on its course."""
        if not self.has_beliefs:
            return self
        course = np.radians(self.course_deg)
        ahead_m = (self.believed_east_m - self.east_m) * np.sin(course)
        ahead_m += (self.believed_north_m - self.north_m) * np.cos(course)
        return replace(self, arc_length_m=self.arc_length_m - ahead_m)

    def part(self, first: int, stop: int) -> Track:
        """Returns the rows from `first` up to `stop`."""
        part = object.__new__(Track)
        part.__dict__.update({name: column[first:stop] for name, column in vars(self).items()})
        return part

    @staticmethod
    def joined(blocks: Sequence[Track]) -> Track:
        """One track of consecutive blocks; an empty sequence gives an empty track."""
        if not blocks:
            none: Any = np.zeros(0)
            return Track(**dict.fromkeys(TRACK_COLUMNS, none))
        joined = object.__new__(Track)
        for name in TRACK_COLUMNS:
            column = np.concatenate([getattr(each, name) for each in blocks])
            column.setflags(write=False)
            object.__setattr__(joined, name, column)
        return joined


TRACK_COLUMNS: Mapping[str, Column] = {each.name: each.metadata["column"] for each in fields(Track)}
"""All columns of `track.parquet`, in its order: the fields of `Track`."""

TRACK_FIELDS = tuple(name for name, column in TRACK_COLUMNS.items() if not column.believed)
"""Names of the columns that every track has."""

BELIEVED_FIELDS = tuple(name for name, column in TRACK_COLUMNS.items() if column.believed)
"""Names of the columns that a track has only where navigation is not perfect."""

SURFACES = ("elevator", "aileron", "rudder")  # names of the columns of control surfaces

DIGEST_COLUMNS = tuple(name for name, column in TRACK_COLUMNS.items() if column.in_digest)
"""Names of the columns of `track.parquet` that the digest covers, in its order."""


def digest(track: Track) -> str:
    """SHA-256 (hex) over the little-endian bytes of every column of `DIGEST_COLUMNS`, one column after the other."""
    sha = hashlib.sha256()
    for name in DIGEST_COLUMNS:
        sha.update(getattr(track, name).tobytes())
    return sha.hexdigest()


@dataclass(frozen=True, eq=False)
class AcceptedPlan:
    """A plan that was flown.

    Attributes:
        plan_index: 0 for the first; row of `plans.parquet`.
        time_s: in effect from this simulated time on.
        compute_ms: processor time of the call that found it.
        plan: the planner's answer; its `path` is not None.
        scan_s: simulated time of the latest scan that the planner knew of; NaN where nothing had been sensed.
    """

    plan_index: int
    time_s: float
    compute_ms: float
    plan: Plan
    scan_s: float = math.nan

    def __post_init__(self) -> None:
        if self.plan.path is None:
            raise ValueError(f"accepted plan {self.plan_index} has no path")

    @property
    def segments(self) -> FloatArray:
        """(n, 6) segments of the path, as in `planner.interface.Path`."""
        assert self.plan.path is not None
        return self.plan.path.segments

    @property
    def length_m(self) -> float:
        """Length of its path; infinite if it loiters."""
        return math.inf if self.loiter else float(self.segments[:, 5].sum())

    @property
    def delay_s(self) -> float:
        """Time from the latest scan known to the plan until it took effect; NaN without a scan."""
        return self.time_s - self.scan_s

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
        compute_ms: processor time of every call in which the planner searched, also where it found nothing new.
        sim_s: simulated time flown.
        wall_s: wall-clock time that took.
        compute_wall_ms: wall-clock time of the same calls as `compute_ms`.
        error: the traceback of what the planner or the guidance law raised; None where neither did.
        contact_m: clearance at a contact between the last two rows; +inf without.
        shield: what the planner's shield did; None without one.
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
    compute_wall_ms: tuple[float, ...] = ()
    shield: ShieldReport | None = None
