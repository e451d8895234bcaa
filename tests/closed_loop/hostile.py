"""Planners that want to hit something, or break: what a shield has to put up with."""

import math
from itertools import pairwise

import numpy as np

from wayproof import Mission, Path, Plan, PlanRequest, PlanStatus


class Straight:
    """Straight at the goal, once and for all."""

    def __init__(self, mission: Mission) -> None:
        self.mission, self.random = mission, np.random.default_rng(7)

    def plan(self, request: PlanRequest) -> Plan:
        if request.flown is not None:
            return Plan(PlanStatus.KEPT, "straight on")
        return self.through(request.position_m, self.mission.goal_m)

    @staticmethod
    def through(*points_m: tuple[float, float]) -> Plan:
        return Plan(PlanStatus.FOUND, "as I like it", np.array(points_m), Path.through(points_m))


class Anywhere(Straight):
    """Corners at random, also outside of the area, and others at every scan."""

    def plan(self, request: PlanRequest) -> Plan:
        steps = self.random.normal(0.0, 600.0, (4, 2)).cumsum(axis=0) + request.position_m
        return self.through(request.position_m, *(tuple(each) for each in steps.tolist()))


class Outwards(Straight):
    """Out of the area, north."""

    def plan(self, request: PlanRequest) -> Plan:
        east, north = request.position_m
        return self.through((east, north), (east, north + 9000.0))


class Onwards(Straight):
    """Straight on for ever, whatever the plan in effect."""

    def plan(self, request: PlanRequest) -> Plan:
        (east, north), ahead = request.position_m, request.direction
        return self.through((east, north), (east + 9000.0 * ahead[0], north + 9000.0 * ahead[1]))


class Raising(Straight):
    """Raises after 20 s."""

    def plan(self, request: PlanRequest) -> Plan:
        if request.time_s > 20.0:
            raise ZeroDivisionError("no more")
        return super().plan(request)


class NotANumber(Straight):
    """A path of NaN after 20 s."""

    def plan(self, request: PlanRequest) -> Plan:
        if request.time_s > 20.0:
            row = (*request.position_m, 1.0, 0.0, math.nan, 100.0)
            return Plan(PlanStatus.FOUND, "", np.array([request.position_m]), Path(np.array([row])))
        return super().plan(request)


class Kinked(Straight):
    """A zigzag of right angles, 60 m long each."""

    def plan(self, request: PlanRequest) -> Plan:
        here, goal = np.array(request.position_m), np.array(self.mission.goal_m)
        ahead = (goal - here) / np.hypot(*(goal - here))
        aside = np.array((-ahead[1], ahead[0]))
        corners = [here + 60.0 * ((i + 1) // 2 * ahead + (i // 2 % 2) * aside) for i in range(60)]
        places = [corners[0], *(b for a, b in pairwise(corners) if math.dist(a, b) > 1.0)]
        return self.through(*(tuple(each) for each in np.array(places).tolist()))


class Teleporting(Straight):
    """A path that begins 3 km from the aircraft."""

    def plan(self, request: PlanRequest) -> Plan:
        east, north = request.position_m
        return self.through((east + 3000.0, north), self.mission.goal_m)


class Dense(Straight):
    """A slalom of half circles of 60 m, tighter than can be flown, of straights of 1 m: no joint turns by a degree."""

    def plan(self, request: PlanRequest) -> Plan:
        side = (-1.0) ** (np.arange(900) // 180 + request.time_s // 20.0)
        ahead = complex(*request.direction) * np.exp(1j * (side.cumsum() - side[0]) / 60.0)
        places = complex(*request.position_m) + np.concatenate(([0.0], ahead.cumsum()))
        return self.through(*zip(places.real.tolist(), places.imag.tolist(), strict=True))


HOSTILE = (Straight, Anywhere, Outwards, Raising, NotANumber, Kinked, Teleporting)
