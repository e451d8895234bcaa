"""What the planners of the BUG family share: the walk of a point that can turn on the spot.

A walk is what the algorithm would do from here on if nothing but what has been seen were there: straight lines
and stretches of boundary, each with the state of the algorithm on it. It stays right until a new edge point
comes too near to what is left of it, because a boundary changes only where a new disc covers it. So it is
taken up again, from the state reached by then, when the aircraft has come to such a place: a BUG knows an
obstacle only on contact. While something moves, and for some minutes after (`planner.world_stability`), the algorithm
begins anew where it would say that the goal is enclosed; once as well where edges have been taken back.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Generic, Literal, Self, TypeVar

import numpy as np

from planner.baselines.boundary import GrownObstacles
from planner.baselines.boundary_path import Contact
from planner.geometry.clearance import distances, first_breach
from planner.geometry.curves import SHORTEST_M, Point, Segment, along, between, end_of, pose_at
from planner.geometry.margin import MARGIN_KEY, margin_of
from planner.interface import Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.world_stability import WorldStability

BREACH_SHARE = 0.25
"""A new edge point counts when it comes nearer than the kept distance by this share of the margin."""

SAME_PLACE = 0.5
"""Places on a boundary passed in one sense and nearer than this share of the kept distance are the same: no two
stretches of a boundary that run the same way can be that near to each other."""

GAP_M = 1e-3
"""A path that would jump further than this between two segments is joined by a straight line."""

WalkState = TypeVar("WalkState")


@dataclass(frozen=True)
class PointConfig:
    """Keys that all planners of the BUG family have."""

    turn: Literal["left", "right"] = field(
        default="left", metadata={"doc": "the way a point turns when it meets an obstacle"}
    )
    margin_m: float | None = field(default=None, metadata=MARGIN_KEY)
    horizon_m: float | None = field(
        default=None,
        metadata={
            "doc": "how far along a boundary a plan reaches; default: the sensor range",
            "unit": "m",
            "above": 0.0,
        },
    )

    def resolved(self, mission: Mission) -> Self:
        """This config with every None replaced by its default for the mission."""
        return replace(
            self,
            margin_m=margin_of(mission) if self.margin_m is None else self.margin_m,
            horizon_m=mission.sensor_range_m if self.horizon_m is None else self.horizon_m,
        )


@dataclass(frozen=True)
class WalkLeg(Generic[WalkState]):
    """A part of a walk on which the state of the algorithm is one.

    Attributes:
        state: as it is where the leg begins.
        segments: the way; none where the algorithm ends.
    """

    state: WalkState
    segments: tuple[Segment, ...] = ()


@dataclass(frozen=True)
class Mark:
    """A place on a boundary and the unit vector in which it was passed."""

    place: Point
    ux: float
    uy: float

    def reversed(self) -> Mark:
        """The same place passed the other way."""
        return Mark(self.place, -self.ux, -self.uy)


@dataclass(frozen=True)
class Straight:
    """On the straight line to the goal."""


@dataclass(frozen=True)
class Enclosed:
    """At the end: the goal cannot be reached.

    Attributes:
        sentence: why.
    """

    sentence: str


class Walker(ABC, Generic[WalkState]):
    """The frame of a planner whose vehicle is a point: when to walk anew, and from which state.

    The algorithms that it frames read half of its attributes: goal, side, kept distance, horizon, legs, what is known.

    Args:
        config: resolved keys.
        mission: what stays the same for the flight.
    """

    def __init__(self, config: PointConfig, mission: Mission) -> None:
        config = config.resolved(mission)
        assert config.margin_m is not None
        assert config.horizon_m is not None
        self.mission, self.goal = mission, mission.goal_m
        self.horizon_m = config.horizon_m
        self.side = (
            -1.0 if config.turn == "left" else 1.0
        )  # turning left, the obstacle comes to be on the right
        self.known = GrownObstacles(mission, config.margin_m)
        self.keep_m = self.known.keep_m
        self._near_m = 2.0 * self.keep_m + mission.ground_speed_mps * (2.0 + mission.compute_latency_s)
        self._breach_keep_m = self.keep_m - BREACH_SHARE * config.margin_m
        self._unrest = WorldStability()
        self._tried_again = False
        self._plan: Plan | None = None
        self.legs: tuple[WalkLeg[WalkState], ...] = ()
        self.breach_m = math.inf
        self._look_at_m = math.inf

    @abstractmethod
    def begin(self, place: Point) -> WalkState:
        """The state at the start of the flight."""

    @abstractmethod
    def after(self, state: WalkState, flown: Sequence[Segment]) -> WalkState:
        """The state after a part of a leg."""

    @abstractmethod
    def walk(self, place: Point, state: WalkState) -> Iterable[WalkLeg[WalkState]]:
        """What the algorithm does from a place on, in what is known, leg by leg to the goal or the horizon."""

    @abstractmethod
    def follows(self, place: Point, state: WalkState) -> tuple[Point, ...]:
        """Where the boundary lies that is followed in a state at a place, and a mark on it; none where none is."""

    @abstractmethod
    def says(self, state: WalkState) -> str:
        """What the algorithm does in a state, a sentence for the event log."""

    def look_again_m(self) -> float:
        """After how much of a walk the algorithm looks round although it can go on (m)."""
        return math.inf

    def prefers(self, new: tuple[WalkLeg[WalkState], ...], left_m: float) -> bool:
        """Whether a new walk is better than the `left_m` that are left of the old one, which can go on."""
        return True

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the walk while it serves; takes it up anew where it does not."""
        fresh, taken_back = self.known.take_in(request.seen)
        self._unrest.note(request.time_s, request.seen)
        path = request.flown.path if request.flown and request.flown is self._plan else None
        if path is None:
            return self._begun(request)
        arc_length_m, end = request.arc_length_m, self.legs[-1].state
        left = path.length_m - arc_length_m
        if isinstance(end, Enclosed) and left < SAME_PLACE * self.keep_m:
            doubtful = taken_back or (self.known.taken_back and not self._tried_again)
            if doubtful or not self._unrest.settled(request.time_s):
                self._tried_again |= doubtful
                return self._begun(request)
            return Plan(PlanStatus.UNREACHABLE, end.sentence)
        if len(fresh):
            breach = first_breach(path, fresh, self._breach_keep_m, arc_length_m)
            self.breach_m = min(self.breach_m, breach)
        ends_early = not isinstance(end, Enclosed) and math.dist(end_of(path)[:2], self.goal) > 1.0
        must = (
            taken_back
            or self.breach_m - arc_length_m < self._near_m
            or (ends_early and left < max(self._near_m, 0.5 * self.horizon_m))
        )
        if not must and arc_length_m < self._look_at_m:
            return Plan(PlanStatus.KEPT, "the walk goes on")
        place = pose_at(path, arc_length_m)[:2]
        if math.dist(place, request.position_m) > self.mission.off_path_m:
            place = request.position_m
        state = self._state_at(path, arc_length_m)
        if taken_back and any(map(self._has_gone, self.follows(place, state))):
            state = self.begin(place)
        legs = tuple(self.walk(place, state))
        if self._begins_off_m(legs, place) > self.mission.off_path_m:
            # Off its boundary, as an aircraft that cuts corners comes to be, the way back to it is blocked.
            legs = tuple(self.walk(place, self.begin(place)))
        if not must and not self.prefers(legs, left):
            self._look_at_m = arc_length_m + self.look_again_m()
            return Plan(PlanStatus.NO_BETTER, "the walk serves as well as a new one")
        return self._found(legs, request, place)

    def _begins_off_m(self, legs: Sequence[WalkLeg[WalkState]], place: Point) -> float:
        """How far from a place a walk begins."""
        first = next((segment for leg in legs for segment in leg.segments), None)
        return 0.0 if first is None else math.dist(first[:2], place)

    def _begun(self, request: PlanRequest) -> Plan:
        """A walk from the beginning of the algorithm."""
        place = request.position_m
        return self._found(tuple(self.walk(place, self.begin(place))), request)

    def _has_gone(self, followed: Point) -> bool:
        """Whether there is no boundary any more where one was."""
        return math.dist(followed, self.known.seat(followed)[1]) > self.keep_m

    def _state_at(self, path: Path, arc_length_m: float) -> WalkState:
        """The state of the algorithm at an arc length of the path in effect."""
        begin = 0.0
        for leg in self.legs:
            end = begin + length_of(leg.segments)
            if arc_length_m < end - SHORTEST_M or leg is self.legs[-1]:
                break
            begin = end
        return self.after(leg.state, between(path, begin, arc_length_m))

    def _found(
        self, legs: tuple[WalkLeg[WalkState], ...], request: PlanRequest, place: Point | None = None
    ) -> Plan:
        here = place or request.position_m
        legs = tuple(connected(legs, here, self.mission.off_path_m))
        segments = [segment for leg in legs for segment in leg.segments]
        end = legs[-1].state
        if not segments:
            reason = end.sentence if isinstance(end, Enclosed) else "there is no room to move"
            proven = isinstance(end, Enclosed) and self._unrest.settled(request.time_s)
            return Plan(PlanStatus.UNREACHABLE if proven else PlanStatus.NO_PATH, reason)
        last = along(segments[-1], segments[-1][5])[:2]
        self.legs, self.breach_m, self._look_at_m = legs, math.inf, self.look_again_m()
        self._plan = Plan(
            PlanStatus.FOUND,
            self.says(legs[0].state),
            np.array([*(segment[:2] for segment in segments), last]),
            Path(np.array(segments)),
            partial(PlanPicture, np.array([here, self.goal]), self.mission.sensor_range_m, np.zeros((0, 4))),
        )
        return self._plan

    def enclosed(self) -> str:
        """How a sentence on a goal that cannot be reached begins."""
        return f"an obstacle encloses the goal at a distance of {self.keep_m:.0f} m from its edge"

    def straight(self, place: Point, target: Point) -> tuple[tuple[Segment, ...], bool]:
        """The line from a place towards a target, up to the first obstacle, and whether it meets one."""
        clear, _ = self.known.first_hit(place, target)
        whole = math.dist(place, target)
        length = min(whole, clear)
        if length <= SHORTEST_M:
            return (), clear < whole
        ux, uy = (target[0] - place[0]) / whole, (target[1] - place[1]) / whole
        return ((*place, ux, uy, 0.0, length),), clear < whole

    def boundary(self, place: Point, side: float, length_m: float) -> tuple[Segment, ...]:
        """The way along the boundary next to a place.

        Args:
            place: on the boundary or near it.
            side: 1 for the obstacle on the left, -1 for on the right.
            length_m: how much of the boundary.
        """
        disc, seat = self.known.seat(place)
        contacts: list[Contact] = []
        length = 0.0
        for contact in self.known.contacts(disc, seat, side):
            contacts.append(contact)
            length += float(self.known.radii_m[contact.disc]) * (contact.end_rad - contact.begin_rad)
            if length >= length_m:
                break
        return tuple(self.known.path_along(place, contacts, side))

    def passes(self, segments: Sequence[Segment], mark: Mark, from_m: float) -> float:
        """Arc length at which a way passes a mark in its sense, not before an arc length; infinite for never."""
        begin, best, best_at = 0.0, SAME_PLACE * self.keep_m, math.inf
        for segment in segments:
            end = begin + segment[5]
            if end >= from_m:
                reach = math.dist(segment[:2], mark.place) - segment[5]
                distance, at = nearest_on_segment(segment, mark.place) if reach < best else (math.inf, 0.0)
                if distance < best and _same_way(segment, at, mark) and begin + at >= from_m:
                    best, best_at = distance, begin + at
                elif math.isfinite(best_at) and begin - best_at > self.keep_m:
                    break
            begin = end
        return best_at


def length_of(segments: Iterable[Segment]) -> float:
    """Length of a way (m)."""
    return sum(segment[5] for segment in segments)


def _same_way(segment: Segment, at_m: float, mark: Mark) -> bool:
    _, _, tx, ty = along(segment, at_m)
    return tx * mark.ux + ty * mark.uy > 0.0


def connected(
    legs: Sequence[WalkLeg[WalkState]], begin: Point | None = None, off_m: float = math.inf
) -> Iterator[WalkLeg[WalkState]]:
    """Legs with a straight line wherever a segment begins off where the one before ends, as beside a boundary.

    Args:
        legs: the walk.
        begin: where the vehicle is.
        off_m: the walk may begin so far from there without a line.
    """
    at, gap_of_m = begin, off_m
    for leg in legs:
        segments: list[Segment] = []
        for segment in leg.segments:
            gap_m = 0.0 if at is None else math.dist(at, segment[:2])
            if at is not None and gap_m > gap_of_m:
                ux, uy = (segment[0] - at[0]) / gap_m, (segment[1] - at[1]) / gap_m
                segments.append((*at, ux, uy, 0.0, gap_m))
            segments.append(segment)
            at, gap_of_m = along(segment, segment[5])[:2], GAP_M
        yield replace(leg, segments=tuple(segments))


def nearest_on_segment(segment: Segment, place: Point) -> tuple[float, float]:
    """Distance of a place from a segment, and where along it (m)."""
    distance, arc_length_m = distances(Path(np.array([segment])), np.array([place]))
    return float(distance[0]), float(arc_length_m[0])


def cut(segments: Sequence[Segment], arc_length_m: float) -> tuple[Segment, ...]:
    """The way up to an arc length."""
    return tuple(between(Path(np.array(segments)), 0.0, arc_length_m)) if segments else ()


def mark_at(segments: Sequence[Segment], arc_length_m: float) -> Mark:
    """The place at an arc length of a way, and its direction there."""
    x, y, ux, uy = pose_at(Path(np.array(segments)), arc_length_m)
    return Mark((x, y), ux, uy)
