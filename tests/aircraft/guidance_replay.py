"""The closed loop of the reference data (shared/guidance/README.md): a point that rolls, turns and drifts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from aircraft.guidance.l1 import (
    L1Circle,
    L1Config,
    L1Leg,
    L1Memory,
    L1Motion,
    L1Parameters,
    follow_circle,
    follow_leg,
)
from aircraft.guidance.npfg import NpfgConfig, NpfgInput, npfg

Row = dict[str, Any]
"""Column names and values: numbers, but for the kind of a run."""

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
        acceleration, error, airspeed = guidance.decide(place, tick)
        row = {"n": north, "e": east, "psi": yaw, "phi": roll, "V": speed, "seg": float(segment)}
        yield {**row, "lat_acc": acceleration, "track_err": error, "airspeed_ref": airspeed}
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
        self.has = NpfgConfig(roll_time_constant_s=0.5).parameters(
            run["va_nom"], run["va_max"], ROLL_LIMIT_RAD
        )

    def decide(self, at: Place, tick: int) -> tuple[float, float, float]:
        """Lateral acceleration, track error, airspeed reference."""
        run = self.run
        path = around(run, at) if at.segment == 1 else beside(run, at)
        output = npfg(
            NpfgInput(*at[:2], *at[3:5], run["w_e"], run["w_n"], *path),
            self.has,
        )
        return output.lateral_acceleration_mps2, output.track_error_m, output.airspeed_mps


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
        config = L1Config()
        self.has = L1Parameters(config.period_s, config.damping, run["xtrack_i"], 0.0, 0.0)
        self.memory = L1Memory()
        self.last_leg_s = 0.0

    def decide(self, at: Place, tick: int) -> tuple[float, float, float]:
        """Lateral acceleration, cross-track error, and no airspeed reference."""
        run = self.run
        yaw_cd = int(100.0 * math.degrees(at.yaw_rad))
        motion = L1Motion(*at[:2], *at[3:5], at.yaw_rad, yaw_cd + 36000 if yaw_cd < 0 else yaw_cd, 1.0)
        if at.segment == 1:
            circle = L1Circle(run["c_e"], run["c_n"], run["radius"], run["dir"])
            output, self.memory = follow_circle(motion, circle, self.memory, self.has)
        else:
            now_s = FIRST_CALL_S + tick * STEP_S
            output, self.memory = follow_leg(
                motion, self.leg(at.segment), now_s - self.last_leg_s, self.memory, self.has
            )
            self.last_leg_s = now_s
        return output.lateral_acceleration_mps2, output.crosstrack_m, math.nan

    def leg(self, segment: int) -> L1Leg:
        run = self.run
        point, course = ("p2", "course2") if segment == 2 else ("a", "course")
        east, north = run[f"{point}_e"], run[f"{point}_n"]
        if run["kind"] == "lal" and segment == 0:
            return L1Leg(east, north, run["p1_e"], run["p1_n"], 0.0)
        to_east = east + LONG_LEG_M * math.sin(run[course])
        return L1Leg(east, north, to_east, north + LONG_LEG_M * math.cos(run[course]), 0.0)


def wrapped(angle_rad: float) -> float:
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))
