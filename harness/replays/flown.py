"""A flown flight as columns, from tables and from flight logs; a missing velocity or height is filled in."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from aircraft.frames import LocalPlane
from harness.files.input_file import InputError, finite, read_data, shown
from harness.files.wording import counted
from harness.flight.record import FloatArray
from harness.replays.logs import LONGEST_HELD_S, LONGEST_S, MAX_BYTES, READERS, read_log, reading
from harness.run_files.drawn_lines import (
    ALTITUDES,
    DEGREES,
    FASTEST_MPS,
    FLYING_MPS,
    LOCAL,
    MOST_BROKEN_SHARE,
)
from planner.interface import BoolArray

if TYPE_CHECKING:
    import pyarrow as pa

VELOCITY: Final = ("ve_mps", "vn_mps")
AIRSPEED_COLUMNS: Final = ("airspeed_tas_mps", "airspeed_ias_mps")  # the first that a log has is used
LAP_COLUMNS: Final = ("autonomous", "lap", "target_index")  # any of them tells which rows the autopilot flew
OPTIONAL: Final = (*VELOCITY, "roll_deg", *AIRSPEED_COLUMNS, "baro_height_m", *LAP_COLUMNS)
"""Columns of a table that are read beside time, place and height, where it has them; their names give the units."""
TABLES: Final = (".parquet", ".csv")  # endings of logs that are tables
APART_S: Final = 0.3  # places nearer in time, which may be rounded or noisy, tell no velocity
Columns = dict[str, FloatArray]
LONGEST_SLOW_S: Final = 30.0  # an aircraft slower than `FLYING_MPS` over the ground for longer stands on it


@dataclass(frozen=True, eq=False)
class FlownFlight:
    """A flown flight, one row for each instant."""

    source: Path
    columns: Mapping[str, FloatArray]
    """(n,) each: `time_s`, `east_m`, `north_m`, `up_m`, `ve_mps`, `vn_mps`, and any of `OPTIONAL`."""
    notes: tuple[str, ...] = ()  # what was inferred, a sentence each
    in_degrees: bool = False  # so were the places in the file

    def __getitem__(self, name: str) -> FloatArray:
        return self.columns[name]

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def rows(self, chosen: NDArray[np.intp]) -> FlownFlight:
        """Returns the flight with the chosen rows only."""
        return replace(self, columns={name: each[chosen] for name, each in self.columns.items()})

    @property
    def airspeed_mps(self) -> FloatArray | None:
        """(n,) true airspeed, or else the indicated one; None where the flight has neither."""
        return next((self.columns[name] for name in AIRSPEED_COLUMNS if name in self.columns), None)


def read_flown(path: Path, plane: LocalPlane | None = None, degrees: bool = False) -> FlownFlight:
    """Reads a flown flight, or raises InputError; rows flown by hand are left out where a column tells them.

    Positions in degrees, of a table with both if `degrees`, are put into the plane; None: into one about the first.
    """
    check_kind(path)
    if path.suffix.lower() in TABLES:
        columns, notes, in_degrees = _of_table(path, plane, degrees)
    else:
        (columns, notes), in_degrees = read_log(path, plane or LocalPlane(0.0, 0.0)), True
    _check_times(columns["time_s"], path, notes)
    columns = _without_leaps(columns, notes)
    times = columns["time_s"]
    _fill_velocity(columns, notes)
    if not np.isfinite(columns.get("up_m", math.nan)).any():
        notes.append("altitude: the table has none; taken to be 0 m")
        columns["up_m"] = np.zeros_like(times)
    for name in [each for each in AIRSPEED_COLUMNS if each in columns]:  # a sensor that is not there says 0
        if (lacking := ~(columns[name] > 0.0)).all():
            del columns[name]
        elif lacking.any():
            columns[name] = np.where(lacking, math.nan, columns[name])
            notes.append(f"{counted(int(lacking.sum()), 'row')} without {name} above 0")
    if not set(AIRSPEED_COLUMNS) & set(columns):
        text = f"the log has none ({', '.join(AIRSPEED_COLUMNS)}); taken to be constant where wind is fitted"
        notes.append(f"airspeed: {text}")
    targets = columns.get("target_index", np.zeros_like(times))
    by_autopilot = columns.get("autonomous", columns.get("lap", 1.0 - (targets < 0.0))) > 0.0
    if not by_autopilot.any():
        raise InputError(f"{path}: {', '.join(LAP_COLUMNS)}: no row is flown by the autopilot")
    flown, slow = by_autopilot & _moving(columns), f"slower than {FLYING_MPS:.1f} m/s over the ground"
    if not flown.any():
        raise InputError(f"{path}: is {slow}; must be a flight")
    if standing := int(by_autopilot.sum() - flown.sum()):
        text = f"{counted(standing, 'row')} on the ground or hovering passed over"
        notes.append(f"{text}: {slow} for over {LONGEST_SLOW_S:g} s")
    flight = FlownFlight(path, columns, tuple(notes), in_degrees).rows(np.flatnonzero(flown))
    _check_motion(flight)
    return flight


def _check_times(times: FloatArray, path: Path, notes: Sequence[str]) -> None:
    if (back := np.flatnonzero(np.diff(times) <= 0.0)[:1]).size:
        text = f"goes back from {times[back[0]]:.10g} to {times[back[0] + 1]:.10g}; must rise from row to row"
        raise InputError(f"{path}: time_s: {text}")
    if len(times) < 3:
        raise InputError(f"{path}: time_s: must have at least 3 rows{''.join(f'; {note}' for note in notes)}")
    if times[-1] - times[0] > LONGEST_S:
        raise InputError(f"{path}: lasts {times[-1] - times[0]:g} s; must be at most {LONGEST_S:g} s")


def _check_motion(flight: FlownFlight) -> None:
    """Raises InputError where in 2 s the places go to and fro, or elsewhere than the velocity tells (medians)."""
    times = flight["time_s"]
    places, velocity = (np.column_stack((flight[a], flight[b])) for a, b in (("east_m", "north_m"), VELOCITY))
    later = np.minimum(np.searchsorted(times, times + 2.0), len(times) - 1)
    steps_s = np.diff(times)
    longest_s = max(3.0, 1.5 * float(np.median(steps_s)))
    rows = np.flatnonzero((later > np.arange(len(times))) & (times[later] - times <= longest_s))
    told = 0.5 * (velocity[:-1] + velocity[1:]) * steps_s[:, None]
    steps = np.column_stack((np.diff(places, axis=0), told))
    way_m = np.append(0.0, np.cumsum(np.hypot(*steps.T[:2])))
    summed = np.vstack((np.zeros(4), np.cumsum(steps, axis=0)))
    if len(rows) < 5:
        return
    moved = (summed[later] - summed)[rows]
    moved_m, gone_m = float(np.median(np.hypot(*moved.T[:2]))), float(np.median((way_m[later] - way_m)[rows]))
    off_m = float(np.median(np.hypot(*(moved[:, :2] - moved[:, 2:]).T)))
    if gone_m > 3.0 * moved_m:
        text = f"its places go to and fro, {gone_m:.0f} m in 2 s to come {moved_m:.0f} m on"
        raise InputError(f"{flight.source}: {text} (medians); must be one aircraft's")
    if off_m > 0.5 * moved_m:
        where, right = f"{flight.source}: ve_mps, vn_mps", "m/s over the ground, and time_s s"
        text = f"lead {off_m:.0f} m off the places after 2 s, in which these move {moved_m:.3g} m (medians)"
        raise InputError(f"{where}: {text}; must be {right}")


def _without_leaps(columns: Columns, notes: list[str]) -> Columns:
    """Leaves out rows too far from both neighbours, with a note; none where they are many."""
    times, places = columns["time_s"], np.column_stack((columns["east_m"], columns["north_m"]))
    leaps, skips = (np.hypot(*(places[k:] - places[:-k]).T) > FASTEST_MPS * (times[k:] - times[:-k]) for k in (1, 2))
    wrong = np.pad(leaps[:-1] & leaps[1:] & ~skips, 1)
    if not 0.0 < wrong.mean() <= MOST_BROKEN_SHARE:
        return columns
    notes.append(f"{counted(int(wrong.sum()), 'row')} too far from both neighbours passed over")
    return {name: each[~wrong] for name, each in columns.items()}


def _moving(columns: Mapping[str, FloatArray]) -> BoolArray:
    """(n,) whether a row is among rows as fast as a flight that are at most `LONGEST_SLOW_S` apart."""
    times = columns["time_s"]
    fast_s = times[np.hypot(columns["ve_mps"], columns["vn_mps"]) >= FLYING_MPS]
    before_s = np.append(-np.inf, fast_s)[np.searchsorted(fast_s, times, side="right")]
    return np.asarray(np.append(fast_s, np.inf)[np.searchsorted(fast_s, times)] - before_s <= LONGEST_SLOW_S)


def _fill_velocity(columns: Columns, notes: list[str]) -> None:
    """Fills in the velocity over the ground by the positions in rows that have none, with a note."""
    velocity = [columns.get(name, np.full_like(columns["time_s"], math.nan)) for name in VELOCITY]
    if (unknown := ~np.isfinite(velocity).all(axis=0)).any():
        rows = "" if unknown.all() else f" in {counted(int(unknown.sum()), 'row')}"
        notes.append(f"velocity over the ground: from the positions{rows}")
        for name, each, other in zip(VELOCITY, velocity, _of_places(columns).T, strict=True):
            columns[name] = np.where(unknown, other, each)


def _of_places(columns: Mapping[str, FloatArray]) -> FloatArray:
    """(n, 2) velocity by places at least `APART_S` before and after a row; one held for long stands."""
    times, places = columns["time_s"], np.column_stack((columns["east_m"], columns["north_m"]))
    new = np.append(True, np.diff(places, axis=0).any(axis=1))
    own = new | (times - np.maximum.accumulate(np.where(new, times, -math.inf)) > LONGEST_HELD_S)
    times, places = times[own], places[own]
    before = np.maximum(np.searchsorted(times, times - APART_S, side="right") - 1, 0)
    after = np.minimum(np.searchsorted(times, times + APART_S), len(times) - 1)
    steps_s = np.maximum(times[after] - times[before], 1e-9)
    middle_s, velocity = times[before] + 0.5 * steps_s, (places[after] - places[before]) / steps_s[:, None]
    return np.column_stack([np.interp(columns["time_s"], middle_s, each) for each in velocity.T])


def check_kind(path: Path) -> None:
    """Raises InputError for a file that cannot be opened, or whose name has not the ending of a log."""
    read_data(path, MAX_BYTES, "a flight log", first=1)
    if path.suffix.lower() not in (endings := (*TABLES, *READERS)):
        raise InputError(f"{path}: is no flight log that is read; must end in {', '.join(endings)}")


def _of_table(path: Path, plane: LocalPlane | None, degrees: bool) -> tuple[Columns, list[str], bool]:
    """Reads the columns of a table that have values, with notes on its rows, and whether its places are in degrees."""
    import pyarrow.parquet as parquet

    with reading(path):
        table = parquet.read_table(path) if path.suffix.lower() == ".parquet" else _csv_table(path)
    table = table.rename_columns([name.strip() for name in table.column_names])
    names = table.column_names
    wanted = _wanted_columns(names, path, degrees)
    place = (wanted["east_m"], wanted["north_m"])
    if (twice := next((name for name in wanted.values() if names.count(name) > 1), None)) is not None:
        raise InputError(f"{path}: {twice}: stands {names.count(twice)} times; must stand once")
    columns = {new: _numbers(table, name, path) for new, name in wanted.items()}
    if place in DEGREES:  # a receiver without a fix says 0, 0
        latitude, longitude = columns["east_m"], columns["north_m"]
        off_earth = (np.abs(latitude) > 85.0) | (np.abs(longitude - 90.0) > 270.0)
        if off_earth.any() and (off_earth | np.isnan(latitude)).all():
            text = f"is {latitude[0]:.10g}, {longitude[0]:.10g} in row 1; must be degrees"
            raise InputError(f"{path}: {', '.join(place)}: {text}")
        columns["east_m"] = np.where(off_earth | ((latitude == 0.0) & (longitude == 0.0)), math.nan, latitude)
    columns, notes = _known_rows(columns)
    if unread := [name or "one without a name" for name in names if name not in wanted.values()]:
        notes.append(f"columns passed over: {shown(', '.join(unread))}")
    if place in DEGREES:
        pairs = np.column_stack((columns["east_m"], columns["north_m"])).tolist()
        plane = plane or LocalPlane(*next(iter(pairs), (0.0, 0.0)))
        placed = np.array([plane.plane(*pair) for pair in pairs]).reshape(-1, 2)
        columns["east_m"], columns["north_m"] = placed.T
    return columns, notes, place in DEGREES


def _known_rows(columns: Columns) -> tuple[Columns, list[str]]:
    """Returns the columns that have values, in rows with a new time, a place and, of flights in laps, a lap; and notes.

    A target that is not known is that of the row before.
    """
    has = {name: each for name, each in columns.items() if name not in OPTIONAL or np.isfinite(each).any()}
    needed = [name for name in ("time_s", "east_m", "north_m", "lap") if name in has]
    known = np.flatnonzero(np.isfinite([has[name] for name in needed]).all(axis=0))
    own = known[np.diff(has["time_s"][known], prepend=-np.inf) != 0.0]  # with a time of their own
    lacking = f"without {', '.join(needed[:-1])} or {needed[-1]}"
    every = {lacking: has["time_s"].size - known.size, "at the time of the row before": known.size - own.size}
    notes = [f"{counted(count, 'row')} {text} passed over" for text, count in every.items() if count]
    has = {name: each[own] for name, each in has.items()}
    if (unknown := np.isnan(has.get("target_index", np.zeros(0)))).any():
        rows = np.maximum.accumulate(np.where(unknown, 0, np.arange(len(unknown))))
        has["target_index"] = has["target_index"][rows]
        text = counted(int(unknown.sum()), "row")
        notes.append(f"{text} without target_index: that of the row before is taken")
    return has, notes


def _csv_table(path: Path) -> pa.Table:
    """Reads a CSV table; an InputError names the first line that has other than one cell for each column."""
    import pyarrow.csv as csv

    def refuse(row: csv.InvalidRow) -> str:
        wrong.append(f":{row.number}: has {row.actual_columns} cells, the header {row.expected_columns}")
        return "skip"

    wrong: list[str] = []
    options = csv.ParseOptions(invalid_row_handler=refuse)
    table = csv.read_csv(path, csv.ReadOptions(use_threads=False), options)
    if wrong:
        raise InputError(f"{path}{wrong[0]}")
    return table


def _wanted_columns(names: Sequence[str], path: Path, degrees: bool) -> dict[str, str]:
    """Returns the columns to read by their names in `FlownFlight`; places in degrees stand as `east_m`, `north_m`."""
    pairs = (*(DEGREES if degrees else ()), *reversed(LOCAL), *DEGREES)
    place = next((pair for pair in pairs if set(pair) <= set(names)), None)
    if "time_s" not in names or place is None:
        missing = next((name for name in ("time_s", *LOCAL[1]) if name not in names), "")
        wanted = "time_s, and east_m, north_m or latitude_deg, longitude_deg; in CSV parted by commas"
        raise InputError(f"{path}: has no column {missing}; must have {wanted}")
    found = {"time_s": "time_s", "east_m": place[0], "north_m": place[1]}
    heights = [name for name in (ALTITUDES if place in DEGREES else ("up_m", *ALTITUDES)) if name in names]
    found |= dict(zip(("up_m",), heights, strict=False)) | {name: name for name in OPTIONAL if name in names}
    return found


def _numbers(table: pa.Table, name: str, path: Path) -> FloatArray:
    """Returns a column, NaN where nothing finite is; an InputError names the first row that is no number, from 1."""
    from pyarrow import types

    column = table[name]
    plain = [types.is_integer, types.is_floating, types.is_decimal]
    plain += [types.is_boolean] if name == "autonomous" else []
    if any(is_so(column.type) for is_so in plain):
        found = np.asarray(column.cast("float64", safe=False).to_numpy())
        return np.where(np.isfinite(found), found, math.nan)

    def number(row: int, cell: Any) -> float:
        if name == "autonomous" and isinstance(cell, str):
            cell = {"true": "1", "false": "0"}.get(cell.strip().lower(), cell)
        empty = cell in (None, "", "nan")
        return math.nan if empty else finite(cell, f"{path}: {name}: row {row}", isinstance(cell, str))

    return np.array([number(*each) for each in enumerate(column.to_pylist(), start=1)])
