"""Section 3.3, the rolling window: the first part of a plan is flown, then it is planned anew in a new window.

What the paper does not say is done in the plainest way:

* The window rolls when a step S_0 of the plan is flown, or when something sensed since cuts the plan.
* A plan begins on the path in effect, a second ahead, at the end of an arc. The first track point w_s1 lies half a
  step straight ahead of there, so that the corner there can be rounded as any other.
* Where the shortest candidate is longer than the plan in effect by more than S_0, that is flown on, to its last step.
* Where no candidate is found, the plan in effect is flown on; where that ends or is cut, the aircraft circles and
  searches again after every scan. Nothing leads it out of a trap.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from planner.geometry.clearance import first_breach
from planner.geometry.course import Route
from planner.geometry.curves import Pose, Segment, along, between, end_of, place_on
from planner.geometry.joining import branch_off, holding_plan, lead_of
from planner.interface import Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.memory import ObstacleMemory
from planner.paper.config import ImprovedBugConfig
from planner.paper.model import within
from planner.paper.multi_step_search import Window, multi_step_search
from planner.paper.route_optimisation import optimise, shortest
from planner.paper.sectors import FULL_CIRCLE, fan_shaped_sectors


class ImprovedBug:
    """The planner for one flight."""

    def __init__(self, config: ImprovedBugConfig, mission: Mission) -> None:
        self._config, self._mission = config.resolved(mission), mission
        self._memory = ObstacleMemory(mission.clearance_m)

    def plan(self, request: PlanRequest) -> Plan:
        """Section 3.3: one step of the rolling window, where one is due; a holding turn without a candidate."""
        path, at_m = request.flown.path if request.flown else None, request.arc_length_m
        if path is not None and not request.scanned:
            return Plan(PlanStatus.KEPT, "nothing new is sensed")
        window = self.planning_window(request)
        serves, keep_m = path, self._mission.clearance_m
        if path is not None and (path.loiter or first_breach(path, window.points_m, keep_m, at_m) < math.inf):
            serves = None
        if serves is not None and at_m < self._config.resolved_step_m:
            return Plan(PlanStatus.KEPT, "the first step of the plan is being flown")
        start, before = self._start(request, serves)
        plan = self._new_plan(request, window, self.local_planning(window, start), before)
        plan = self._compared(serves, at_m, plan)
        return plan or holding_plan("no candidate in the window", request, self._mission, window.points_m)

    def _compared(self, serves: Path | None, at_m: float, plan: Plan | None) -> Plan | None:
        """The new plan; or that the one in effect `serves`, where the new one is longer by more than S_0 or none is.

        In its last step the plan in effect gives way to any new one.
        """
        goal, step_m = self._mission.goal_m, self._config.resolved_step_m
        if serves is None or serves.length_m - at_m <= step_m:
            return plan
        if plan is None or plan.path is None:
            return Plan(PlanStatus.NO_PATH, "no candidate in the window; the plan in effect is flown on")
        new_m = plan.path.length_m + math.dist(end_of(plan.path)[:2], goal)
        if new_m > serves.length_m - at_m + math.dist(end_of(serves)[:2], goal) + step_m:
            return Plan(PlanStatus.NO_BETTER, "every candidate is longer than the plan in effect")
        return plan

    def planning_window(self, request: PlanRequest) -> Window:
        """Section 3.3: U_1 about the aircraft, with the sensed edge points that are not too far to matter in it."""
        config, mission = self._config, self._mission
        assert config.planning_window_m is not None
        keep_m = mission.clearance_m + config.margin(mission)
        self._memory.take_in(request.seen, met=[])
        sensed = np.concatenate((self._memory.standing_m, *(each.points_m for each in request.seen.moving)))
        near = within(sensed, request.position_m, config.planning_window_m + keep_m)
        return Window(request.position_m, config.planning_window_m, near, keep_m, mission, config)

    def local_planning(self, window: Window, start: Pose) -> list[Route]:
        """Section 3.2: multi-step search, route optimisation of each candidate; the shortest first, none if blocked."""
        ahead = along((*start, 0.0, 0.0), 0.5 * self._config.resolved_step_m)
        course = math.atan2(start.tangent_north, start.tangent_east)
        if not window.free(start[:2], ahead[:2]):
            return []
        routes = (optimise(track, start, window) for track in multi_step_search(window, ahead[:2], course))
        return shortest((route for route in routes if route is not None), self._mission.goal_m)

    def _start(self, request: PlanRequest, serves: Path | None) -> tuple[Pose, list[Segment]]:
        """Where the new plan leaves the one that `serves`, at the end of an arc, and the stretch up to there."""
        start, before = branch_off(request, self._mission)
        if serves is None or not before:
            return start, before
        leave_m = request.arc_length_m + lead_of(self._mission)
        end_m = next((end_m for end_m in np.cumsum(serves.segments[:, 5]).tolist() if end_m > leave_m), None)
        if end_m is not None and place_on(serves, leave_m)[1]:
            return place_on(serves, end_m)[0], between(serves, request.arc_length_m, end_m)
        return start, before

    def _new_plan(
        self, request: PlanRequest, window: Window, routes: list[Route], before: list[Segment]
    ) -> Plan | None:
        """The shortest route as a plan; None without any."""
        if not routes:
            return None
        best = routes[0]
        straight = len(routes) == 1 and len(best.nodes) == 2
        return Plan(
            PlanStatus.FOUND,
            "along the guide vector" if straight else f"round obstacles, the best of {len(routes)}",
            np.array([request.position_m, *best.nodes]),
            Path(np.array([*before, *best.path.segments.tolist()])),
            partial(_picture, request.position_m, window, routes),
        )


def _picture(position_m: tuple[float, float], window: Window, routes: list[Route]) -> PlanPicture:
    """What was searched: guide vector, window, the sectors at the first track point, the optimised candidates."""
    sectors = fan_shaped_sectors(window.points_m, window.keep_m, routes[0].nodes[0])
    edges = np.array([each for each in sectors if each != FULL_CIRCLE]).reshape(-1, 2)
    return PlanPicture(
        np.array([position_m, window.mission.goal_m]),
        window.radius_m,
        np.column_stack((np.cos(edges), np.sin(edges)))[:, [0, 2, 1, 3]],
        tuple(np.array([position_m, *route.nodes]) for route in routes),
    )
