"""The route that an aeroplane flies on a mission: lines and arcs, with altitude and airspeed along them.

As fixed-wing autopilots fly: waypoints are flown by, the altitude goes from one to the next along the leg (ArduPilot's
glide slope, PX4's first-order hold), circles are joined and left along tangents.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from aircraft.guidance.altitude import VerticalProfile
from aircraft.guidance.mission_legs import MissionLeg, straight
from aircraft.interface import Route
from harness.files.input_file import InputError
from harness.run_files.given_path import SAME_PLACE_M, CutCorner, FloatArray, FlyBy
from harness.run_files.mission.circle import (
    Pose,
    Row,
    arc,
    direction_on,
    end_of,
    joins_at,
    leaves_at,
    on_circle,
    onto,
    towards,
    turns_to,
    up_to,
)
from harness.run_files.mission.flying import Flying, MissionRoute
from harness.run_files.mission.items import GROUND
from harness.run_files.mission.short_leg import begins_before_m, corner_radius_m, short_leg
from harness.run_files.mission.steps import MissionStep, Program
from harness.run_files.mission.waypoint_run import (
    Vertex,
    altitude_m,
    followed,
    legs_of,
    rounded,
    without_steps,
)

LANDING_HEIGHT_M: Final = 15.0
"""A landing is flown down to this height above its place; flare and touchdown are not."""

CLIMB_SHARE: Final = 0.8
"""A loiter to an altitude and a climb straight on are as long as this share of the fastest climb takes."""

ARC_RAD: Final = math.pi / 2
"""Longest arc of a circle in one segment."""

SAMPLE_M: Final = 5.0
"""Points along circles are this close together, where a track is compared with them."""


def mission_route(mission: Program, flying: Flying, source: str) -> MissionRoute:
    """Makes the route of a mission.

    Args:
        mission: the mission.
        flying: what it is flown with.
        source: its name, for faults.

    Raises:
        InputError: all of it is in one place.
    """
    build = _Build(mission, flying)
    for number in range(len(mission.steps)):
        build.fly(number)
    build.flush()
    if not build.rows:
        raise InputError(f"{source}: all its items are in one place; a path has at least 2")
    return build.route()


class _Build:
    """A route while it is made."""

    def __init__(self, mission: Program, flying: Flying) -> None:
        self._steps, self._flying = mission.steps, flying
        self._home_m = mission.home_altitude_m
        self.rows: list[Row] = []
        self._length_m = 0.0
        self._pose: Pose | None = None
        self._run: list[Vertex] = []
        self._speeds_of_run: list[tuple[float, float]] = []  # asked and flown on the way to each vertex
        self._given: list[FloatArray] = []
        self._corners: list[CutCorner] = []
        self._waypoints: list[tuple[complex, float]] = []
        self._altitudes: list[tuple[float, float]] = []
        self._speeds: list[tuple[float, float, float]] = []
        self._marks: list[tuple[int, float]] = []
        self._notes: list[str] = []
        self._legs: list[MissionLeg] = []
        self._asked_mps = self._mps = flying.airspeed_mps
        if mission.steps[0].airspeed_mps is not None:  # the aircraft comes with its own
            self._speeds.append((0.0, self._asked_mps, self._mps))
        self._altitude_m = math.nan

    def fly(self, number: int) -> None:
        """Adds a step to the route."""
        step = self._steps[number]
        if step.airspeed_mps is not None:
            self._asked_mps = step.airspeed_mps or self._flying.airspeed_mps
            low, high = self._flying.airspeed_range_mps
            self._mps = min(max(self._asked_mps, low), high)
            if self._mps != self._asked_mps:
                self._notes.append(
                    f"{self._asked_mps:g} m/s asked for before item {step.item}: flown at {self._mps:g} m/s; the "
                    f"aircraft holds speed and altitude in turns from {low:g} to {high:g} m/s"
                )
        place = step.place
        here = self._here()
        at = place if place is not None else here
        if step.straight:
            self._straight(step)
            return
        assert at is not None  # the first step has a place
        ground_m = self._ground_m(at)
        altitude = altitude_m(step, self._home_m, ground_m, self._altitude_m)
        if step.loiter is not None:
            self._loiter(number, at, altitude)
        elif step.landing:
            self._land(step, at, altitude)
        else:
            agl = step.height_m if step.above == GROUND and self._flying.ground is not None else None
            self._add(Vertex(at, altitude, step.item, step.acceptance_m, agl))

    def _here(self) -> complex | None:
        if self._run:
            return self._run[-1].place
        return self._pose[0] if self._pose else None

    def _ground_m(self, place: complex) -> float:
        """Height of the ground; that of home where it is not known."""
        if self._flying.ground is None:
            return self._home_m
        height = float(self._flying.ground(np.array([place.real]), np.array([place.imag]))[0])
        return height if math.isfinite(height) else self._home_m

    def _add(self, vertex: Vertex) -> None:
        self._run.append(vertex)
        self._speeds_of_run.append((self._asked_mps, self._mps))
        self._altitude_m = vertex.altitude_m

    def _heading(self) -> complex | None:
        """Direction at the end of what is there."""
        for before, after in zip(self._run[-2::-1], self._run[::-1], strict=False):
            if abs(after.place - before.place) > SAME_PLACE_M:
                return (after.place - before.place) / abs(after.place - before.place)
        return self._pose[1] if self._pose else None

    def _straight(self, step: MissionStep) -> None:
        heading, here = self._heading(), self._here()
        if heading is None or here is None:
            self._notes.append(f"item {step.item}: not flown, there is no course before it")
            return
        altitude = altitude_m(step, self._home_m, self._ground_m(here), self._altitude_m)
        self._add(Vertex(here + self._climbing_m(altitude) * heading, altitude, step.item))

    def _climbing_m(self, altitude_m: float) -> float:
        """How far it takes to climb or sink from the present altitude to another; 1 m at the least."""
        rise = altitude_m - self._altitude_m
        up, down = self._flying.climb_mps(self._mps)
        rate = CLIMB_SHARE * (up if rise > 0.0 else down)
        return max(abs(rise) / max(rate, 1e-3 * self._mps) * self._mps, 1.0)

    def _land(self, step: MissionStep, place: complex, altitude: float) -> None:
        here, above = self._here(), altitude + LANDING_HEIGHT_M
        if here is None or not self._altitude_m > above:
            self._add(Vertex(place, max(altitude, min(above, self._altitude_m)), step.item))
            return
        share = (self._altitude_m - above) / (self._altitude_m - altitude)
        self._add(Vertex(here + share * (place - here), above, step.item))

    def _loiter(self, number: int, center: complex, altitude: float) -> None:
        step = self._steps[number]
        assert step.loiter is not None
        loiter, turn_m = step.loiter, self._flying.turn_radius_m(self._mps)
        radius, side = loiter.radius_m or turn_m, -1 if loiter.clockwise else 1
        climbs = loiter.turns is None and loiter.time_s is None
        before = self._altitude_m if math.isfinite(self._altitude_m) else altitude
        entry = before if climbs else altitude
        self._altitude_m = before
        self._join(step, center, radius, side, turn_m, entry)
        length = self._climbing_m(altitude) if climbs else 0.0
        if loiter.turns is not None:
            length = loiter.turns * math.tau * radius
        elif loiter.time_s is not None:
            length = loiter.time_s * self._mps
        assert self._pose is not None
        target = self._target(number, center, radius, side)
        length += up_to(self._pose, target, length, (center, radius, side))
        self._speeds.append((self._length_m, self._asked_mps, self._mps))
        self._altitudes.append((self._length_m, entry))
        if length > SAME_PLACE_M:
            circle = Route(np.array(arc(*self._pose, side, radius, math.tau)), loiter=True)
            around = (self._length_m, self._length_m + length)
            centre_m = (center.real, center.imag)
            self._legs.append(MissionLeg(circle, around, centre_m=centre_m, swept_rad=length / radius))
        pieces = max(math.ceil(length / radius / ARC_RAD), 1)
        for _ in range(pieces):
            self._append(arc(*self._pose, side, radius, length / radius / pieces))
        self._altitudes.append((self._length_m, altitude))
        self._marks.append((step.item, self._length_m))
        self._altitude_m = altitude
        if target is not None and leaves_at(target, center, radius, side) is None:
            self._turn(towards(self._pose, target, turn_m))
        self._add(Vertex(self._pose[0], altitude, None))

    def _join(
        self, step: MissionStep, center: complex, radius: float, side: int, turn_m: float, altitude: float
    ) -> None:
        """Gets onto a circle."""
        here, heading = self._here(), self._heading()
        touch = joins_at(here, center, radius, side) if here is not None else None
        if here is not None and touch is not None and self._run and self._flying.heads_for_centres:
            self._join_from_far(
                step, center, center + radius * (here - center) / abs(here - center), side, altitude
            )
            return
        alone = len(self._run) <= 1
        if touch is not None and not alone and self._turn_onto((center, radius, side), touch):
            pass
        elif touch is not None and self._run and not (alone and turns_to(self._pose, touch)):
            self._add(Vertex(touch, altitude, None))
            self.flush()
        elif here is not None and heading is not None:
            self.flush()
            assert self._pose is not None
            if not on_circle(self._pose, center, radius, side):
                self._turn(onto(self._pose, center, radius, side, turn_m))
        else:  # it begins here
            out = (here - center) / abs(here - center) if here is not None and here != center else 1j
            self._run, self._speeds_of_run = [], []
            self._pose = center + radius * out, direction_on(center + out, center, side)
        assert self._pose is not None
        self._waypoints.append((self._pose[0], self._length_m))

    def _turn_onto(self, circle: tuple[complex, float, int], touch: complex) -> bool:
        """Gets onto a circle from a waypoint so near that the turn there ends on it; whether that was so."""
        last, heading = self._run[-1], self._heading()
        apart = [
            abs(last.place - each.place) for each in self._run if abs(last.place - each.place) > SAME_PLACE_M
        ]
        if heading is None or not apart or abs(touch - last.place) <= SAME_PLACE_M:
            return False
        before = next(each for each in self._run[::-1] if abs(last.place - each.place) > SAME_PLACE_M)
        angle = cmath.phase((touch - last.place) / heading)
        turn_m = corner_radius_m(self._flying, self._mps, last.acceptance_m, angle)
        leg_m = abs(last.place - before.place)
        back_m = begins_before_m(leg_m, abs(touch - last.place), angle, turn_m)
        if back_m <= 0.0:
            return False
        self._run[-1] = last._replace(place=last.place - back_m * heading)
        self.flush()
        assert self._pose is not None
        made = short_leg(self._pose, (last.place, touch), circle, turn_m, self._length_m)
        self.rows += made.rows
        self._pose, self._length_m = end_of(self.rows[-1]), self._length_m + sum(row[5] for row in made.rows)
        self._given.append(made.given_m)
        begins_m = self._legs.pop().stations_m[0]
        at_m = made.arc_length_m
        self._legs.append(straight((before.place, last.place), (begins_m, at_m), last.acceptance_m or None))
        self._legs.append(straight((last.place, touch), (at_m, self._length_m), 0.0))
        turn_deg = math.degrees(angle)
        place = last.place
        self._corners.append(
            CutCorner(last.item or 0, place.real, place.imag, turn_deg, turn_m, made.cut_m, at_m, made.half_m)
        )
        if last.item is not None:
            self._marks[-1], self._waypoints[-1] = (last.item, at_m), (place, at_m)
        return True

    def _join_from_far(
        self, step: MissionStep, center: complex, edge: complex, side: int, altitude: float
    ) -> None:
        """Gets onto a circle as autopilots do that head for its centre: there is a corner where they join it."""
        self._add(Vertex(edge, altitude, None, centre=center))
        self.flush()
        self._pose = edge, direction_on(edge, center, side)
        self._corners.append(
            CutCorner(step.item, edge.real, edge.imag, -90.0 * side, 0.0, 0.0, self._length_m, 0.0)
        )
        self._waypoints.append((edge, self._length_m))

    def _target(self, number: int, center: complex, radius: float, side: int) -> complex | None:
        """What the aircraft turns to as it leaves a circle; None where it goes on round it or straight."""
        if number + 1 >= len(self._steps):
            return None
        step = self._steps[number + 1]
        place = step.place
        if place is None or step.straight or (step.loiter is not None and abs(place - center) < SAME_PLACE_M):
            return None
        if step.loiter is None or self._flying.heads_for_centres:
            return place
        # From circle to circle along a common tangent: both ends are found in turns.
        other = -1 if step.loiter.clockwise else 1
        wide = step.loiter.radius_m or self._flying.turn_radius_m(self._mps)
        aim: complex = place
        for _ in range(50):
            leave = leaves_at(aim, center, radius, side)
            touch = None if leave is None else joins_at(leave, place, wide, other)
            if touch is None:
                return aim
            aim = touch
        return aim

    def _turn(self, rows: Sequence[Row]) -> None:
        """Adds a way that is flown as it is, whatever the law."""
        if rows:
            along = (self._length_m, self._length_m + sum(row[5] for row in rows))
            self._legs.append(MissionLeg(Route(np.array(rows)), along))
        self._append(rows)

    def _append(self, rows: Sequence[Row]) -> None:
        """Adds lines and arcs as they are."""
        for row in rows:
            places = [
                end_of((*row[:5], share * row[5]))[0]
                for share in np.linspace(0.0, 1.0, 1 + math.ceil(row[5] / SAMPLE_M))
            ]
            along = self._length_m + np.linspace(0.0, row[5], len(places))
            self._given.append(np.column_stack((np.real(places), np.imag(places), along)))
            self.rows.append(row)
            self._length_m += row[5]
            self._pose = end_of(row)

    def flush(self) -> None:
        """Turns the waypoints since the last circle into lines and arcs."""
        run, speeds, self._run, self._speeds_of_run = self._run, self._speeds_of_run, [], []
        if not run:
            return
        length_m = 0.0
        points = np.array([(vertex.place.real, vertex.place.imag) for vertex in run])
        if np.hypot(*(points - points[0]).T).max() <= SAME_PLACE_M:
            stations = np.zeros(len(run))
            if self._pose is None:  # nothing was flown to it yet
                self._run, self._speeds_of_run = run[-1:], speeds[-1:]
        else:
            way = rounded(run, np.array([flown for _, flown in speeds]), self._flying)
            stations = way.stations_of(points)
            self._given.append(way.given_m + np.array((0.0, 0.0, self._length_m)))
            for corner in way.corners:
                item = run[corner.waypoint].item
                self._corners.append(
                    replace(corner, waypoint=item or 0, arc_length_m=corner.arc_length_m + self._length_m)
                )
            self.rows += [(*row,) for row in way.segments.tolist()]
            self._pose, length_m = end_of(self.rows[-1]), float(way.segments[:, 5].sum())
            self._legs += legs_of(run, stations + self._length_m)
        self._note(run, speeds, stations + self._length_m)
        self._length_m += length_m

    def _note(
        self, run: Sequence[Vertex], speeds: Sequence[tuple[float, float]], stations: FloatArray
    ) -> None:
        """Altitudes, speeds and items along waypoints."""
        for place, (vertex, station) in enumerate(zip(run, stations.tolist(), strict=True)):
            before = float(stations[max(place - 1, 0)])
            self._speeds.append((before, *speeds[place]))
            if place and vertex.agl_m is not None:
                self._altitudes += followed((run[place - 1], vertex), (before, station), self._ground_m)
            self._altitudes.append((station, vertex.altitude_m))
            if vertex.item is not None:
                self._marks.append((vertex.item, station))
                self._waypoints.append((vertex.place, station))

    def _slope(self) -> float:
        """Climb over distance that the aircraft flies where no leg is there for it."""
        return CLIMB_SHARE * min(self._flying.climb_mps(self._mps)) / self._mps

    def route(self) -> MissionRoute:
        """What was made."""
        kept = [
            (place, station)
            for number, (place, station) in enumerate(self._waypoints)
            if not number or abs(place - self._waypoints[number - 1][0]) > SAME_PLACE_M
        ]
        places = np.array([(place.real, place.imag) for place, _ in kept])
        every = sorted(self._altitudes, key=lambda each: each[0])
        along, altitude = np.array(without_steps(every, self._slope)).T
        since, asked, flown = np.array(self._speeds).T
        way = FlyBy(
            places,
            np.array(self.rows),
            tuple(self._corners),
            np.arange(len(places)),
            np.array([station for _, station in kept]),
            np.concatenate(self._given),
        )
        profile = VerticalProfile(along, altitude, np.maximum.accumulate(since), flown)
        return MissionRoute(way, profile, asked, tuple(self._marks), tuple(self._notes), tuple(self._legs))
