"""Compiled arithmetic of every update, as plain functions of numbers and arrays.

numba compiles a function at its first call and keeps the result on disk. Importing this module takes half a second, so
it is imported inside the functions that need it. Fast mathematics is off: the same numbers give the same results.

A route is given as rows, see `aircraft.guidance.progress.route_rows`. A record is an array of one element with named
fields, so that a function can change it. The frame is the local ENU plane; headings are clockwise from north.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np

from aircraft.interface import GRAVITY_MPS2, FloatArray

INTERCEPT_SINE = 0.7  # sine of the steepest angle at which the law `preview` approaches the path from far off
CURVATURE, LENGTH, START, STOP, TURNED = 4, 5, 6, 7, 8  # columns of a route's rows
SMOOTH_RAD = 1e-6
"""Rows of a route join smoothly at a lesser angle: the distance from them then differs by less than 1e-12 of it."""
PREVIEW_GAINS = np.dtype(  # what the law `preview` is configured by
    [
        ("bandwidth_radps", np.float64),
        ("damping", np.float64),
        ("bank_limit_rad", np.float64),
        ("roll_step_rad", np.float64),  # largest change of the roll reference from one update to the next
        ("roll_lag_updates", np.float64),  # time constant of roll, in update intervals
        ("delay_s", np.float64),  # from a command to when roll begins to follow it
        ("turn_rate_share", np.float64),  # turn rate of the aircraft over that of a coordinated turn
        ("blend_s", np.float64),  # a step of curvature is averaged over this time
        ("turning_mps2", np.float64),  # acceleration across the path that is there to end the approach to it
        ("rolling_mps3", np.float64),  # and the rate at which roll can change it
    ]
)
PREVIEW_MEMORY = np.dtype([("row", np.intp), ("along_m", np.float64), ("roll_reference_rad", np.float64)])
"""Place of the nearest point (row of the route, distance along it) and the roll that the law has asked for."""
P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Has numba compile a function at its first call, for the types it is called with; division by zero gives inf."""
    return numba.njit(cache=True, error_model="numpy")(function)


def for_types_of(function: Any, *arguments: Any) -> Any:
    """Compiles a function for the types of these arguments and returns the machine code, to be called many times.

    numba looks at the types at every call of the function, which takes as long as the arithmetic. The code does not:
    it must get arrays of the same layout.
    """
    return _machine_code(function, tuple(map(numba.typeof, arguments)))


@functools.cache
def _machine_code(function: Any, types: tuple[Any, ...]) -> Any:
    return function.compile(types)


@compiled
def place_in_patch(patch: FloatArray, latitude_rad: float, longitude_rad: float) -> tuple[float, float, float]:
    """East and north (m) and meridian convergence (rad) of a point; NaN where the patch does not reach."""
    up, right = latitude_rad - patch[0], longitude_rad - patch[1]
    if not (abs(up) <= patch[2] and abs(right) <= patch[3]):
        return math.nan, math.nan, math.nan
    convergence = patch[16] + up * patch[17] + right * patch[18]
    return _second_order(patch[4:10], up, right), _second_order(patch[10:16], up, right), convergence


@compiled
def _second_order(terms: FloatArray, up: float, right: float) -> float:
    """Value of a polynomial of second order: its middle value, two slopes and half of three second derivatives."""
    return float(terms[0] + up * (terms[1] + up * terms[3] + right * terms[4]) + right * (terms[2] + right * terms[5]))


@compiled
def preview_update(
    rows: FloatArray,
    gains: Any,
    memory: Any,
    place_m: tuple[float, float],
    velocity_mps: tuple[float, float],
    heading_rad: float,
    airspeed_mps: float,
) -> tuple[float, float, float, bool, bool]:
    """The law of `aircraft.guidance.preview`, from one update to the next: what `GuidanceOutput` consists of."""
    (east_m, north_m), (velocity_east_mps, velocity_north_mps) = place_m, velocity_mps
    has, state = gains[0], memory[0]
    row, along_m, cross, tangent_east, tangent_north, off = nearest_on_route(
        rows, state.row, state.along_m, east_m, north_m
    )
    arc_length = rows[row, START] + along_m
    speed = max(math.sqrt(velocity_east_mps * velocity_east_mps + velocity_north_mps * velocity_north_mps), 1.0)
    along_mps = velocity_east_mps * tangent_east + velocity_north_mps * tangent_north
    cross_mps = velocity_east_mps * tangent_north - velocity_north_mps * tangent_east
    heading_east, heading_north = math.sin(heading_rad), math.cos(heading_rad)
    ahead_mps = velocity_east_mps * heading_east + velocity_north_mps * heading_north
    pull_per_s = has.bandwidth_radps / (2.0 * has.damping)
    # The wind, the ground velocity less the air velocity, is not weaker than the airspeed.
    if speed * speed >= 2.0 * airspeed_mps * ahead_mps:
        # Left of the path by this sine, as far as it can be made good.
        left = INTERCEPT_SINE * _clamp(1.0, cross * pull_per_s / airspeed_mps)
        ahead = math.sqrt(1.0 - left * left)
        to_east, to_north = air_direction(
            velocity_east_mps - airspeed_mps * heading_east,
            velocity_north_mps - airspeed_mps * heading_north,
            airspeed_mps,
            ahead * tangent_east - left * tangent_north,
            ahead * tangent_north + left * tangent_east,
        )
        turn = math.atan2(
            to_east * heading_north - to_north * heading_east,
            to_east * heading_east + to_north * heading_north,
        )
        wanted = math.atan(airspeed_mps * has.bandwidth_radps * turn / GRAVITY_MPS2)
    elif along_mps <= 0.0:
        wanted = -has.bank_limit_rad if cross_mps > 0.0 else has.bank_limit_rad
    else:
        pull = _clamp(INTERCEPT_SINE * speed, _eased(pull_per_s, has.turning_mps2, cross))
        # Lift acts across the course, the correction across the path.
        damped = -_eased(2.0 * has.damping * has.bandwidth_radps, has.rolling_mps3, cross_mps + pull)
        across = damped * speed / max(along_mps, 0.3 * speed)
        curvature = _mean_curvature(rows, row, arc_length + speed * has.delay_s, speed * has.blend_s)
        acceleration = across - curvature * (speed * speed)
        wanted = math.atan(acceleration / (GRAVITY_MPS2 * has.turn_rate_share * max(ahead_mps / speed, 0.2)))
    allowed = _clamp(has.bank_limit_rad, wanted)
    step = _clamp(has.roll_step_rad, allowed - state.roll_reference_rad)
    roll = state.roll_reference_rad + step
    # Ahead by what roll lags behind its command: roll then moves at the reference's rate.
    command = _clamp(has.bank_limit_rad, roll + has.roll_lag_updates * step)
    state.row, state.along_m, state.roll_reference_rad = row, along_m, roll
    return command, off, arc_length, allowed != wanted, rows[row, LENGTH] == math.inf and along_m > 0.0


@compiled
def _mean_curvature(rows: FloatArray, row: int, arc_length_m: float, blend_m: float) -> float:
    """Curvature averaged over a length of the route about an arc length near a row, 1/m, positive to the left."""
    low = arc_length_m - 0.5 * blend_m
    if rows[row, START] <= low and low + blend_m <= rows[row, STOP]:
        return float(rows[row, CURVATURE])
    return (_turned_rad(rows, row, low + blend_m) - _turned_rad(rows, row, low)) / blend_m


@compiled
def nearest_on_route(
    rows: FloatArray, row: int, along_m: float, east_m: float, north_m: float
) -> tuple[int, float, float, float, float, float]:
    """The nearest point of a route from the last one onwards.

    Returns:
        Row and distance along it, cross-track error (m, positive to the right), unit tangent east and north, and the
        distance from the route with the error's sign, which is more where the nearest point is a corner.
    """
    while True:
        along, cross, tangent_east, tangent_north = _project(rows, row, along_m, east_m, north_m)
        if along <= rows[row, LENGTH] or row == len(rows) - 1:
            off = cross if along >= 0.0 or row == 0 else _off_corner(rows, row, cross, east_m, north_m)
            return row, max(along, 0.0), cross, tangent_east, tangent_north, off
        row, along_m = row + 1, 0.0


@compiled
def _project(
    rows: FloatArray, row: int, along_m: float, east_m: float, north_m: float
) -> tuple[float, float, float, float]:
    """Distance along and to the right of a row carried on at both ends, and unit tangent; it was last at `along_m`."""
    east = east_m - rows[row, 0]
    north = north_m - rows[row, 1]
    tangent_east, tangent_north, curvature = rows[row, 2], rows[row, 3], rows[row, CURVATURE]
    if curvature == 0.0:
        along = east * tangent_east + north * tangent_north
        return along, east * tangent_north - north * tangent_east, tangent_east, tangent_north
    # The centre lies 1/curvature to the left of the start; angles are counted along the flight.
    radius = 1.0 / curvature
    east, north = east + radius * tangent_north, north - radius * tangent_east
    outward_east, outward_north = tangent_north * radius, -tangent_east * radius
    angle = math.atan2(outward_east * north - outward_north * east, outward_east * east + outward_north * north)
    # Within half a turn of the last one.
    expected = along_m * curvature
    since = np.fmod(angle - expected, math.tau)
    if abs(since) > math.pi:
        since -= math.copysign(math.tau, since)
    angle = expected + since
    away = math.sqrt(east * east + north * north)
    cross = away - radius if radius > 0.0 else -radius - away
    along = angle * radius
    sine, cosine = math.sin(angle), math.cos(angle)
    turned_east = tangent_east * cosine - tangent_north * sine
    return along, cross, turned_east, tangent_east * sine + tangent_north * cosine


@compiled
def _off_corner(rows: FloatArray, row: int, cross: float, east_m: float, north_m: float) -> float:
    """Distance to the right of a route at a place before the start of a row: of the corner there, or of rows before.

    Where the rows before join smoothly, it is the cross-track error.
    """
    turned = rows[row, TURNED] - rows[row - 1, TURNED]
    sine, cosine = math.sin(turned), math.cos(turned)
    end_east = rows[row - 1, 2] * cosine - rows[row - 1, 3] * sine
    end_north = rows[row - 1, 2] * sine + rows[row - 1, 3] * cosine
    if math.hypot(end_east - rows[row, 2], end_north - rows[row, 3]) < SMOOTH_RAD:
        return cross
    east, north = east_m - rows[row, 0], north_m - rows[row, 1]
    right = east * (end_north + rows[row, 3]) - north * (end_east + rows[row, 2])
    off = math.copysign(math.hypot(east, north), right)
    while row > 0:
        row -= 1
        along, beside, _, _ = _project(rows, row, rows[row, LENGTH], east_m, north_m)
        if along >= 0.0 or row == 0:
            return beside if along <= rows[row, LENGTH] and abs(beside) < abs(off) else off
        away = math.hypot(east_m - rows[row, 0], north_m - rows[row, 1])
        off = math.copysign(away, beside) if away < abs(off) else off
    return off


@compiled
def _turned_rad(rows: FloatArray, row: int, arc_length_m: float) -> float:
    """Direction change of the route from its start to an arc length near a row, rad, positive to the left."""
    while row > 0 and arc_length_m < rows[row, START]:
        row -= 1
    while arc_length_m >= rows[row, STOP]:
        row += 1
    turned: float = rows[row, TURNED] + rows[row, CURVATURE] * (arc_length_m - rows[row, START])
    return turned


@compiled
def _clamp(limit: float, value: float) -> float:
    return value if -limit <= value <= limit else math.copysign(limit, value)


@compiled
def _eased(slope: float, most: float, off: float) -> float:
    """A rate that takes back what is off: slope * off near 0; far from it, one that falls by `most` a second."""
    if abs(off) * slope * slope <= most:
        return slope * off
    return math.copysign(math.sqrt(most * (2.0 * abs(off) - most / (slope * slope))), off)


@compiled
def air_direction(
    wind_east_mps: float,
    wind_north_mps: float,
    airspeed_mps: float,
    bearing_east: float,
    bearing_north: float,
) -> tuple[float, float]:
    """Returns the direction to head in a wind that is not weaker than the airspeed.

    If the bearing can be made good, the wind triangle. If not, along sqrt(W^2 - V^2) b - w, as PX4's npfg has it
    (`CourseToAirspeedRefMapper::infeasibleAirVelRef`): this is the wind triangle where feasibility ends, and
    straight into the wind where the bearing is against it. A unit vector.
    """
    along = wind_east_mps * bearing_east + wind_north_mps * bearing_north
    excess = wind_east_mps**2 + wind_north_mps**2 - airspeed_mps**2
    reach = along * along - excess  # of the ground velocity's quadratic: negative where no course is the bearing
    ground = along + math.sqrt(reach) if along > 0.0 and reach > 0.0 else math.sqrt(max(excess, 0.0))
    east = ground * bearing_east - wind_east_mps
    north = ground * bearing_north - wind_north_mps
    length = max(math.sqrt(east * east + north * north), 1e-9)
    return east / length, north / length
