"""The table of a run's plans, `plans.parquet`: from the plans of a flight, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harness.flight.polylines import polylines
from harness.flight.record import AcceptedPlan, FloatArray
from harness.run_files.columns import lists, numbers, texts, truths

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, eq=False)
class PlanRow:
    """One row of `plans.parquet`.

    Attributes:
        plan_index: 0 for the first plan.
        time_s: in effect from this simulated time on.
        status: how the planner's call ended, a value of `planner.interface.PlanStatus`.
        compute_ms: processor time of the call that found it.
        waypoints_m: (k, 2) east, north.
        path_m: (m, 2) dense polyline, east, north.
        segments: (n, 6) the same path exactly, as in `planner.interface.Path`.
        loiter: whether its last segment is a full circle, flown for ever.
        length_m: length of the path.
        max_curvature_1pm: its largest absolute curvature.
        reason: the planner's sentence on it; empty in folders of older versions.
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
    reason: str = ""


def plans_table(plans: Sequence[AcceptedPlan]) -> pa.Table:
    """The plans of a flight, a row each."""
    import pyarrow as pa

    paths = [accepted.plan.path for accepted in plans]
    columns = {
        "plan_index": numbers([accepted.plan_index for accepted in plans], np.int64),
        "time_s": numbers([accepted.time_s for accepted in plans]),
        "status": texts([accepted.plan.status.value for accepted in plans]),
        "reason": texts([accepted.plan.reason for accepted in plans]),
        "compute_ms": numbers([accepted.compute_ms for accepted in plans]),
        "waypoints": lists([accepted.plan.waypoints_m for accepted in plans], 2),
        "path": lists(polylines([accepted.segments for accepted in plans]), 2),
        "segments": lists([accepted.segments for accepted in plans], 6),
        "loiter": truths([accepted.loiter for accepted in plans]),
        "length_m": numbers([path.length_m for path in paths if path]),
        "max_curvature_1pm": numbers([path.max_curvature_1pm for path in paths if path]),
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
