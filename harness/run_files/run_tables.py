"""The tables of a run, `track.parquet` and `plans.parquet`: from a flight, and back.

`pyarrow.array` imports pandas, where it is installed, to ask whether it was given an object of pandas. That takes
longer than writing a flight's tables, so columns are handed over as buffers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from aircraft.interface import FloatArray
from harness.flight.polylines import polylines
from harness.flight.record import BELIEVED_FIELDS, TRACK_COLUMNS, TRACK_FIELDS, AcceptedPlan, Track

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, eq=False)
class PlanRow:
    """One row of `plans.parquet`: a plan, in effect from a simulated time on; places are east, north (m)."""

    plan_index: int
    time_s: float
    status: str
    compute_ms: float
    waypoints_m: FloatArray
    path_m: FloatArray
    segments: FloatArray  # (n, 6) as in `planner.interface.Path`
    loiter: bool  # the last segment has no end
    length_m: float
    max_curvature_1pm: float
    reason: str = ""


def track_table(track: Track) -> pa.Table:
    """Returns a track as the table that `track.parquet` holds."""
    import pyarrow as pa

    names = (*TRACK_FIELDS, *BELIEVED_FIELDS) if track.has_beliefs else TRACK_FIELDS
    columns = {name: TRACK_COLUMNS[name] for name in names}
    return pa.table(
        [_numbers(getattr(track, name), column.dtype) for name, column in columns.items()],
        pa.schema(
            pa.field(name, pa.from_numpy_dtype(column.dtype), metadata={"description": column.doc})
            for name, column in columns.items()
        ),
    )


def track_of(table: pa.Table) -> Track:
    """Returns the track in a table of `track.parquet`."""
    names = set(table.column_names)
    needed = [name for name, column in TRACK_COLUMNS.items() if column.left_out is None or name in names]
    return Track(**{name: table[name].to_numpy() for name in needed})


def plans_table(plans: Sequence[AcceptedPlan]) -> pa.Table:
    """Returns the plans of a flight as the table that `plans.parquet` holds, a row each."""
    import pyarrow as pa

    def get(attribute: str) -> list[Any]:
        return list(map(attrgetter(attribute), plans))

    # To cast numbers would import what takes longer than writing the tables.
    loiter = pa.py_buffer(np.packbits(np.array(get("loiter"), dtype=np.bool_), bitorder="little"))
    return pa.table(
        {
            "plan_index": _numbers(get("plan_index"), np.int64),
            "time_s": _numbers(get("time_s")),
            "status": _texts(get("plan.status.value")),
            "reason": _texts(get("plan.reason")),
            "compute_ms": _numbers(get("compute_ms")),
            "waypoints": _lists(get("plan.waypoints_m"), 2),
            "path": _lists(polylines(get("segments")), 2),
            "segments": _lists(get("segments"), 6),
            "loiter": pa.Array.from_buffers(pa.bool_(), len(plans), [None, loiter]),
            "length_m": _numbers(get("plan.path.length_m")),
            "max_curvature_1pm": _numbers(get("plan.path.max_curvature_1pm")),
        }
    )


def plan_rows(table: pa.Table) -> tuple[PlanRow, ...]:
    """Returns the rows of a table of `plans.parquet`."""
    rows = []
    for row in table.to_pylist():
        row["waypoints_m"] = np.array(row.pop("waypoints"), dtype=np.float64).reshape(-1, 2)
        row["path_m"] = np.array(row.pop("path"), dtype=np.float64).reshape(-1, 2)
        row["segments"] = np.array(row["segments"], dtype=np.float64).reshape(-1, 6)
        rows.append(PlanRow(**row))
    return tuple(rows)


def _numbers(values: ArrayLike, dtype: DTypeLike = np.float64) -> pa.Array:
    """Returns a column of numbers, without copying an array that is contiguous and of this type."""
    import pyarrow as pa

    array: NDArray[Any] = np.ascontiguousarray(values, dtype)
    return pa.Array.from_buffers(pa.from_numpy_dtype(array.dtype), len(array), [None, pa.py_buffer(array)])


def _texts(values: Sequence[str]) -> pa.Array:
    import pyarrow as pa

    coded = [value.encode() for value in values]
    ends = np.cumsum([0, *(len(each) for each in coded)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(coded), pa.py_buffer(ends), pa.py_buffer(b"".join(coded)))


def _lists(rows: Sequence[FloatArray], width: int) -> pa.Array:
    """Returns a column of lists of rows, (n, width) numbers for each entry."""
    import pyarrow as pa

    flat = np.concatenate([np.zeros((0, width)), *rows]).ravel()
    values = pa.FixedSizeListArray.from_arrays(_numbers(flat), width)
    return pa.ListArray.from_arrays(_numbers(np.cumsum([0, *map(len, rows)]), np.int32), values)
