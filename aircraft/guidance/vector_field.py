"""Vector field: the course field of Beard and McLain for straight lines and orbits, and their course hold.

Far from a line the field leads to it at a fixed angle, near it ever flatter; far from an orbit it leads to the centre,
on it along the tangent. A PI law turns the course to that of the field; on an orbit the bank that holds it is fed
forward.

Source: R. W. Beard and T. W. McLain, "Small Unmanned Aircraft: Theory and Practice", 2nd edition: chapter 10 (the field
of a line, eq. 10.8, and of an orbit, eq. 10.13), chapter 9 (coordinated turn in wind), chapter 6 (course hold). Right
is positive: roll, course clockwise from north, cross-track error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLimits
from aircraft.guidance.key import key
from aircraft.guidance.progress import PathPoint
from aircraft.guidance.route_law import RouteLaw, centre_of
from aircraft.interface import GRAVITY_MPS2, AircraftState

CONVERGENCE_S = 7.2
"""Time constant of the approach to a line, s: that of the authors' k_path 0.01 1/m and 50 degrees at 25 m/s."""
COURSE_SHARE = 0.55
"""Bandwidth of course hold over that of the aircraft's guidance: a fifth of the bandwidth of roll (chapter 6 asks for a
separation of five at least)."""
FIELD_SHARE = 3.5
"""The field converges no faster than with this time constant, in units of that of course hold."""
LEAST_CRAB_COSINE = 0.2
"""Least cosine of the angle between course and heading with which bank is worked out."""
SLOW_MPS = 1.0
"""Ground speeds below this count as this."""


@dataclass(frozen=True)
class VectorFieldConfig:
    """Keys of `guidance.kind: vector_field`."""

    approach_angle_deg: float = key(
        50.0,
        "chi infinity, the angle to a line at which a far-off aircraft approaches it",
        "deg",
        above=0.0,
        maximum=90.0,
    )
    path_gain_1pm: float | None = key(
        None,
        "k_path, how soon the field turns to a line; default: 0.01 at 25 m/s, less for the faster",
        "1/m",
        above=0.0,
    )
    orbit_gain: float = key(
        0.0,
        "k_orbit, how soon the field turns to an orbit; 0: an orbit is approached as soon as a line",
        "1",
        minimum=0.0,
    )
    course_bandwidth_radps: float | None = key(
        None,
        "natural frequency of course hold; default: a fifth of the bandwidth of the aircraft's roll",
        "rad/s",
        above=0.0,
    )
    course_damping: float = key(1.0, "damping ratio of course hold", "1", minimum=0.1, maximum=5.0)

    def resolved(self, limits: GuidanceLimits) -> VectorFieldConfig:
        """The config with every default filled in."""
        gain, bandwidth = self.path_gain_1pm, self.course_bandwidth_radps
        if bandwidth is None:
            bandwidth = COURSE_SHARE * limits.bandwidth_radps
        if gain is None:
            convergence_s = max(CONVERGENCE_S, FIELD_SHARE / bandwidth)
            angle = math.radians(self.approach_angle_deg)
            gain = 0.5 * math.pi / (angle * limits.airspeed_mps * convergence_s)
        return replace(self, path_gain_1pm=gain, course_bandwidth_radps=bandwidth)


def parameters(config: VectorFieldConfig, limits: GuidanceLimits) -> VectorFieldParameters:
    """What the law needs: the keys, resolved, and figures of the aircraft."""
    assert config.path_gain_1pm is not None
    assert config.course_bandwidth_radps is not None
    return VectorFieldParameters(
        math.radians(config.approach_angle_deg),
        config.path_gain_1pm,
        config.orbit_gain,
        config.course_bandwidth_radps,
        config.course_damping,
        limits.bank_limit_rad,
        1.0 / UPDATE_RATE_HZ,
    )


class VectorFieldParameters(NamedTuple):
    """Constants of one flight."""

    approach_angle_rad: float
    path_gain_1pm: float
    orbit_gain: float
    """0: what approaches an orbit as soon as a line."""
    course_bandwidth_radps: float
    course_damping: float
    roll_limit_rad: float
    update_s: float
    """Time between calls, which the integrator adds up."""


class Motion(NamedTuple):
    """How the aircraft moves."""

    east_m: float
    north_m: float
    velocity_east_mps: float
    velocity_north_mps: float
    heading_rad: float


class VectorFieldOutput(NamedTuple):
    """The roll command, and what it comes from."""

    roll_rad: float
    course_rad: float
    """Of the field."""
    error_m: float
    """From the path, positive to its right."""
    feedforward_rad: float
    integral_rad: float
    """The integrator's part of the roll command, for the next call."""
    saturated: bool
    """The roll limit cut the command."""


def line_course(
    cross_track_m: float, tangent_east: float, tangent_north: float, has: VectorFieldParameters
) -> float:
    """Course of the field of a line (eq. 10.8), rad; the distance is positive to the line's right."""
    away = 2.0 / math.pi * math.atan(has.path_gain_1pm * cross_track_m)
    return math.atan2(tangent_east, tangent_north) - has.approach_angle_rad * away


def orbit_course(
    out_east_m: float, out_north_m: float, radius_m: float, direction: float, has: VectorFieldParameters
) -> float:
    """Course of the field of an orbit (eq. 10.13), rad, by the way out from its centre; direction +1 clockwise."""
    gain = has.orbit_gain
    if gain == 0.0:
        # The slope, at the orbit, of the field of a line.
        gain = 2.0 / math.pi * has.approach_angle_rad * has.path_gain_1pm * radius_m
    distance = math.sqrt(out_east_m * out_east_m + out_north_m * out_north_m)
    inwards = math.atan(gain * (distance - radius_m) / radius_m)
    return math.atan2(out_east_m, out_north_m) + direction * (0.5 * math.pi + inwards)


def follow_line(
    at: Motion,
    point_east_m: float,
    point_north_m: float,
    tangent_east: float,
    tangent_north: float,
    integral_rad: float,
    has: VectorFieldParameters,
) -> VectorFieldOutput:
    """The law on a line through a point; the integrator is as the last call left it, 0 at first."""
    east, north = at.east_m - point_east_m, at.north_m - point_north_m
    error = east * tangent_north - north * tangent_east
    course = line_course(error, tangent_east, tangent_north, has)
    return hold_course(at, course, error, 0.0, integral_rad, has)


def follow_orbit(
    at: Motion,
    centre_east_m: float,
    centre_north_m: float,
    radius_m: float,
    direction: float,
    integral_rad: float,
    has: VectorFieldParameters,
) -> VectorFieldOutput:
    """The law on an orbit, direction +1 clockwise; the integrator is as the last call left it, 0 at first."""
    east, north = at.east_m - centre_east_m, at.north_m - centre_north_m
    course = orbit_course(east, north, radius_m, direction, has)
    # The bank that holds the orbit at this ground speed and crab angle (chapter 9).
    speed_squared = at.velocity_east_mps**2 + at.velocity_north_mps**2
    forward = direction * math.atan(speed_squared / (GRAVITY_MPS2 * radius_m * crab_cosine(at)))
    error = direction * (radius_m - math.sqrt(east * east + north * north))
    return hold_course(at, course, error, forward, integral_rad, has)


def hold_course(
    at: Motion,
    course_rad: float,
    error_m: float,
    forward_rad: float,
    integral_rad: float,
    has: VectorFieldParameters,
) -> VectorFieldOutput:
    """Course hold (chapter 6): PI with the feedforward; the integrator stands still while the command is cut."""
    east, north = at.velocity_east_mps, at.velocity_north_mps
    to_east, to_north = math.sin(course_rad), math.cos(course_rad)
    off = math.atan2(north * to_east - east * to_north, east * to_east + north * to_north)
    speed = max(math.sqrt(east * east + north * north), SLOW_MPS)
    scale = speed / (GRAVITY_MPS2 * crab_cosine(at))
    omega = has.course_bandwidth_radps
    grown = integral_rad + omega * omega * scale * off * has.update_s
    wanted = forward_rad + 2.0 * has.course_damping * omega * scale * off + grown
    roll = min(max(wanted, -has.roll_limit_rad), has.roll_limit_rad)
    saturated = roll != wanted
    return VectorFieldOutput(
        roll, course_rad, error_m, forward_rad, integral_rad if saturated else grown, saturated
    )


def crab_cosine(at: Motion) -> float:
    """Cosine of the angle between course and heading, not below its least."""
    east, north = at.velocity_east_mps, at.velocity_north_mps
    speed = math.sqrt(east * east + north * north)
    if speed < SLOW_MPS:
        return 1.0
    ahead = east * math.sin(at.heading_rad) + north * math.cos(at.heading_rad)
    return max(ahead / speed, LEAST_CRAB_COSINE)


class VectorFieldLaw(RouteLaw):
    """Flies a route by the field of each of its lines and arcs."""

    def __init__(self, config: VectorFieldConfig, limits: GuidanceLimits) -> None:
        super().__init__(limits)
        self._has, self._integral_rad = parameters(config, limits), 0.0

    def wanted(self, state: AircraftState, place: PathPoint) -> tuple[float, float]:
        """What the law asks for."""
        moves = state.east_m, state.north_m, state.velocity_east_mps, state.velocity_north_mps
        at, bend = Motion(*moves, state.heading_rad), place.curvature_1pm
        if bend == 0.0:
            line = place.east_m, place.north_m, place.tangent_east, place.tangent_north
            output = follow_line(at, *line, self._integral_rad, self._has)
        else:
            orbit = *centre_of(place), abs(1.0 / bend), -math.copysign(1.0, bend)
            output = follow_orbit(at, *orbit, self._integral_rad, self._has)
        self._integral_rad = output.integral_rad
        return output.roll_rad, math.nan
