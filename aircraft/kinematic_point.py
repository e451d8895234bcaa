"""A point that flies its route exactly and turns on the spot: what raw paths are scored with."""

from __future__ import annotations

import math

import numpy as np

from aircraft.guidance.interface import GuidanceOutput
from aircraft.interface import STEP_RATE_HZ, AircraftState, FloatArray, Route
from aircraft.route import route_length, route_point
from aircraft.start import Atmosphere, StartConditions

JOINED_M = 1e-6
"""A route that begins nearer than this begins where the point is."""

JOINING_STEPS = 8


class KinematicPoint:
    """Flight model and guidance in one: moves along its route at the commanded airspeed, whatever its bends.

    Implements `FlightModel` and `GuidanceLaw`. The air does not touch it:
    speed over the ground is the airspeed, wind and turbulence are ignored. Before its first route it flies
    straight on. A route that begins elsewhere is joined in a straight line, where it comes near; the
    cross-track error is then the distance to that place, else 0. Beyond the end it goes straight on, or round
    a closing loiter.
    """

    def __init__(
        self,
        start: StartConditions,
        atmosphere: Atmosphere | None = None,
        step_rate_hz: int = STEP_RATE_HZ,
    ) -> None:
        """Starts along the course."""
        del atmosphere
        self.command(0.0, start.altitude_m, start.airspeed_mps)
        self._step, self._step_rate_hz = 0, step_rate_hz
        tangent = math.sin(start.course_rad), math.cos(start.course_rad)
        self._way = Route(np.array([[start.east_m, start.north_m, *tangent, 0.0, 1.0]]))
        self._along_m = 0.0
        self._gap_m = 0.0
        self._joins_at_m = 0.0

    @property
    def step_rate_hz(self) -> int:
        """Integration steps per simulated second."""
        return self._step_rate_hz

    def state(self) -> AircraftState:
        """The state now; on a corner, in the direction that it leaves it."""
        east, north, tangent_east, tangent_north = route_point(self._way, self._along_m)
        speed = self._airspeed
        return AircraftState(
            time_s=self._step / self._step_rate_hz,
            east_m=east,
            north_m=north,
            up_m=self._altitude,
            velocity_east_mps=speed * tangent_east,
            velocity_north_mps=speed * tangent_north,
            velocity_up_mps=0.0,
            heading_rad=math.atan2(tangent_east, tangent_north) % math.tau,
            roll_rad=0.0,
            pitch_rad=0.0,
            airspeed_mps=speed,
            load_factor=1.0,
        )

    def command(self, roll_rad: float, altitude_m: float, airspeed_mps: float) -> None:
        """Sets altitude and airspeed, which hold at once; a point does not roll."""
        del roll_rad
        self._altitude, self._airspeed = altitude_m, airspeed_mps

    def advance(self, steps: int) -> None:
        """Moves on by `steps` steps of 1 / step_rate_hz."""
        self._step += steps
        self._along_m += self._airspeed * steps / self._step_rate_hz

    def fault(self) -> str | None:
        """None: a point is always under control."""
        return None

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route."""
        east, north, *_ = route_point(self._way, self._along_m)
        arc_length_m = _nearest_station(route, arc_length_m, east, north)
        joint_east, joint_north, *_ = route_point(route, arc_length_m)
        rows = _rest(route, arc_length_m)
        gap = math.hypot(joint_east - east, joint_north - north)
        if gap > JOINED_M:
            towards = (joint_east - east) / gap, (joint_north - north) / gap
            rows = np.vstack(([[east, north, *towards, 0.0, gap]], rows))
        self._way = Route(rows, route.loiter)
        self._gap_m = gap if gap > JOINED_M else 0.0
        self._joins_at_m, self._along_m = arc_length_m, 0.0

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Says where on its route the point is; it has nothing to decide."""
        on_route_m = self._along_m - self._gap_m
        return GuidanceOutput(
            roll_command_rad=0.0,
            cross_track_m=max(-on_route_m, 0.0),
            arc_length_m=self._joins_at_m + max(on_route_m, 0.0),
            bank_saturated=False,
            past_end=not self._way.loiter and self._along_m > route_length(self._way),
        )


def _nearest_station(route: Route, arc_length_m: float, east_m: float, north_m: float) -> float:
    """The station of the point of a route nearest to a place, sought from a station on by Newton's method."""
    nearest, gap, station = arc_length_m, math.inf, arc_length_m
    for _ in range(JOINING_STEPS):
        at_east, at_north, tangent_east, tangent_north = route_point(route, station)
        away_east, away_north = east_m - at_east, north_m - at_north
        if math.hypot(away_east, away_north) < gap:
            nearest, gap = station, math.hypot(away_east, away_north)
        station = max(station + away_east * tangent_east + away_north * tangent_north, arc_length_m)
    return nearest


def _rest(route: Route, arc_length_m: float) -> FloatArray:
    """(n, 6) what is left of a route from a station on; a closing loiter is left whole."""
    ends = np.cumsum(route.segments[:, 5])
    index = int(np.searchsorted(ends, arc_length_m, side="right"))
    here = route_point(route, arc_length_m)
    if index == len(ends) and not route.loiter:
        return np.array([[*here, 0.0, 1.0]])
    index = min(index, len(ends) - 1)
    curvature, length = route.segments[index, 4:].tolist()
    whole = route.loiter and index == len(ends) - 1
    first = [*here, curvature, length if whole else float(ends[index]) - arc_length_m]
    return np.vstack(([first], route.segments[index + 1 :]))
