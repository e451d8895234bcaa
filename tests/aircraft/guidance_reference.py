"""Replays reference data of the original npfg and L1: `python -m tests.aircraft.guidance_reference FOLDER`.

The folder has the format of shared/guidance (its README): states, closed-loop runs and their tracks. Prints, of every
column, the largest |x - ref| / (1 + |ref|) in every set, and exits with 1 where one is beyond its tolerance.
"""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

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
LAWS = ("npfg", "l1")
"""Those that have runs and tracks."""


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


def rows_of(path: Path) -> list[Row]:
    rows: list[Row] = pq.read_table(path).to_pylist()
    return rows


def of_states(path: Path, law: Callable[[Row], Row], every: int = 1) -> dict[tuple[str, int], Worst]:
    """The worst of every column that the file has, by name and set; of every row, or of some."""
    found: dict[tuple[str, int], list[tuple[float, float]]] = defaultdict(list)
    for row in rows_of(path)[::every]:
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
    runs = {int(run["run"]): run for run in rows_of(folder / f"{law}_runs.parquet")}
    by_run: dict[int, list[Row]] = defaultdict(list)
    for row in rows_of(folder / f"{law}_tracks.parquet"):
        by_run[int(row["run"])].append(row)
    for number, rows in list(by_run.items())[::every]:
        if number not in runs:
            print(f"{folder}: {law}_tracks has run {number}, {law}_runs has not: left out", file=sys.stderr)
            continue
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
        if all((folder / f"{kind}_{part}.parquet").is_file() for part in ("runs", "tracks")):
            yield f"{kind}_tracks", of_tracks(folder, kind, every)


def main(arguments: list[str]) -> int:
    """Compares a folder; 0 if all is within the tolerances, 1 if not, 2 if there is nothing to compare."""
    if len(arguments) != 1 or not Path(arguments[0]).is_dir():
        print("usage: python -m tests.aircraft.guidance_reference FOLDER", file=sys.stderr)
        return 2
    tables = 0
    missed = 0
    for name, worst in compared(Path(arguments[0])):
        tables += 1
        print(f"{name}\n  {'column':24} {'set':>3} {'rows':>6} {'largest':>9} {'allowed':>8}")
        for (column, number), one in sorted(worst.items(), key=lambda item: (item[0][1], item[0][0])):
            missed += not one.kept
            print(
                f"  {column:24} {number:3} {one.rows:6} {one.difference:9.2e} {one.tolerance:8.0e}"
                f"{'' if one.kept else '  BEYOND'}"
            )
    if not tables:
        print(f"{arguments[0]}: no states, and no runs with tracks, of npfg or l1", file=sys.stderr)
        return 2
    print("all within" if not missed else f"{missed} beyond what is allowed")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
