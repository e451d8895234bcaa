"""The planner of a flight that is steered from outside, and of the same flight flown again without whoever steered."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.scenario.scenario import Scenario
from planner.geometry.curves import Pose, along, turn_onto
from planner.interface import Mission, Path, Plan, PlanRequest, PlanStatus

NEAREST_M = 1.0
"""A waypoint nearer to the aircraft than this is taken as passed; the way to it is flown at least this long."""
SAME_TIME_S = 1e-6  # times no further apart are one


class Waypoint(NamedTuple):
    """A waypoint, and when the planner gave it."""

    time_s: float
    east_m: float
    north_m: float


class WaypointPilot:
    """A planner whose plan is a turn onto the line to a waypoint, and straight on beyond it.

    `noted` are the waypoints of an earlier flight; None where somebody sets `target_m`.
    """

    def __init__(self, mission: Mission, noted: Sequence[Waypoint] | None = None) -> None:
        self._mission = mission
        self._left = None if noted is None else [*noted]
        self.target_m: tuple[float, float] | None = None
        """East and north of the waypoint to fly to from the next scan on."""
        self.noted: list[Waypoint] = []

    def plan(self, request: PlanRequest) -> Plan:
        """A plan to a new waypoint; that in effect is kept where there is none."""
        if self._left and self._left[0].time_s <= request.time_s + SAME_TIME_S:
            self.target_m = self._left.pop(0)[1:]
        target, self.target_m = self.target_m, None
        if target is None:
            reason = "on to the waypoint" if request.flown else "straight on, until there is a waypoint"
            return Plan(PlanStatus.KEPT if request.flown else PlanStatus.NO_PATH, reason)
        self.noted.append(Waypoint(request.time_s, *target))
        begin = Pose(*request.position_m, *request.direction)
        way = turn_onto(begin, target, self._mission.turn_radius_m)
        if math.dist(target, request.position_m) < NEAREST_M or way is None:
            way = [(*begin, 0.0, NEAREST_M)]
        path = Path(np.array([*way, (*along(way[-1], way[-1][5]), 0.0, self._mission.sensor_range_m)]))
        return Plan(PlanStatus.FOUND, "a waypoint from outside", np.array([target]), path)


@dataclass(frozen=True)
class Episode:
    """What an agent flew; `wayproof.fly(episode.scenario, **episode.pilots)` flies it again, to the same digest."""

    scenario: Scenario  # with the seed that was flown
    waypoints: tuple[Waypoint, ...] = ()  # that the agent gave

    @property
    def pilots(self) -> dict[str, Callable[[Mission], WaypointPilot]]:
        """The arguments of `wayproof.fly` that fly the waypoints again: a `planner`."""
        return {"planner": lambda mission: WaypointPilot(mission, self.waypoints)}
