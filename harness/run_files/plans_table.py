"""The table of a run's plans, `plans.parquet`: from the plans of a flight, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harness.flight.polylines import polylines
from harness.flight.record import AcceptedPlan, FloatArray

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, eq=False)
class PlanRow:
    """One row of `plans.parquet`.

    Attributes:
        plan_index: 0 for the first plan.
        time_s: in effect from this simulated time on.
        status: how the planner's call ended, a value of `planner.interface.PlanStatus`.
        compute_ms: wall-clock time of the call that found it.
        waypoints_m: (k, 2) east, north.
        path_m: (m, 2) dense polyline, east, north.
        segments: (n, 6) the same path exactly, as in `planner.interface.Path`.
        loiter: whether its last segment is a full circle, flown for ever.
        length_m: length of the path.
        max_curvature_1pm: its largest absolute curvature.
    """

    plan_index: int
    time_s: float
    status: str
    compute_ms: float
    waypoints_m: FloatArray
    path_m: FloatArray
    segments: FloatArray
    loiter: bool
    length_m: float
    max_curvature_1pm: float


def plans_table(plans: Sequence[AcceptedPlan]) -> pa.Table:
    """The plans of a flight, a row each."""
    import pyarrow as pa

    paths = [accepted.plan.path for accepted in plans]
    columns = {
        "plan_index": pa.array([accepted.plan_index for accepted in plans], pa.int64()),
        "time_s": pa.array([accepted.time_s for accepted in plans], pa.float64()),
        "status": pa.array([accepted.plan.status.value for accepted in plans], pa.string()),
        "compute_ms": pa.array([accepted.compute_ms for accepted in plans], pa.float64()),
        "waypoints": _points_column([accepted.plan.waypoints_m for accepted in plans]),
        "path": _points_column(polylines([accepted.segments for accepted in plans])),
        "segments": _points_column([accepted.segments for accepted in plans], 6),
        "loiter": pa.array([accepted.loiter for accepted in plans], pa.bool_()),
        "length_m": pa.array([path.length_m for path in paths if path], pa.float64()),
        "max_curvature_1pm": pa.array([path.max_curvature_1pm for path in paths if path], pa.float64()),
    }
    return pa.table(columns)


def plan_rows(table: pa.Table) -> tuple[PlanRow, ...]:
    """The rows of such a table."""
    rows = []
    for row in table.to_pylist():
        row["waypoints_m"] = np.array(row.pop("waypoints"), dtype=np.float64).reshape(-1, 2)
        row["path_m"] = np.array(row.pop("path"), dtype=np.float64).reshape(-1, 2)
        row["segments"] = np.array(row["segments"], dtype=np.float64).reshape(-1, 6)
        rows.append(PlanRow(**row))
    return tuple(rows)


def _points_column(rows: Sequence[FloatArray], width: int = 2) -> pa.Array:
    """A column of lists of rows: by default of [east_m, north_m]."""
    import pyarrow as pa

    flat = np.concatenate([np.zeros((0, width)), *rows]).ravel()
    offsets = np.cumsum([0, *(len(each) for each in rows)])
    values = pa.FixedSizeListArray.from_arrays(pa.array(flat), width)
    return pa.ListArray.from_arrays(pa.array(offsets, pa.int32()), values)
