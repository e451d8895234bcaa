"""Base class of the BUG family: plans the walk of a point that can turn on the spot.

A walk is what the algorithm would do from here on if nothing but what has been seen were there: straight lines and
stretches of boundary, each with the state of the algorithm on it. Where a new edge point comes too near to it, it is
taken up again from the state reached by then: a BUG knows an obstacle only on contact. How far it is done does not
depend on what is flown: where a shield flies something else, the walk is joined again. While something moves, and for
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
        self._same_m, self.progress_m = SAME_PLACE_SHARE * self.keep_m, PROGRESS_SHARE * self.keep_m
        self._near_m = 2.0 * self.keep_m + mission.ground_speed_mps * (2.0 + mission.compute_latency_s)
        self._breach_keep_m = self.keep_m - BREACH_SHARE * margin_m
        self._unrest = WorldStability()
        self._tried_again = False
        self.shielded = False  # its plans are flown by a shield, as far as that lets them be
        self._beside_m = 2.0 * mission.hold_radius_m + self.keep_m
        # The algorithm's memory, whatever is flown: the walk it is on, and how far that has been walked.
        self.legs: tuple[WalkLeg[WalkState], ...] = ()
        self._way, self._walked_m = np.zeros((2, 2)), 0.0
        self._plan, self._path = Plan(PlanStatus.KEPT, ""), Path(NOWHERE)  # that flies the walk
        self.breach_m = self._look_at_m = math.inf

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
        """Keeps the walk while it serves; takes it up anew where it does not, or where something else is flown."""
        fresh, removed = self.known.take_in(request.seen)
        self._unrest.note(request.time_s, request.seen)
        position = request.position_m
        if not self.legs:
            return self._plan_walk(self.walk(position, self.begin(position)), request, position)
        self.shielded, on_plan = request.committed is not None, request.flown is self._plan
        self._walked_m = self._done_m(request)
        end, left_m = self.legs[-1].state, length_of(self._way) - self._walked_m
        if isinstance(end, Enclosed) and left_m < (self._beside_m if self.shielded else self._same_m):
            return self._end(request, end, removed)
        must = not on_plan or removed or self._ends_soon(request.arc_length_m, fresh)
        if not must and request.arc_length_m < self._look_at_m:
            return Plan(PlanStatus.KEPT, "the walk goes on")
        state, place = self._resume(position, removed)
        legs = tuple(self.walk(place, state))
        if not must and not self.prefers(legs, left_m):
            self._look_at_m = request.arc_length_m + self.look_again_m()
            return Plan(PlanStatus.NO_BETTER, "the walk serves as well as a new one")
        return self._plan_walk(legs, request, place)

    def _ends_soon(self, arc_length_m: float, fresh: FloatArray) -> bool:
        """Whether the walk comes too near to (k, 2) new edge points or those before, or ends, not far ahead."""
        path = self._path
        if len(fresh):
            self.breach_m = min(self.breach_m, first_breach(path, fresh, self._breach_keep_m, arc_length_m))
        ends_early = math.dist(end_of(path)[:2], self.goal) > 1.0
        ends_early &= not isinstance(self.legs[-1].state, Enclosed)
        ends = ends_early and path.length_m - arc_length_m < max(self._near_m, 0.5 * self.horizon_m)
        return ends or self.breach_m - arc_length_m < self._near_m

    def _end(self, request: PlanRequest, end: Enclosed, removed: bool) -> Plan:
        """The answer where the goal is enclosed: begins anew if the world may have changed, else says UNREACHABLE."""
        doubtful, place = removed or (self.known.edges_removed and not self._tried_again), request.position_m
        if doubtful or not self._proven(request):
            self._tried_again |= doubtful
            return self._plan_walk(self.walk(place, self.begin(place)), request, place)
        return Plan(PlanStatus.UNREACHABLE, end.sentence)

    def _resume(self, position: Point, removed: bool) -> tuple[WalkState, Point]:
        """State and place to walk on from: on the boundary followed, of the aircraft where it is off another way."""
        state, place = self._state_at(self._walked_m), pose_at(Path.through(self._way), self._walked_m)[:2]
        followed = self.follows(place, state)
        joins = self.shielded and followed and self.known.sees(position, place)
        if math.dist(place, position) > self.mission.off_path_m and not joins:
            place = position
        lost = removed and any(self.known.off_m(each) > self.keep_m for each in followed)
        return (self.begin(place) if lost else state), place  # the boundary has gone

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
        way, end = np.concatenate([leg.way for leg in legs]), legs[-1].state
        way = way.compress(np.hypot(*np.diff(way, axis=0, prepend=math.inf).T) > SHORTEST_M, axis=0)
        if len(way) < 2:
            reason = end.sentence if isinstance(end, Enclosed) else "there is no room to move"
            proven = isinstance(end, Enclosed) and self._proven(request)
            return Plan(PlanStatus.UNREACHABLE if proven else PlanStatus.NO_PATH, reason)
        self.legs, self._way, self._walked_m = legs, way, 0.0
        self.breach_m, self._look_at_m = math.inf, self.look_again_m()
        position, corners = request.position_m, way
        if (off_m := math.dist(position, way[0])) > self.mission.off_path_m:
            aslant = piece(way, min(2.0 * off_m, 0.5 * length_of(way)), math.inf)
            onto = aslant if self.known.sees(position, place_at_end(aslant[:1], position)) else way
            corners = np.concatenate(([position], onto))
        picture = partial(PlanPicture, np.array([place, self.goal]), self.mission.sensor_range_m)
        self._path = Path.through(corners)
        self._plan = Plan(PlanStatus.FOUND, self.says(legs[0].state), corners, self._path, picture)
        return self._plan

    def _proven(self, request: PlanRequest) -> bool:
        """Whether what is known surely parts aircraft and goal: a shield may have led past a place to leave at."""
        return self._unrest.settled(request.time_s) and self.known.separates(request.position_m, self.goal)

    def _done_m(self, request: PlanRequest) -> float:
        """How far the walk is done: where a shield flies, to the place not far ahead nearest to the aircraft."""
        if request.flown is self._plan and not self.shielded:
            return request.arc_length_m
        ahead = piece(self._way, self._walked_m, self._walked_m + self._beside_m)
        away, at, _ = beside(ahead, request.position_m)
        nearest = int(away.argmin())
        return self._walked_m + (float(at[nearest]) if away[nearest] < self._beside_m else 0.0)

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
        same = (away < self._same_m) & (along @ (mark.ux, mark.uy) > 0.0) & (at >= from_m)
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
