"""Bug1: round every obstacle that is met, once and wholly, and on from its point nearest to the goal.

V. J. Lumelsky and A. A. Stepanov, "Dynamic path planning for a mobile automaton with limited information on the
environment", IEEE Transactions on Automatic Control 31(11), 1986; and "Path-planning strategies for a point
mobile automaton moving amidst unknown obstacles of arbitrary shape", Algorithmica 2, 1987.

1. Move straight to the goal, or to a hit point on an obstacle.
2. Turn to the given side and follow the boundary back to the hit point, remembering the point Q nearest to the
   goal.
3. Return to Q by the shorter way along the boundary. If the straight line from Q to the goal begins inside the
   obstacle, the goal is enclosed and cannot be reached; if not, go to 1.

The path is no longer than the distance to the goal and 1.5 times the perimeters of the obstacles met.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.baselines.walk import (
    Enclosed,
    Mark,
    PointConfig,
    Straight,
    Walker,
    WalkLeg,
    cut,
    length_of,
    mark_at,
)
from planner.geometry.clearance import distances
from planner.geometry.curves import Point, Segment, along
from planner.interface import Path

LOST_SHARE = 1.5
"""Q not met again after this share of a round: the obstacle is not what it was, and is gone round anew."""


@dataclass(frozen=True)
class Circling:
    """On the way round an obstacle.

    Attributes:
        hit: where it was met.
        walked_m: how far the boundary has been followed.
        q: the point of it nearest to the goal.
        q_m: its distance from the goal.
        q_at_m: how far along the boundary it lies.
    """

    hit: Mark
    walked_m: float
    q: Mark
    q_m: float
    q_at_m: float


@dataclass(frozen=True)
class Returning:
    """On the way back to Q.

    Attributes:
        q: the point, passed in the sense of the way back.
        side: of the obstacle on this way.
        round_m: length of the whole boundary.
        walked_m: how far the way back has been followed.
    """

    q: Mark
    side: float
    round_m: float
    walked_m: float


Bug1State = Straight | Circling | Returning | Enclosed


class Bug1Config(PointConfig):
    """Keys of `planner.kind: bug1`."""


class Bug1(Walker[Bug1State]):
    """The planner for one flight."""

    def begin(self, place: Point) -> Bug1State:
        """Straight to the goal."""
        return Straight()

    def after(self, state: Bug1State, flown: Sequence[Segment]) -> Bug1State:
        """Counts what has been followed and remembers Q."""
        if isinstance(state, Circling):
            return self._circled(state, flown)
        if isinstance(state, Returning):
            return replace(state, walked_m=state.walked_m + length_of(flown))
        return state

    def follows(self, place: Point, state: Bug1State) -> tuple[Point, ...]:
        """The boundary here, and where the way round or back ends."""
        if isinstance(state, Circling | Returning):
            return place, (state.hit if isinstance(state, Circling) else state.q).place
        return ()

    def says(self, state: Bug1State) -> str:
        """What the planner does."""
        if isinstance(state, Circling):
            return f"going round an obstacle, {state.walked_m / 1000:.1f} km from the hit point"
        if isinstance(state, Returning):
            return "returning to the boundary point nearest to the goal"
        return "straight to the goal"

    def walk(self, place: Point, state: Bug1State) -> Iterator[WalkLeg[Bug1State]]:
        """Steps 1 to 3 in turn."""
        left = self.horizon_m
        while left > 0.0:
            if isinstance(state, Enclosed):
                yield WalkLeg(state)
                return
            if isinstance(state, Straight):
                line, met = self.straight(place, self.goal)
                yield WalkLeg(state, line)
                if not met:
                    return
                place = along(line[0], line[0][5])[:2] if line else place
                state = self._met(place)
                continue
            if isinstance(state, Returning) and state.walked_m > LOST_SHARE * state.round_m:
                state = self._met(place)
            side = state.side if isinstance(state, Returning) else self.side
            segments = self.boundary(place, side, left)
            if isinstance(state, Circling):
                stop = self.passes(segments, state.hit, self.keep_m - state.walked_m)
            else:
                stop = self.passes(segments, state.q, 0.0)
            flown = cut(segments, stop)
            yield WalkLeg(state, flown)
            if math.isinf(stop):
                return
            left -= stop
            place = mark_at(segments, stop).place
            if isinstance(state, Circling):
                state = self._returning(self._circled(state, flown))
            elif self.known.leads_inside(place, self.goal):
                state = Enclosed(
                    f"{self.enclosed()}: gone round, and the way from its nearest point leads inside"
                )
            else:
                state = Straight()

    def _met(self, place: Point) -> Circling:
        hit = mark_at(self.boundary(place, self.side, self.keep_m), 0.0)
        return Circling(hit, 0.0, hit, math.dist(place, self.goal), 0.0)

    def _circled(self, state: Circling, flown: Sequence[Segment]) -> Circling:
        """The state further round."""
        if not flown:
            return state
        walked = state.walked_m + length_of(flown)
        distance, at = distances(Path(np.array(flown)), np.array([self.goal]))
        if distance[0] >= state.q_m:
            return replace(state, walked_m=walked)
        arc_length_m = float(at[0])
        return Circling(
            state.hit, walked, mark_at(flown, arc_length_m), float(distance[0]), state.walked_m + arc_length_m
        )

    def _returning(self, state: Circling) -> Returning:
        """The shorter way back to Q."""
        onward = state.q_at_m <= 0.5 * state.walked_m
        q, side = (state.q, self.side) if onward else (state.q.reversed(), -self.side)
        return Returning(q, side, state.walked_m, 0.0)
