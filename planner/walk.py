"""What the planners of the BUG family share: the walk of a point that can turn on the spot.

A walk is what the algorithm would do from here on if nothing but what has been seen were there: straight lines
and stretches of boundary, each with the state of the algorithm on it. It stays right until a new edge point
comes too near to what is left of it, because a boundary changes only where a new disc covers it. So it is
taken up again, from the state reached by then, when the aircraft has come to such a place: a BUG knows an
obstacle only on contact.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any, Generic, Literal, TypeVar

import numpy as np

from planner.boundary import Contact, GrownObstacles, margin_of
from planner.clearance import distances, first_breach
from planner.curves import SHORTEST_M, Point, Segment, along, between, pose_at
from planner.interface import Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus

OFF_PATH = 4.0
"""Further off the path than this many times the tracking error, a walk begins at the aircraft itself."""

BREACH_SHARE = 0.25
"""A new edge point counts when it comes nearer than the kept distance by this share of the margin."""

SAME_PLACE = 0.5
"""Places on a boundary passed in one sense and nearer than this share of the kept distance are the same: no two
stretches of a boundary that run the same way can be that near to each other."""

State = TypeVar("State")


@dataclass(frozen=True)
class PointConfig:
    """Keys that all planners of the BUG family have."""

    turn: Literal["left", "right"] = field(
        default="left", metadata={"doc": "the way a point turns when it meets an obstacle"}
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
    horizon_m: float | None = field(
        default=None,
        metadata={
            "doc": "how far along a boundary a plan reaches; default: the sensor range",
            "unit": "m",
            "above": 0.0,
        },
    )

    def resolved(self, mission: Mission) -> Any:
        """This config with every None replaced by its default for the mission."""
        return replace(
            self,
            margin_m=margin_of(mission) if self.margin_m is None else self.margin_m,
            horizon_m=mission.sensor_range_m if self.horizon_m is None else self.horizon_m,
        )


@dataclass(frozen=True)
class Leg(Generic[State]):
    """A part of a walk on which the state of the algorithm is one.

    Attributes:
        state: as it is where the leg begins.
        segments: the way; none where the algorithm ends.
    """

    state: State
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
class Cut:
    """Where a stretch of boundary is left: the way up to there."""

    segments: tuple[Segment, ...]
    place: Point


class Walker(ABC, Generic[State]):
    """The frame of a planner whose vehicle is a point: when to walk anew, and from which state.

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
        self._near_m = 2.0 * self.keep_m + mission.speed_mps * (2.0 + mission.compute_latency_s)
        self._breach_keep_m = self.keep_m - BREACH_SHARE * config.margin_m
        self._plan: Plan | None = None
        self._legs: tuple[Leg[State], ...] = ()
        self._whole = False
        self._breach_m = math.inf

    @abstractmethod
    def begin(self, place: Point) -> State:
        """The state at the start of the flight."""

    @abstractmethod
    def after(self, state: State, flown: Sequence[Segment]) -> State:
        """The state after a part of a leg."""

    @abstractmethod
    def walk(self, place: Point, state: State) -> Iterable[Leg[State]]:
        """What the algorithm does from a place on, in what is known, leg by leg to the goal or the horizon."""

    @abstractmethod
    def verdict(self, state: State) -> str | None:
        """Why the goal cannot be reached, a sentence, once this state is reached; None in any other state."""

    def rethinks(self, station_m: float) -> bool:
        """Whether the algorithm looks round here although its walk is still right."""
        return False

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the walk while it serves; takes it up anew where it does not."""
        fresh, taken_back = self.known.take_in(request.seen)
        path = request.flown.path if request.flown is self._plan and request.flown else None
        if path is None:
            return self._answer(request, request.position_m, self.begin(request.position_m))
        station = request.station_m
        if len(fresh):
            breach = first_breach(path, fresh, self._breach_keep_m, station)
            self._breach_m = min(self._breach_m, breach)
        due = self._breach_m - station < self._near_m or (
            not self._whole and path.length_m - station < max(self._near_m, 0.5 * self.horizon_m)
        )
        if not (due or taken_back or self.rethinks(station)):
            return Plan(PlanStatus.KEPT, "the walk goes on")
        state = self._state_at(path, station)
        sentence = self.verdict(state)
        if sentence is not None:
            return Plan(PlanStatus.UNREACHABLE, sentence)
        if not (due or taken_back) and self.rethinks(station) is False:
            return Plan(PlanStatus.KEPT, "the walk goes on")
        place = pose_at(path, station)[:2]
        if math.dist(place, request.position_m) > max(1.0, OFF_PATH * self.mission.tracking_error_m):
            place = request.position_m
        return self._answer(request, place, state)

    def _state_at(self, path: Path, station_m: float) -> State:
        """The state of the algorithm at a station of the path in effect."""
        begin = 0.0
        for leg, following in zip(self._legs, (*self._legs[1:], None), strict=True):
            end = begin + sum(segment[5] for segment in leg.segments)
            if following is None or station_m < end - SHORTEST_M:
                return self.after(leg.state, between(path, begin, station_m))
            begin = end
        raise AssertionError("a walk has a leg")

    def _answer(self, request: PlanRequest, place: Point, state: State) -> Plan:
        legs = tuple(self.walk(place, state))
        sentence = self.verdict(legs[0].state)
        if sentence is not None:
            return Plan(PlanStatus.UNREACHABLE, sentence)
        segments = [segment for leg in legs for segment in leg.segments]
        if not segments:
            return Plan(PlanStatus.NO_PATH, "there is no room to move")
        path = Path(np.array(segments))
        joints = [
            segment[:2]
            for before, segment in zip(segments, segments[1:], strict=False)
            if _kink(before, segment)
        ]
        last = along(segments[-1], segments[-1][5])[:2]
        self._whole = math.dist(last, self.goal) < 1.0 or self.verdict(legs[-1].state) is not None and False
        self._legs, self._breach_m = legs, math.inf
        self._plan = Plan(
            PlanStatus.FOUND,
            self.sentence(legs),
            np.array([place, *joints, last]),
            path,
            PlanPicture(np.array([place, self.goal]), self.mission.sensor_range_m, np.zeros((0, 4))),
        )
        return self._plan
