"""Replays reference data of the original npfg and L1: `python -m tests.aircraft.guidance_reference FOLDER`.

The folder has the format of shared/guidance (its README): states, closed-loop runs and their tracks; any rows, columns
in any order. Prints, of every column, the largest |x - ref| / (1 + |ref|) in every set, and exits with 1 where one is
beyond its tolerance, with 2 and one line where the data are not of that format.
"""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from aircraft.guidance.l1 import (
    L1Circle,
    L1Leg,
    L1Memory,
    L1Motion,
    L1Parameters,
    follow_circle,
    follow_leg,
)
from aircraft.guidance.npfg import NpfgInput, NpfgParameters, npfg
from tests.aircraft.guidance_replay import Row, replayed

TOLERANCE, SINGLE_TOLERANCE, CENTIDEGREES = 1e-6, 2e-4, 1.0
"""Largest |x - ref| / (1 + |ref|) of double columns, of single ones, and |x - ref| of whole hundredths of a degree."""
DIRECTIONS = {"heading_ref", "course_sp", "nav_bearing"}
"""Compared as directions: pi and -pi are the same."""


@dataclass(frozen=True)
class Worst:
    """The largest difference of a column in one set."""

    difference: float
    tolerance: float
    rows: int

    @property
    def kept(self) -> bool:
        return self.difference <= self.tolerance  # not so for NaN


def npfg_columns(row: Row) -> Row:
    """The columns that the law gives for a row of `npfg_states`."""
    output = npfg(
        NpfgInput(
            row["pos_e"],
            row["pos_n"],
            row["vg_e"],
            row["vg_n"],
            row["w_e"],
            row["w_n"],
            row["path_e"],
            row["path_n"],
            row["t_e"],
            row["t_n"],
            row["kappa"],
        ),
        NpfgParameters(
            row["p_period"],
            row["p_damping"],
            bool(row["p_en_period_lb"]),
            bool(row["p_en_period_ub"]),
            bool(row["p_en_min_gsp"]),
            bool(row["p_en_track_keep"]),
            bool(row["p_en_wind_reg"]),
            row["p_min_gsp"],
            row["p_gsp_max_tk"],
            row["p_roll_tc"],
            row["p_sw_mult"],
            row["p_period_sf"],
            row["p_roll_lim"],
            row["p_va_nom"],
            row["p_va_max"],
        ),
    )
    names = (
        "lat_acc lat_acc_ff roll_sp airspeed_ref heading_ref course_sp track_err track_err_bound look_ahead "
        "track_prox feas feas_on_track min_gsp_ref adapted_period p_gain time_const switch_dist vref_e vref_n"
    )
    return dict(zip(names.split(), output, strict=True))


def motion_of(row: Row) -> L1Motion:
    return L1Motion(
        row["pos_e"], row["pos_n"], row["vg_e"], row["vg_n"], row["yaw"], int(row["yaw_cd"]), row["eas2tas"]
    )


def leg_columns(row: Row) -> Row:
    """The columns that the law gives for a row of `l1_waypoint_states`."""
    output, memory = follow_leg(
        motion_of(row),
        L1Leg(row["prev_e"], row["prev_n"], row["next_e"], row["next_n"], row["dist_min"]),
        row["dt_us"] * 1e-6,
        L1Memory(row["last_nu_in"], row["xtrack_i_in"], row["gain_prev_in"]),
        L1Parameters(row["p_period"], row["p_damping"], row["p_xtrack_i"], 0.0, 0.0),
    )
    return {
        "lat_acc": output.lateral_acceleration_mps2,
        "nav_roll_cd": output.roll_cd,
        "nav_bearing": output.bearing_rad,
        "bearing_error": output.bearing_error_rad,
        "crosstrack": output.crosstrack_m,
        "xtrack_i_out": memory.integrator_rad,
        "last_nu_out": memory.last_nu_rad,
        "l1_dist": output.distance_m,
        "target_bearing_cd": output.target_bearing_cd,
        "turn_dist_90": output.turn_distance_m,
    }


def circle_columns(row: Row) -> Row:
    """The columns that the law gives for a row of `l1_loiter_states`."""
    output, memory = follow_circle(
        motion_of(row),
        L1Circle(row["centre_e"], row["centre_n"], row["radius"], row["direction"]),
        L1Memory(row["last_nu_in"]),
        L1Parameters(
            row["p_period"],
            row["p_damping"],
            0.0,
            math.radians(row["p_lim_bank"]),
            row["p_tecs_target_airspeed"],
        ),
    )
    return {
        "lat_acc": output.lateral_acceleration_mps2,
        "nav_roll_cd": output.roll_cd,
        "nav_bearing": output.bearing_rad,
        "bearing_error": output.bearing_error_rad,
        "crosstrack": output.crosstrack_m,
        "last_nu_out": memory.last_nu_rad,
        "l1_dist": output.distance_m,
        "circling": float(output.circling),
        "target_bearing_cd": output.target_bearing_cd,
        "scaled_radius": output.radius_m,
    }


STATES: dict[str, Callable[[Row], Row]] = {
    "npfg_states": npfg_columns,
    "l1_waypoint_states": leg_columns,
    "l1_loiter_states": circle_columns,
}
STATE_COLUMNS = {
    "npfg_states": (
        "pos_n pos_e vg_n vg_e w_n w_e t_n t_e path_n path_e kappa p_period p_damping p_en_period_lb p_en_period_ub "
        "p_en_min_gsp p_en_track_keep p_en_wind_reg p_min_gsp p_gsp_max_tk p_roll_tc p_sw_mult p_period_sf p_roll_lim "
        "p_va_nom p_va_max lat_acc lat_acc_ff roll_sp airspeed_ref heading_ref course_sp track_err track_err_bound "
        "look_ahead track_prox feas feas_on_track min_gsp_ref adapted_period p_gain time_const switch_dist vref_n "
        "vref_e"
    ),
    "l1_waypoint_states": (
        "pos_n pos_e vg_n vg_e yaw yaw_cd eas2tas dt_us prev_n prev_e next_n next_e dist_min p_period p_damping "
        "p_xtrack_i last_nu_in xtrack_i_in gain_prev_in lat_acc nav_roll_cd nav_bearing bearing_error crosstrack "
        "xtrack_i_out last_nu_out l1_dist target_bearing_cd turn_dist_90"
    ),
    "l1_loiter_states": (
        "pos_n pos_e vg_n vg_e yaw yaw_cd eas2tas centre_n centre_e radius direction p_period p_damping p_lim_bank "
        "p_tecs_target_airspeed last_nu_in ambiguous lat_acc nav_roll_cd nav_bearing bearing_error crosstrack "
        "last_nu_out l1_dist circling target_bearing_cd scaled_radius"
    ),
}
"""What a file of states must have: what the law is given, and what the original gave. `set` is 0 where absent."""
RUN_COLUMNS = (
    "run kind V0 w_n w_e speed_loop a_n a_e course c_n c_e radius dir p1_n p1_e p2_n p2_e course2 n0 e0 "
    "psi0 phi0"
)
TRACK_COLUMNS = "run k n e psi phi V seg lat_acc track_err"
LAWS = {"npfg": (" va_nom va_max", " airspeed_ref"), "l1": (" xtrack_i", "")}
"""Those that have runs and tracks, and which columns of these only one law has."""


class FormatError(ValueError):
    """The data are not of the format; the message says which file, and what is wrong, in one line."""


def difference(name: str, found: float, reference: float) -> tuple[float, float]:
    """How far a number is from its reference, and what is allowed."""
    plain, single = name.removesuffix("_f32"), name.endswith("_f32")
    off = abs(found - reference)
    if plain in DIRECTIONS:
        off = min(off, abs(off - math.tau))
    if found == reference or (math.isnan(found) and math.isnan(reference)):
        off = 0.0
    if plain.endswith("_cd"):
        return off, CENTIDEGREES
    return off / (1.0 + abs(reference)), SINGLE_TOLERANCE if single else TOLERANCE


def rows_of(path: Path, columns: str) -> list[Row]:
    """The rows of a file that has these columns, a number in every row of each (`kind` is a word).

    Args:
        path: a parquet file.
        columns: names, with spaces between.

    Returns:
        The rows, with all columns of the file.

    Raises:
        FormatError: it is not a parquet file, has no rows, or a column is missing or not of numbers.
    """
    needed = columns.split()
    try:
        table = pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise FormatError(f"{path}: cannot be read as parquet: {str(error).splitlines()[0]}") from None
    if missing := [name for name in needed if name not in table.column_names]:
        raise FormatError(f"{path}: has no column {', '.join(missing)}")
    if not table.num_rows:
        raise FormatError(f"{path}: has no rows")
    for name in needed:
        column = table[name]
        number = pa.types.is_integer(column.type) or pa.types.is_floating(column.type)
        if column.null_count or not (number or name == "kind"):
            raise FormatError(f"{path}: column {name} must have a number in every row")
    rows: list[Row] = table.to_pylist()
    return rows


def of_states(path: Path, law: Callable[[Row], Row], every: int = 1) -> dict[tuple[str, int], Worst]:
    """The worst of every column that the file has, by name and set; of every row, or of some."""
    found: dict[tuple[str, int], list[tuple[float, float]]] = defaultdict(list)
    for row in rows_of(path, STATE_COLUMNS[path.stem])[::every]:
        if row.get("ambiguous"):
            continue
        for plain, value in law(row).items():
            for name in (plain, f"{plain}_f32"):
                if name in row:
                    found[name, int(row.get("set", 0))].append(difference(name, float(value), row[name]))
    return worst_of(found)


def of_tracks(folder: Path, law: str, every: int = 1) -> dict[tuple[str, int], Worst]:
    """The worst of every column of a law's tracks, flown anew from the start of each run; of every run, or of some."""
    found: dict[tuple[str, int], list[tuple[float, float]]] = defaultdict(list)
    of_run, of_track = LAWS[law]
    started, flown_by = folder / f"{law}_runs.parquet", folder / f"{law}_tracks.parquet"
    runs = {int(run["run"]): run for run in rows_of(started, RUN_COLUMNS + of_run)}
    by_run: dict[int, list[Row]] = defaultdict(list)
    for row in rows_of(flown_by, TRACK_COLUMNS + of_track):
        by_run[int(row["run"])].append(row)
    if lost := sorted(set(by_run) - set(runs)):
        raise FormatError(f"{flown_by}: has run {lost[0]}, which {started.name} has not")
    for number, rows in list(by_run.items())[::every]:
        flown = list(replayed(law, runs[number], 1 + max(int(row["k"]) for row in rows)))
        for row in rows:
            for name, value in flown[int(row["k"])].items():
                if name in ("n", "e"):
                    found[name, 0].append((abs(value - row[name]), TOLERANCE))
                elif name in row:
                    found[name, 0].append(difference(name, value, row[name]))
    return worst_of(found)


def worst_of(found: dict[tuple[str, int], list[tuple[float, float]]]) -> dict[tuple[str, int], Worst]:
    return {
        key: Worst(
            max((d for d, _ in pairs), key=lambda d: math.inf if math.isnan(d) else d),
            pairs[0][1],
            len(pairs),
        )
        for key, pairs in found.items()
    }


def compared(folder: Path, every: int = 1) -> Iterator[tuple[str, dict[tuple[str, int], Worst]]]:
    """The worst of every column, file by file, of those files that the folder has."""
    for name, law in STATES.items():
        if (folder / f"{name}.parquet").is_file():
            yield name, of_states(folder / f"{name}.parquet", law, every)
    for kind in LAWS:
        if (folder / f"{kind}_tracks.parquet").is_file():
            yield f"{kind}_tracks", of_tracks(folder, kind, every)


def shown(name: str, worst: dict[tuple[str, int], Worst]) -> int:
    """Prints the table of a file; how many of its columns are beyond their tolerance."""
    print(f"{name}\n  {'column':24} {'set':>3} {'rows':>6} {'largest':>9} {'allowed':>8}")
    for (column, number), one in sorted(worst.items(), key=lambda item: (item[0][1], item[0][0])):
        print(
            f"  {column:24} {number:3} {one.rows:6} {one.difference:9.2e} {one.tolerance:8.0e}"
            f"{'' if one.kept else '  BEYOND'}"
        )
    return sum(not one.kept for one in worst.values())


def main(arguments: list[str]) -> int:
    """Compares a folder; 0 if all is within the tolerances, 1 if not, 2 if they cannot be compared."""
    if len(arguments) != 1 or not Path(arguments[0]).is_dir():
        print("usage: python -m tests.aircraft.guidance_reference FOLDER", file=sys.stderr)
        return 2
    tables = 0
    missed = 0
    try:
        for name, worst in compared(Path(arguments[0])):
            tables += 1
            missed += shown(name, worst)
    except FormatError as error:
        print(error, file=sys.stderr)
        return 2
    if not tables:
        print(f"{arguments[0]}: no states, and no runs with tracks, of npfg or l1", file=sys.stderr)
        return 2
    print("all within" if not missed else f"{missed} beyond what is allowed")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
