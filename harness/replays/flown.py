"""A flown flight as columns: from tables, from flight logs, and what is made of them where a column is missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aircraft.frames import LocalPlane
from harness.files.input_file import InputError
from harness.flight.record import FloatArray

REQUIRED = ("time_s", "east_m", "north_m")
OPTIONAL = (
    *("up_m", "ve_mps", "vn_mps", "roll_deg", "p_degps", "airspeed_tas_mps", "airspeed_ias_mps"),
    *("baro_height_m", "lap", "autonomous", "target_index"),
)
"""Columns that are read of a table: SI units and degrees in their names, east, north, up of one plane."""
MOST_BYTES = 1_000_000_000


@dataclass(frozen=True, eq=False)
class FlownFlight:
    """What was flown, one row an instant.

    Attributes:
        source: the file.
        columns: (n,) float64 each: those of `REQUIRED`, `up_m`, `ve_mps`, `vn_mps`, and those of `OPTIONAL` that the
            file has.
        notes: what was inferred, a sentence each.
    """

    source: Path
    columns: Mapping[str, FloatArray]
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> FloatArray:
        return self.columns[name]

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def rows(self, chosen: NDArray[np.intp]) -> FlownFlight:
        """Some of its rows."""
        return FlownFlight(
            self.source, {name: each[chosen] for name, each in self.columns.items()}, self.notes
        )

    @property
    def airspeed_mps(self) -> FloatArray | None:
        """(n,) true airspeed, or else the indicated one; None where neither is there."""
        return next(
            (self.columns[name] for name in ("airspeed_tas_mps", "airspeed_ias_mps") if name in self.columns),
            None,
        )


def read_flown(path: Path, plane: LocalPlane) -> FlownFlight:
    """Reads a flown flight; rows by hand, before the autopilot was on, are left out where the file tells them.

    Args:
        path: .parquet or .csv with the columns that this module names, or a log that `wayproof view --log` takes.
        plane: positions in degrees are put into it.

    Raises:
        InputError: it cannot be read or has no track.
    """
    if path.suffix.lower() == ".parquet" or (path.suffix.lower() == ".csv" and _heads(path) >= set(REQUIRED)):
        columns, notes = _table(path), []
    else:
        from harness.run_files.flight_logs import read_log

        log = read_log(path, plane)
        columns = {"time_s": log.time_s, "east_m": log.east_m, "north_m": log.north_m, "up_m": log.up_m}
        notes = [
            *log.notes,
            "airspeed: not read of this kind of log; taken to be constant where wind is fitted",
        ]
    if len(columns["time_s"]) < 3 or not (np.diff(columns["time_s"]) > 0.0).all():
        raise InputError(f"{path}: time_s: must have at least 3 rows, each later than the one before")
    if "ve_mps" not in columns or "vn_mps" not in columns:
        notes.append("velocity over the ground: from the positions")
        for name, position in (("ve_mps", "east_m"), ("vn_mps", "north_m")):
            columns[name] = np.gradient(columns[position], columns["time_s"])
    columns.setdefault("up_m", np.zeros_like(columns["time_s"]))
    flight = FlownFlight(path, columns, tuple(notes))
    on = columns["autonomous"] > 0 if "autonomous" in columns else columns.get("lap", np.ones(1)) > 0
    if "autonomous" in columns or "lap" in columns:
        if not on.any():
            raise InputError(f"{path}: autonomous, lap: no row is flown by the autopilot")
        flight = flight.rows(np.flatnonzero(on))
    return flight


def _heads(path: Path) -> set[str]:
    try:
        with path.open(encoding="utf-8-sig") as file:
            return {head.strip().strip('"') for head in file.readline().split(",")}
    except (OSError, UnicodeDecodeError):
        return set()


def _table(path: Path) -> dict[str, FloatArray]:
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if path.stat().st_size > MOST_BYTES:
        raise InputError(f"{path}: has more than {MOST_BYTES / 1e6:g} MB")
    try:
        table = pa.parquet.read_table(path) if path.suffix.lower() == ".parquet" else pa.csv.read_csv(path)
    except (pa.ArrowException, OSError) as error:
        raise InputError(
            f"{path}: cannot be read as a table ({' '.join(str(error).split())[:200]})"
        ) from error
    missing = [name for name in REQUIRED if name not in table.column_names]
    if missing:
        raise InputError(f"{path}: has no column {missing[0]}; must have {', '.join(REQUIRED)}")
    columns = {}
    for name in (*REQUIRED, *OPTIONAL):
        if name in table.column_names:
            try:
                columns[name] = table[name].cast("float64", safe=False).to_numpy()
            except pa.ArrowException as error:
                raise InputError(f"{path}: {name}: must be numbers") from error
    known = np.isfinite([columns[name] for name in REQUIRED]).all(axis=0)
    return {name: each[known] for name, each in columns.items()}
