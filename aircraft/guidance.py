"""Route following: from where the aircraft is to the roll angle it should hold.

The law is path curvature plus a second-order correction of the cross-track error,

    a = kappa Vg^2 - 2 zeta omega e_dot - omega^2 e,    phi = atan(a / (g cos(chi - psi)))

with a, e positive to the right of the path (the curvature kappa is therefore taken positive to the right
here), chi the course and psi the heading. Curvature is that where the aircraft will be when it has rolled,
averaged over the time that rolling into a turn takes, so that line and arc join without a bump. Clothoids
in their place gained too little for what they would ask of every planner: on the 14-turn courses of
`harness.tracking`, three seeds, calm, 20 updates a second, p95/max were .049/.091 m with this and .074/.085
m with clothoids as long as the roll-in for the Aerosonde, .101/.182 and .063/.119 m for c172p, .101/.644
and .110/.417 m for T38. The roll command leads by the time constant of the roll loop, so that roll itself
follows the law. Wind enters through the ground velocity alone, except where it is stronger than the
aircraft: then the wind is estimated as ground velocity less air velocity, and `air_direction` says where to
head.
See R. W. Beard and T. W. McLain, "Small Unmanned Aircraft", chapter 9 (coordinated turn in wind), and
PX4's npfg for the same use of ground and air velocity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from aircraft.interface import AircraftState, Route
from aircraft.route import SegmentRow, arc_point

GRAVITY_MPS2 = 9.80665
UPDATE_RATE_HZ = 10
"""Roll commands a second. Flown on the 14-turn courses of `harness.tracking`, 20 a second track no better: the command
is held for half an update more, which the preview makes up for."""

DAMPING = 0.9
INTERCEPT_SINE = 0.7
"""Sine of the steepest angle to the path at which a far-off aircraft approaches it."""


TYPICAL_BANK_RAD = math.radians(30.0)
"""A step of curvature is blended over the time that rolling this far takes."""


@dataclass(frozen=True)
class GuidanceLimits:
    """What guidance may ask of an aircraft.

    Attributes:
        bank_limit_rad: largest roll command.
        roll_rate_radps: fastest change of the roll command.
        roll_lag_s: time constant of roll behind its command; the command leads by it.
        roll_delay_s: what further delay there is (actuators, the roll mode).
        bandwidth_radps: natural frequency omega of the cross-track correction, about a third of 1 / roll_lag_s.
    """

    bank_limit_rad: float
    roll_rate_radps: float
    roll_lag_s: float
    roll_delay_s: float
    bandwidth_radps: float


class GuidanceOutput(NamedTuple):
    """One decision of the path follower."""

    roll_command_rad: float
    cross_track_m: float
    """Distance from the path, positive to its right."""
    station_m: float
    """Distance along the route of the nearest point; grows on in a loiter."""
    bank_saturated: bool
    """The bank limit cut the command."""
    past_end: bool
    """The route is flown out; straight on along its last tangent."""


class PathFollower:
    """Follows a route from one update to the next, `update_rate_hz` times a second.

    Progress is local: the nearest point is sought from the last one onwards, so a route may cross itself.
    """

    def __init__(self, limits: GuidanceLimits, update_rate_hz: float = UPDATE_RATE_HZ) -> None:
        """Makes a follower without a route.

        Args:
            limits: what may be asked of the aircraft.
            update_rate_hz: how often `update` will be called.
        """
        self._roll_step = limits.roll_rate_radps / update_rate_hz
        # The held command acts on average half an update late.
        self._lead_s = limits.roll_delay_s + 0.5 / update_rate_hz
        self._lead_updates = limits.roll_lag_s * update_rate_hz
        self._blend_s = max(TYPICAL_BANK_RAD / limits.roll_rate_radps, 1.0 / update_rate_hz)
        self._bank_limit = limits.bank_limit_rad
        self._bandwidth = limits.bandwidth_radps
        self._two_zeta_omega = 2.0 * DAMPING * limits.bandwidth_radps
        self._pull_per_s = limits.bandwidth_radps / (2.0 * DAMPING)
        self._roll = 0.0
        self._rows: list[SegmentRow] = []
        self._starts: list[float] = []
        self._stops: list[float] = []
        self._turned: list[float] = []
        self._loiter = False
        self._length = 0.0
        self._index = self._last = 0
        self._along = 0.0

    def follow(self, route: Route, station_m: float = 0.0) -> None:
        """Takes a new route; the roll command goes on from where it is.

        Args:
            route: what to fly.
            station_m: where on it to begin looking for the nearest point, m from its start.
        """
        self._rows = [(e, n, te, tn, k, length) for e, n, te, tn, k, length in route.segments.tolist()]
        self._loiter = route.loiter
        self._starts, self._turned = [], []
        start = turned = 0.0
        for row in self._rows:
            self._starts.append(start)
            self._turned.append(turned)
            start += row[5]
            turned += row[4] * row[5]
        self._length = start
        self._stops = [*self._starts[1:], math.inf if route.loiter else start]
        self._last = len(self._rows) - 1
        self._index = 0
        while self._index < self._last and self._starts[self._index + 1] <= station_m:
            self._index += 1
        self._along = station_m - self._starts[self._index]

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Decides the roll command for the next update interval.

        Args:
            state: the aircraft now.

        Returns:
            Roll command, and where the aircraft is relative to the route.

        Raises:
            RuntimeError: if there is no route yet.
        """
        if not self._rows:
            raise RuntimeError("follow() a route before update()")
        _, here_east, here_north, _, velocity_east, velocity_north, _, heading, _, _, airspeed, _, _ = state
        cross, tangent_east, tangent_north = self._project(here_east, here_north)
        index = self._index
        station = self._starts[index] + self._along
        speed = math.sqrt(velocity_east * velocity_east + velocity_north * velocity_north)
        if speed < 1.0:
            speed = 1.0
        along_mps = velocity_east * tangent_east + velocity_north * tangent_north
        cross_mps = velocity_east * tangent_north - velocity_north * tangent_east

        bank_limit = self._bank_limit
        heading_east, heading_north = math.sin(heading), math.cos(heading)
        ahead_mps = velocity_east * heading_east + velocity_north * heading_north
        # The wind, the ground velocity less the air velocity, is not weaker than the airspeed.
        if speed * speed >= 2.0 * airspeed * ahead_mps:
            wind_east = velocity_east - airspeed * heading_east
            wind_north = velocity_north - airspeed * heading_north
            # Left of the path by this sine, as far as it can be made good.
            left = INTERCEPT_SINE * _within(1.0, cross * self._pull_per_s / airspeed)
            ahead = math.sqrt(1.0 - left * left)
            bearing_east = ahead * tangent_east - left * tangent_north
            bearing_north = ahead * tangent_north + left * tangent_east
            east, north = air_direction(wind_east, wind_north, airspeed, bearing_east, bearing_north)
            turn = math.atan2(
                east * heading_north - north * heading_east, east * heading_east + north * heading_north
            )
            wanted = math.atan(airspeed * self._bandwidth * turn / GRAVITY_MPS2)
        elif along_mps <= 0.0:
            wanted = -bank_limit if cross_mps > 0.0 else bank_limit
        else:
            pull = _within(INTERCEPT_SINE * speed, cross * self._pull_per_s)
            least = 0.3 * speed
            # Lift acts across the course, the correction across the path.
            across = -self._two_zeta_omega * (cross_mps + pull) * speed
            across /= along_mps if along_mps > least else least
            # The curvature where the aircraft will be when it has rolled, averaged over the way that takes.
            blend = speed * self._blend_s
            low = station + speed * self._lead_s - 0.5 * blend
            if self._starts[index] <= low and low + blend <= self._stops[index]:
                curvature = self._rows[index][4]
            else:
                curvature = (self._turn_at(low + blend) - self._turn_at(low)) / blend
            acceleration = across - curvature * (speed * speed)
            cosine = ahead_mps / speed
            wanted = math.atan(acceleration / (GRAVITY_MPS2 * (cosine if cosine > 0.2 else 0.2)))
        allowed = _within(bank_limit, wanted)
        step = _within(self._roll_step, allowed - self._roll)
        self._roll += step
        # Ahead by what roll lags behind its command: roll then moves at the reference's rate.
        command = _within(bank_limit, self._roll + self._lead_updates * step)
        past_end = not self._loiter and station > self._length
        # At once: the constructor of a NamedTuple takes twice as long.
        return tuple.__new__(GuidanceOutput, (command, cross, station, allowed != wanted, past_end))

    def _project(self, east: float, north: float) -> tuple[float, float, float]:
        """Moves to the nearest point; cross-track error and the unit tangent there."""
        while True:
            row = self._rows[self._index]
            east0, north0, tangent_east, tangent_north, curvature, length = row
            begun = 0.0
            if curvature and self._along > length and self._index == self._last and not self._loiter:
                east0, north0, tangent_east, tangent_north = arc_point(row, length)
                curvature, begun = 0.0, length
            if curvature:
                along, cross, tangent_east, tangent_north = _on_arc(row, east, north, self._along)
            else:
                to_east, to_north = east - east0, north - north0
                along = begun + to_east * tangent_east + to_north * tangent_north
                cross = to_east * tangent_north - to_north * tangent_east
            if along <= length or self._index == self._last:
                self._along = along if along > 0.0 else 0.0
                return cross, tangent_east, tangent_north
            self._index += 1
            self._along = 0.0

    def _turn_at(self, station: float) -> float:
        """Direction change of the route from its start to a station, rad, positive to the left."""
        index = self._index
        while index > 0 and station < self._starts[index]:
            index -= 1
        last = self._last
        while index < last and station >= self._starts[index + 1]:
            index += 1
        along = station - self._starts[index]
        if index == last and not self._loiter:
            along = min(along, self._rows[index][5])
        return self._turned[index] + self._rows[index][4] * along


def _within(limit: float, value: float) -> float:
    """The value between minus and plus a limit that is nearest to it."""
    return value if -limit <= value <= limit else math.copysign(limit, value)


def _on_arc(row: SegmentRow, east: float, north: float, near_m: float) -> tuple[float, float, float, float]:
    """Where a point is along and to the right of an arc, and the unit tangent there.

    The point is within half a turn of a place along the arc.
    """
    east0, north0, tangent_east, tangent_north, curvature, _ = row
    # The centre lies 1/curvature to the left of the start; angles are counted along the flight.
    radius = 1.0 / curvature
    east, north = east - east0 + radius * tangent_north, north - north0 - radius * tangent_east
    outward_east, outward_north = tangent_north * radius, -tangent_east * radius
    angle = math.atan2(
        outward_east * north - outward_north * east, outward_east * east + outward_north * north
    )
    expected = near_m * curvature
    angle = expected + math.remainder(angle - expected, math.tau)
    distance = math.hypot(east, north)
    cross = distance - radius if radius > 0.0 else -radius - distance
    sine, cosine = math.sin(angle), math.cos(angle)
    return (
        angle * radius,
        cross,
        tangent_east * cosine - tangent_north * sine,
        tangent_east * sine + tangent_north * cosine,
    )


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
    length = max(math.hypot(east, north), 1e-9)
    return east / length, north / length
