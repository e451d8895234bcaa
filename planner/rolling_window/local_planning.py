"""One rolling step of local planning: n-best search, route optimisation, the shortest of the n."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from planner.geometry.clearance import distances
from planner.geometry.course import Course, Route
from planner.geometry.curves import Limits, Point, onward_in_turn
from planner.geometry.terrain import POINT_WORK, TANGENT_WORK, Terrain, WorkCount
from planner.interface import FloatArray, Mission, Path
from planner.kernels.fans import encircled
from planner.memory import NO_POINTS, ObstacleMemory
from planner.rolling_window.cost_to_go import CostToGo
from planner.rolling_window.multi_step_search import Candidate, Width, search_candidates
from planner.rolling_window.pose_search import search_poses
from planner.rolling_window.route_optimisation import optimise
from planner.rolling_window.window import Window
from planner.shield.committed_plan import BROKEN_SHARE, Start
from planner.shield.escape import Room

SEARCH_SHARE, PATH_SHARE = 0.7, 0.4
"""Shares of the margin. Straight steps keep the first beyond the clearance, the curve through them the second;
track points keep all of the margin."""

LEAST_HUG_SHARE, LEAST_MARGIN_SHARE = 0.005, 0.4
"""Track points lie further out than straight steps by at least the first share of the clearance. The second share of
the margin is still kept where there is no room for all of it."""

GAP_LOOKED_AT_SHARE = 0.5
"""Gaps narrower than twice this share of the clearance are not looked at again from nearer by."""

MOST_TRACKS = 300
"""A search expands at most this many track points (a wide one in proportion more), and as many after the first find."""

WIDE_FACTOR, WIDE_STEPS = 4, 60
"""A wide search, where N steps with n candidates find no way, has `WIDE_FACTOR` times as many of both and is led by the
cost to go, so that the best come first; after the first it looks at only `WIDE_STEPS` steps more."""

DOUBTFUL_SHARE, MOST_AROUND = 0.1, 8
"""A way that is longer than the one flown by the share `DOUBTFUL_SHARE` is doubtful. Then the `MOST_AROUND` obstacles
nearest to the start are looked at as well."""

SWITCH_SHARE, RETRACE_SHARE = 0.03, 0.25
"""Hysteresis: the other way round an obstacle is taken only where it saves `SWITCH_SHARE` of the distance left, and
`RETRACE_SHARE` of what leads back along where the aircraft has been."""

RECEDING_FACTOR = 6.0
"""The way round an edge that recedes as more of it is seen grows. Among ways with room for holds it is expected to grow
on by this factor of that, but at most by a full turn of a hold; in calm air, where nothing is gained by it, not."""

TRAIL_CLEARANCES = 4.0
"""Side (in clearances) of squares of the plane: places in or beside one flown through count as retraced."""

TURN_EXITS = 8  # a held turn may be left at this many places of it: from some no curve fits the way on

ROOM_WORTH_HOLDS = 0.5
"""A way with room for holds may be longer by this many of them than a narrow one that is not seen to lead on."""


@dataclass(frozen=True)
class Attempt:
    """Distance kept from every edge point, and a margin beyond it: shares are given up for steps and curves; m.

    Track points lie `inside_m` inside the area. The way of a `doubtful` one is flown only as far as it keeps the
    clearance: to look from nearer by at a gap that seems too narrow.
    """

    distance_m: float
    margin_m: float
    inside_m: float = 0.0
    doubtful: bool = False


Test = Callable[[], bool]
StartProvider = Callable[[], tuple[Start, Course | None]]
"""Returns where a plan would begin now, and the course that is flown."""


class Trail:
    """The squares of the plane that the aircraft has flown through, and those around them."""

    def __init__(self, side_m: float) -> None:
        self._side = side_m
        self._last: tuple[int, int] | None = None
        self._flown: set[tuple[int, int]] = set()

    def add(self, place: Point) -> None:
        """Takes in where the aircraft is."""
        x, y = math.floor(place[0] / self._side), math.floor(place[1] / self._side)
        if (x, y) != self._last:
            self._last = x, y
            self._flown.update((x + i, y + j) for i, j in product((-1, 0, 1), repeat=2))

    def retraced_m(self, nodes: Sequence[Point]) -> float:
        """Length (m) of a polyline that lies where the aircraft has been, to about a square."""
        back_m, side_m = 0.0, self._side
        for (ax, ay), (bx, by) in pairwise(nodes):
            length = math.hypot(bx - ax, by - ay)
            count, back = max(math.ceil(length / side_m), 1), 0
            for i in range(count):
                share = (i + 0.5) / count
                x, y = ax + share * (bx - ax), ay + share * (by - ay)
                back += (math.floor(x / side_m), math.floor(y / side_m)) in self._flown
            back_m += length / count * back
        return back_m


class LocalPlanning:
    """Looks for the shortest flyable way to the goal through what is remembered."""

    def __init__(
        self, mission: Mission, memory: ObstacleMemory, *, margin_m: float, steps: int, candidates: int
    ) -> None:
        self._mission, self.memory, self._margin_m = mission, memory, margin_m
        self._steps, self._candidates = steps, candidates
        self.work_count = WorkCount()
        self.trail = Trail(TRAIL_CLEARANCES * mission.clearance_m)
        self._grown_m = 0.0  # length by which the way has grown on these sides of obstacles
        self._most_growth_m = math.tau * mission.hold_radius_m if mission.wind_mps else 0.0
        self._hug_m = LEAST_HUG_SHARE * mission.clearance_m
        self._tight = Attempt(mission.clearance_m, LEAST_MARGIN_SHARE * margin_m)
        self.last_attempts: list[Attempt] = []  # attempts that are made where all others were in vain
        self.limits = Limits.of(mission)
        self._measured: tuple[Start | None, FloatArray, FloatArray] = None, NO_POINTS, NO_POINTS
        self._terrains: dict[float, Terrain] = {}  # for the start and points of `_measured`, by distance kept
        self.room = Room(mission, memory, mission.clearance_m + PATH_SHARE * margin_m, self.work_count)

    @property
    def least_keeps_m(self) -> float:
        """Least distance (m) from every edge point of a way that can be found at all."""
        return self._mission.clearance_m + SEARCH_SHARE * self._tight.margin_m

    def lower_margin(self, margin_m: float) -> bool:
        """Goes down to the least share of a margin from now on; returns whether that is less than it was."""
        before, least_m = self._tight.margin_m, LEAST_MARGIN_SHARE * margin_m
        self._tight = replace(self._tight, margin_m=min(before, least_m))
        return least_m < before

    def look_closer(self) -> bool:
        """Looks at gaps that are too narrow from nearer by from now on; returns whether that is new."""
        keeps_m = GAP_LOOKED_AT_SHARE * self._mission.clearance_m
        before, self.last_attempts = self.last_attempts, [Attempt(keeps_m, 0.0, doubtful=True)]
        return not before

    def attempts(self) -> list[Attempt]:
        """Distances to search with, in order of preference.

        First as wanted, then with what of the margin there is room for, then wide enough for a turn about the end of
        a wall, last so wide that a turn can be flown everywhere on the way.
        """
        clearance, margin, radius = self._mission.clearance_m, self._margin_m, self._mission.turn_radius_m
        attempts = [Attempt(clearance, margin), self._tight]
        if radius > clearance:
            attempts.append(Attempt(radius, margin))
        return [*attempts, Attempt(clearance + radius, margin)]

    @property
    def wide_attempt(self) -> Attempt:
        """Distances at which a hold can be flown everywhere on the way, inside the area."""
        radius = self._mission.hold_radius_m
        return Attempt(self._mission.clearance_m + radius, self._margin_m, inside_m=radius)

    def route(
        self, attempt: Attempt, effort: int, now: StartProvider, candidates: list[Candidate], closed: Test
    ) -> Generator[None, None, Route | None]:
        """The shortest of the n best candidates, after route optimisation.

        What comes in meanwhile is left for the next search: else the shortest way round something that is just coming
        into view would be dropped, again and again.
        """
        start, _ = now()
        points = self.memory.points_m
        keep = np.minimum(attempt.distance_m + SEARCH_SHARE * attempt.margin_m, self._room_m(start, points))
        self.work_count.add(0, TANGENT_WORK, len(points))
        labels, cell_m = self.memory.labels, self.memory.cell_m
        window = Window(start.pose[:2], points, labels, cell_m, keep, self.work_count)
        begun = start
        fitted: list[tuple[float, Route]] = []

        def least_m() -> float:
            return min((worth_m for worth_m, _ in fitted), default=math.inf)

        def doubtful() -> bool:
            _, course = now()
            return course is None or least_m() > (1.0 + DOUBTFUL_SHARE) * course.path.length_m

        for search_on in self._searches(window, attempt, effort, candidates, doubtful, closed):
            for candidate in search_on:
                if candidate is None:
                    yield
                    continue
                start, course = now()
                if candidate.cost_m >= least_m():
                    break
                candidates.append(candidate)
                reluctance_m = self._reluctance_m(candidate, course, attempt.inside_m > 0.0)
                if candidate.cost_m + reluctance_m >= least_m():
                    continue
                route = self.fitted(start, attempt, candidate.nodes, points, turning=course is None)
                if route is not None:
                    fitted.append((route.path.length_m + reluctance_m, route))
                yield
        fitted.sort(key=lambda each: each[0])
        start, course = now()
        if start is begun:
            return fitted[0][1] if fitted else None
        ways = ((start.pose[:2], *route.nodes) for _, route in fitted)
        routes = (self.fitted(start, attempt, way, points, turning=course is None) for way in ways)
        return next(filter(None, routes), None)

    def _reluctance_m(self, candidate: Candidate, course: Course | None, wide: bool) -> float:
        """Length (m) added to a candidate: on the course's sides for growing, else for other sides and leading back."""
        switching = 0.0
        if course is not None:
            self.work_count.add(4, POINT_WORK, 4 * len(candidate.nodes) * course.known)
            if course.same_side(candidate.nodes, self.memory.points_m):
                return min(RECEDING_FACTOR * self._grown_m, self._most_growth_m) if wide else 0.0
            switching = SWITCH_SHARE * candidate.cost_m
        return switching + RETRACE_SHARE * self.trail.retraced_m(candidate.nodes)

    def growth_m(self, course: Course, before: Course | None) -> float:
        """Length (m) by which a course that is flown from now on exceeds what was left of the one before, if any."""
        grown_m, self._grown_m = self._grown_m, 0.0
        if before is None:
            return math.inf
        self.work_count.add(4, POINT_WORK, 4 * len(course.nodes) * before.known)
        start: Point = tuple(course.path.segments[0, :2].tolist())
        growth_m = course.path.length_m - before.path.length_m
        if before.same_side((start, *course.nodes), self.memory.points_m):
            self._grown_m = max(grown_m + growth_m, 0.0)
        return growth_m

    def is_worth_room(self, wide: Route, narrow: Course, open_to_m: float) -> bool:
        """Whether a way with room for holds is to be flown before a shorter one, which leads on up to `open_to_m`.

        It is where the shorter one passes on another side of something further on: the aircraft may have to turn there.
        """
        hold_m = math.tau * self._mission.hold_radius_m
        if wide.path.length_m > narrow.path.length_m + ROOM_WORTH_HOLDS * hold_m:
            return False
        points = self.memory.points_m[: narrow.known]
        self.work_count.add(4, POINT_WORK, 4 * len(wide.nodes) * len(points))
        start: Point = tuple(narrow.path.segments[0, :2].tolist())
        between = points[encircled(np.array([start, *wide.nodes, *narrow.nodes[-2::-1]]), points)]
        if not len(between):
            return False
        away_m, at_m = distances(narrow.path, between)
        return open_to_m < float(at_m[away_m.argmin()])

    def fitted(
        self,
        start: Start,
        attempt: Attempt,
        nodes: Sequence[Point],
        points: FloatArray,
        turning: bool = False,
    ) -> Route | None:
        """The curve along track points found among (m, 2) points, from where a plan would begin now; None: none is.

        An aircraft that is `turning` may leave its turn later: the shortest of these curves, with the rest of the turn.
        """
        cut = (1.0 - SEARCH_SHARE) * attempt.margin_m
        terrain = self._terrain(start, attempt, points)
        best: Route | None = None
        for pose, before in start.later(TURN_EXITS if turning else 1):
            least_m = sum(arc[5] for arc in before) + math.dist(pose[:2], nodes[-1])
            if best is not None and least_m >= best.path.length_m:
                break
            in_turn = self.room.terrain(BROKEN_SHARE * self._mission.clearance_m) if before else None
            if in_turn and not in_turn.admits(Path(np.array(before))):
                break  # something has come near to the turn
            route = optimise(pose, start.curvature, (pose[:2], *nodes[1:]), self.limits, cut, terrain)
            if route is None:
                continue
            path = Path(np.array([*before, *route.path.segments.tolist()]))
            if best is None or path.length_m < best.path.length_m:
                best = Route(route.nodes, path)
        return best

    def tight_route(self, now: StartProvider) -> Generator[None, None, Route | None]:
        """A way found by search over poses, where none through the free sectors can be flown.

        While this goes on the aircraft flies the turn that it is in, so that it comes by where the way begins again.
        """
        start, _ = now()
        terrain = self._terrain(start, self._tight, self.memory.points_m)
        goal, points = self._mission.goal_m, (terrain.points_m, terrain.keep_m)
        to_go = CostToGo(start.pose[:2], goal, self._mission.bounds_m, *points, self.work_count)
        yield from to_go.spread()
        route = yield from search_poses(start.pose, start.curvature, goal, self.limits, terrain, to_go)
        begins, _ = now()
        if route is None or begins is start:
            return route
        if (on := onward_in_turn(begins.pose, begins.curvature, start.pose)) is None:
            return None
        path = Path(np.array([*on, *route.path.segments.tolist()]))
        # What has come in meanwhile may be in its way.
        terrain = self._terrain(begins, self._tight, self.memory.points_m)
        return Route(route.nodes, path) if terrain.admits(path) else None

    def longest_part(self, now: StartProvider, candidate: Candidate) -> Generator[None, None, Route | None]:
        """The longest beginning of a candidate that can be flown, where all of it cannot; None where none can."""
        for end in range(len(candidate.nodes) - 1, 1, -1):
            start, _ = now()
            nodes = (start.pose[:2], *candidate.nodes[1:end])
            route = self.fitted(start, [self._tight, *self.last_attempts][-1], nodes, self.memory.points_m)
            if route is not None:
                return route
            yield
        return None

    def _terrain(self, start: Start, attempt: Attempt, points: FloatArray) -> Terrain:
        """The terrain of an attempt among (m, 2) points: of each no more is kept than it lies from start and goal."""
        keep = min(self._mission.clearance_m, attempt.distance_m) + PATH_SHARE * attempt.margin_m
        room = self._room_m(start, points)
        terrain = Terrain(points, np.minimum(keep, room), self._mission.bounds_m, self.work_count)
        return self._terrains.setdefault(keep, terrain)

    def _room_m(self, start: Start, points: FloatArray) -> FloatArray:
        """(m,) most distance that can be kept from each point: its distance from the nearer of start and goal."""
        if start is not self._measured[0] or points is not self._measured[1]:
            ends = (start.pose[:2], self._mission.goal_m)
            east, north = points.T
            away: FloatArray = np.minimum(*(np.hypot(east - x, north - y) for x, y in ends)) - 1e-3
            self._measured, self._terrains = (start, points, away), {}
        return self._measured[2]

    def _searches(
        self,
        window: Window,
        attempt: Attempt,
        effort: int,
        candidates: Sequence[Candidate],
        doubtful: Test,
        closed: Test,
    ) -> Iterator[Iterator[Candidate | None]]:
        """Searches for the n best candidates, each where those before have not found enough.

        Where what was found is doubtful the obstacles around the start are looked at as well: a way out of a pocket
        may lead past what does not lie towards the goal. Where nothing was found a wider search follows.
        """
        before = len(candidates)
        yield self._search(window, attempt, 1)
        if len(candidates) > before:
            if doubtful():
                yield self._search(window, attempt, 1, window.nearest_obstacles(MOST_AROUND))
        elif attempt.doubtful or not closed():
            around = window.nearest_obstacles(MOST_AROUND)
            yield self._search(window, attempt, WIDE_FACTOR * 2**effort, around)

    def _search(
        self, window: Window, attempt: Attempt, widening: int, around: Sequence[int] = ()
    ) -> Iterator[Candidate | None]:
        """Yields the best candidates of one search, as many as wanted, and None before each place looked at."""
        to_go: CostToGo | None = None
        if widening > 1:
            ends = window.center_m, self._mission.goal_m
            to_go = CostToGo(*ends, self._mission.bounds_m, window.points_m, window.keep_m, self.work_count)
            yield from to_go.spread()
        found = steps_since = 0
        off_m, (xmin, ymin, xmax, ymax) = attempt.inside_m, self._mission.bounds_m
        for candidate in search_candidates(
            window,
            self._mission.goal_m,
            (xmin + off_m, ymin + off_m, xmax - off_m, ymax - off_m),
            Width(self._steps * widening, self._candidates * widening, MOST_TRACKS * widening, widening > 1),
            attempt.distance_m + max(attempt.margin_m, SEARCH_SHARE * attempt.margin_m + self._hug_m),
            around,
            to_go,
        ):
            yield candidate
            found += candidate is not None
            steps_since += found > 0
            if found == self._candidates or steps_since > (MOST_TRACKS if to_go is None else WIDE_STEPS):
                return
