"""The law of route following: from where the aircraft is to the roll angle it should hold; and all of an update.

The law is path curvature plus a second-order correction of the cross-track error,

    a = kappa Vg^2 - 2 zeta omega e_dot - omega^2 e,    phi = atan(a / (g cos(chi - psi)))

with a, e positive to the right of the path (the curvature kappa is therefore taken positive to the right
here), chi the course and psi the heading. Curvature is that where the aircraft will be when it has rolled,
averaged over the time that rolling into a turn takes, so that line and arc join without a bump. Clothoids
in their place gained too little for what they would ask of every planner: on the 14-turn courses of
`harness.bench.tracking`, three seeds, calm, 20 updates a second, p95/max were .049/.091 m with this and .074/.085
m with clothoids as long as the roll-in for the Aerosonde, .101/.182 and .063/.119 m for c172p, .101/.644
and .110/.417 m for T38. The roll command leads by the time constant of the roll loop, so that roll itself
follows the law. Wind enters through the ground velocity alone, except where it is stronger than the
aircraft: then the wind is estimated as ground velocity less air velocity, and `air_direction` says where to
head.
See R. W. Beard and T. W. McLain, "Small Unmanned Aircraft", chapter 9 (coordinated turn in wind), and
PX4's npfg for the same use of ground and air velocity.

`update` is what happens ten times a second while a route is flown, from what JSBSim tells, in its units, to a row of
the track. What it has to know beside that stands on a sheet, one array, as arrays are what machine code reads soonest.
"""

from __future__ import annotations

import math

import numpy as np

from aircraft.interface import FloatArray
from aircraft.properties import FOOT_M

GRAVITY_MPS2 = 9.80665
DAMPING = 0.9
INTERCEPT_SINE = 0.7
"""Sine of the steepest angle to the path at which a far-off aircraft approaches it."""

SPLIT = 2.0**27 + 1.0
"""Times this, a number is parted into two of half its digits."""

START, STOP, TURNED = 6, 7, 8
"""Columns of a route's rows after those of `Route.segments`: the stations of begin and end, m, and by how much the
route has turned up to there, rad, positive to the left."""

PATCH, LIMITS, LEANS, SHEET = 0, 19, 23, 24
"""Where on a sheet these begin: a patch of the plane (`aircraft.frames.LocalPlane.patch`); the largest angle of attack,
rad, the least airspeed, ft/s, and altitude, ft, and the largest roll angle, rad, under control; the meridian
convergence at the last state, rad. And how many numbers a sheet has."""
ROLL_STEP, LEAD, LEADS_BY, BLEND, BANK_LIMIT, OMEGA, ROW, ALONG, REFERENCE, MEMORY = range(10)
"""Places in the memory of guidance: largest change of the reference roll in an update, rad; what the command is held
and delayed for, s; by how many updates it leads; over how long a step of curvature is blended, s; the largest roll
command, rad; omega, rad/s; the row of the route that was followed last; how far along it, m; the reference roll so far,
rad. And how many they are."""


def update(
    sheet: FloatArray,
    memory: FloatArray,
    route: FloatArray,
    track: FloatArray,
    row: int,
    plan_index: int,
    time_s: float,
    latitude_rad: float,
    longitude_rad: float,
    up_ft: float,
    north_fps: float,
    east_fps: float,
    climb_fps: float,
    heading_rad: float,
    roll_rad: float,
    pitch_rad: float,
    airspeed_fps: float,
    load_factor: float,
    throttle: float,
    alpha_rad: float,
) -> float:
    """One update: fills a row of the track and says how to roll.

    Numbers after `time_s` are those of `aircraft.properties.STATE_PROPERTIES`, and the angle of attack. A row is what
    `AircraftState` consists of, roll command, cross-track error, station and plan index. Without a route (no rows) only
    the state is filled in, and the command is 0.

    Returns:
        The roll command, rad; NaN where control is lost or the patch does not reach: the state is filled in, its place
        NaN in the second case, and nothing is decided.
    """
    east, north, leans = in_patch(sheet, latitude_rad, longitude_rad)
    sheet[LEANS] = leans
    ahead, aside = FOOT_M * math.cos(leans), FOOT_M * math.sin(leans)
    east_mps, north_mps = east_fps * ahead - north_fps * aside, east_fps * aside + north_fps * ahead
    heading, airspeed_mps = (heading_rad - leans) % math.tau, airspeed_fps * FOOT_M
    track[row, 0], track[row, 1], track[row, 2], track[row, 3] = time_s, east, north, up_ft * FOOT_M
    track[row, 4], track[row, 5], track[row, 6] = east_mps, north_mps, climb_fps * FOOT_M
    track[row, 7], track[row, 8], track[row, 9], track[row, 10] = heading, roll_rad, pitch_rad, airspeed_mps
    track[row, 11], track[row, 12] = load_factor, throttle
    if math.isnan(east) or not in_control(sheet, alpha_rad, airspeed_fps, up_ft, roll_rad):
        return math.nan
    if not len(route):
        return 0.0
    command, cross, station, _, _ = decide(
        route, memory, east, north, east_mps, north_mps, heading, airspeed_mps
    )
    track[row, 13], track[row, 14], track[row, 15], track[row, 16] = command, cross, station, plan_index
    return command


def in_control(
    sheet: FloatArray, alpha_rad: float, airspeed_fps: float, altitude_ft: float, roll_rad: float
) -> bool:
    """Whether an aircraft flies: not stalled, not at the ground, not rolled over, every number finite."""
    return bool(
        abs(alpha_rad) <= sheet[LIMITS]
        and sheet[LIMITS + 1] <= airspeed_fps < math.inf
        and sheet[LIMITS + 2] < altitude_ft < math.inf
        and abs(roll_rad) <= sheet[LIMITS + 3]
    )


def in_patch(sheet: FloatArray, latitude_rad: float, longitude_rad: float) -> tuple[float, float, float]:
    """East and north (m) and meridian convergence (rad) of a point; NaN where the patch does not reach."""
    up, right = latitude_rad - float(sheet[PATCH]), longitude_rad - float(sheet[PATCH + 1])
    if not (abs(up) <= sheet[PATCH + 2] and abs(right) <= sheet[PATCH + 3]):
        return math.nan, math.nan, math.nan
    leans = sheet[PATCH + 16] + up * sheet[PATCH + 17] + right * sheet[PATCH + 18]
    return (
        _in_second_order(sheet, PATCH + 4, up, right),
        _in_second_order(sheet, PATCH + 5, up, right),
        float(leans),
    )


def _in_second_order(sheet: FloatArray, first: int, up: float, right: float) -> float:
    """A polynomial, its terms at every other place of the sheet: the middle, slopes, half of second derivatives."""
    return float(
        sheet[first]
        + up * (sheet[first + 2] + up * sheet[first + 6] + right * sheet[first + 8])
        + right * (sheet[first + 4] + right * sheet[first + 10])
    )


def decide(
    route: FloatArray,
    memory: FloatArray,
    east_m: float,
    north_m: float,
    velocity_east_mps: float,
    velocity_north_mps: float,
    heading_rad: float,
    airspeed_mps: float,
) -> tuple[float, float, float, bool, bool]:
    """The law, from one update to the next.

    Args:
        route: (n, 9), see `START`, as `aircraft.guidance` has it.
        memory: (9,) of guidance, see `MEMORY`; its last three go on.
        east_m: position of the aircraft.
        north_m: position of the aircraft.
        velocity_east_mps: ground velocity.
        velocity_north_mps: ground velocity.
        heading_rad: of the nose.
        airspeed_mps: true airspeed.

    Returns:
        What `GuidanceOutput` consists of.
    """
    bank_limit, omega = memory[BANK_LIMIT], memory[OMEGA]
    index, along_m, cross, tangent_east, tangent_north = _nearest(
        route, int(memory[ROW]), memory[ALONG], east_m, north_m
    )
    station = route[index, START] + along_m
    speed = max(
        math.sqrt(velocity_east_mps * velocity_east_mps + velocity_north_mps * velocity_north_mps), 1.0
    )
    along_mps = velocity_east_mps * tangent_east + velocity_north_mps * tangent_north
    cross_mps = velocity_east_mps * tangent_north - velocity_north_mps * tangent_east
    heading_east, heading_north = math.sin(heading_rad), math.cos(heading_rad)
    ahead_mps = velocity_east_mps * heading_east + velocity_north_mps * heading_north
    pull_per_s = omega / (2.0 * DAMPING)
    # The wind, the ground velocity less the air velocity, is not weaker than the airspeed.
    if speed * speed >= 2.0 * airspeed_mps * ahead_mps:
        # Left of the path by this sine, as far as it can be made good.
        left = INTERCEPT_SINE * _within(1.0, cross * pull_per_s / airspeed_mps)
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
        wanted = math.atan(airspeed_mps * omega * turn / GRAVITY_MPS2)
    elif along_mps <= 0.0:
        wanted = -bank_limit if cross_mps > 0.0 else bank_limit
    else:
        pull = _within(INTERCEPT_SINE * speed, cross * pull_per_s)
        # Lift acts across the course, the correction across the path.
        across = -2.0 * DAMPING * omega * (cross_mps + pull) * speed / max(along_mps, 0.3 * speed)
        # The curvature where the aircraft will be when it has rolled, averaged over the way that takes.
        blend = speed * memory[BLEND]
        low = station + speed * memory[LEAD] - 0.5 * blend
        if route[index, START] <= low and low + blend <= route[index, STOP]:
            curvature = route[index, 4]
        else:
            curvature = (_turned(route, index, low + blend) - _turned(route, index, low)) / blend
        acceleration = across - curvature * (speed * speed)
        wanted = math.atan(acceleration / (GRAVITY_MPS2 * max(ahead_mps / speed, 0.2)))
    allowed = _within(bank_limit, wanted)
    step = _within(memory[ROLL_STEP], allowed - memory[REFERENCE])
    roll = memory[REFERENCE] + step
    # Ahead by what roll lags behind its command: roll then moves at the reference's rate.
    command = _within(bank_limit, roll + memory[LEADS_BY] * step)
    past_end = route[index, 5] == math.inf and along_m > 0.0
    memory[ROW], memory[ALONG], memory[REFERENCE] = index, along_m, roll
    return command, cross, station, allowed != wanted, past_end


def _nearest(
    route: FloatArray, index: int, along_m: float, east_m: float, north_m: float
) -> tuple[int, float, float, float, float]:
    """Row and distance along it of the nearest point from the last one on; cross-track error and tangent there."""
    while True:
        east = east_m - route[index, 0]
        north = north_m - route[index, 1]
        tangent_east, tangent_north, curvature = route[index, 2], route[index, 3], route[index, 4]
        if curvature == 0.0:
            along = east * tangent_east + north * tangent_north
            cross = east * tangent_north - north * tangent_east
        else:
            # The centre lies 1/curvature to the left of the start; angles are counted along the flight.
            radius = 1.0 / curvature
            east, north = east + radius * tangent_north, north - radius * tangent_east
            outward_east, outward_north = tangent_north * radius, -tangent_east * radius
            angle = math.atan2(
                outward_east * north - outward_north * east, outward_east * east + outward_north * north
            )
            # Within half a turn of the last one.
            expected = along_m * curvature
            since = np.fmod(angle - expected, math.tau)
            if abs(since) > math.pi:
                since -= math.copysign(math.tau, since)
            angle = expected + since
            away = _length(east, north)
            cross = away - radius if radius > 0.0 else -radius - away
            along = angle * radius
            sine, cosine = math.sin(angle), math.cos(angle)
            tangent_east, tangent_north = (
                tangent_east * cosine - tangent_north * sine,
                tangent_east * sine + tangent_north * cosine,
            )
        if along <= route[index, 5] or index == len(route) - 1:
            return index, max(along, 0.0), cross, tangent_east, tangent_north
        index, along_m = index + 1, 0.0


def _length(x: float, y: float) -> float:
    """sqrt(x^2 + y^2) to half a unit in the last place, as CPython's `math.hypot` has it and that of C has not.

    Squares are taken in two parts, and one step of Newton's makes up for the error of the root (T. J. Dekker, A
    floating-point technique for extending the available precision, Numerische Mathematik 18, 1971).
    """
    large, small = max(abs(x), abs(y)), min(abs(x), abs(y))
    if large == 0.0:
        return 0.0
    square = large * large + small * small
    root = math.sqrt(square)
    lost = large * large - square + small * small
    lost += _rounded_off(large) + _rounded_off(small) - _rounded_off(root)
    return root + (square - root * root + lost) / (2.0 * root)


def _rounded_off(x: float) -> float:
    """What x * x lacks of the exact square."""
    high = x * SPLIT - (x * SPLIT - x)
    low = x - high
    return (high * high - x * x) + 2.0 * high * low + low * low


def _turned(route: FloatArray, index: int, arc_length_m: float) -> float:
    """Direction change of the route from its start to a station near a row, rad, positive to the left."""
    while index > 0 and arc_length_m < route[index, START]:
        index -= 1
    while arc_length_m >= route[index, STOP]:
        index += 1
    turned: float = route[index, TURNED] + route[index, 4] * (arc_length_m - route[index, START])
    return turned


def _within(limit: float, value: float) -> float:
    """The value between minus and plus a limit that is nearest to it."""
    return value if -limit <= value <= limit else math.copysign(limit, value)


def air_direction(
    wind_east_mps: float,
    wind_north_mps: float,
    airspeed_mps: float,
    bearing_east: float,
    bearing_north: float,
) -> tuple[float, float]:
    """Where to head in a wind that is not weaker than the airspeed.

    If the bearing can be made good, the wind triangle. If not, along sqrt(W^2 - V^2) b - w, as PX4's npfg has it
    (`CourseToAirspeedRefMapper::infeasibleAirVelRef`): this is the wind triangle where feasibility ends, and
    straight into the wind where the bearing is against it.

    Args:
        wind_east_mps: the wind, the direction it blows towards.
        wind_north_mps: its other component.
        airspeed_mps: true airspeed, not above the wind's.
        bearing_east: wanted direction over the ground, a unit vector.
        bearing_north: its other component.

    Returns:
        East and north of the heading, a unit vector.
    """
    along = wind_east_mps * bearing_east + wind_north_mps * bearing_north
    excess = wind_east_mps**2 + wind_north_mps**2 - airspeed_mps**2
    reach = (
        along * along - excess
    )  # of the ground velocity's quadratic: negative where no course is the bearing
    ground = along + math.sqrt(reach) if along > 0.0 and reach > 0.0 else math.sqrt(max(excess, 0.0))
    east = ground * bearing_east - wind_east_mps
    north = ground * bearing_north - wind_north_mps
    length = max(_length(east, north), 1e-9)
    return east / length, north / length


FLOAT, INDEX, ROUTE = "float64", "intp", "Array(float64, 2, 'C', readonly=True)"
NUMBERS_OUT, ROWS_OUT = "float64[::1]", "float64[:, ::1]"
COMPILED = (
    (_in_second_order, (NUMBERS_OUT, INDEX, FLOAT, FLOAT)),
    (in_patch, (NUMBERS_OUT, FLOAT, FLOAT)),
    (in_control, (NUMBERS_OUT, *(FLOAT,) * 4)),
    (_within, (FLOAT,) * 2),
    (_rounded_off, (FLOAT,)),
    (_length, (FLOAT,) * 2),
    (air_direction, (FLOAT,) * 5),
    (_turned, (ROUTE, INDEX, FLOAT)),
    (_nearest, (ROUTE, INDEX, FLOAT, FLOAT, FLOAT)),
    (decide, (ROUTE, NUMBERS_OUT, *(FLOAT,) * 6)),
    (update, (NUMBERS_OUT, NUMBERS_OUT, ROUTE, ROWS_OUT, INDEX, INDEX, *(FLOAT,) * 14)),
)
"""What whoever has a compiler (numba) may put machine code in the place of, in this order: types of arguments."""
