"""Base class of the BUG family: plans the walk of a point that can turn on the spot.

A walk is what the algorithm would do from here on if nothing but what has been seen were there: straight lines and
stretches of boundary, each with the state of the algorithm on it. Where a new edge point comes too near to it, it is
taken up again from the state reached by then: a BUG knows an obstacle only on contact. While something moves, and for
some minutes after (`planner.world_stability`), the algorithm begins anew where it would say that the goal is enclosed;
once as well where edges have been taken back.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Generic, TypeVar

import numpy as np

from planner.baselines.polyline import NOWHERE, Mark, beside, length_of, piece
from planner.geometry.clearance import first_breach
from planner.geometry.curves import SHORTEST_M, Point, end_of, pose_at
from planner.interface import FloatArray, Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.keys import MarginConfig
from planner.world_stability import WorldStability

ON_RIGHT = -1.0
"""Side of the obstacle (1: left, -1: right): a point that meets an obstacle turns left and has it on its right."""

BREACH_SHARE = 0.25
"""An edge point cuts the walk if it is nearer to it than the kept distance by this share of the margin."""

SAME_PLACE_SHARE = 0.5
"""Places on a boundary passed in one sense and nearer than this share of the kept distance are the same: no two
stretches that run the same way can be that near to each other."""

PROGRESS_SHARE = 0.05
"""A place counts as nearer to the goal only by at least this share of the kept distance, `progress_m`."""

WalkState = TypeVar("WalkState")


@dataclass(frozen=True, eq=False)
class WalkLeg(Generic[WalkState]):
    """A part of a walk: the state of the algorithm at its beginning, (n, 2) corners, none where the algorithm ends."""

    state: WalkState
    way: FloatArray = field(default_factory=lambda: NOWHERE)


@dataclass(frozen=True)
class Straight:
    """On the straight line to the goal."""


@dataclass(frozen=True)
class Enclosed:
    """At the end: the goal cannot be reached, and a sentence why."""

    sentence: str


class Walker(ABC, Generic[WalkState]):
    """The frame of a planner whose vehicle is a point: when to walk anew, and from which state."""

    def __init__(self, config: MarginConfig, mission: Mission) -> None:
        from planner.baselines.grown import GrownObstacles

        margin_m = config.margin(mission)
        self.mission, self.goal, self.horizon_m = mission, mission.goal_m, mission.sensor_range_m
        self.known = GrownObstacles(mission, margin_m)
        self.keep_m = self.known.keep_m
        self.progress_m = PROGRESS_SHARE * self.keep_m
        self._near_m = 2.0 * self.keep_m + mission.ground_speed_mps * (2.0 + mission.compute_latency_s)
        self._breach_keep_m = self.keep_m - BREACH_SHARE * margin_m
        self._unrest = WorldStability()
        self._tried_again = False
        self._plan: Plan | None = None
        self.legs: tuple[WalkLeg[WalkState], ...] = ()
        self.breach_m = self._look_at_m = math.inf
        self._flown_m = 0.0

    @abstractmethod
    def begin(self, place: Point) -> WalkState:
        """The state in which a walk begins, at the start of the flight or anew."""

    def after(self, state: WalkState, flown: FloatArray) -> WalkState:
        """The state after a part of a leg, (n, 2)."""
        return state

    @abstractmethod
    def walk(self, place: Point, state: WalkState) -> Iterator[WalkLeg[WalkState]]:
        """Yields the legs that the algorithm walks among known obstacles, to the goal or the sensing range."""

    @abstractmethod
    def follows(self, place: Point, state: WalkState) -> tuple[Point, ...]:
        """Two places of the boundary followed in a state: one beside `place`, and a mark; empty if none is followed."""

    @abstractmethod
    def says(self, state: WalkState) -> str:
        """Describes what the algorithm does in a state, for the event log."""

    def look_again_m(self) -> float:
        """Length of a walk (m) after which the algorithm looks for a better one although it can go on."""
        return math.inf

    def prefers(self, new: tuple[WalkLeg[WalkState], ...], left_m: float) -> bool:
        """Whether a new walk is better than the `left_m` that are left of the old one, which can go on."""
        return True

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the walk while it serves; takes it up anew where it does not."""
        fresh, removed = self.known.take_in(request.seen)
        self._unrest.note(request.time_s, request.seen)
        place, flown = request.position_m, request.flown
        if flown is not None and flown is self._plan:
            assert flown.path is not None
            return self._continue(request, flown.path, fresh, removed)
        if request.refused is None or not self.legs:
            return self._plan_walk(self.walk(place, self.begin(place)), request, place)
        # Not begun anew: the shield only held.
        return self._plan_walk(self._resume(place, self._state_at(self._flown_m), removed), request, place)

    def _continue(self, request: PlanRequest, path: Path, fresh: FloatArray, removed: bool) -> Plan:
        """The answer while the walk is flown."""
        at_m, end = request.arc_length_m, self.legs[-1].state
        self._flown_m, left_m = at_m, path.length_m - at_m
        if isinstance(end, Enclosed) and left_m < SAME_PLACE_SHARE * self.keep_m:
            return self._end(request, end, removed)
        must = removed or self._ends_soon(path, at_m, fresh)
        if not must and at_m < self._look_at_m:
            return Plan(PlanStatus.KEPT, "the walk goes on")
        place = pose_at(path, at_m)[:2]
        if math.dist(place, request.position_m) > self.mission.off_path_m:
            place = request.position_m
        legs = self._resume(place, self._state_at(at_m), removed)
        if not must and not self.prefers(legs, left_m):
            self._look_at_m = at_m + self.look_again_m()
            return Plan(PlanStatus.NO_BETTER, "the walk serves as well as a new one")
        return self._plan_walk(legs, request, place)

    def _ends_soon(self, path: Path, arc_length_m: float, fresh: FloatArray) -> bool:
        """Whether the walk comes too near to (k, 2) new edge points or those before, or ends, not far ahead."""
        if len(fresh):
            breach = first_breach(path, fresh, self._breach_keep_m, arc_length_m)
            self.breach_m = min(self.breach_m, breach)
        enclosed = isinstance(self.legs[-1].state, Enclosed)
        ends_early = not enclosed and math.dist(end_of(path)[:2], self.goal) > 1.0
        ends = ends_early and path.length_m - arc_length_m < max(self._near_m, 0.5 * self.horizon_m)
        return ends or self.breach_m - arc_length_m < self._near_m

    def _end(self, request: PlanRequest, end: Enclosed, removed: bool) -> Plan:
        """The answer where the goal is enclosed: begins anew if the world may have changed, else says UNREACHABLE."""
        doubtful = removed or (self.known.edges_removed and not self._tried_again)
        if doubtful or not self._unrest.settled(request.time_s):
            self._tried_again |= doubtful
            place = request.position_m
            return self._plan_walk(self.walk(place, self.begin(place)), request, place)
        return Plan(PlanStatus.UNREACHABLE, end.sentence)

    def _resume(self, place: Point, state: WalkState, removed: bool) -> tuple[WalkLeg[WalkState], ...]:
        """The walk from a state on; begins anew where the boundary that was followed has gone."""
        if isinstance(state, Enclosed):  # the algorithm has ended
            return (WalkLeg(state),)
        lost = removed and any(self.known.off_m(each) > self.keep_m for each in self.follows(place, state))
        return tuple(self.walk(place, self.begin(place) if lost else state))

    def _state_at(self, arc_length_m: float) -> WalkState:
        """The state of the algorithm at an arc length of the path in effect."""
        begin = 0.0
        for leg in self.legs:
            end = begin + length_of(leg.way)
            if arc_length_m < end - SHORTEST_M or leg is self.legs[-1]:
                break
            begin = end
        return self.after(leg.state, piece(leg.way, 0.0, arc_length_m - begin))

    def _plan_walk(self, walk: Iterable[WalkLeg[WalkState]], request: PlanRequest, place: Point) -> Plan:
        """The plan that flies a walk; if it leads nowhere NO_PATH, or UNREACHABLE if enclosed in a settled world."""
        legs = tuple(connected(walk, place))
        corners = np.concatenate([leg.way for leg in legs])
        apart = np.hypot(*np.diff(corners, axis=0).T) > SHORTEST_M
        corners = corners[np.concatenate(([True], apart))] if len(corners) else corners
        end = legs[-1].state
        if len(corners) < 2:
            reason = end.sentence if isinstance(end, Enclosed) else "there is no room to move"
            proven = isinstance(end, Enclosed) and self._unrest.settled(request.time_s)
            return Plan(PlanStatus.UNREACHABLE if proven else PlanStatus.NO_PATH, reason)
        self.legs, self.breach_m, self._look_at_m = legs, math.inf, self.look_again_m()
        self._flown_m = 0.0
        picture = partial(PlanPicture, np.array([place, self.goal]), self.mission.sensor_range_m)
        self._plan = Plan(PlanStatus.FOUND, self.says(legs[0].state), corners, Path.through(corners), picture)
        return self._plan

    def enclosed(self) -> str:
        """Returns the beginning of a sentence that says why the goal cannot be reached."""
        return f"an obstacle encloses the goal at a distance of {self.keep_m:.0f} m from its edge"

    def straight(self, place: Point, target: Point) -> tuple[FloatArray, bool]:
        """(n, 2) the line from a place towards a target, up to the first obstacle, and whether it meets one."""
        clear, _ = self.known.first_hit(place, target)
        whole = math.dist(place, target)
        length = min(whole, clear)
        way = piece(np.array([place, target]), 0.0, length) if length > SHORTEST_M else NOWHERE
        return way, clear < whole

    def passes(self, way: FloatArray, mark: Mark, from_m: float) -> float:
        """Arc length at which a way passes a mark in its sense, not before an arc length; infinite for never."""
        if len(way) < 2:
            return math.inf
        away, at, along = beside(way, mark.place)
        same = (away < SAME_PLACE_SHARE * self.keep_m) & (along @ (mark.ux, mark.uy) > 0.0) & (at >= from_m)
        if not same.any():
            return math.inf
        same &= at < at[same].min() + self.keep_m
        return float(at[same][away[same].argmin()])


def place_at_end(way: FloatArray, otherwise: Point) -> Point:
    """The end of a way; `otherwise` for a way without a place."""
    return (float(way[-1, 0]), float(way[-1, 1])) if len(way) else otherwise


def connected(legs: Iterable[WalkLeg[WalkState]], begin: Point) -> Iterator[WalkLeg[WalkState]]:
    """Joins each leg by a straight line to the end of the one before, and the first leg to the vehicle."""
    at = np.array([begin])
    for leg in legs:
        yield replace(leg, way=np.concatenate((at, leg.way))) if len(leg.way) else leg
        at = leg.way[-1:] if len(leg.way) else at
