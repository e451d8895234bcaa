"""Planner and guidance law of a flight that is steered from outside, and of the same flight flown again.

Each is told what to do by whoever steers, notes when it did that, and can be given such notes in place of somebody who
steers: then it does the same at the same times.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from aircraft.guidance.interface import GuidanceLimits, GuidanceOutput
from aircraft.guidance.preview import PreviewConfig, PreviewLaw
from aircraft.interface import AircraftState, Route
from planner.geometry.curves import Pose, along, turn_onto
from planner.interface import Mission, Path, Plan, PlanRequest, PlanStatus

NEAREST_M = 1.0
"""A waypoint that is nearer than this is passed."""
SAME_TIME_S = 1e-6


class Waypoint(NamedTuple):
    """A waypoint, and when the planner gave it."""

    time_s: float
    east_m: float
    north_m: float


class Roll(NamedTuple):
    """A roll command (positive right), and from when on it was given."""

    time_s: float
    roll_rad: float


class WaypointPilot:
    """A planner whose plan is a turn onto the line to a waypoint, and straight on beyond it.

    Args:
        mission: turn radius and sensing range.
        noted: of an earlier flight; None where somebody sets `target_m`.
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
        beyond = (*along(way[-1], way[-1][5]), 0.0, self._mission.sensor_range_m)
        return Plan(
            PlanStatus.FOUND, "a waypoint from outside", np.array([target]), Path(np.array([*way, beyond]))
        )


class LinePilot:
    """A planner that gives the line from the start to the goal, once: what roll commands are flown beside."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission

    def plan(self, request: PlanRequest) -> Plan:
        """The line."""
        if request.flown is not None:
            return Plan(PlanStatus.KEPT, "the line to the goal")
        line = Path.through([request.position_m, self._mission.goal_m])
        return Plan(PlanStatus.FOUND, "the line to the goal", np.array([self._mission.goal_m]), line)


class RollPilot:
    """A guidance law that commands the rolls it is told, on the line to the goal; on any other path `preview` steers.

    Args:
        limits: of the aircraft.
        goal_m: east and north of the goal: where the line ends.
        noted: of an earlier flight; None where somebody sets `roll_rad`.
    """

    def __init__(
        self,
        limits: GuidanceLimits,
        goal_m: tuple[float, float],
        noted: Sequence[Roll] | None = None,
    ) -> None:
        self._limits, self._goal_m = limits, goal_m
        self._law = PreviewLaw(PreviewConfig().resolved(limits), limits)
        self._left = None if noted is None else [*noted]
        self._told = False
        self.roll_rad = 0.0
        """What is commanded from the next update on, rad."""
        self.noted: list[Roll] = []

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a path; cross-track errors are those from it."""
        self._law.follow(route, arc_length_m)
        end = along(tuple(route.segments[-1].tolist()), float(route.segments[-1, 5]))
        self._told = math.dist((end.east_m, end.north_m), self._goal_m) < NEAREST_M

    def update(self, state: AircraftState) -> GuidanceOutput:
        """What is commanded, the bank limit observed."""
        steered = self._law.update(state)
        if not self._told:
            return steered
        if self._left and self._left[0].time_s <= state.time_s + SAME_TIME_S:
            self.roll_rad = self._left.pop(0).roll_rad
        limit = self._limits.bank_limit_rad
        roll = min(max(self.roll_rad, -limit), limit)
        if not self.noted or self.noted[-1].roll_rad != roll:
            self.noted.append(Roll(state.time_s, roll))
        return steered._replace(roll_command_rad=roll, bank_saturated=abs(roll) >= limit)
