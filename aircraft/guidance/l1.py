"""L1: the guidance that ArduPilot flies, legs between waypoints and circles around a point.

On a leg the aircraft turns on the circle through a point of the leg that is the distance L1 away, and an integrator
takes out what is left over. On a circle it does so until a PD law of the distance from the circle asks for a tighter
turn; that law then holds the circle, with the centripetal acceleration fed forward.

Source: S. Park, J. Deyst and J. P. How, "A New Nonlinear Guidance Logic for Trajectory Tracking", AIAA 2004-4900:
a = 2 V^2 / L1 sin(Nu); capture limit, integrator, circle law, indecision and floors as ArduPilot 4.6 has them. Right is
positive: roll, acceleration, Nu; the cross-track error of a leg alone is positive to its LEFT, as there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from aircraft.guidance.interface import GuidanceLimits
from aircraft.guidance.key import key
from aircraft.guidance.npfg import cross, dot
from aircraft.guidance.progress import PathPoint
from aircraft.guidance.route_law import RouteLaw, centre_of
from aircraft.interface import GRAVITY_MPS2, AircraftState

ONE_OVER_PI = 0.3183099  # 1/pi to the digits that the autopilot uses
TWO_PI = 6.2832  # 2 pi to the digits that the autopilot uses for the circle law
QUARTER_TURN_RAD = 1.5708  # largest Nu on a leg, rad: pi/2 to the digits that the autopilot uses
HALF_RIGHT_SINE = 0.7071
"""Sine of 45 degrees: the steepest angle to a leg; from so near to straight behind it, the law aims at its start."""
SLOW_MPS = 0.1  # least ground speed on a leg; a slower or backwards flight counts as this fast along the nose
MIN_CIRCLE_SPEED_MPS = 1.0  # on a circle a slower ground speed counts as this
NEAR_CENTRE_M = 0.1
"""Nearer to a circle's centre than this, the direction out of it is taken along the course, or the nose."""
SHORT_LEG_M = 1e-6  # a shorter leg has no direction
PAST_LEG_S = 3.0  # from this flying time beyond a leg's end on the law aims back at the end
INTEGRATOR_RANGE_RAD = math.radians(5.0)
"""The integrator grows only while Nu1, the angle to intercept the leg, is below this."""
INTEGRATOR_LIMIT_RAD = 0.1  # largest value of the integrator, to either side
MAX_UPDATE_S = 0.1  # the integrator counts no more time than this since the last call
FAR_M = 1e4  # a leg without an end goes on this far beyond the aircraft
STALE_S = 1.0  # the integrator begins again at 0 if the last call on a leg is longer ago than this
INDECISION_RAD = 0.9 * math.pi
"""Beyond this Nu the target is behind; then the last direction of turn is kept, so that it does not alternate."""
INDECISION_CD = 12000
"""The direction of turn is kept only if the nose is more than this off the target, hundredths of a degree."""


@dataclass(frozen=True)
class L1Config:
    """Keys of `guidance.kind: l1`; defaults are those of ArduPilot's parameters."""

    period_s: float = key(17.0, "period of the track error's decay (NAVL1_PERIOD)", "s", minimum=1.0, maximum=1000.0)
    damping: float = key(
        0.75, "damping ratio of the track error's decay (NAVL1_DAMPING)", "1", minimum=0.1, maximum=2.0
    )
    integrator_gain: float = key(
        0.02, "gain of the cross-track integrator (NAVL1_XTRACK_I); 0: none", "1/s", minimum=0.0, maximum=0.1
    )

    def resolved(self, limits: GuidanceLimits) -> L1Config:
        """The config with every default filled in; no key of it depends on the aircraft."""
        return self


class L1Motion(NamedTuple):
    """How the aircraft moves. Vectors are complex: east + i north, in m and m/s."""

    place: complex
    velocity: complex
    yaw_rad: float
    yaw_cd: int  # the same in hundredths of a degree, as the autopilot keeps it


class L1Memory(NamedTuple):
    """State of the law between two calls."""

    last_nu_rad: float = 0.0
    integrator_rad: float = 0.0
    last_gain: float = 0.0  # the integrator begins at 0 when its gain has changed


class L1Circle(NamedTuple):
    """A circle to loiter on."""

    centre: complex
    radius_m: float
    direction: float  # +1 clockwise (right turns), -1 counter-clockwise


def follow_leg(
    at: L1Motion, leg: tuple[complex, complex], since_s: float, memory: L1Memory, has: L1Config
) -> tuple[float, L1Memory]:
    """Lateral acceleration (m/s^2) on a leg from A to B, so long since the last call on one, and the next memory."""
    begin, end = leg
    fresh, since = since_s > STALE_S, min(since_s, MAX_UPDATE_S)
    velocity, speed = leg_velocity(at)
    distance = ONE_OVER_PI * has.damping * has.period_s * speed
    ahead, length = leg_direction(at, *leg), abs(end - begin)
    flown, to = at.place - begin, end - at.place
    left, along = -cross(flown, ahead), dot(ahead, flown)

    integrator, gain = 0.0 if fresh else memory.integrator_rad, memory.last_gain
    if abs(flown) > distance and along / max(abs(flown), 1.0) < -HALF_RIGHT_SINE:
        nu = aim_at(-flown, velocity)
    elif along > length + PAST_LEG_S * speed:
        nu = aim_at(to, velocity)
    else:
        intercept = math.asin(min(max(left / max(distance, 0.1), -HALF_RIGHT_SINE), HALF_RIGHT_SINE))
        if has.integrator_gain <= 0.0 or has.integrator_gain != gain:
            integrator, gain = 0.0, has.integrator_gain
        elif abs(intercept) < INTEGRATOR_RANGE_RAD:
            integrator += intercept * has.integrator_gain * since
            integrator = min(max(integrator, -INTEGRATOR_LIMIT_RAD), INTEGRATOR_LIMIT_RAD)
        nu = intercept + integrator + aim_at(ahead, velocity)
    nu = decided(nu, memory.last_nu_rad, bearing_cd(to), at.yaw_cd)
    used = min(max(nu, -QUARTER_TURN_RAD), QUARTER_TURN_RAD)
    acceleration = 4.0 * has.damping * has.damping * speed * speed / distance * math.sin(used)
    return acceleration, L1Memory(nu, integrator, gain)


def follow_circle(at: L1Motion, circle: L1Circle, memory: L1Memory, has: L1Config) -> tuple[float, L1Memory]:
    """Lateral acceleration (m/s^2) on a circle, and the memory for the next call."""
    radius, omega = circle.radius_m, TWO_PI / has.period_s
    speed = max(abs(at.velocity), MIN_CIRCLE_SPEED_MPS)
    distance = ONE_OVER_PI * has.damping * has.period_s * speed
    out = at.place - circle.centre
    if (away := abs(out)) > NEAR_CENTRE_M:
        out /= away
    elif abs(at.velocity) < SLOW_MPS:
        out = nose(at)
    else:
        out = at.velocity / abs(at.velocity)
    across, inwards = cross(at.velocity, out), -dot(out, at.velocity)
    nu = decided(math.atan2(across, inwards), memory.last_nu_rad, bearing_cd(circle.centre - at.place), at.yaw_cd)
    used = min(max(nu, -0.5 * math.pi), 0.5 * math.pi)
    capture = 4.0 * has.damping * has.damping * speed * speed / distance * math.sin(used)

    error = away - radius
    correction = omega * omega * error - 2.0 * has.damping * omega * inwards
    around = circle.direction * across
    if inwards < 0.0 and around < 0.0:
        # Away from the centre and the wrong way round: never turn away from the circle.
        correction = max(correction, 0.0)
    bend_m = max(0.5 * radius, radius + error)
    centripetal = around * around / bend_m if bend_m > 0.0 else 0.0  # 0: no circle, straight on
    hold = circle.direction * (correction + centripetal)
    approaching = error > 0.0 and circle.direction * capture < circle.direction * hold
    return capture if approaching else hold, L1Memory(nu, memory.integrator_rad, memory.last_gain)


def nose(at: L1Motion) -> complex:
    """Unit vector along the nose."""
    return complex(math.sin(at.yaw_rad), math.cos(at.yaw_rad))


def leg_velocity(at: L1Motion) -> tuple[complex, float]:
    """The ground velocity for a leg, and its speed, m/s: along the nose at the least speed if slow or backwards."""
    if (speed := abs(at.velocity)) < SLOW_MPS or dot(at.velocity, nose(at)) <= 0.0:
        return SLOW_MPS * nose(at), SLOW_MPS
    return at.velocity, speed


def leg_direction(at: L1Motion, begin: complex, end: complex) -> complex:
    """Unit direction of a leg; of one too short for it, that to its end, or else that of the nose."""
    for way in (end - begin, end - at.place):
        if abs(way) >= SHORT_LEG_M:
            return way / abs(way)
    return nose(at)


def aim_at(to: complex, velocity: complex) -> float:
    """Nu, the angle from the velocity to a direction, rad, positive to the right."""
    return math.atan2(cross(to, velocity), dot(velocity, to))


def decided(nu_rad: float, last_nu_rad: float, target_cd: int, yaw_cd: int) -> float:
    """Nu, or the last one where the target is behind and Nu has just changed sides."""
    if (off := (target_cd - yaw_cd) % 36000) > 18000:
        off -= 36000
    behind = abs(nu_rad) > INDECISION_RAD and abs(last_nu_rad) > INDECISION_RAD
    return last_nu_rad if behind and abs(off) > INDECISION_CD and nu_rad * last_nu_rad < 0.0 else nu_rad


def bearing_cd(to: complex) -> int:
    """Direction to a point in whole hundredths of a degree, in (-18000, 18000]."""
    whole = int((0.5 * math.pi + math.atan2(-to.imag, to.real)) % math.tau * 18000.0 / math.pi + 0.5) % 36000
    return whole - 36000 if whole > 18000 else whole


class L1Law(RouteLaw):
    """Flies a route by L1: its lines as legs, its arcs as circles, which do not grow with altitude."""

    def __init__(self, config: L1Config, limits: GuidanceLimits) -> None:
        super().__init__(limits)
        self._has, self._memory, self._leg_time_s = config, L1Memory(), -math.inf

    def demand(self, state: AircraftState, place: PathPoint) -> tuple[float, float]:
        """Roll (rad) of L1 on the nearest line or arc; no airspeed."""
        yaw = (state.heading_rad + math.pi) % math.tau - math.pi
        velocity = complex(state.velocity_east_mps, state.velocity_north_mps)
        at = L1Motion(complex(state.east_m, state.north_m), velocity, yaw, int(100.0 * math.degrees(yaw)) % 36000)
        if place.curvature_1pm == 0.0:
            east, north, ahead_east, ahead_north, _, length, start, *_ = self.progress.segment
            length = min(length, place.arc_length_m - start + FAR_M)
            begin = complex(east, north)
            leg = begin, begin + length * complex(ahead_east, ahead_north)
            since_s, self._leg_time_s = state.time_s - self._leg_time_s, state.time_s
            acceleration, self._memory = follow_leg(at, leg, since_s, self._memory, self._has)
        else:
            bend = place.curvature_1pm
            circle = L1Circle(complex(*centre_of(place)), abs(1.0 / bend), -math.copysign(1.0, bend))
            acceleration, self._memory = follow_circle(at, circle, self._memory, self._has)
        return math.atan(acceleration / GRAVITY_MPS2), math.nan
