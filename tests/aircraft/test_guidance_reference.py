"""npfg and L1 against what the original sources gave: single states, and tracks of a point that rolls and drifts.

The data (shared/guidance/README.md) are not part of wayproof.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow.parquet as pq
import pytest

from aircraft.guidance.l1 import L1Circle, L1Config, L1Memory, L1Motion, follow_circle, follow_leg
from aircraft.guidance.npfg import NpfgConfig, NpfgInput, npfg

Row = dict[str, Any]
"""Column names and values: numbers, but for the kind of a run."""

REFERENCE = Path(__file__).parents[2].parent / "shared" / "guidance"
TOLERANCE = 1e-6
"""Of a difference over 1 + |reference|; of positions in m."""
EVERY = 12
GRAVITY_MPS2 = 9.80665
STEP_S = 0.05
ROLL_LAG_S, SPEED_LAG_S = 0.5, 3.0
ROLL_LIMIT_RAD = math.radians(35.0)
LONG_LEG_M = 10000.0
FIRST_CALL_S = 10.0
"""Clock of the first call of L1; its last call was at 0."""


class Place(NamedTuple):
    """What the loop knows before guidance is asked."""

    east_m: float
    north_m: float
    yaw_rad: float
    """Wrapped."""
    velocity_east_mps: float
    velocity_north_mps: float
    segment: int


def replayed(law: str, run: Row, ticks: int) -> Iterator[Row]:
    """The rows of a track, from the start of the run."""
    guidance = Npfg(run) if law == "npfg" else L1(run)
    east, north, yaw, roll, speed = (run[name] for name in ("e0", "n0", "psi0", "phi0", "V0"))
    segment = 1 if run["kind"] == "circle" else 0
    for tick in range(ticks):
        velocity_east = speed * math.sin(yaw) + run["w_e"]
        velocity_north = speed * math.cos(yaw) + run["w_n"]
        segment = next_segment(run, segment, east, north)
        place = Place(east, north, wrapped(yaw), velocity_east, velocity_north, segment)
        acceleration, airspeed = guidance.decide(place, tick)
        row = {"n": north, "e": east, "psi": yaw, "phi": roll, "V": speed, "seg": float(segment)}
        yield {**row, "lat_acc": acceleration, "airspeed_ref": airspeed}
        command = max(-ROLL_LIMIT_RAD, min(math.atan(acceleration / GRAVITY_MPS2), ROLL_LIMIT_RAD))
        rolled = command + (roll - command) * math.exp(-STEP_S / ROLL_LAG_S)
        turned = yaw + STEP_S * GRAVITY_MPS2 * math.tan(0.5 * (roll + rolled)) / speed
        middle = 0.5 * (yaw + turned)
        north += STEP_S * (speed * math.cos(middle) + run["w_n"])
        east += STEP_S * (speed * math.sin(middle) + run["w_e"])
        yaw, roll = turned, rolled
        if run["speed_loop"]:
            speed = airspeed + (speed - airspeed) * math.exp(-STEP_S / SPEED_LAG_S)


def next_segment(run: Row, segment: int, east: float, north: float) -> int:
    """The segment of line, arc, line that is flown; other paths have one."""
    if run["kind"] != "lal":
        return segment
    for number, point, course in ((0, "p1", "course"), (1, "p2", "course2")):
        along = (north - run[f"{point}_n"]) * math.cos(run[course])
        along += (east - run[f"{point}_e"]) * math.sin(run[course])
        if segment == number and along >= 0.0:
            segment = number + 1
    return segment


class Npfg:
    """npfg on a line, a circle, or line, arc, line."""

    def __init__(self, run: Row) -> None:
        self.run = run

    def decide(self, at: Place, tick: int) -> tuple[float, float]:
        """Lateral acceleration and airspeed reference."""
        run = self.run
        path = around(run, at) if at.segment == 1 else beside(run, at)
        given = npfg_input(*at[:2], *at[3:5], run["w_e"], run["w_n"], *path)
        return npfg(given, NpfgConfig(roll_time_constant_s=0.5), run["va_nom"], run["va_max"])


def npfg_input(*values: float) -> NpfgInput:
    """From east and north of five vectors, and the curvature."""
    every: Any = (*map(complex, values[:10:2], values[1:10:2]), values[10])
    return NpfgInput(*every)


def around(run: Row, at: Place) -> tuple[float, ...]:
    """East and north of the nearest point of the circle, its tangent, its curvature."""
    east, north = at.east_m - run["c_e"], at.north_m - run["c_n"]
    away = math.hypot(east, north)
    east, north = (east / away, north / away) if away > 0.0 else (0.0, 1.0)
    radius, turn = run["radius"], run["dir"]
    return run["c_e"] + radius * east, run["c_n"] + radius * north, turn * north, -turn * east, turn / radius


def beside(run: Row, at: Place) -> tuple[float, ...]:
    """East and north of the nearest point of the line, its tangent, its curvature."""
    point, course = ("p2", "course2") if at.segment == 2 else ("a", "course")
    from_east, from_north, angle = run[f"{point}_e"], run[f"{point}_n"], run[course]
    east, north = math.sin(angle), math.cos(angle)
    along = (at.east_m - from_east) * east + (at.north_m - from_north) * north
    return from_east + along * east, from_north + along * north, east, north, 0.0


class L1:
    """L1 on a leg, a circle, or leg, circle, leg."""

    def __init__(self, run: Row) -> None:
        self.run = run
        self.has = L1Config(integrator_gain=run["xtrack_i"])
        self.memory = L1Memory()
        self.last_leg_s = 0.0

    def decide(self, at: Place, tick: int) -> tuple[float, float]:
        """Lateral acceleration, and no airspeed reference."""
        run = self.run
        yaw_cd = int(100.0 * math.degrees(at.yaw_rad))
        place, velocity = complex(*at[:2]), complex(*at[3:5])
        motion = L1Motion(place, velocity, at.yaw_rad, yaw_cd + 36000 if yaw_cd < 0 else yaw_cd)
        if at.segment == 1:
            circle = L1Circle(complex(run["c_e"], run["c_n"]), run["radius"], run["dir"])
            acceleration, self.memory = follow_circle(motion, circle, self.memory, self.has)
        else:
            now_s = FIRST_CALL_S + tick * STEP_S
            acceleration, self.memory = follow_leg(
                motion, self.leg(at.segment), now_s - self.last_leg_s, self.memory, self.has
            )
            self.last_leg_s = now_s
        return acceleration, math.nan

    def leg(self, segment: int) -> tuple[complex, complex]:
        run = self.run
        point, course = ("p2", "course2") if segment == 2 else ("a", "course")
        begin = complex(run[f"{point}_e"], run[f"{point}_n"])
        if run["kind"] == "lal" and segment == 0:
            return begin, complex(run["p1_e"], run["p1_n"])
        return begin, begin + LONG_LEG_M * complex(math.sin(run[course]), math.cos(run[course]))


def wrapped(angle_rad: float) -> float:
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))


def npfg_columns(row: Row) -> Row:
    """What the law gives for a row of `npfg_states`."""
    at = "pos_e pos_n vg_e vg_n w_e w_n path_e path_n t_e t_n kappa"
    keys = "p_period p_damping p_min_gsp p_gsp_max_tk p_roll_tc p_sw_mult p_period_sf"
    has = NpfgConfig(*(row[key] for key in keys.split()))
    output = npfg(npfg_input(*(row[name] for name in at.split())), has, row["p_va_nom"], row["p_va_max"])
    return dict(zip(("lat_acc", "airspeed_ref"), output, strict=True))


def motion_of(row: Row) -> L1Motion:
    place, velocity = complex(row["pos_e"], row["pos_n"]), complex(row["vg_e"], row["vg_n"])
    return L1Motion(place, velocity, row["yaw"], int(row["yaw_cd"]))


def leg_columns(row: Row) -> Row:
    """What the law gives for a row of `l1_waypoint_states`."""
    begin, end = (complex(row[f"{name}_e"], row[f"{name}_n"]) for name in ("prev", "next"))
    before = L1Memory(*(row[name] for name in ["last_nu_in", "xtrack_i_in", "gain_prev_in"]))
    has = L1Config(row["p_period"], row["p_damping"], row["p_xtrack_i"])
    output, memory = follow_leg(motion_of(row), (begin, end), row["dt_us"] * 1e-6, before, has)
    return {"lat_acc": output, "xtrack_i_out": memory.integrator_rad, "last_nu_out": memory.last_nu_rad}


def circle_columns(row: Row) -> Row:
    """What the law gives for a row of `l1_loiter_states`, on a circle as large as that was flown."""
    circle = L1Circle(complex(row["centre_e"], row["centre_n"]), row["scaled_radius"], row["direction"])
    has = L1Config(row["p_period"], row["p_damping"], 0.0)
    output, memory = follow_circle(motion_of(row), circle, L1Memory(row["last_nu_in"]), has)
    return {"lat_acc": output, "last_nu_out": memory.last_nu_rad}


STATES: dict[str, Callable[[Row], Row]] = {
    "npfg_states": npfg_columns,
    "l1_waypoint_states": leg_columns,
    "l1_loiter_states": circle_columns,
}


def off(name: str, found: float, reference: float) -> float:
    """How far a number is from its reference, relative to 1 + |reference|; the reference may be NaN, too."""
    if found == reference or (math.isnan(found) and math.isnan(reference)):
        return 0.0
    away = abs(found - reference)
    if name == "psi":
        away = min(away, abs(away - math.tau))
    return away / (1.0 + abs(reference))


needs_reference = pytest.mark.skipif(not REFERENCE.is_dir(), reason="no shared/guidance beside the checkout")


@needs_reference
@pytest.mark.parametrize("name", STATES)
def test_laws_decide_as_the_original_sources_do(name: str) -> None:
    """With the switches on that PX4 has on by default, and without a least L1 distance, as plain missions."""
    worst: dict[str, float] = defaultdict(float)
    for row in pq.read_table(REFERENCE / f"{name}.parquet").to_pylist()[::EVERY]:
        switches = [on for key, on in row.items() if key.startswith("p_en_")]
        if row.get("ambiguous") or row.get("dist_min") or not all(switches):
            continue
        for column, value in STATES[name](row).items():
            worst[column] = max(worst[column], off(column, value, row[column]))
    assert len(worst) >= 2
    assert {column: far for column, far in worst.items() if not far <= TOLERANCE} == {}


@needs_reference
@pytest.mark.parametrize("law", ["npfg", "l1"])
def test_laws_fly_as_the_original_sources_do(law: str) -> None:
    runs = {int(run["run"]): run for run in pq.read_table(REFERENCE / f"{law}_runs.parquet").to_pylist()}
    by_run: dict[int, list[Row]] = defaultdict(list)
    for row in pq.read_table(REFERENCE / f"{law}_tracks.parquet").to_pylist():
        by_run[int(row["run"])].append(row)
    for number, rows in list(by_run.items())[::EVERY]:
        flown = list(replayed(law, runs[number], 1 + max(int(row["k"]) for row in rows)))
        for row in rows:
            for name, value in flown[int(row["k"])].items():
                if name in ("n", "e"):
                    assert abs(value - row[name]) <= TOLERANCE, (number, row["k"], name)
                elif name in row:
                    assert off(name, value, row[name]) <= TOLERANCE, (number, row["k"], name)
