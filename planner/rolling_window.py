"""The rolling-window planner of the paper.

In every rolling step: take the planning window about the track point where the new plan begins; search N steps
deep among the free sectors for the n best tracks (`multi_step_search`); shorten each under the minimum turn
radius (`route_optimisation`); the shortest of the n is the plan. It is flown until the window rolls on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner.clearance import distances, first_breach
from planner.curves import Point, Pose, Segment, between, pose_at
from planner.interface import FloatArray, Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.memory import ObstacleMemory
from planner.multi_step_search import Track, search
from planner.pose_search import search_poses
from planner.route_optimisation import optimise
from planner.window import Window, guide_vector

LEAD_S = 1.0
"""A new plan leaves the old one this much flying time ahead, so that guidance has seen the joint coming."""

OFF_PATH = 4.0
"""Further off the path than this many times the tracking error, a plan begins at the aircraft itself."""

SEARCH_SHARE, PATH_SHARE = 0.6, 0.25
"""Shares of the margin that straight steps and the curve through them keep; track points keep all of it."""

WIDER = 6
"""Where n tracks at every one of N steps find no way, this many times as many are tried."""

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
        pose: where the new plan leaves the old one.
        prefix: the stretch of the old one up to there.
        points: (m, 2) edge points.
        room: (m,) distance of each to the nearer of pose and goal: more than that cannot be kept from it.
    """

    pose: Pose
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
        self._urgent_m = 8.0 * mission.turn_radius_m + mission.speed_mps * (4.0 + mission.compute_latency_s)
        self._memory = ObstacleMemory(mission.clearance_m)
        self._breach_m = math.inf  # where the plan in effect comes too near to something seen since
        self._flown: Plan | None = None
        self._searched_at_m = 0.0

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the plan in effect while it serves; rolls the window and searches where it does not."""
        if request.flown is not self._flown:
            self._flown, self._breach_m, self._searched_at_m = request.flown, math.inf, 0.0
        fresh = self._memory.take_in(request.seen)
        path = request.flown.path if request.flown else None
        if path is None:
            return self._roll(request, None)
        if len(fresh):
            keep = self._mission.clearance_m + 0.5 * PATH_SHARE * self._margin_m
            self._breach_m = min(self._breach_m, first_breach(path, fresh, keep, request.station_m))
        rolled = request.station_m - self._searched_at_m >= self._rolling_step_m
        cut = self._breach_m < math.inf
        if not (rolled or self._breach_m - request.station_m < self._urgent_m):
            return Plan(PlanStatus.KEPT, "the plan in effect serves")
        if not cut and self._is_straight(request, path):
            self._searched_at_m = request.station_m
            return Plan(PlanStatus.KEPT, "nothing in the window along the guide vector")
        return self._roll(request, path)

    def _attempts(self) -> list[tuple[float, float]]:
        """Distances and margins to search with, in order, until a track can be flown.

        First as wanted. Then wide enough for a turn about the end of a wall at the turn radius. Last with what of the
        margin there is room for.
        """
        clearance, margin, radius = self._mission.clearance_m, self._margin_m, self._mission.turn_radius_m
        attempts = [(clearance, margin), (clearance, 0.2 * margin)]
        if radius > clearance:
            attempts.insert(1, (radius, margin))
        return attempts

    def _is_straight(self, request: PlanRequest, path: Path) -> bool:
        """Whether what is left of a path is hardly longer than the guide vector."""
        left = path.length_m - request.station_m
        _, _, guide = guide_vector(request.position_m, self._mission.goal_m)
        return left - guide < 1e-4 * guide + self._mission.tracking_error_m

    def _roll(self, request: PlanRequest, path: Path | None) -> Plan:
        """One rolling step: search, optimise, compare with the plan in effect."""
        self._searched_at_m = request.station_m
        situation = self._situation(request, path)
        best: tuple[list[Point], Path] | None = None
        tracks: list[Track] = []
        window = None
        for clearance, margin in self._attempts():
            window = Window(
                situation.pose[:2],
                self._window_m,
                situation.points,
                self._memory.labels,
                request.seen.spacing_m,
                np.minimum(clearance + SEARCH_SHARE * margin, situation.room),
            )
            for widening in (1, WIDER):
                tracks = search(
                    window,
                    self._mission.goal_m,
                    self._mission.bounds_m,
                    steps=self._config.steps * widening,
                    keep_best=self._config.candidates * widening,
                    outer_m=clearance + margin,
                )
                if tracks:
                    break
            keep = np.minimum(self._mission.clearance_m + PATH_SHARE * margin, situation.room)
            best = self._shortest(situation, tracks, keep, (1.0 - SEARCH_SHARE) * margin)
            if best is not None:
                break
        if best is None:
            keep = np.minimum(self._mission.clearance_m + PATH_SHARE * self._margin_m, situation.room)
            best = search_poses(
                situation.pose,
                self._mission.goal_m,
                self._mission.turn_radius_m,
                situation.points,
                keep,
                self._mission.bounds_m,
            )
        if best is None or window is None:
            return Plan(PlanStatus.NO_PATH, "no track in the window can be flown; the plan in effect goes on")
        nodes, curve = best
        new = Path(np.array([*situation.prefix, *curve.segments.tolist()]))
        if path is not None and math.isinf(self._breach_m):
            left = path.length_m - request.station_m
            if new.length_m > left * (1.0 - BETTER):
                return Plan(PlanStatus.NO_BETTER, "the plan in effect serves as well as any other")
        return Plan(
            PlanStatus.FOUND,
            self._sentence(request, nodes),
            waypoints_m=np.array([request.position_m, *nodes]),
            path=new,
            picture=self._picture(request, window, nodes, tracks),
        )

    def _situation(self, request: PlanRequest, path: Path | None) -> _Situation:
        """Where the new plan begins, and what lies in the window about that place."""
        mission = self._mission
        pose = Pose(*request.position_m, *request.direction)
        prefix: list[Segment] = []
        if path is not None:
            nearest = pose_at(path, request.station_m)
            off = math.dist(nearest[:2], request.position_m)
            if off <= max(1.0, OFF_PATH * mission.tracking_error_m):
                lead = mission.speed_mps * (LEAD_S + mission.compute_latency_s)
                lead = max(
                    0.0, min(lead, self._breach_m - request.station_m, path.length_m - request.station_m)
                )
                prefix = between(path, request.station_m, request.station_m + lead)
                pose = pose_at(path, request.station_m + lead)
        points = self._memory.points_m
        ends = (pose, mission.goal_m)
        room = [np.hypot(points[:, 0] - end[0], points[:, 1] - end[1]) - 1e-3 for end in ends]
        return _Situation(pose, prefix, points, np.minimum(*room))

    def _shortest(
        self, situation: _Situation, tracks: Sequence[Track], keep: FloatArray, cut: float
    ) -> tuple[list[Point], Path] | None:
        """Route optimisation of each of the n tracks; the shortest that can be flown."""
        best: tuple[list[Point], Path] | None = None
        for track in tracks:
            if best is not None and track.cost_m >= best[1].length_m:
                continue
            found = optimise(
                situation.pose,
                track.nodes,
                self._mission.turn_radius_m,
                cut,
                situation.points,
                keep,
                self._mission.bounds_m,
            )
            if found is not None and (best is None or found[1].length_m < best[1].length_m):
                best = found
        return best

    def _sentence(self, request: PlanRequest, nodes: Sequence[Point]) -> str:
        ux, uy, left = guide_vector(request.position_m, self._mission.goal_m)
        if len(nodes) < 2:
            return f"way to the goal in view, {left / 1000:.1f} km to go"
        x, y = nodes[0][0] - request.position_m[0], nodes[0][1] - request.position_m[1]
        side = "left" if ux * y - uy * x > 0.0 else "right"
        return f"obstacle ahead, passing {side} at {math.hypot(x, y) / 1000:.1f} km"

    def _picture(
        self, request: PlanRequest, window: Window, nodes: Sequence[Point], tracks: Sequence[Track]
    ) -> PlanPicture:
        return PlanPicture(
            guide_m=np.array([request.position_m, self._mission.goal_m]),
            window_m=self._window_m,
            sectors=window.free_sectors(request.position_m),
            candidates=(np.array([request.position_m, *nodes]), *(np.array(track.nodes) for track in tracks)),
        )
