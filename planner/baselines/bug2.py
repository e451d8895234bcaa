"""Bug2: along the straight line from start to goal, round what stands on it, and on along the line.

V. J. Lumelsky and A. A. Stepanov, "Dynamic path planning for a mobile automaton with limited information on the
environment", IEEE Transactions on Automatic Control 31(11), 1986; and "Path-planning strategies for a point
mobile automaton moving amidst unknown obstacles of arbitrary shape", Algorithmica 2, 1987.

1. Move along the M-line, the line from start to goal, to the goal, or to a hit point on an obstacle.
2. Turn to the given side and follow the boundary until
   (a) the goal is reached;
   (b) the M-line is met at a point nearer to the goal than the hit point from which the line leads away from
   the obstacle, a leave point: go to 1;
   (c) the hit point is met again: the goal is enclosed and cannot be reached.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

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
from planner.geometry.curves import Point, Segment, along
from planner.interface import Mission

PROGRESS_SHARE = 0.05
"""A leave point is nearer to the goal than the hit point by more than this share of the kept distance."""


@dataclass(frozen=True)
class RoundObstacle:
    """On the boundary of an obstacle.

    Attributes:
        hit: where it was met.
        walked_m: how far the boundary has been followed.
    """

    hit: Mark
    walked_m: float


Bug2State = Straight | RoundObstacle | Enclosed


class Bug2Config(PointConfig):
    """Keys of `planner.kind: bug2`."""


class Bug2(Walker[Bug2State]):
    """The planner for one flight."""

    def __init__(self, config: Bug2Config, mission: Mission) -> None:
        super().__init__(config, mission)
        self._start = mission.goal_m

    def begin(self, place: Point) -> Bug2State:
        """The M-line begins where the flight does."""
        self._start = place
        return Straight()

    def after(self, state: Bug2State, flown: Sequence[Segment]) -> Bug2State:
        """Counts what has been followed."""
        if isinstance(state, RoundObstacle):
            return replace(state, walked_m=state.walked_m + length_of(flown))
        return state

    def follows(self, place: Point, state: Bug2State) -> tuple[Point, ...]:
        """The boundary here, and the hit point."""
        return (place, state.hit.place) if isinstance(state, RoundObstacle) else ()

    def says(self, state: Bug2State) -> str:
        """What the planner does."""
        if isinstance(state, RoundObstacle):
            return f"following a boundary, {state.walked_m / 1000:.1f} km from the hit point"
        return "on the M-line to the goal"

    def walk(self, place: Point, state: Bug2State) -> Iterator[WalkLeg[Bug2State]]:
        """Steps 1 and 2 in turn."""
        left = self.horizon_m
        while True:
            if isinstance(state, RoundObstacle):
                segments = self.boundary(place, self.side, left)
            else:
                line, met = self.straight(place, self.goal)
                yield WalkLeg(state, line)
                if not met or left <= 0.0:
                    return
                place = along(line[0], line[0][5])[:2] if line else place
                segments = self.boundary(place, self.side, left)
                state = RoundObstacle(mark_at(segments, 0.0), 0.0)
            closed = self.passes(segments, state.hit, self.keep_m - state.walked_m)
            leave = self._leaves(segments, math.dist(state.hit.place, self.goal))
            stop = min(closed, leave)
            yield WalkLeg(state, cut(segments, stop))
            if math.isinf(stop):
                return
            if closed < leave:
                yield WalkLeg(Enclosed(f"{self.enclosed()}: back at the hit point without a leave point"))
                return
            left -= stop
            place, state = mark_at(segments, stop).place, Straight()

    def _leaves(self, segments: Sequence[Segment], hit_m: float) -> float:
        """Arc length of the first leave point; infinite where there is none."""
        dx, dy = self.goal[0] - self._start[0], self.goal[1] - self._start[1]
        length = math.hypot(dx, dy)
        begin = 0.0
        for segment in segments:
            for at in crossings(segment, self._start, (-dy / length, dx / length)) if length else ():
                place = along(segment, at)[:2]
                nearer = math.dist(place, self.goal) < hit_m - PROGRESS_SHARE * self.keep_m
                if nearer and not self.known.leads_inside(place, self.goal):
                    return begin + at
            begin += segment[5]
        return math.inf


def crossings(segment: Segment, origin: Point, normal: tuple[float, float]) -> list[float]:
    """Where along a segment it crosses a line through a point (m), in order.

    Args:
        segment: the segment.
        origin: a point of the line.
        normal: unit vector across the line.
    """
    x, y, tx, ty, curvature, length = segment
    off = (x - origin[0]) * normal[0] + (y - origin[1]) * normal[1]
    if abs(off) > length:
        return []
    towards, across = tx * normal[0] + ty * normal[1], tx * normal[1] - ty * normal[0]
    if curvature == 0.0:
        places = [-off / towards] if towards else []
    else:
        # off + (towards sin(turn) + across (1 - cos(turn))) / curvature = 0
        sine = -(curvature * off + across)
        if abs(sine) > 1.0:
            return []
        lead, swing = math.atan2(across, towards), math.asin(sine)
        side = math.copysign(1.0, curvature)
        places = [side * turn % math.tau / abs(curvature) for turn in (lead + swing, lead + math.pi - swing)]
    return sorted(at for at in places if 0.0 <= at <= length)
