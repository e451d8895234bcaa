"""Base classes of the baselines: `Replanner` keeps or replaces a path, `Steerer` flies a chosen direction."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planner.geometry.clearance import first_breach, inside_bounds
from planner.geometry.curves import SHORTEST_M, Point, Pose, Segment, turn_onto
from planner.geometry.joining import branch_off, holding_plan
from planner.interface import FloatArray, Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.memory import ObstacleMemory


class Start(NamedTuple):
    """Where a new path leaves the one in effect."""

    pose: Pose
    before: list[Segment]  # of the path in effect up to that pose
    left_m: float  # length that is left of the path in effect; 0 without one, and in a turn to hold in
    cut: bool  # an edge point lies nearer to the path in effect than the clearance


class Replanner(ABC):
    """A planner that keeps its path until an edge point comes nearer to it than the clearance, or a new one is due."""

    every_s = 1.0  # a new path is due when the one in effect is this old

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self.memory = ObstacleMemory(mission.clearance_m)
        self._planned_s = -math.inf

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the path in effect, or plans a new one where it is cut or that is due."""
        self.memory.take_in(request.seen)
        path, at_m = request.flown.path if request.flown else None, request.arc_length_m
        left_m, cut = 0.0, False
        if path is not None:
            left_m = 0.0 if path.loiter else path.length_m - at_m
            cut = math.isfinite(first_breach(path, self.memory.points_m, self.mission.clearance_m, at_m))
            if not cut and not self.due(path, left_m, request.time_s - self._planned_s):
                return Plan(PlanStatus.KEPT, "nothing cuts the path in effect, and it is not due")
        self._planned_s = request.time_s
        return self.replanned(request, Start(*branch_off(request, self.mission), left_m, cut))

    def due(self, path: Path, left_m: float, age_s: float) -> bool:
        """Whether a new path is planned although no edge point cuts the one in effect."""
        return age_s >= self.every_s

    @abstractmethod
    def replanned(self, request: PlanRequest, start: Start) -> Plan:
        """Plans a new path that begins at `start`."""

    def holding_plan(self, why: str, request: PlanRequest) -> Plan:
        """The answer if no new path is found: a turn to hold in."""
        return holding_plan(why, request, self.mission, self.memory.points_m)


class Steerer(Replanner):
    """A planner that chooses a direction, and has no path of its own: a turn onto it and straight on.

    The path is `look_m` long; only edge points within `near_m` of the aircraft count; neighbouring directions are
    `step_rad` apart.
    """

    def __init__(self, mission: Mission, look_m: float, near_m: float, step_rad: float) -> None:
        super().__init__(mission)
        self.look_m, self._near_m, self._step_rad = look_m, near_m, step_rad
        self.chosen: float | None = None  # the direction chosen last, rad counter-clockwise from east

    @abstractmethod
    def direction(self, pose: Pose, points_m: FloatArray) -> float | None:
        """The direction to fly, rad counter-clockwise from east, among (m, 2) edge points; None if none is free."""

    def picture(self, request: PlanRequest) -> PlanPicture:
        """The picture of a plan: the line from the aircraft to the goal, and the look distance."""
        return PlanPicture(np.array([request.position_m, self.mission.goal_m]), self.look_m)

    def replanned(self, request: PlanRequest, start: Start) -> Plan:
        """A new path if another direction is chosen, or if the path in effect is cut or short."""
        points = self.memory.points_m
        near = points[np.hypot(*(points - start.pose[:2]).T) < self._near_m]
        last, self.chosen = self.chosen, self.direction(start.pose, near)
        if self.chosen is None:
            return self.holding_plan("no direction is free", request)
        look_m = min(self.look_m, math.dist(start.pose[:2], self.mission.goal_m))
        same = last is not None and abs(turn_rad(self.chosen, last)) < 0.5 * self._step_rad
        if same and not start.cut and start.left_m > 0.5 * look_m:
            self.chosen = last
            return Plan(PlanStatus.KEPT, "the direction is still the best one")
        return self._turn_path(request, start, ahead(start.pose[:2], self.chosen, look_m))

    def _turn_path(self, request: PlanRequest, start: Start, target: Point) -> Plan:
        """A turn at the turn radius towards a place, then straight on, up to the border of the area at most."""
        if (turn := turn_onto(start.pose, target, self.mission.turn_radius_m)) is None:
            return Plan(PlanStatus.NO_PATH, "the goal is nearer than a turn")
        arcs, last = [row for row in turn if row[4]], turn[-1]
        room_m = last[5] if last[4] else _to_border_m(last, self.mission.bounds_m)
        if room_m < SHORTEST_M or (arcs and not inside_bounds(Path(np.array(arcs)), self.mission.bounds_m)):
            return self.holding_plan("no turn stays inside the area", request)
        turn[-1] = (*last[:5], min(last[5], room_m))
        bearing = math.atan2(target[1] - start.pose.north_m, target[0] - start.pose.east_m)
        reason = f"steering {math.degrees(math.pi / 2 - bearing) % 360:.0f} degrees"
        waypoints = np.array([request.position_m, *(row[:2] for row in turn[1:]), target])
        picture = self.picture(request)
        path = Path(np.array([*start.before, *turn]))
        return Plan(PlanStatus.FOUND, reason, waypoints, path, lambda: picture)


def ahead(place: Point, bearing: float, distance_m: float) -> Point:
    """The place at a distance in a direction, rad counter-clockwise from east."""
    return place[0] + distance_m * math.cos(bearing), place[1] + distance_m * math.sin(bearing)


def turn_rad(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Angle from direction b to direction a, rad in [-pi, pi)."""
    return np.asarray((np.subtract(a, b) + math.pi) % math.tau - math.pi, dtype=np.float64)


def _to_border_m(straight: Segment, bounds_m: tuple[float, float, float, float]) -> float:
    """Distance (m) from where a line begins to the border, however long the line is; -inf if it begins outside."""
    x, y, ux, uy, _, _ = straight
    xmin, ymin, xmax, ymax = bounds_m
    room = [math.inf]
    for low, high, place, pace in ((xmin, xmax, x, ux), (ymin, ymax, y, uy)):
        if not low <= place <= high:
            return -math.inf
        if pace:
            room.append(((high if pace > 0.0 else low) - place) / pace)
    return min(room)
