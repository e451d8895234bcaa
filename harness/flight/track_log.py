"""Collects the track of a flight row by row and hands it on in blocks while flying."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import AircraftState
from harness.flight.observer import Observer, RowObserver
from harness.flight.record import SURFACES, FloatArray, Track
from harness.world.world import World

Clearance = Callable[[FloatArray, FloatArray], FloatArray]
"""(k, 2) points and (k,) times -> (k,) true distance to the nearest active obstacle edge, m."""

BLOCK_ROWS = 6000
"""Rows that are handed on together: ten minutes of flight, which is less than a second of the loop."""

LOGGED = np.dtype(
    [
        *((name, np.float64) for name in AircraftState._fields),
        ("roll_command_rad", np.float64),
        ("cross_track_m", np.float64),
        ("arc_length_m", np.float64),
        ("plan_index", np.int64),
    ]
)
"""What is kept of a tick until its block is full."""

PACKED = struct.Struct(f"{len(AircraftState._fields) + 3}dq")
"""The same as the standard library writes it."""

NAMES = tuple(LOGGED.fields or ())

BELIEVED = np.dtype(
    [
        (name, np.float64)
        for name in ("east_m", "north_m", "up_m", "velocity_east_mps", "velocity_north_mps", "cross_track_m")
    ]
)
"""What is kept beside that of a tick at which the aircraft did not know its state exactly."""

FINITE = [name for name in AircraftState._fields if name not in AircraftState._field_defaults]
"""What is finite of a state while the aircraft is under control."""


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
        self._rows = np.zeros(block_rows, LOGGED)
        self._bytes, self._used = self._rows.data.cast("B"), 0
        self._beliefs = np.full(block_rows, math.nan, BELIEVED)
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
        """Adds one row. A state that is not finite, with which control is lost, is no row of the track.

        Args:
            state: the true state.
            steering: what guidance decided last; before the first plan its cross-track error and arc length are NaN.
            plan_index: row of `plans.parquet` being flown, -1 before the first.
            believed: what the aircraft believes; None where it knows its state exactly.
            true_cross_track_m: of the true position, where `believed` is given; `steering` has the believed one's.
        """
        if believed is not None:
            self._believes = True
            self._beliefs[self._used] = (
                believed.east_m,
                believed.north_m,
                believed.up_m,
                believed.velocity_east_mps,
                believed.velocity_north_mps,
                steering.cross_track_m,
            )
            steering = steering._replace(cross_track_m=true_cross_track_m)
        PACKED.pack_into(  # numpy takes twice as long to fill a row
            self._bytes,
            self._used * PACKED.size,
            *state,
            steering.roll_command_rad,
            steering.cross_track_m,
            steering.arc_length_m,
            plan_index,
        )
        self._used += 1
        if self._used == len(self._rows):
            self.hand_on()
        for told in self._row_sinks:
            told(state, steering, plan_index)

    def close(self) -> Track:
        """Hands on the last block and returns the whole track."""
        if self._used:
            self.hand_on()
        return Track.joined(self._blocks)

    def hand_on(self) -> None:
        """Hands on the rows since the last block as a block; without any it does nothing."""
        rows = self._rows[: self._used]
        kept = np.all([np.isfinite(rows[name]) for name in FINITE], axis=0)
        rows, beliefs = rows[kept], self._beliefs[: self._used][kept]
        self._used = 0
        if not len(rows):
            return
        of = {name: np.ascontiguousarray(rows[name]) for name in NAMES}
        east_mps, north_mps = of["velocity_east_mps"], of["velocity_north_mps"]
        block = Track(
            time_s=of["time_s"],
            east_m=of["east_m"],
            north_m=of["north_m"],
            up_m=of["up_m"],
            course_deg=np.degrees(np.arctan2(east_mps, north_mps)) % 360.0,
            heading_deg=np.degrees(of["heading_rad"]) % 360.0,
            roll_deg=np.degrees(of["roll_rad"]),
            pitch_deg=np.degrees(of["pitch_rad"]),
            airspeed_mps=of["airspeed_mps"],
            groundspeed_mps=np.hypot(east_mps, north_mps),
            load_factor=of["load_factor"],
            roll_command_deg=np.degrees(of["roll_command_rad"]),
            cross_track_m=of["cross_track_m"],
            clearance_m=self._clearance(np.column_stack((of["east_m"], of["north_m"])), of["time_s"]),
            plan_index=of["plan_index"],
            arc_length_m=of["arc_length_m"],
            throttle=of["throttle"],
            actuator_limited_s=of["actuator_limited_s"],
            vertical_actuator_limited_s=of["vertical_actuator_limited_s"],
            **{name: of[name] for name in SURFACES},
            angle_of_attack_deg=np.degrees(of["angle_of_attack_rad"]),
            altitude_above_ground_m=(
                None if self._ground is None else of["up_m"] - self._ground(of["east_m"], of["north_m"])
            ),
            **(_believed(beliefs) if self._believes else {}),
        )
        self._blocks.append(block)
        for sink in self._sinks:
            sink(block)


def flight_log(world: World, observers: Sequence[Observer]) -> TrackLog:
    """The track of one flight in a world; the observers get every finished block, a `RowObserver` every row."""
    rows = [each.on_row for each in observers if isinstance(each, RowObserver)]
    return TrackLog(
        world.clearance, [each.on_block for each in observers], ground=world.ground_heights, row_sinks=rows
    )


def _believed(rows: np.ndarray[Any, Any]) -> dict[str, FloatArray]:
    """The columns of what the aircraft believed."""
    course = np.degrees(np.arctan2(rows["velocity_east_mps"], rows["velocity_north_mps"])) % 360.0
    return {
        "believed_east_m": rows["east_m"].copy(),
        "believed_north_m": rows["north_m"].copy(),
        "believed_up_m": rows["up_m"].copy(),
        "believed_course_deg": course,
        "believed_cross_track_m": rows["cross_track_m"].copy(),
    }
