"""A tree of Dubins curves, grown anew whenever the way is blocked: RRT* of the Open Motion Planning Library.

S. Karaman and E. Frazzoli, "Sampling-based algorithms for optimal motion planning", International Journal of
Robotics Research 30(7), 2011 (RRT*); L. E. Dubins, "On curves of minimal length with a constraint on average
curvature, and with prescribed initial and terminal positions and tangents", American Journal of
Mathematics 79, 1957; I. A. Sucan, M. Moll and L. E. Kavraki, "The Open Motion Planning Library", IEEE Robotics and
Automation Magazine 19(4), 2012.

What has not been seen is taken to be free. The tree is grown for a number of iterations, not for a time, from a
seed, so that the same flight is planned the same way. Its path is shortened by Dubins curves between its poses
that keep the distance. OMPL is an optional dependency: `pip install wayproof[ompl]`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec

import numpy as np

from planner.geometry.clearance import first_breach
from planner.geometry.curves import SHORTEST_M, Point, Pose, Segment, along
from planner.geometry.joining import branch_off, stuck
from planner.geometry.margin import margin_of
from planner.geometry.terrain import Terrain
from planner.interface import FloatArray, Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.keys import key, margin_key
from planner.memory import ObstacleMemory

GOAL_COURSES = 8
"""The goal may be reached on this many courses."""

ROLLS = 16.0
"""A plan that is blocked further ahead, or holds, is dropped after this share of the sensing range."""

CURVE_SHARE = 0.125
"""Share of the margin that a path keeps."""

ATTEMPTS = ((1.0, 1), (0.5, 4))
"""Share of the margin that a tree keeps, and how many times as often it is grown."""

NEAR = 1.5
"""Within so many of the distances that the tree keeps about start and goal it keeps no more than the path."""

LOOK_SHARE = 0.5
"""A branch of the tree is looked at every so many of the distances that it keeps."""


@dataclass(frozen=True)
class DubinsTreeConfig:
    """Keys of `planner.kind: dubins_tree`."""

    iterations: int = key(300, "how many times the tree is grown", minimum=1, maximum=1_000_000)
    tree_seed: int = key(1, "seed of the samples", minimum=1, maximum=1_000_000)
    margin_m: float | None = margin_key()

    def resolved(self, mission: Mission) -> DubinsTreeConfig:
        """This config with every None replaced by its default for the mission.

        Raises:
            ValueError: OMPL is not installed.
        """
        if find_spec("ompl") is None:
            raise ValueError(
                "kind dubins_tree needs OMPL, which is not installed: pip install wayproof[ompl]"
            )
        return replace(self, margin_m=margin_of(mission) if self.margin_m is None else self.margin_m)


class DubinsTree:
    """The planner for one flight."""

    def __init__(self, config: DubinsTreeConfig, mission: Mission) -> None:
        config = config.resolved(mission)
        assert config.margin_m is not None
        self._config, self._mission, self._margin_m = config, mission, config.margin_m
        self._memory = ObstacleMemory(mission.clearance_m)
        late_s = 4.0 + mission.compute_latency_s
        self._urgent_m = 8.0 * mission.turn_radius_m + mission.ground_speed_mps * late_s
        self._searches = 0
        self._gone = 0
        self._flown: Plan | None = None
        self._searched_at_m = 0.0
        self._breach_m = (
            math.inf
        )  # where something seen since it was made comes too near to the plan in effect

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the plan in effect while nothing seen blocks it; grows a tree where something does."""
        fresh, gone = self._memory.take_in(request.seen), self._memory.cleared
        changed, self._gone = len(fresh) > 0 or gone != self._gone, gone
        keep = self._mission.clearance_m + CURVE_SHARE * self._margin_m
        if request.flown is not self._flown:
            self._flown, self._breach_m, self._searched_at_m = request.flown, math.inf, 0.0
        why = self._serves(request, fresh, changed, keep)
        if why:
            return Plan(PlanStatus.KEPT, why)
        arc_length_m = request.arc_length_m
        self._searched_at_m = arc_length_m
        pose, prefix = branch_off(request, self._mission)
        poses, ways = self._ways(pose, self._terrain(pose, keep))
        if not ways:
            return stuck("the tree found no way", request, self._mission, self._memory.points_m)
        segments = [segment for way in ways for segment in way]
        nodes = [way[-1] for way in ways]
        told = f"tree {self._searches}, {len(ways)} Dubins curves to the goal"
        guide, seen_m = np.array([request.position_m, self._mission.goal_m]), self._mission.sensor_range_m
        return Plan(
            PlanStatus.FOUND,
            told if len(ways) > 1 else "way to the goal in view",
            np.array([request.position_m, *(along(node, node[5])[:2] for node in nodes)]),
            Path(np.array([*prefix, *segments])),
            partial(PlanPicture, guide, seen_m, candidates=(np.array([each[:2] for each in poses]),)),
        )

    def _serves(self, request: PlanRequest, fresh: FloatArray, changed: bool, keep: float) -> str:
        """Why the plan in effect is flown on; empty where a tree is to be grown."""
        path, arc_length_m = request.flown.path if request.flown else None, request.arc_length_m
        rolled = arc_length_m - self._searched_at_m >= self._mission.sensor_range_m / ROLLS
        if path is not None and path.loiter:
            return "" if changed or rolled else "holding; nothing new is known"
        if path is None or path.length_m <= arc_length_m:
            return ""
        room = self._room(fresh, Pose(*path.segments[0, :4].tolist()), keep)
        self._breach_m = min(self._breach_m, first_breach(path, fresh, room, arc_length_m))
        near = rolled or self._breach_m - arc_length_m < self._urgent_m
        return "" if near and math.isfinite(self._breach_m) else "nothing near blocks the plan in effect"

    def _room(self, points: FloatArray, pose: Pose, keep: float) -> FloatArray:
        room = [
            np.hypot(points[:, 0] - x, points[:, 1] - y) - 1e-3 for x, y in (pose[:2], self._mission.goal_m)
        ]
        return np.minimum(keep, np.minimum(*room))

    def _terrain(self, pose: Pose, keep: float) -> Terrain:
        points = self._memory.points_m
        return Terrain(points, self._room(points, pose, keep), self._mission.bounds_m)

    def _free(self, pose: Pose, terrain: Terrain, share: float) -> Terrain:
        """Where a tree may grow that keeps a share of the margin."""
        keep_m = self._mission.clearance_m + share * self._margin_m
        away_m = self._room(terrain.points_m, pose, math.inf)
        return replace(terrain, keep_m=np.where(away_m < NEAR * keep_m, terrain.keep_m, keep_m))

    def _ways(self, pose: Pose, terrain: Terrain) -> tuple[list[Pose], list[list[Segment]]]:
        """The poses of a way to the goal, and Dubins curves that lead along it; none where there is none.

        The tree is grown to where the line to the goal is free beyond the sensing range; where no curve leads on from
        there past all that is known, to the goal itself.
        """
        goals, radius = self._goals(pose, self._mission.goal_m), self._mission.turn_radius_m
        direct = [([pose, goal], dubins_chain([pose, goal], radius, terrain)) for goal in goals]
        found = [(poses, ways) for poses, ways in direct if ways]
        if found:
            return min(found, key=lambda each: sum(segment[5] for segment in each[1][0]))
        frees = [(self._free(pose, terrain, share), times) for share, times in ATTEMPTS]
        beyond = self._beyond(pose, frees[0][0])
        nearer = [] if beyond == self._mission.goal_m else [self._goals(pose, beyond)]
        for ends in (*nearer, goals):
            for free, times in frees:
                self._searches += 1
                grown = self._grown(pose, ends, free, times * self._config.iterations)
                if grown is None:
                    continue
                for onward in [[]] if ends is goals else [[goal] for goal in goals]:
                    ways = dubins_chain([*grown, *onward], radius, terrain)
                    if ways:
                        return [*grown, *onward], ways
                break
        return [], []

    def _beyond(self, pose: Pose, free: Terrain) -> Point:
        """The first free place on the line to the goal that lies beyond the sensing range; else the goal."""
        (x, y), (to_x, to_y) = pose[:2], self._mission.goal_m
        whole, step = math.dist((x, y), (to_x, to_y)), self._mission.turn_radius_m
        for i in range(math.ceil(self._mission.sensor_range_m / step), math.floor(whole / step) - 2):
            share = i * step / whole
            place = x + share * (to_x - x), y + share * (to_y - y)
            if is_free(free, *place):
                return place
        return self._mission.goal_m

    def _goals(self, pose: Pose, place: Point) -> list[Pose]:
        """A place to reach on several courses, the straight one first."""
        x, y = place
        straight = math.atan2(y - pose.north_m, x - pose.east_m)
        courses = [straight + math.tau * i / GOAL_COURSES for i in range(GOAL_COURSES)]
        return [Pose(x, y, math.cos(course), math.sin(course)) for course in courses]

    def _grown(self, pose: Pose, goals: list[Pose], free: Terrain, iterations: int) -> list[Pose] | None:
        """The best path of a tree grown for some iterations."""
        from ompl import base, geometric, util

        util.setLogLevel(util.LogLevel.LOG_NONE)
        util.RNG.setSeed(self._config.tree_seed + self._searches)
        reach = self._mission.sensor_range_m
        xmin, ymin, xmax, ymax = self._mission.bounds_m
        (x, y), (to_x, to_y) = pose[:2], goals[0][:2]
        space, box = base.DubinsStateSpace(self._mission.turn_radius_m), base.RealVectorBounds(2)
        box.setLow(0, max(xmin, min(x, to_x) - reach))
        box.setLow(1, max(ymin, min(y, to_y) - reach))
        box.setHigh(0, min(xmax, max(x, to_x) + reach))
        box.setHigh(1, min(ymax, max(y, to_y) + reach))
        space.setBounds(box)
        space.setup()
        setup = base.SpaceInformation(space)
        setup.setStateValidityChecker(lambda state: is_free(free, state.getX(), state.getY()))
        keep = self._mission.clearance_m + self._margin_m
        setup.setStateValidityCheckingResolution(LOOK_SHARE * keep / space.getMaximumExtent())
        setup.setup()

        def state(place: Pose) -> object:
            made = setup.allocState()
            made.setXY(place.east_m, place.north_m)
            made.setYaw(math.atan2(place.tangent_north, place.tangent_east))
            return made

        problem, goal = base.ProblemDefinition(setup), base.GoalStates(setup)
        problem.addStartState(state(pose))
        for each in goals:
            goal.addState(state(each))
        problem.setGoal(goal)
        tree = geometric.RRTstar(setup)
        tree.setRange(0.5 * reach)
        tree.setProblemDefinition(problem)
        tree.setup()
        grown = 0

        def enough() -> bool:
            nonlocal grown
            grown += 1
            return grown > iterations

        tree.solve(base.PlannerTerminationCondition(enough))
        if not problem.hasExactSolution():
            return None
        states = problem.getSolutionPath().getStates()
        return [pose] + [
            Pose(s.getX(), s.getY(), math.cos(s.getYaw()), math.sin(s.getYaw())) for s in states[1:]
        ]


def is_free(terrain: Terrain, east_m: float, north_m: float) -> bool:
    """Whether a place is in the area and keeps its distance from all that is known."""
    xmin, ymin, xmax, ymax = terrain.bounds_m
    inside = xmin <= east_m <= xmax and ymin <= north_m <= ymax
    away = np.hypot(terrain.points_m[:, 0] - east_m, terrain.points_m[:, 1] - north_m)
    return inside and bool((away >= terrain.keep_m).all())


def dubins_chain(poses: Sequence[Pose], radius_m: float, terrain: Terrain) -> list[list[Segment]] | None:
    """Dubins curves from pose to pose, each on to the furthest that one leads to; None where none leads on."""
    ways: list[list[Segment]] = []
    i = 0
    while i < len(poses) - 1:
        for k in range(len(poses) - 1, i, -1):
            way = dubins(poses[i], poses[k], radius_m)
            if way and terrain.admits(Path(np.array(way))):
                ways.append(way)
                i = k
                break
        else:
            return None
    return ways


def dubins(start: Pose, end: Pose, radius_m: float) -> list[Segment]:
    """The shortest curve from pose to pose whose radius is nowhere smaller than a given one.

    Words and formulas: A. M. Shkel and V. Lumelsky, "Classification of the Dubins set", Robotics and Autonomous Systems
    34, 2001. A word that begins with a turn to the right is that of the mirrored poses.
    """
    words = [(side, word) for side in (1.0, -1.0) for word in _words(start, end, radius_m, side)]
    side, (middle, last, *lengths) = min(words, key=lambda each: sum(each[1][2:]))
    way: list[Segment] = []
    pose = start
    for turn, length in zip((1.0, middle, last), lengths, strict=True):
        if length * radius_m > SHORTEST_M:
            way.append((*pose, side * turn / radius_m, length * radius_m))
            pose = along(way[-1], way[-1][5])
    return way


def _words(
    start: Pose, end: Pose, radius_m: float, side: float
) -> Iterator[tuple[float, float, float, float, float]]:
    """LSL, LSR, LRL where they join the poses: turns of the second and third part, and three lengths in radii."""
    dx, dy = (end.east_m - start.east_m) / radius_m, side * (end.north_m - start.north_m) / radius_m
    d, bearing = math.hypot(dx, dy), math.atan2(dy, dx)
    a = side * math.atan2(start.tangent_north, start.tangent_east) - bearing
    b = side * math.atan2(end.tangent_north, end.tangent_east) - bearing
    sines, cosines = math.sin(a) - math.sin(b), math.cos(a) - math.cos(b)
    turn, same = 2.0 * math.cos(a - b), math.atan2(-cosines, d + sines)
    straight = 2.0 + d * d - turn + 2.0 * d * sines
    yield 0.0, 1.0, _angle(same - a), math.sqrt(max(straight, 0.0)), _angle(b - same)
    both = math.sin(a) + math.sin(b)
    straight = -2.0 + d * d + turn + 2.0 * d * both
    if straight >= 0.0:
        length = math.sqrt(straight)
        course = math.atan2(-math.cos(a) - math.cos(b), d + both) - math.atan2(-2.0, length)
        yield 0.0, -1.0, _angle(course - a), length, _angle(course - b)
    cosine = (6.0 - d * d + turn - 2.0 * d * sines) / 8.0
    if abs(cosine) <= 1.0:
        middle = math.tau - math.acos(cosine)
        first = _angle(same - a + 0.5 * middle)
        yield -1.0, 1.0, first, middle, _angle(b - a - first + middle)


def _angle(radians: float) -> float:
    """An angle in [0, 2 pi); one that is a full turn but for rounding is 0."""
    angle = radians % math.tau
    return 0.0 if math.tau - angle < 1e-9 else angle
