"""Collects the track of a flight row by row and hands it on in blocks while flying."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.flight.record import TRACK_COLUMNS, FloatArray, Track

Clearance = Callable[[FloatArray, FloatArray], FloatArray]
"""Maps (k, 2) points and (k,) times to (k,) true distances (m) to the nearest active obstacle edge."""

BLOCK_ROWS = 6000  # a block has this many rows, ten minutes of flight

ROW_TYPE = np.dtype(
    [
        *((name, np.float64) for name in AircraftState._fields),
        ("roll_command_rad", np.float64),
        ("cross_track_m", np.float64),
        ("arc_length_m", np.float64),
        ("asked_airspeed_mps", np.float64),
        ("plan_index", np.int64),
    ]
)
"""The fields of a row until its block is full."""

ROW_STRUCT = struct.Struct(f"{len(AircraftState._fields) + 4}dq")
"""`ROW_TYPE` as the standard library writes it."""

NAMES = tuple(ROW_TYPE.fields or ())  # of the fields of a row

BELIEVED = slice(1, 6)  # fields of a believed state that a row has: east_m to velocity_north_mps

BELIEVED_STRUCT = struct.Struct("6d")  # `BELIEVED_TYPE` as the standard library writes it

BELIEVED_TYPE = np.dtype([(name, np.float64) for name in (*AircraftState._fields[BELIEVED], "cross_track_m")])
"""The further fields of a row where the aircraft does not know its state exactly."""

FINITE = [name for name in AircraftState._fields if name not in AircraftState._field_defaults]
"""Fields of the state that are finite while the aircraft is under control."""


class TrackLog:
    """The track of one flight.

    Args:
        clearance: distance to the nearest obstacle edge, vectorised; asked once a block.
        sinks: each is called with every finished block, in order.
        block_rows: rows a block.
        ground: height of the ground at east and north, vectorised; None where it is not known.
        row_sinks: each is called with every row: true state, steering, and the plan in effect.
    """

    def __init__(
        self,
        clearance: Clearance,
        sinks: Iterable[Callable[[Track], None]] = (),
        block_rows: int = BLOCK_ROWS,
        ground: Callable[[FloatArray, FloatArray], FloatArray] | None = None,
        row_sinks: Iterable[Callable[[AircraftState, GuidanceOutput, int], None]] = (),
    ) -> None:
        self._clearance, self._ground = clearance, ground
        self._sinks, self._row_sinks = tuple(sinks), tuple(row_sinks)
        self._rows = np.zeros(block_rows, ROW_TYPE)
        self._bytes, self._used = self._rows.data.cast("B"), 0
        self._beliefs = np.full(block_rows, math.nan, BELIEVED_TYPE)
        self._believed_bytes = self._beliefs.data.cast("B")
        self._believes = False
        self._blocks: list[Track] = []

    def add(
        self,
        state: AircraftState,
        steering: GuidanceOutput,
        plan_index: int,
        believed: AircraftState | None = None,
        true_cross_track_m: float = math.nan,
    ) -> None:
        """Adds one row: true state, latest steering, and the index of the plan in effect, -1 before the first.

        Where the aircraft does not know its state exactly, `believed` is what it takes it to be, and the true position
        lies `true_cross_track_m` beside the plan; `steering` has that of the believed one. A state that is not finite,
        with which control is lost, is no row of the track.
        """
        cross_track_m = steering.cross_track_m
        if believed is not None:
            self._believes = True
            at = self._used * BELIEVED_STRUCT.size
            BELIEVED_STRUCT.pack_into(self._believed_bytes, at, *tuple(believed)[BELIEVED], cross_track_m)
            cross_track_m = true_cross_track_m
        ROW_STRUCT.pack_into(  # numpy takes twice as long to fill a row
            self._bytes,
            self._used * ROW_STRUCT.size,
            *state,
            steering.roll_command_rad,
            cross_track_m,
            steering.arc_length_m,
            steering.airspeed_mps,
            plan_index,
        )
        self._used += 1
        if self._used == len(self._rows):
            self.flush_rows()
        for sink in self._row_sinks:
            sink(state, steering._replace(cross_track_m=cross_track_m), plan_index)

    def close(self) -> Track:
        """Hands on the last block and returns the whole track."""
        if self._used:
            self.flush_rows()
        return Track.joined(self._blocks)

    def flush_rows(self) -> None:
        """Hands on the rows since the last block as a block; without any it does nothing."""
        rows = self._rows[: self._used]
        finite = np.all([np.isfinite(rows[name]) for name in FINITE], axis=0)
        rows, beliefs = rows[finite], self._beliefs[: self._used][finite]
        self._used = 0
        if not len(rows):
            return
        of = {name: np.ascontiguousarray(rows[name]) for name in NAMES}
        of |= {name.replace("_rad", "_deg"): np.degrees(of[name]) for name in NAMES if name.endswith("_rad")}
        east_m, north_m = of["east_m"], of["north_m"]
        of |= {
            "course_deg": _course_deg(rows),
            "heading_deg": of["heading_deg"] % 360.0 % 360.0,  # of a tiny negative angle the first gives 360
            "groundspeed_mps": np.hypot(of["velocity_east_mps"], of["velocity_north_mps"]),
            "clearance_m": self._clearance(np.column_stack((east_m, north_m)), of["time_s"]),
        }
        if self._ground is not None:
            of["altitude_above_ground_m"] = of["up_m"] - self._ground(east_m, north_m)
        if self._believes:
            of["believed_course_deg"] = _course_deg(beliefs)
            for name in ("east_m", "north_m", "up_m", "cross_track_m"):
                of[f"believed_{name}"] = beliefs[name].copy()
        block = Track(**{name: column for name, column in of.items() if name in TRACK_COLUMNS})
        self._blocks.append(block)
        for sink in self._sinks:
            sink(block)


def _course_deg(rows: np.ndarray[Any, Any]) -> FloatArray:
    """(k,) direction of the ground velocity, in [0, 360)."""
    course: FloatArray = np.degrees(np.arctan2(rows["velocity_east_mps"], rows["velocity_north_mps"]))
    return course % 360.0 % 360.0
