"""NPFG: the nonlinear path following guidance that PX4 flies, for light and for excessive wind.

A look-ahead angle bends the wanted course from straight at the path, far away, to along the path. The wind triangle
turns course into air velocity; where the wind leaves no solution the air velocity fades to one that drifts least. A
proportional law turns the true air velocity to it, and the path's curvature is fed forward.

Source: T. Stastny and R. Siegwart, "On Flying Backwards: Preventing Run-away of Small, Low-speed, Fixed-wing UAVs in
Strong Winds", IROS 2019, arXiv 1908.01381; T. Stastny, PhD thesis, ETH Zurich 2020, Paper III; the bounds of the period
and the floors of small speeds as PX4 1.15 has them. Right is positive: roll, acceleration, curvature, track error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from aircraft.guidance.interface import GuidanceLimits
from aircraft.guidance.key import key
from aircraft.guidance.progress import PathPoint
from aircraft.guidance.route_law import RouteLaw
from aircraft.interface import GRAVITY_MPS2, AircraftState

FEASIBILITY_BUFFER_MPS = 1.5
"""A bearing is feasible in full if the airspeed exceeds the wind that must be beaten by this much."""
SLOW_MPS = 1.0  # below this ground speed the track error bound no longer shrinks in proportion to speed
TRACK_KEEPING_SHARE = 0.5
"""From this share of the track error bound track keeping asks for its full ground speed, and for less below."""
NEGLIGIBLE = 1e-6  # time constants, speeds (m/s) and rates (rad/s) below this count as zero
LEAST_DAMPING = 0.5  # below this damping the lower bound of the period for curved paths does not apply


@dataclass(frozen=True)
class NpfgConfig:
    """Keys of `guidance.kind: npfg`; defaults are those of PX4's parameters."""

    period_s: float = key(10.0, "period of the track error's decay (NPFG_PERIOD)", "s", minimum=1.0, maximum=1000.0)
    damping: float = key(0.7, "damping ratio of the track error's decay (NPFG_DAMPING)", "1", minimum=0.1, maximum=1.0)
    lower_period_bound: bool = key(True, "lengthen the period to what the roll time constant allows (NPFG_LB_PERIOD)")
    upper_period_bound: bool = key(True, "shorten the period to what a curved path in wind needs (NPFG_UB_PERIOD)")
    min_ground_speed_on: bool = key(True, "raise the airspeed to keep a least ground speed (NPFG_EN_MIN_GSP)")
    track_keeping: bool = key(True, "raise the airspeed to stay on the track in excessive wind (NPFG_TRACK_KEEP)")
    wind_regulation: bool = key(True, "let the law raise the airspeed at all (NPFG_WIND_REG)")
    min_ground_speed_mps: float = key(5.0, "least ground speed along the path (FW_GND_SPD_MIN)", "m/s", minimum=0.0)
    max_track_keeping_speed_mps: float = key(
        5.0, "largest ground speed that track keeping asks for (NPFG_GSP_MAX_TK)", "m/s", minimum=0.0
    )
    roll_time_constant_s: float | None = key(
        None,
        "time constant of roll (NPFG_ROLL_TC); default: the aircraft's, at least bank limit / roll rate",
        "s",
        minimum=0.0,
    )
    switch_distance_multiplier: float = key(
        0.32,
        "share of the track error bound at which the next leg begins (NPFG_SW_DST_MLT)",
        "1",
        minimum=0.1,
        maximum=1.0,
    )
    period_safety_factor: float = key(
        1.5, "factor on the lower bound of the period (NPFG_PERIOD_SF)", "1", minimum=1.0, maximum=10.0
    )

    def resolved(self, limits: GuidanceLimits) -> NpfgConfig:
        """The config with every default filled in."""
        given_s = self.roll_time_constant_s
        return replace(self, roll_time_constant_s=limits.slowest_roll_s if given_s is None else given_s)


class NpfgInput(NamedTuple):
    """Where the aircraft is, how it moves over the ground, the wind, and the nearest point of the path.

    Vectors are complex: east + i north, in m and m/s.
    """

    place: complex
    velocity: complex
    wind: complex  # the direction it blows towards
    path: complex
    tangent: complex  # the path's unit tangent at that point
    right_curvature_1pm: float  # the path's there, positive for a right turn


def dot(a: complex, b: complex) -> float:
    """Scalar product of two vectors."""
    return a.real * b.real + a.imag * b.imag


def cross(a: complex, b: complex) -> float:
    """Cross product of two vectors: positive if b points to the left of a."""
    return a.real * b.imag - a.imag * b.real


def npfg(at: NpfgInput, has: NpfgConfig, nominal_mps: float, largest_mps: float) -> tuple[float, float]:
    """Lateral acceleration (m/s^2) and true airspeed (m/s) that NPFG asks for, by nominal and largest airspeed."""
    air = at.velocity - at.wind
    error = cross(at.place - at.path, at.tangent)
    on_track = feasibility(abs(air), at.wind, at.tangent)
    period = adapted_period(at, has, abs(error), abs(air), on_track)
    share = min(abs(error) / track_error_bound(abs(at.velocity), period * has.damping), 1.0)
    look_ahead = look_ahead_angle(share)
    proximity = math.sin(look_ahead) ** 2

    # The bearing: along the path, and back to it.
    side = 1.0 if error < 0.0 else -1.0
    bearing = at.tangent * complex(math.sin(look_ahead), -side * math.cos(look_ahead))
    feasible = feasibility(abs(air), at.wind, bearing) * on_track
    least_mps = min_ground_speed(has, share, feasible)
    wanted = air_velocity(has, nominal_mps, largest_mps, least_mps, at.wind, bearing)

    acceleration = turning(4.0 * math.pi * has.damping / period, air, wanted)
    acceleration += feasible * proximity * curvature_feedforward(at, abs(air), error)
    return acceleration, abs(wanted)


def feasibility(airspeed_mps: float, wind: complex, direction: complex) -> float:
    """Returns how well a direction over the ground can be made good, from 1 (light wind) to 0 (wind too strong)."""
    against = abs(wind) if dot(wind, direction) < 0.0 else abs(cross(direction, wind))
    share = min(max((airspeed_mps - against) / FEASIBILITY_BUFFER_MPS, 0.0), 1.0)
    return math.sin(0.5 * math.pi * share) ** 2


def track_error_bound(ground_speed_mps: float, time_constant_s: float) -> float:
    """Distance from the path at which the law aims straight at it, m."""
    if ground_speed_mps > SLOW_MPS:
        return ground_speed_mps * time_constant_s
    return 0.5 * time_constant_s * (1.0 + ground_speed_mps * ground_speed_mps)


def look_ahead_angle(share: float) -> float:
    """Angle between the bearing and the shortest way to the path, rad, of the share of the track error bound."""
    return 0.5 * math.pi * (1.0 - share) ** 2


def adapted_period(at: NpfgInput, has: NpfgConfig, distance_m: float, airspeed_mps: float, on_track: float) -> float:
    """The period (s), lengthened to what roll can follow and shortened to what a curved path in wind needs."""
    roll_s, wind_mps = has.roll_time_constant_s or 0.0, abs(at.wind)
    if not has.lower_period_bound or roll_s <= NEGLIGIBLE:
        return has.period_s
    beaten = wind_mps > airspeed_mps or airspeed_mps < NEGLIGIBLE
    rate = 2.0 * abs(at.right_curvature_1pm) * airspeed_mps
    rate *= 1.0 if beaten else 1.0 - math.sqrt(1.0 - wind_mps / airspeed_mps)
    straight = math.pi * roll_s / has.damping
    curved = straight
    if rate >= NEGLIGIBLE and has.damping >= LEAST_DAMPING:
        curved = on_track * 4.0 * math.pi * roll_s * has.damping + (1.0 - on_track) * straight
    safety = has.period_safety_factor
    bound = track_error_bound(abs(at.velocity), safety * straight * has.damping)
    near = math.sin(look_ahead_angle(min(distance_m / bound, 1.0))) ** 2
    lower = near * safety * curved + (1.0 - near) * safety * straight
    period = max(has.period_s, lower)
    if has.upper_period_bound and rate > NEGLIGIBLE and on_track > 0.0:
        upper = 4.0 * math.pi * has.damping / (rate * on_track)
        if period > upper:
            period = near * max(lower, upper) + (1.0 - near) * period
    return period


def min_ground_speed(has: NpfgConfig, share: float, feasible: float) -> float:
    """Least ground speed along the bearing, m/s: the key's, or what track keeping asks for if more."""
    least = 0.0
    if has.wind_regulation and has.min_ground_speed_on:
        least = has.min_ground_speed_mps
    if has.wind_regulation and has.track_keeping:
        eagerness = min(share / TRACK_KEEPING_SHARE, 1.0)
        least = max(least, (1.0 - feasible) * has.max_track_keeping_speed_mps * eagerness)
    return least


def air_velocity(
    has: NpfgConfig, nominal: float, largest: float, least_mps: float, wind: complex, bearing: complex
) -> complex:
    """The air velocity that makes a bearing good, or comes nearest to it, m/s."""
    along, across = dot(wind, bearing), cross(bearing, wind)

    def solvable(airspeed: float) -> bool:
        """Whether the wind triangle has a solution that moves along the bearing."""
        return abs(across) < airspeed and (along > 0.0 or abs(wind) < airspeed)

    speed = 0.0  # of the wind triangle; 0: none
    if has.wind_regulation and (has.min_ground_speed_on or has.track_keeping) and least_mps > along:
        if (speed := max(math.hypot(least_mps - along, across), nominal)) > largest:
            if not solvable(largest):
                return against_wind(largest, wind, bearing)
            speed = largest
    elif solvable(nominal):
        speed = nominal
    elif not has.wind_regulation:
        return against_wind(nominal, wind, bearing)
    elif not solvable(largest):
        return against_wind(largest, wind, bearing)
    elif along <= 0.0:
        return wind  # as flown: to face the wind it would be the other way round
    return bearing * complex(math.sqrt(max(speed * speed - across * across, 0.0)), -across)


def against_wind(airspeed_mps: float, wind: complex, bearing: complex) -> complex:
    """The air velocity where a bearing cannot be made good: it drifts least, and fades to the wind triangle, m/s."""
    to = math.sqrt(max(abs(wind) ** 2 - airspeed_mps * airspeed_mps, 0.0)) * bearing - wind
    return to * (airspeed_mps / abs(to)) if to else 0j


def curvature_feedforward(at: NpfgInput, airspeed_mps: float, error_m: float) -> float:
    """Lateral acceleration that holds the path's curvature in the wind, m/s^2."""
    curvature = at.right_curvature_1pm
    # On the circle through the aircraft, which has no less than half of the path's radius.
    curvature /= max(1.0 - curvature * error_m, 0.5 * abs(curvature))
    along, across = dot(at.wind, at.tangent), cross(at.tangent, at.wind)
    ahead = math.sqrt(max(airspeed_mps * airspeed_mps - across * across, 0.0))
    speed = max(dot(at.velocity, at.tangent), 0.0)
    return airspeed_mps * (1.0 + along / max(ahead, NEGLIGIBLE)) * curvature * speed


def turning(gain_1ps: float, air: complex, wanted: complex) -> float:
    """Lateral acceleration that turns the air velocity to the wanted one, m/s^2."""
    across = cross(wanted, air)
    if dot(air, wanted) < 0.0:
        return gain_1ps * abs(air) * (-1.0 if across < 0.0 else 1.0)
    return gain_1ps * across / abs(wanted) if wanted else 0.0


class NpfgLaw(RouteLaw):
    """Flies a route by `npfg`."""

    def __init__(self, config: NpfgConfig, limits: GuidanceLimits) -> None:
        super().__init__(limits)
        self._has, self._speeds_mps = config, (limits.airspeed_mps, limits.max_airspeed_mps)

    def hold_airspeed(self, airspeed_mps: float) -> None:
        """Takes the true airspeed (m/s) that the mission holds now for the nominal one."""
        self._speeds_mps = airspeed_mps, self._speeds_mps[1]

    def demand(self, state: AircraftState, place: PathPoint) -> tuple[float, float]:
        """Roll (rad) and true airspeed (m/s) of `npfg`, without limits."""
        velocity = complex(state.velocity_east_mps, state.velocity_north_mps)
        at = NpfgInput(
            complex(state.east_m, state.north_m),
            velocity,
            velocity - state.airspeed_mps * complex(math.sin(state.heading_rad), math.cos(state.heading_rad)),
            complex(place.east_m, place.north_m),
            complex(place.tangent_east, place.tangent_north),
            -place.curvature_1pm,
        )
        acceleration, airspeed_mps = npfg(at, self._has, *self._speeds_mps)
        return math.atan(acceleration / GRAVITY_MPS2), airspeed_mps
