"""The route of a mission as fixed-wing autopilots fly it: lines and arcs, with altitude and airspeed along them."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from aircraft.guidance.altitude import VerticalProfile
from aircraft.guidance.circle import SHARE_ROUNDING, Circle, Pose, end_of, sampled, segment, shortest_way
from aircraft.guidance.waypoints import MissionLeg
from aircraft.interface import FloatArray, Route
from aircraft.route import SegmentRow
from harness.files.input_file import InputError
from harness.files.mavlink.items import GROUND
from harness.run_files.given_path import SAME_PLACE_M, CutCorner, FlyBy
from harness.run_files.mission import vertices
from harness.run_files.mission.program import Loiter, MissionStep, Program
from harness.run_files.mission.vertices import Flying, MissionRoute, Vertex

LANDING_HEIGHT_M: Final = 15.0  # a landing is flown down to this height; flare and touchdown are not
CLIMB_SHARE: Final = 0.8  # a loiter to an altitude takes as long as a climb at this share of the fastest rate
ARC_RAD: Final = math.pi / 2  # a segment on a circle spans at most this angle
SAMPLE_M: Final = 5.0  # points along circles are this close together, for comparison with a track
SAME_DIRECTION: Final = 1e-5  # directions that differ by less than this (rad) make no corner
FAR_M: Final = 1e5  # a leg of this length has room for every turn


def mission_route(mission: Program, flying: Flying, source: str) -> MissionRoute:
    """Makes the route of a mission that lies in the plane; `source` names it in faults."""
    build = _RouteBuilder(mission, flying)
    for number, step in enumerate(mission.steps):
        build.fly(number, step)
    build.flush()
    if not build.rows:
        raise InputError(f"{source}: all its items are in one place; a path has at least 2")
    return build.route()


class _RouteBuilder:
    """A route while it is made: the rows made so far, and the run of waypoints that comes next."""

    def __init__(self, mission: Program, flying: Flying) -> None:
        self._steps, self._flying, self._home_m = mission.steps, flying, mission.home_altitude_m
        self.rows: list[SegmentRow] = []
        self._length_m = 0.0
        self._pose: Pose | None = None
        self._run: list[Vertex] = []
        self._given: list[FloatArray] = []
        self._corners: list[CutCorner] = []
        self._passed: list[tuple[int | None, complex | None, float]] = []  # each: item, waypoint, arc length
        self._altitudes: list[tuple[float, float]] = []
        self._speeds: list[tuple[float, float, float]] = []
        self._notes: list[str] = []
        self._over_unknown: dict[int, None] = {}
        self._legs: list[MissionLeg] = []
        self._commanded_mps = self._mps = flying.airspeed_mps
        if mission.steps[0].airspeed_mps is not None:  # the aircraft comes with its own
            self._speeds.append((0.0, self._commanded_mps, self._mps))
        self._altitude_m = math.nan

    def fly(self, number: int, step: MissionStep) -> None:
        """Adds a step to the route, its airspeed first: a waypoint, a loiter, or the end of an approach."""
        if step.airspeed_mps is not None:
            self._change_speed(step, step.airspeed_mps or self._flying.airspeed_mps)
        at = step.place if step.place is not None else self._current_place()
        assert at is not None  # the first step has a place
        ground_m = self._ground_m(at, step.item if step.above == GROUND else None)
        altitude = vertices.altitude_m(step, self._home_m, ground_m, self._altitude_m)
        if step.loiter is not None:
            self._loiter(number, step.loiter, at, altitude)
        elif step.landing:
            self._land(step, at, altitude)
        else:
            agl = step.height_m if step.above == GROUND and self._flying.ground is not None else None
            self._add(Vertex(at, altitude, step.item, step.acceptance_m, agl))

    def _change_speed(self, step: MissionStep, commanded_mps: float) -> None:
        low, high = self._flying.airspeed_range_mps
        self._commanded_mps, self._mps = commanded_mps, min(max(commanded_mps, low), high)
        if self._mps != commanded_mps:
            flown = f"{commanded_mps:g} m/s asked for before item {step.item}: flown at {self._mps:g} m/s"
            held = f"the aircraft holds speed and altitude in turns from {low:g} to {high:g} m/s"
            self._notes.append(f"{flown}; {held}")

    def _current_place(self) -> complex | None:
        if self._run:
            return self._run[-1].place
        return self._pose[0] if self._pose else None

    def _ground_m(self, place: complex, item: int | None) -> float:
        """Returns the height of the ground; that of home where it is not known, which is noted of the item."""
        ground = self._flying.ground
        height = float(ground(np.array([place.real]), np.array([place.imag]))[0]) if ground else math.nan
        if item is not None and not math.isfinite(height):
            self._over_unknown[item] = None
        return height if math.isfinite(height) else self._home_m

    def _add(self, vertex: Vertex) -> None:
        self._run.append(vertex._replace(commanded_mps=self._commanded_mps, airspeed_mps=self._mps))
        self._altitude_m = vertex.altitude_m

    def _heading(self) -> complex | None:
        """Returns the direction at the end of the route so far; None before its first way."""
        for before, after in zip(self._run[-2::-1], self._run[::-1], strict=False):
            if abs(after.place - before.place) > SAME_PLACE_M:
                return (after.place - before.place) / abs(after.place - before.place)
        return self._pose[1] if self._pose else None

    def _climbing_m(self, altitude: float) -> float:
        """Returns the way (m) to climb or sink from the present altitude to another; at least 1 m."""
        rise = altitude - self._altitude_m
        up, down = self._flying.climb_mps(self._mps)
        rate = CLIMB_SHARE * (up if rise > 0.0 else down)
        return max(abs(rise) / max(rate, 1e-3 * self._mps) * self._mps, 1.0)

    def _land(self, step: MissionStep, place: complex, altitude: float) -> None:
        """Adds the end of an approach, `LANDING_HEIGHT_M` above the landing; over it if no higher before."""
        here, above = self._current_place(), altitude + LANDING_HEIGHT_M
        if here is None or not self._altitude_m > above:
            self._add(Vertex(place, max(altitude, min(above, self._altitude_m)), step.item))
            return
        share = (self._altitude_m - above) / (self._altitude_m - altitude)
        self._add(Vertex(here + share * (place - here), above, step.item))

    def _loiter(self, number: int, loiter: Loiter, center: complex, altitude: float) -> None:
        """Adds the turn onto a loiter's circle, the way round it, and the turn off towards the next place."""
        turn_m, item = self._flying.turn_radius_m(self._mps), self._steps[number].item
        circle = Circle(center, loiter.radius_m or turn_m, -1 if loiter.clockwise else 1)
        before = self._altitude_m if math.isfinite(self._altitude_m) else altitude
        entry = before if loiter.turns is None and loiter.time_s is None else altitude
        self._altitude_m = before
        pose = self._join(item, circle, turn_m, entry)
        length = self._around_m(loiter, circle, altitude)
        target = self._target(number, center)
        length += circle.further_m(pose[0], target, length)
        self._speeds.append((self._length_m, self._commanded_mps, self._mps))
        self._altitudes.append((self._length_m, entry))
        swept, bend_1pm = length / circle.radius_m, circle.side / circle.radius_m
        if length > SAME_PLACE_M:
            route = Route(np.array(segment(pose, bend_1pm, math.tau * circle.radius_m)), loiter=True)
            around, centre_m = (self._length_m, self._length_m + length), (center.real, center.imag)
            self._legs.append(MissionLeg(route, around, centre_m=centre_m, swept_rad=swept))
        pieces = max(math.ceil(swept / ARC_RAD), 1)
        for _ in range(pieces):
            pose = self._append(segment(pose, bend_1pm, length / pieces)) or pose
        self._altitudes.append((self._length_m, altitude))
        self._passed.append((item, None, self._length_m))
        self._altitude_m = altitude
        if target is not None and circle.left_to(target) is None:
            turn = shortest_way(pose, Circle(target, 0.0, 1), turn_m)
            pose = self._turn(turn[: len(turn) - (turn[-1][4] == 0.0)]) or pose
        self._passed.append((None, pose[0], self._length_m))
        self._add(Vertex(pose[0], altitude, None))

    def _around_m(self, loiter: Loiter, circle: Circle, altitude: float) -> float:
        """Returns the way (m) of a loiter round its circle: by turns, by time, or as long as it climbs."""
        if loiter.turns is not None:
            return loiter.turns * math.tau * circle.radius_m
        return self._climbing_m(altitude) if loiter.time_s is None else loiter.time_s * self._mps

    def _target(self, number: int, center: complex) -> complex | None:
        """Returns the place for which a circle is left; None where the next item goes on round it or has no place."""
        after = next(iter(self._steps[number + 1 : number + 2]), None)
        if after is None or after.place is None:
            return None
        return None if after.loiter and abs(after.place - center) < SAME_PLACE_M else after.place

    def _join(self, item: int, circle: Circle, turn_m: float, altitude: float) -> Pose:
        """Adds the way onto a circle, and returns the pose there."""
        here, heading = self._current_place(), self._heading()
        touch = circle.joined_from(here) if here is not None and self._run else None
        if here is not None and touch is not None and self._flying.heads_for_centres:
            self._join_from_far(item, circle, circle.edge(here), altitude)
        elif touch is not None and not self._turns_to(touch) and not self._is_near(touch, turn_m):
            self._add(Vertex(touch, altitude, None))
            self.flush()
        elif heading is not None:  # over the waypoint, and from there by a turn
            self.flush()
            assert self._pose is not None
            self._turn([] if circle.contains(self._pose) else shortest_way(self._pose, circle, turn_m))
        else:  # the route begins on the circle
            edge = circle.edge(here if here not in (None, circle.center) else circle.center + 1j)
            self._run, self._pose = [], (edge, circle.direction(edge))
        assert self._pose is not None
        self._passed.append((None, self._pose[0], self._length_m))
        return self._pose

    def _turns_to(self, place: complex) -> bool:
        """Tells whether a line to a place begins with a turn, as where a circle was just left."""
        if len(self._run) > 1 or self._pose is None:
            return False
        way = place - self._pose[0]
        return abs(way - abs(way) * self._pose[1]) > SAME_DIRECTION * abs(way)

    def _join_from_far(self, item: int, circle: Circle, edge: complex, altitude: float) -> None:
        """Adds the way onto a circle for autopilots that head for its centre, with a corner where they join it."""
        self._add(Vertex(edge, altitude, None, centre=circle.center))
        self.flush()
        self._pose = edge, circle.direction(edge)
        if circle.radius_m < self._flying.least_radius_m(self._mps):
            return  # a corner's limit would hold all round a circle that cannot be flown
        turn_deg, course_deg = -90.0 * circle.side, 90.0 - math.degrees(cmath.phase(circle.center - edge))
        shape = (turn_deg, 0.0, 0.0, self._length_m, 0.0, 0.0, course_deg % 360.0)
        self._corners.append(CutCorner(item, edge.real, edge.imag, *shape))

    def _is_near(self, touch: complex, turn_m: float) -> bool:
        """Tells whether a corner at the last waypoint has no room before the next place: it were wider further away."""
        last, way = self._run[-1], touch - self._run[-1].place
        if abs(way) <= SAME_PLACE_M:
            return False
        ends = (last._replace(place=last.place + share * way) for share in (1.0, FAR_M / abs(way)))
        corners = (vertices.rounded([*self._run, end], self._flying).corners for end in ends)
        here, there = (sum(min(corner.radius_m, turn_m) for corner in each) for each in corners)
        return here < there * (1.0 - SHARE_ROUNDING)

    def _turn(self, rows: Sequence[SegmentRow]) -> Pose | None:
        """Adds a way that is flown as it is, whatever the law; returns the pose at the end of the route, if any."""
        if rows:
            along = (self._length_m, self._length_m + sum(row[5] for row in rows))
            self._legs.append(MissionLeg(Route(np.array(rows)), along))
        return self._append(rows)

    def _append(self, rows: Sequence[SegmentRow]) -> Pose | None:
        """Adds lines and arcs as they are; returns the pose at the end of the route, if any."""
        for row in rows:
            self._given.append(np.add(sampled(row, math.ceil(row[5] / SAMPLE_M)), (0.0, 0.0, self._length_m)))
            self.rows.append(row)
            self._length_m += row[5]
            self._pose = end_of(row)
        return self._pose

    def flush(self) -> None:
        """Makes lines and arcs of the waypoints since the last circle; notes altitudes, speeds and items along them."""
        run, self._run = self._run, []
        if not run:
            return
        begins_m = self._length_m
        points = np.array([(vertex.place.real, vertex.place.imag) for vertex in run])
        stations = np.full(len(run), begins_m)
        if np.hypot(*(points - points[0]).T).max() > SAME_PLACE_M:
            way = vertices.rounded(run, self._flying)
            stations = begins_m + way.stations_of(points)
            self._given.append(np.add(way.given_m, (0.0, 0.0, begins_m)))
            for each in way.corners:
                item, along_m = run[each.waypoint].item or 0, each.arc_length_m + begins_m
                self._corners.append(replace(each, waypoint=item, arc_length_m=along_m))
            self.rows += [(*row,) for row in way.segments.tolist()]
            self._pose = end_of(self.rows[-1])
            self._length_m += float(way.segments[:, 5].sum())
            self._legs += vertices.legs_of(run, stations)
        elif self._pose is None:  # nothing was flown to it yet
            self._run = run[-1:]
        for place, (vertex, station) in enumerate(zip(run, stations.tolist(), strict=True)):
            before = float(stations[max(place - 1, 0)])
            self._speeds.append((before, vertex.commanded_mps, vertex.airspeed_mps))
            if place and vertex.agl_m is not None:
                ground = partial(self._ground_m, item=vertex.item)
                self._altitudes += vertices.above_ground((run[place - 1], vertex), (before, station), ground)
            self._altitudes.append((station, vertex.altitude_m))
            if vertex.item is not None:
                self._passed.append((vertex.item, vertex.place, station))

    def route(self) -> MissionRoute:
        """Returns the route made."""
        marks = tuple((item, station) for item, _, station in self._passed if item is not None)
        places = [(place, station) for _, place, station in self._passed if place is not None]
        spaced = [b for a, b in pairwise([(math.inf, 0.0), *places]) if abs(b[0] - a[0]) > SAME_PLACE_M]
        every = sorted(self._altitudes, key=lambda each: each[0])
        slope = CLIMB_SHARE * min(self._flying.climb_mps(self._mps)) / self._mps
        along, altitude = np.array(vertices.without_steps(every, lambda: slope)).T
        since, speeds, flown = np.array(self._speeds).T
        points = np.array([(place.real, place.imag) for place, _ in spaced])
        stations = np.array([station for _, station in spaced])
        rows, given, corners = np.array(self.rows), np.concatenate(self._given), tuple(self._corners)
        way = FlyBy(points, rows, corners, np.arange(len(spaced)), stations, given)
        profile = VerticalProfile(along, altitude, np.maximum.accumulate(since), flown)
        return MissionRoute(
            way, profile, speeds, marks, tuple(self._notes), tuple(self._legs), tuple(self._over_unknown)
        )
