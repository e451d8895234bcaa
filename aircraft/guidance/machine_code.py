"""Machine code of the laws: where on the route, what the law says there, what roll may do, in one call an update.

The laws themselves are the plain functions of their own files; numba compiles them as they are. What was compiled is
kept on disk, by the file and the free variables of the compiled function: the stamp is one of these, so that a change
of any of the files compiles anew. Importing this module takes half a second.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from hashlib import sha256
from inspect import getsource
from types import FunctionType, ModuleType
from typing import Any, TypeAlias

import numpy as np
from numba.extending import register_jitable

from aircraft import kernels
from aircraft.guidance import l1, npfg, pure_pursuit, vector_field
from aircraft.guidance.l1 import L1Circle, L1Leg, L1Memory, L1Motion, follow_circle, follow_leg
from aircraft.guidance.npfg import NpfgInput
from aircraft.guidance.npfg import npfg as npfg_law
from aircraft.guidance.pure_pursuit import look_ahead_distance
from aircraft.guidance.pure_pursuit import pure_pursuit as pursuit_law
from aircraft.guidance.vector_field import Motion, follow_line, follow_orbit
from aircraft.interface import GRAVITY_MPS2, FloatArray
from aircraft.kernels import CURVATURE, LENGTH, START, compiled, nearest_on_route

FLIGHT = np.dtype(
    [
        ("row", np.intp),  # of the route, and the distance along it: the nearest point of the last update
        ("along_m", np.float64),
        ("roll_rad", np.float64),  # the last command
        ("bank_limit_rad", np.float64),
        ("roll_step_rad", np.float64),  # largest change of the roll command from one update to the next
    ]
)
FAR_M = 1e4
"""A leg without an end goes on this far beyond the aircraft."""
GOAL_STEPS = 16
"""Most steps towards the goal point of pure pursuit."""
GOAL_REACH = 2.0
"""It is at most this many look-ahead distances along the route away."""

Output: TypeAlias = tuple[float, float, float, bool, bool, float]
"""What `GuidanceOutput` consists of."""


def _plain_functions(module: ModuleType) -> None:
    """Lets compiled functions call the functions of a law's file."""
    for function in vars(module).values():
        if isinstance(function, FunctionType) and function.__module__ == module.__name__:
            register_jitable(error_model="numpy")(function)


LAWS = (npfg, l1, vector_field, pure_pursuit)
for _law in LAWS:
    _plain_functions(_law)
STAMP = sha256("".join(getsource(module) for module in (kernels, *LAWS)).encode()).hexdigest()


@compiled
def _centre(rows: FloatArray, row: int) -> tuple[float, float]:
    """East and north of the centre of an arc: 1/curvature to the left of its start."""
    radius = 1.0 / rows[row, CURVATURE]
    return rows[row, 0] - radius * rows[row, 3], rows[row, 1] + radius * rows[row, 2]


@compiled
def _output(
    rows: FloatArray,
    flight: Any,
    row: int,
    along_m: float,
    cross_track_m: float,
    roll_rad: float,
    airspeed_mps: float,
) -> Output:
    """The roll that a law wants, within its limits; the place on the route and the command are kept."""
    kept = flight[0]
    limit, most = kept.bank_limit_rad, kept.roll_step_rad
    allowed = min(max(roll_rad, -limit), limit)
    command = kept.roll_rad + min(max(allowed - kept.roll_rad, -most), most)
    kept.row, kept.along_m, kept.roll_rad = row, along_m, command
    past_end = rows[row, LENGTH] == math.inf and along_m > 0.0
    return command, cross_track_m, rows[row, START] + along_m, allowed != roll_rad, past_end, airspeed_mps


def _npfg(stamp: str) -> Callable[..., Output]:
    def npfg_update(
        rows: FloatArray,
        parameters: Any,
        flight: Any,
        memory: Any,
        time_s: float,
        east_m: float,
        north_m: float,
        velocity_east_mps: float,
        velocity_north_mps: float,
        heading_rad: float,
        airspeed_mps: float,
    ) -> Output:
        assert stamp
        row, along_m, cross, tangent_east, tangent_north = nearest_on_route(
            rows, flight[0].row, flight[0].along_m, east_m, north_m
        )
        at = NpfgInput(
            east_m,
            north_m,
            velocity_east_mps,
            velocity_north_mps,
            velocity_east_mps - airspeed_mps * math.sin(heading_rad),
            velocity_north_mps - airspeed_mps * math.cos(heading_rad),
            east_m - cross * tangent_north,
            north_m + cross * tangent_east,
            tangent_east,
            tangent_north,
            -rows[row, CURVATURE],
        )
        wanted = npfg_law(at, parameters[0])
        roll = math.atan(wanted.lateral_acceleration_mps2 / GRAVITY_MPS2)
        return _output(rows, flight, row, along_m, cross, roll, wanted.airspeed_mps)

    return compiled(npfg_update)


def _l1(stamp: str) -> Callable[..., Output]:
    def l1_update(
        rows: FloatArray,
        parameters: Any,
        flight: Any,
        memory: Any,
        time_s: float,
        east_m: float,
        north_m: float,
        velocity_east_mps: float,
        velocity_north_mps: float,
        heading_rad: float,
        airspeed_mps: float,
    ) -> Output:
        assert stamp
        row, along_m, cross, _, _ = nearest_on_route(rows, flight[0].row, flight[0].along_m, east_m, north_m)
        kept = memory[0]
        before = L1Memory(kept.last_nu_rad, kept.integrator_rad, kept.last_gain)
        yaw = (heading_rad + math.pi) % (2.0 * math.pi) - math.pi
        at = L1Motion(
            east_m,
            north_m,
            velocity_east_mps,
            velocity_north_mps,
            yaw,
            int(100.0 * math.degrees(yaw)) % 36000,
            1.0,  # an arc is planned for the true airspeed: it does not grow with altitude
        )
        bend = rows[row, CURVATURE]
        if bend == 0.0:
            length = rows[row, LENGTH] if rows[row, LENGTH] < math.inf else along_m + FAR_M
            from_east, from_north = rows[row, 0], rows[row, 1]
            leg = L1Leg(
                from_east,
                from_north,
                from_east + length * rows[row, 2],
                from_north + length * rows[row, 3],
                0.0,
            )
            wanted, after = follow_leg(at, leg, time_s - kept.leg_time_s, before, parameters[0])
            kept.leg_time_s = time_s
        else:
            east, north = _centre(rows, row)
            circle = L1Circle(east, north, abs(1.0 / bend), -math.copysign(1.0, bend))
            wanted, after = follow_circle(at, circle, before, parameters[0])
        kept.last_nu_rad, kept.integrator_rad, kept.last_gain = after
        roll = math.atan(wanted.lateral_acceleration_mps2 / GRAVITY_MPS2)
        return _output(rows, flight, row, along_m, cross, roll, math.nan)

    return compiled(l1_update)


def _vector_field(stamp: str) -> Callable[..., Output]:
    def vector_field_update(
        rows: FloatArray,
        parameters: Any,
        flight: Any,
        memory: Any,
        time_s: float,
        east_m: float,
        north_m: float,
        velocity_east_mps: float,
        velocity_north_mps: float,
        heading_rad: float,
        airspeed_mps: float,
    ) -> Output:
        assert stamp
        row, along_m, cross, _, _ = nearest_on_route(rows, flight[0].row, flight[0].along_m, east_m, north_m)
        has, integral = parameters[0], memory[0].integral_rad
        at = Motion(east_m, north_m, velocity_east_mps, velocity_north_mps, heading_rad)
        bend = rows[row, CURVATURE]
        if bend == 0.0:
            wanted = follow_line(at, rows[row, 0], rows[row, 1], rows[row, 2], rows[row, 3], integral, has)
        else:
            east, north = _centre(rows, row)
            direction = -math.copysign(1.0, bend)
            wanted = follow_orbit(at, east, north, abs(1.0 / bend), direction, integral, has)
        memory[0].integral_rad = wanted.integral_rad
        return _output(rows, flight, row, along_m, cross, wanted.roll_rad, math.nan)

    return compiled(vector_field_update)


@compiled
def _point(rows: FloatArray, row: int, along_m: float) -> tuple[float, float]:
    """East and north of a point of the route (m), so far along one of its rows."""
    half = 0.5 * rows[row, CURVATURE] * along_m
    sine, cosine = math.sin(half), math.cos(half)
    chord = along_m * (sine / half if abs(half) > 1e-9 else 1.0)
    east = rows[row, 0] + chord * (rows[row, 2] * cosine - rows[row, 3] * sine)
    return east, rows[row, 1] + chord * (rows[row, 2] * sine + rows[row, 3] * cosine)


@compiled
def _goal(
    rows: FloatArray, row: int, along_m: float, east_m: float, north_m: float, ahead_m: float
) -> tuple[float, float]:
    """The way, east and north (m), to the first point from the nearest one on that is the look-ahead distance away.

    To go on along the route by what is missing of that distance never oversteps the point.
    """
    gone = 0.0
    east, north = _point(rows, row, along_m)
    for _ in range(GOAL_STEPS):
        missing = ahead_m - math.sqrt((east - east_m) ** 2 + (north - north_m) ** 2)
        if missing <= 1e-3 * ahead_m or gone > GOAL_REACH * ahead_m:
            break
        gone, along_m = gone + missing, along_m + missing
        while along_m > rows[row, LENGTH] and row < len(rows) - 1:
            along_m, row = along_m - rows[row, LENGTH], row + 1
        east, north = _point(rows, row, along_m)
    return east - east_m, north - north_m


def _pure_pursuit(stamp: str) -> Callable[..., Output]:
    def pure_pursuit_update(
        rows: FloatArray,
        parameters: Any,
        flight: Any,
        memory: Any,
        time_s: float,
        east_m: float,
        north_m: float,
        velocity_east_mps: float,
        velocity_north_mps: float,
        heading_rad: float,
        airspeed_mps: float,
    ) -> Output:
        assert stamp
        row, along_m, cross, _, _ = nearest_on_route(rows, flight[0].row, flight[0].along_m, east_m, north_m)
        ahead = look_ahead_distance(velocity_east_mps, velocity_north_mps, parameters[0])
        to_east, to_north = _goal(rows, row, along_m, east_m, north_m, ahead)
        wanted = pursuit_law(to_east, to_north, velocity_east_mps, velocity_north_mps, heading_rad, ahead)
        return _output(rows, flight, row, along_m, cross, wanted.roll_rad, math.nan)

    return compiled(pure_pursuit_update)


UPDATES: dict[str, Callable[..., Output]] = {
    "npfg": _npfg(STAMP),
    "l1": _l1(STAMP),
    "vector_field": _vector_field(STAMP),
    "pure_pursuit": _pure_pursuit(STAMP),
}
"""A law's update, by its kind.

Args: rows (n, 9) of the route, records of the law's parameters, of `FLIGHT` and of the law's memory; time (s), position
(m), ground velocity (m/s), heading (rad), true airspeed (m/s).
"""
