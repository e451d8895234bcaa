"""Bug1 and Bug2: straight on, and round what is met.

V. J. Lumelsky and A. A. Stepanov, "Dynamic path planning for a mobile automaton with limited information on the
environment", IEEE Transactions on Automatic Control 31(11), 1986; and "Path-planning strategies for a point
mobile automaton moving amidst unknown obstacles of arbitrary shape", Algorithmica 2, 1987.

Both move straight to the goal, or to a hit point on an obstacle, turn left and follow its boundary.
Bug1 follows it back to the hit point, remembering the point Q nearest to the goal, and returns to Q by the shorter way.
If the line from Q to the goal begins inside the obstacle, the goal is enclosed and cannot be reached.
Bug2 follows it until the M-line, the line from start to goal, is met at a point nearer to the goal than the hit point
from which the line leads away from the obstacle: a leave point. If the hit point is met again, the goal is enclosed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.baselines.polyline import Mark, beside, length_of, mark_at, piece, stations
from planner.baselines.walk import ON_RIGHT, Enclosed, Walker, WalkLeg, place_at_end
from planner.geometry.curves import Point
from planner.interface import FloatArray

LOST_SHARE = 1.5
"""If Q is not met again within this many rounds of the obstacle, that has changed, and is gone round anew."""


@dataclass(frozen=True)
class Straight:
    """On the straight line to the goal; the M-line comes from `start`."""

    start: Point


@dataclass(frozen=True)
class Circling:
    """On the boundary of an obstacle: where it was met, and how far it has been followed.

    `q` is the point of it nearest to the goal, `q_m` from that, and `q_at_m` along the boundary.
    """

    start: Point  # of the M-line
    hit: Mark
    q: Mark
    q_m: float
    q_at_m: float = 0.0
    walked_m: float = 0.0


@dataclass(frozen=True)
class Returning:
    """Bug1, on the way back to Q: side of the obstacle, length (m) of its whole boundary and of the part followed."""

    q: Mark
    side: float
    round_m: float
    walked_m: float = 0.0


BugState = Straight | Circling | Returning | Enclosed


class Bug1(Walker[BugState]):
    """Bug1 for one flight."""

    def begin(self, place: Point) -> BugState:
        """The state that a walk begins in: straight to the goal, along the M-line from there."""
        return Straight(place)

    def after(self, state: BugState, flown: FloatArray) -> BugState:
        """The state after a part of a leg: counts the length followed and remembers Q."""
        if isinstance(state, Circling):
            return self._advance_circling(state, flown)
        if isinstance(state, Returning):
            return replace(state, walked_m=state.walked_m + length_of(flown))
        return state

    def follows(self, place: Point, state: BugState) -> tuple[Point, ...]:
        """The place beside the boundary, and the place where the way round or back ends; empty on a straight."""
        if isinstance(state, Circling | Returning):
            return place, (state.hit if isinstance(state, Circling) else state.q).place
        return ()

    def says(self, state: BugState) -> str:
        """A sentence that says what the planner is doing, for the plan's reason."""
        if isinstance(state, Circling):
            return f"going round an obstacle, {state.walked_m / 1000:.1f} km from the hit point"
        if isinstance(state, Returning):
            return "returning to the boundary point nearest to the goal"
        return "straight to the goal"

    def walk(self, place: Point, state: BugState) -> Iterator[WalkLeg[BugState]]:
        """Yields legs straight on, round an obstacle and back to Q, as they follow one another."""
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
                place = place_at_end(line, place)
                state = self._begin_circling(place, state.start)
                continue
            way = self.known.boundary(place, state.side if isinstance(state, Returning) else ON_RIGHT, left)
            stop, leaves = self._stops(state, way)
            flown = piece(way, 0.0, stop)
            yield WalkLeg(state, flown)
            if math.isinf(stop):
                return
            left -= stop
            place = place_at_end(flown, place)
            start = state.start if isinstance(state, Circling) else place
            state = Straight(start) if leaves else self._after_boundary(place, state, flown)

    def _begin_circling(self, place: Point, start: Point) -> Circling:
        """The state at a hit point; where the shield has led beside the M-line, that begins there anew."""
        hit = mark_at(self.known.boundary(place, ON_RIGHT, self.keep_m), 0.0)
        off_m = float(beside(np.array([start, self.goal]), place)[0][0])
        return Circling(start if off_m < self._same_m else place, hit, hit, math.dist(place, self.goal))

    def _stops(self, state: Circling | Returning, way: FloatArray) -> tuple[float, bool]:
        """Arc length to which the boundary is followed, infinite beyond the horizon, and whether it is left there."""
        if isinstance(state, Circling):
            return self.passes(way, state.hit, self.keep_m - state.walked_m), False
        return self.passes(way, state.q, 0.0), False

    def _after_boundary(self, place: Point, state: Circling | Returning, flown: FloatArray) -> BugState:
        """The state at the end of a boundary: on the way back to Q, or there on to the goal, or enclosed."""
        if isinstance(state, Circling):
            state = self._advance_circling(state, flown)
            q, side = state.q, ON_RIGHT
            if state.q_at_m > 0.5 * state.walked_m:  # the other way back is the shorter one
                q, side = Mark(q.place, -q.ux, -q.uy), -ON_RIGHT
            return Returning(q, side, state.walked_m)
        if state.walked_m > LOST_SHARE * state.round_m:
            return self._begin_circling(place, place)
        if self.known.leads_inside(place, self.goal):
            return Enclosed(f"{self.enclosed()}: gone round, and the way from its nearest point leads inside")
        return Straight(place)

    def _advance_circling(self, state: Circling, flown: FloatArray) -> Circling:
        """The state of circling after a further part of the boundary, with Q where that came nearer to the goal."""
        walked = state.walked_m + length_of(flown)
        if len(flown) < 2:
            return state
        away, at, _ = beside(flown, self.goal)
        if away[i := int(away.argmin())] >= state.q_m:
            return replace(state, walked_m=walked)
        q = mark_at(flown, float(at[i]))
        return Circling(state.start, state.hit, q, float(away[i]), state.walked_m + float(at[i]), walked)


class Bug2(Bug1):
    """Bug2 for one flight."""

    def _stops(self, state: Circling | Returning, way: FloatArray) -> tuple[float, bool]:
        """Arc length of the hit point or the first leave point, and whether the boundary is left there."""
        closed, leave = super()._stops(state, way)[0], self._leaves(way, state)
        return min(closed, leave), leave <= closed

    def _after_boundary(self, place: Point, state: Circling | Returning, flown: FloatArray) -> BugState:
        """Ends the walk: back at the hit point without a leave point, the goal is enclosed."""
        return Enclosed(f"{self.enclosed()}: back at the hit point without a leave point")

    def _leaves(self, way: FloatArray, state: Circling | Returning) -> float:
        """Arc length of the first leave point: on the M-line, nearer to the goal, way free; infinite without one."""
        assert isinstance(state, Circling)
        m_line = np.array(self.goal) - state.start
        off = (way - state.start) @ (-m_line[1], m_line[0])
        least_m = math.dist(state.hit.place, self.goal) - self.progress_m
        at = stations(way)
        for i in np.flatnonzero((off[:-1] * off[1:] <= 0.0) & (off[:-1] != off[1:])).tolist():
            arc_length_m = float(at[i] + off[i] / (off[i] - off[i + 1]) * (at[i + 1] - at[i]))
            place = mark_at(way, arc_length_m).place
            if math.dist(place, self.goal) < least_m and not self.known.leads_inside(place, self.goal):
                return arc_length_m
        return math.inf
