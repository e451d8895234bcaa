"""The rolling-window planner of the paper.

In every rolling step: take the planning window about the track point where the new plan begins; search N
steps deep among the free sectors for the n best tracks (`multi_step_search`); shorten each under the minimum
turn radius (`route_optimisation`); the shortest of the n is the plan. It is flown until the window rolls on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np

from planner.clearance import first_breach
from planner.curves import Limits, Point, Pose, Segment, between, on_loiter, place_on
from planner.hold import hold
from planner.interface import FloatArray, Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.memory import ObstacleMemory
from planner.multi_step_search import Track, search
from planner.pose_search import search_poses
from planner.route_optimisation import Route, Terrain, optimise
from planner.window import Window, guide_vector

LEAD_S = 1.0
"""A new plan leaves the old one this much flying time ahead, so that guidance has seen the joint coming."""

OFF_PATH = 4.0
"""Further off the path than this many times the tracking error, a plan begins at the aircraft itself."""

SEARCH_SHARE, PATH_SHARE = 0.7, 0.4
"""Shares of the margin that straight steps and the curve through them keep; track points keep all of it."""

WIDER = 6
"""Where n tracks at every one of N steps find no way, this many times as many are tried."""

HOLD_SHARES = (1.0, 0.5, 0.1)
"""Shares of the clearance with which a holding turn is sought: one too near to something is better than none."""

BETTER = 0.005
"""A plan that still serves is dropped only for one that is shorter by this share of what is left to fly."""


@dataclass(frozen=True)
class RollingWindowConfig:
    """Keys of `planner.kind: rolling_window`."""

    planning_window_m: float | None = field(
        default=None,
        metadata={
            "doc": "radius r1 of the planning window, at most the sensor range; default: the sensor range",
            "unit": "m",
            "above": 0.0,
        },
    )
    steps: int = field(
        default=16,
        metadata={
            "doc": "N, how many steps the search looks ahead",
            "unit": "1",
            "minimum": 1,
            "maximum": 100,
        },
    )
    candidates: int = field(
        default=6,
        metadata={
            "doc": "n, how many tracks are kept at every step",
            "unit": "1",
            "minimum": 1,
            "maximum": 100,
        },
    )
    margin_m: float | None = field(
        default=None,
        metadata={
            "doc": "planned distance beyond the clearance; "
            "default: 0.1 of the clearance, at least twice the tracking error",
            "unit": "m",
            "minimum": 0.0,
        },
    )
    rolling_step_m: float | None = field(
        default=None,
        metadata={
            "doc": "distance flown before the window rolls, unless the plan is cut near by; "
            "default: 1/16 of the planning window",
            "unit": "m",
            "above": 0.0,
        },
    )

    def resolved(self, mission: Mission) -> RollingWindowConfig:
        """This config with every None replaced by its default for the mission.

        Raises:
            ValueError: the planning window is larger than the sensing range.
        """
        window = mission.sensor_range_m if self.planning_window_m is None else self.planning_window_m
        if window > mission.sensor_range_m:
            raise ValueError(
                f"planning_window_m is {window:g}, more than sensor.range_m {mission.sensor_range_m:g}; "
                "the planner cannot plan beyond what is sensed"
            )
        margin = max(0.1 * mission.clearance_m, 2.0 * mission.tracking_error_m)
        return replace(
            self,
            planning_window_m=window,
            margin_m=margin if self.margin_m is None else self.margin_m,
            rolling_step_m=window / 16.0 if self.rolling_step_m is None else self.rolling_step_m,
        )


@dataclass(frozen=True, eq=False)
class _Situation:
    """What one search works on.

    Attributes:
        position: where the aircraft is.
        pose: where the new plan leaves the old one.
        curvature: of the old one there, 1/m.
        prefix: the stretch of the old one up to there.
        points: (m, 2) edge points.
        room: (m,) distance of each to the nearer of pose and goal: more than that cannot be kept from it.
    """

    position: Point
    pose: Pose
    curvature: float
    prefix: list[Segment]
    points: FloatArray
    room: FloatArray


class RollingWindow:
    """The planner for one flight."""

    def __init__(self, config: RollingWindowConfig, mission: Mission) -> None:
        config = config.resolved(mission)
        assert config.planning_window_m is not None
        assert config.margin_m is not None
        assert config.rolling_step_m is not None
        self._config, self._mission = config, mission
        self._window_m, self._margin_m = config.planning_window_m, config.margin_m
        self._rolling_step_m = config.rolling_step_m
        self._limits = Limits(mission.turn_radius_m, mission.speed_mps * mission.roll_in_s)
        self._urgent_m = 8.0 * mission.turn_radius_m + mission.speed_mps * (4.0 + mission.compute_latency_s)
        self._memory = ObstacleMemory(mission.clearance_m)
        self._flown: Plan | None = None
        self._searched_at_m = 0.0
        self._breach_m = (
            math.inf
        )  # where the plan in effect comes too near to something seen since it was made

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the plan in effect while it serves; rolls the window and searches where it does not."""
        if request.flown is not self._flown:
            self._flown, self._breach_m, self._searched_at_m = request.flown, math.inf, 0.0
        fresh = self._memory.take_in(request.seen)
        path = request.flown.path if request.flown else None
        if path is None:
            return self._roll(request, None, 0.0)
        if len(fresh):
            keep = self._mission.clearance_m + 0.5 * PATH_SHARE * self._margin_m
            here = on_loiter(path, request.station_m)
            self._breach_m = min(
                self._breach_m, first_breach(path, fresh, keep, 0.0 if path.loiter else here)
            )
        rolled = request.station_m - self._searched_at_m >= self._rolling_step_m
        if not (rolled or self._breach_m - request.station_m < self._urgent_m):
            return Plan(PlanStatus.KEPT, "the plan in effect serves")
        self._searched_at_m = request.station_m
        if math.isinf(self._breach_m) and self._is_straight(request, path):
            return Plan(PlanStatus.KEPT, "nothing in the window along the guide vector")
        return self._roll(request, path, on_loiter(path, request.station_m))

    def _is_straight(self, request: PlanRequest, path: Path) -> bool:
        """Whether what is left of a path is hardly longer than the guide vector."""
        left = path.length_m - request.station_m
        _, _, guide = guide_vector(request.position_m, self._mission.goal_m)
        return not path.loiter and left - guide < 1e-4 * guide + self._mission.tracking_error_m

    def _roll(self, request: PlanRequest, path: Path | None, station_m: float) -> Plan:
        """One rolling step: search, optimise, compare with the plan in effect."""
        situation = self._situation(request, path, station_m)
        tracks: list[Track] = []
        route = self._shortest(situation, tracks)
        if route is None:
            return self._hold(request, path, station_m)
        new = Path(np.array([*situation.prefix, *route.path.segments.tolist()]))
        serves = path is not None and not path.loiter and math.isinf(self._breach_m)
        if path is not None and serves and new.length_m > (path.length_m - station_m) * (1.0 - BETTER):
            return Plan(PlanStatus.NO_BETTER, "the plan in effect serves as well as any other")
        return Plan(
            PlanStatus.FOUND,
            self._sentence(request, route.nodes),
            waypoints_m=np.array([situation.position, *route.nodes]),
            path=new,
            picture=self._picture(situation, route, tracks),
        )

    def _situation(self, request: PlanRequest, path: Path | None, station_m: float) -> _Situation:
        """Where the new plan begins, and what is known."""
        mission = self._mission
        pose, curvature = Pose(*request.position_m, *request.direction), 0.0
        prefix: list[Segment] = []
        if path is not None:
            nearest, _ = place_on(path, station_m)
            if math.dist(nearest[:2], request.position_m) <= max(1.0, OFF_PATH * mission.tracking_error_m):
                lead = mission.speed_mps * (LEAD_S + mission.compute_latency_s)
                lead = max(0.0, min(lead, self._breach_m - station_m, path.length_m - station_m))
                prefix = between(path, station_m, station_m + lead)
                pose, curvature = place_on(path, station_m + lead)
        points = self._memory.points_m
        ends = (pose, mission.goal_m)
        room = [np.hypot(points[:, 0] - end[0], points[:, 1] - end[1]) - 1e-3 for end in ends]
        return _Situation(request.position_m, pose, curvature, prefix, points, np.minimum(*room))

    def _shortest(self, situation: _Situation, tracks: list[Track]) -> Route | None:
        """Route optimisation of each of the n best tracks; the shortest that can be flown.

        Args:
            situation: what to work on.
            tracks: the candidates that were looked at are added to it.
        """
        terrain = self._terrain(situation, self._margin_m)
        for clearance, margin in self._attempts():
            terrain = self._terrain(situation, margin)
            for widening in (1, WIDER):
                best: Route | None = None
                for track in self._candidates(situation, clearance, margin, widening):
                    tracks.append(track)
                    if best is not None and track.cost_m >= best.path.length_m:
                        break
                    route = optimise(
                        situation.pose,
                        situation.curvature,
                        track.nodes,
                        self._limits,
                        (1.0 - SEARCH_SHARE) * margin,
                        terrain,
                    )
                    if route is not None and (best is None or route.path.length_m < best.path.length_m):
                        best = route
                if best is not None:
                    return best
                if tracks:
                    break
        return search_poses(situation.pose, situation.curvature, self._mission.goal_m, self._limits, terrain)

    def _attempts(self) -> list[tuple[float, float]]:
        """Distances and margins to search with, in order, until a track can be flown.

        First as wanted. Then wide enough for a turn about the end of a wall at the turn radius. Last with what
        of the margin there is room for.
        """
        clearance, margin, radius = self._mission.clearance_m, self._margin_m, self._mission.turn_radius_m
        attempts = [(clearance, margin), (clearance, 0.2 * margin)]
        if radius > clearance:
            attempts.insert(1, (radius, margin))
        return attempts

    def _candidates(
        self, situation: _Situation, clearance: float, margin: float, widening: int
    ) -> islice[Track]:
        """The n best tracks."""
        keep = np.minimum(clearance + SEARCH_SHARE * margin, situation.room)
        window = self._window(situation, keep)
        found = search(
            window,
            self._mission.goal_m,
            self._mission.bounds_m,
            steps=self._config.steps * widening,
            keep_best=self._config.candidates * widening,
            outer_m=clearance + margin,
        )
        return islice(found, self._config.candidates)

    def _window(self, situation: _Situation, keep: FloatArray) -> Window:
        return Window(
            situation.pose[:2],
            self._window_m,
            situation.points,
            self._memory.labels,
            self._memory.cell_m,
            keep,
        )

    def _terrain(self, situation: _Situation, margin: float) -> Terrain:
        keep = np.minimum(self._mission.clearance_m + PATH_SHARE * margin, situation.room)
        return Terrain(situation.points, keep, self._mission.bounds_m)

    def _hold(self, request: PlanRequest, path: Path | None, station_m: float) -> Plan:
        """No way on was found: the plan in effect goes on while it can, and then into a turn."""
        if path is not None and (path.loiter or self._breach_m - station_m > self._urgent_m):
            return Plan(PlanStatus.NO_PATH, "no track can be flown; the plan in effect goes on")
        if path is None:
            ahead = (*request.position_m, *request.direction, 0.0, self._limits.roll_m)
            path, station_m = Path(np.array([ahead])), 0.0
        points = self._memory.points_m
        for share in HOLD_SHARES:
            keep = np.full(len(points), share * self._mission.clearance_m)
            terrain = Terrain(points, keep, self._mission.bounds_m)
            last = min(self._breach_m, path.length_m)
            turn = hold(path, station_m, last, self._limits, terrain)
            if turn is not None:
                waypoints = np.array([request.position_m, *turn.segments[1:, :2].tolist()])
                return Plan(PlanStatus.FOUND, "no track can be flown; holding", waypoints, turn)
        return Plan(PlanStatus.NO_PATH, "no track can be flown and there is no room to hold")

    def _sentence(self, request: PlanRequest, nodes: tuple[Point, ...]) -> str:
        ux, uy, left = guide_vector(request.position_m, self._mission.goal_m)
        if len(nodes) < 2:
            return f"way to the goal in view, {left / 1000:.1f} km to go"
        x, y = nodes[0][0] - request.position_m[0], nodes[0][1] - request.position_m[1]
        side = "left" if ux * y - uy * x > 0.0 else "right"
        return f"obstacle ahead, passing {side} at {math.hypot(x, y) / 1000:.1f} km"

    def _picture(self, situation: _Situation, route: Route, tracks: list[Track]) -> PlanPicture:
        window = self._window(situation, np.full(len(situation.points), self._mission.clearance_m))
        return PlanPicture(
            guide_m=np.array([situation.position, self._mission.goal_m]),
            window_m=self._window_m,
            sectors=window.free_sectors(situation.position),
            candidates=(
                np.array([situation.position, *route.nodes]),
                *(np.array(track.nodes) for track in tracks),
            ),
        )
