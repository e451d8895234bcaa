"""Replays what the original npfg and L1 gave: `python -m tests.aircraft.guidance_reference FOLDER`.

FOLDER has states, or closed-loop runs and their tracks, in the format of shared/guidance/README.md: any of its files,
with any rows. Prints of every column the largest |x - ref| / (1 + |ref|), of places on tracks |x - ref| in m. Exits
with 1 if one is above `TOLERANCE`, with 2 if there is nothing to compare. Columns of single precision, and those of
steps that the laws here do not have, are not compared.
"""

import cmath
import math
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pyarrow.parquet as pq

from aircraft.guidance import l1, npfg
from aircraft.interface import GRAVITY_MPS2

Row = dict[str, Any]
"""Column names and values: numbers, but for the kind of a run."""

TOLERANCE: Final = 1e-6
STEP_S: Final = 0.05  # of the closed loop
ROLL_LIMIT_RAD: Final = math.radians(35.0)  # of the closed loop


def vector(row: Row, name: str) -> complex:
    return complex(row[f"{name}_e"], row[f"{name}_n"])


def npfg_columns(row: Row) -> Row:
    given: Any = (*(vector(row, name) for name in ("pos", "vg", "w", "path", "t")), row["kappa"])
    switches = [bool(row[f"p_en_{k}"]) for k in ("period_lb", "period_ub", "min_gsp", "track_keep", "wind_reg")]
    others = (row[f"p_{k}"] for k in ("min_gsp", "gsp_max_tk", "roll_tc", "sw_mult", "period_sf"))
    has, at = npfg.NpfgConfig(row["p_period"], row["p_damping"], *switches, *others), npfg.NpfgInput(*given)
    air, error = at.velocity - at.wind, npfg.cross(at.place - at.path, at.tangent)
    on_track = npfg.feasibility(abs(air), at.wind, at.tangent)
    period = npfg.adapted_period(at, has, abs(error), abs(air), on_track)
    bound = npfg.track_error_bound(abs(at.velocity), period * has.damping)
    look_ahead = npfg.look_ahead_angle(min(abs(error) / bound, 1.0))
    names = "lat_acc airspeed_ref track_err feas_on_track adapted_period track_err_bound look_ahead lat_acc_ff"
    ahead = npfg.curvature_feedforward(at, abs(air), error)
    decided = npfg.npfg(at, has, row["p_va_nom"], row["p_va_max"])
    return dict(zip(names.split(), (*decided, error, on_track, period, bound, look_ahead, ahead), strict=True))


def motion_of(row: Row) -> l1.L1Motion:
    return l1.L1Motion(vector(row, "pos"), vector(row, "vg"), row["yaw"], int(row["yaw_cd"]))


def leg_columns(row: Row) -> Row:
    """Columns of `l1_waypoint_states`; a least L1 distance is flown as the period that gives it."""
    at, leg = motion_of(row), (vector(row, "prev"), vector(row, "next"))
    before = l1.L1Memory(row["last_nu_in"], row["xtrack_i_in"], row["gain_prev_in"])
    scale = l1.ONE_OVER_PI * row["p_damping"] * l1.leg_velocity(at)[1]
    has = l1.L1Config(max(row["p_period"], row["dist_min"] / scale), row["p_damping"], row["p_xtrack_i"])
    acceleration, after = l1.follow_leg(at, leg, row["dt_us"] * 1e-6, before, has)
    found = {"lat_acc": acceleration, "xtrack_i_out": after.integrator_rad, "last_nu_out": after.last_nu_rad}
    left = npfg.cross(l1.leg_direction(at, *leg), at.place - leg[0])
    return found | {"crosstrack": left, "target_bearing_cd": l1.bearing_cd(leg[1] - at.place)}


def circle_columns(row: Row) -> Row:
    """Columns of `l1_loiter_states`, on a circle as large as that was flown."""
    at, centre, radius = motion_of(row), vector(row, "centre"), row["scaled_radius"]
    circle, has = (l1.L1Circle(centre, radius, row["direction"]), l1.L1Config(row["p_period"], row["p_damping"], 0.0))
    acceleration, after = l1.follow_circle(at, circle, l1.L1Memory(row["last_nu_in"]), has)
    found = {"lat_acc": acceleration, "last_nu_out": after.last_nu_rad, "crosstrack": abs(at.place - centre) - radius}
    return found | {"target_bearing_cd": l1.bearing_cd(centre - at.place)}


STATES: Final = {"npfg_states": npfg_columns, "l1_waypoint_states": leg_columns, "l1_loiter_states": circle_columns}


def flown(run: Row, ticks: int, of_npfg: bool) -> Iterator[Row]:
    """The rows of a run's track from its start: a point that rolls, turns and drifts, under npfg or L1."""
    place, yaw, roll, speed = complex(run["e0"], run["n0"]), run["psi0"], run["phi0"], run["V0"]
    wind, centre, radius, turn = vector(run, "w"), vector(run, "c"), run["radius"], run["dir"]
    segment, memory, last_s = int(run["kind"] == "circle"), l1.L1Memory(), 0.0
    legs = {s: 1j * cmath.exp(-1j * run[name]) for s, name in ((0, "course"), (2, "course2"))}
    for tick in range(ticks):
        for number in range(2) if run["kind"] == "lal" else ():
            beyond = npfg.dot(place - vector(run, f"p{number + 1}"), legs[2 * number])
            segment += segment == number and beyond >= 0.0
        velocity, airspeed = speed * 1j * cmath.exp(-1j * yaw) + wind, math.nan
        begin, ahead = vector(run, "p2" if segment == 2 else "a"), legs.get(segment, 0j)
        if of_npfg:
            path, tangent = begin + npfg.dot(place - begin, ahead) * ahead, ahead
            if segment == 1:
                out = (place - centre) / abs(place - centre)
                path, tangent = centre + radius * out, -1j * turn * out
            at = npfg.NpfgInput(place, velocity, wind, path, tangent, turn / radius if segment == 1 else 0.0)
            has = npfg.NpfgConfig(roll_time_constant_s=0.5)
            acceleration, airspeed = npfg.npfg(at, has, run["va_nom"], run["va_max"])
        else:
            wrapped, gain = math.remainder(yaw, math.tau), l1.L1Config(integrator_gain=run["xtrack_i"])
            motion = l1.L1Motion(place, velocity, wrapped, int(100.0 * math.degrees(wrapped)) % 36000)
            if segment == 1:
                circle = l1.L1Circle(centre, radius, turn)
                acceleration, memory = l1.follow_circle(motion, circle, memory, gain)
            else:
                ends, now_s = run["kind"] == "lal" and segment == 0, 10.0 + tick * STEP_S
                leg = begin, vector(run, "p1") if ends else begin + 1e4 * ahead
                acceleration, memory = l1.follow_leg(motion, leg, now_s - last_s, memory, gain)
                last_s = now_s
        yield {"n": place.imag, "e": place.real, "psi": yaw, "phi": roll, "V": speed, "lat_acc": acceleration}
        wanted = min(max(math.atan(acceleration / GRAVITY_MPS2), -ROLL_LIMIT_RAD), ROLL_LIMIT_RAD)
        rolled = wanted + (roll - wanted) * math.exp(-STEP_S / 0.5)
        turned = yaw + STEP_S * GRAVITY_MPS2 * math.tan(0.5 * (roll + rolled)) / speed
        place += STEP_S * (speed * 1j * cmath.exp(-0.5j * (yaw + turned)) + wind)
        yaw, roll = turned, rolled
        speed = airspeed + (speed - airspeed) * math.exp(-STEP_S / 3.0) if run["speed_loop"] else speed


def pairs(folder: Path, name: str, every: int) -> Iterator[tuple[Row, Row]]:
    """What the laws give, and the reference, of every so many rows, or runs, of a file."""
    rows = pq.read_table(folder / f"{name}.parquet").to_pylist()
    if name in STATES:
        yield from ((STATES[name](row), row) for row in rows[::every] if not row.get("ambiguous"))
        return
    for run in pq.read_table(folder / name.replace("tracks", "runs.parquet")).to_pylist()[::every]:
        of_run = [row for row in rows if row["run"] == run["run"]]
        found = [*flown(run, 1 + max((row["k"] for row in of_run), default=0), name == "npfg_tracks")]
        yield from ((found[row["k"]], row) for row in of_run)


def largest(folder: Path, name: str, every: int = 1) -> dict[str, float]:
    """The largest difference of every column of a file; what is cut to whole numbers may be off by one."""
    worst: dict[str, float] = defaultdict(float)
    for found, reference in pairs(folder, name, every):
        for column, value in found.items():
            off = max(abs(value - reference[column]) - column.endswith("_cd"), 0.0)
            off /= 1.0 if column in ("n", "e") else 1.0 + abs(reference[column])
            worst[column] = math.inf if math.isnan(value) else max(worst[column], off)
    return worst


def main(folder: Path) -> int:
    names = [each for each in (*STATES, "npfg_tracks", "l1_tracks") if (folder / f"{each}.parquet").is_file()]
    of = {name: largest(folder, name) for name in names}
    for name, worst in of.items():
        print(name, *(f"  {column:18} {off:.2e}" for column, off in worst.items()), sep="\n")
    far = sum(not off <= TOLERANCE for worst in of.values() for off in worst.values())
    print(f"{far} above {TOLERANCE}" if names else f"{folder}: has no states and no tracks of npfg or l1")
    return min(far, 1) if names else 2


if __name__ == "__main__":
    sys.exit(main(Path(*sys.argv[1:2])))
