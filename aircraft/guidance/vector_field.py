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

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLimits
from aircraft.guidance.key import key
from aircraft.guidance.progress import PathPoint
from aircraft.guidance.route_law import RouteLaw, centre_of
from aircraft.interface import GRAVITY_MPS2, AircraftState

CONVERGENCE_S = 7.2
"""Time constant of the approach to a line, s: that of the authors' k_path 0.01 1/m and 50 degrees at 25 m/s."""
COURSE_SHARE = 0.55
"""Bandwidth of course hold over that of the aircraft's guidance: at most a fifth of the bandwidth of roll, as chapter 6
asks for."""
FIELD_SHARE = 3.5  # the field converges no faster than with this time constant, in those of course hold
LEAST_CRAB_COSINE = 0.2  # least cosine of the angle between course and heading that bank is computed with
SLOW_MPS = 1.0  # least ground speed that course and bank are computed with


@dataclass(frozen=True)
class VectorFieldConfig:
    """Keys of `guidance.kind: vector_field`."""

    approach_angle_deg: float = key(
        50.0, "chi infinity, the angle of approach to a line from far off", "deg", above=0.0, maximum=90.0
    )
    path_gain_1pm: float | None = key(
        None, "k_path, the field's turn to a line; default: 0.01 at 25 m/s, less if faster", "1/m", above=0.0
    )
    orbit_gain: float = key(
        0.0, "k_orbit, how soon the field turns to an orbit; 0: as soon as to a line", "1", minimum=0.0
    )
    course_bandwidth_radps: float | None = key(
        None, "natural frequency of course hold; default: 0.55 of the guidance bandwidth", "rad/s", above=0.0
    )
    course_damping: float = key(1.0, "damping ratio of course hold", "1", minimum=0.1, maximum=5.0)

    def resolved(self, limits: GuidanceLimits) -> VectorFieldConfig:
        """The config with every default filled in."""
        gain, bandwidth = self.path_gain_1pm, self.course_bandwidth_radps
        if bandwidth is None:
            bandwidth = COURSE_SHARE * limits.bandwidth_radps
        if gain is None:
            angle = math.radians(self.approach_angle_deg)
            gain = 0.5 * math.pi / (angle * limits.airspeed_mps * max(CONVERGENCE_S, FIELD_SHARE / bandwidth))
        return replace(self, path_gain_1pm=gain, course_bandwidth_radps=bandwidth)


def line_course(
    cross_track_m: float, tangent_east: float, tangent_north: float, approach_rad: float, gain_1pm: float
) -> float:
    """Course of the field of a line (eq. 10.8), rad; the distance is positive to the line's right."""
    away = 2.0 / math.pi * math.atan(gain_1pm * cross_track_m)
    return math.atan2(tangent_east, tangent_north) - approach_rad * away


def orbit_course(out_east_m: float, out_north_m: float, radius_m: float, direction: float, gain: float) -> float:
    """Course of the field of an orbit (eq. 10.13), rad, at an offset from its centre; direction +1 is clockwise."""
    inwards = math.atan(gain * (math.hypot(out_east_m, out_north_m) - radius_m) / radius_m)
    return math.atan2(out_east_m, out_north_m) + direction * (0.5 * math.pi + inwards)


def crab_cosine(state: AircraftState) -> float:
    """Cosine of the angle between course and heading, at least `LEAST_CRAB_COSINE`; 1 for a slow aircraft."""
    east, north = state.velocity_east_mps, state.velocity_north_mps
    if (speed := math.hypot(east, north)) < SLOW_MPS:
        return 1.0
    ahead = east * math.sin(state.heading_rad) + north * math.cos(state.heading_rad)
    return max(ahead / speed, LEAST_CRAB_COSINE)


class VectorFieldLaw(RouteLaw):
    """Flies a route by the field of each of its lines and arcs."""

    def __init__(self, config: VectorFieldConfig, limits: GuidanceLimits) -> None:
        super().__init__(limits)
        assert config.path_gain_1pm is not None
        assert config.course_bandwidth_radps is not None
        self._approach_rad, self._gain_1pm = math.radians(config.approach_angle_deg), config.path_gain_1pm
        self._orbit_gain = config.orbit_gain
        self._omega, self._damping = config.course_bandwidth_radps, config.course_damping
        self._integral_rad = 0.0

    def demand(self, state: AircraftState, place: PathPoint) -> tuple[float, float]:
        """Roll (rad) that holds the course of the field; no airspeed."""
        if place.curvature_1pm == 0.0:
            tangent = place.tangent_east, place.tangent_north
            course_rad = line_course(place.cross_track_m, *tangent, self._approach_rad, self._gain_1pm)
            return self._course_hold_rad(state, course_rad, 0.0), math.nan
        radius, direction = abs(1.0 / place.curvature_1pm), -math.copysign(1.0, place.curvature_1pm)
        # By default the slope, at the orbit, of the field of a line.
        gain = self._orbit_gain or 2.0 / math.pi * self._approach_rad * self._gain_1pm * radius
        centre_east, centre_north = centre_of(place)
        out = state.east_m - centre_east, state.north_m - centre_north
        # The bank that holds the orbit at this ground speed and crab angle (chapter 9).
        speed2 = state.velocity_east_mps**2 + state.velocity_north_mps**2
        forward = direction * math.atan(speed2 / (GRAVITY_MPS2 * radius * crab_cosine(state)))
        return self._course_hold_rad(state, orbit_course(*out, radius, direction, gain), forward), math.nan

    def _course_hold_rad(self, state: AircraftState, course_rad: float, forward_rad: float) -> float:
        """Roll of course hold (chapter 6): PI and the feedforward; the integrator stops while the bank limit cuts."""
        east, north = state.velocity_east_mps, state.velocity_north_mps
        to_east, to_north = math.sin(course_rad), math.cos(course_rad)
        off = math.atan2(north * to_east - east * to_north, east * to_east + north * to_north)
        scale = max(math.hypot(east, north), SLOW_MPS) / (GRAVITY_MPS2 * crab_cosine(state))
        grown = self._integral_rad + self._omega * self._omega * scale * off / UPDATE_RATE_HZ
        demand = forward_rad + 2.0 * self._damping * self._omega * scale * off + grown
        if abs(demand) <= self._limit_rad:
            self._integral_rad = grown
        return demand
