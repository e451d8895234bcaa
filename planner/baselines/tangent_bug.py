"""TangentBug: straight to the goal, round obstacles by the edges in sight, along a boundary only where caught.

I. Kamon, E. Rimon and E. Rivlin, "TangentBug: a range-sensor-based navigation algorithm", International Journal of
Robotics Research 17(9), 1998.

The local tangent graph has the goal, where it is in sight, or the end of what is free towards it; and the places
V at which the edges of free sectors touch an obstacle within the sensing range.

1. Motion to the goal: move to the V of the graph with the least d(x, V) + d(V, T) among those nearer to the goal
   T than the aircraft x (and than the last boundary that was left), and along the obstacle it touches while that
   leads nearer to T. Where there is no such V, a local minimum: go to 2.
2. Follow the boundary of the obstacle that blocks the goal, straight to the furthest place of it in sight, until
   (a) a V is in sight that is nearer to T than any place of that boundary sensed so far, d_reach < d_followed:
   move to it (transition) and go to 1;
   (b) the whole boundary has been gone round: the goal is enclosed and cannot be reached.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.baselines.polyline import NOWHERE, Mark, Tangent, length_of, mark_at, piece
from planner.baselines.walk import ON_RIGHT, Enclosed, Walker, WalkLeg, place_at_end
from planner.geometry.curves import Point
from planner.interface import FloatArray

LOOKS_PER_RANGE = 40.0
"""The local tangent graph is made anew this many times per sensing range flown, and when the way is blocked."""
SHORTER_SHARE = 0.005
"""A way to the goal that follows no boundary and that nothing cuts is dropped only for one shorter by this share."""
SHORTCUT_TRIES = 16
"""A straight way to a boundary is tried to this many of its places, evenly spaced, the furthest first."""


@dataclass(frozen=True)
class Toward:
    """Motion to the goal: only places nearer to it than this are aimed at; `left` for them is a boundary."""

    limit_m: float
    left: BoundaryFollowing | None = None


@dataclass(frozen=True)
class BoundaryFollowing:
    """Following a boundary since `hit`, the obstacle on a side (1: left), from `anchor` on, `walked_m` from the hit.

    `on_boundary`: at the anchor, not on a straight way to it; `followed_m`: d_followed, how near to the goal it comes.
    """

    hit: Mark
    side: float
    anchor: Point
    walked_m: float
    on_boundary: bool
    followed_m: float


TangentBugState = Toward | BoundaryFollowing | Enclosed


class TangentBug(Walker[TangentBugState]):
    """The planner for one flight."""

    def begin(self, place: Point) -> TangentBugState:
        """Motion to the goal, wherever that leads."""
        return Toward(math.inf)

    def after(self, state: TangentBugState, flown: FloatArray) -> TangentBugState:
        """Moves the anchor along with the aircraft, and notes d_followed and the length walked."""
        if not isinstance(state, BoundaryFollowing):
            return state
        followed = min(state.followed_m, self._nearest_m(state.anchor))
        if not state.on_boundary or not len(flown):
            return replace(state, followed_m=followed)
        place, walked = place_at_end(flown, state.anchor), state.walked_m + length_of(flown)
        return replace(state, anchor=place, walked_m=walked, followed_m=followed)

    def follows(self, place: Point, state: TangentBugState) -> tuple[Point, ...]:
        """The place where the boundary is followed on, and the place where following began."""
        return (state.anchor, state.hit.place) if isinstance(state, BoundaryFollowing) else ()

    def says(self, state: TangentBugState) -> str:
        """A sentence that says what the planner is doing, for the plan's reason."""
        if isinstance(state, BoundaryFollowing):
            return f"local minimum, following a boundary for {state.walked_m / 1000:.1f} km"
        return "motion to the goal"

    def look_again_m(self) -> float:
        """Length (m) after which the local tangent graph is made anew."""
        return self.mission.sensor_range_m / LOOKS_PER_RANGE

    def prefers(self, new: tuple[WalkLeg[TangentBugState], ...], left_m: float) -> bool:
        """Whether a new walk is better: far straight to a boundary, or to the goal if the old is longer or not free."""
        if isinstance(state := new[0].state, BoundaryFollowing):
            return not state.on_boundary and length_of(new[0].way) > self.look_again_m()
        was_caught = any(isinstance(leg.state, BoundaryFollowing) for leg in self.legs)
        shorter = sum(length_of(leg.way) for leg in new) < (1.0 - SHORTER_SHARE) * left_m
        return was_caught or shorter or math.isfinite(self.breach_m)

    def walk(self, place: Point, state: TangentBugState) -> Iterator[WalkLeg[TangentBugState]]:
        """Yields the legs of steps 1 and 2, as they follow one another."""
        if isinstance(state, BoundaryFollowing) and (node := self._leave_node(place, state)) is not None:
            way, _ = self.straight(place, node.place)
            state = Toward(state.followed_m, state)
            yield WalkLeg(state, way)
            place = node.place
        while isinstance(state, Toward):
            line, met = self.straight(place, self.goal)
            if not met or length_of(line) >= self.mission.sensor_range_m:
                yield WalkLeg(state, line)
                return
            node = self._best_node(place, self._nodes(place), state.limit_m)
            slide = self._slide(place, node) if node is not None else NOWHERE
            onto = place_at_end(slide, place)
            if math.dist(place, self.goal) - math.dist(onto, self.goal) <= self.progress_m:
                if self.shielded and state.left and math.dist(place, self.goal) > state.limit_m:
                    state = replace(state.left, on_boundary=False)  # carried back before it was left
                else:
                    state = self._leave_minimum(place, place_at_end(line, place))
            else:
                yield WalkLeg(state, slide)
                place = onto
        if isinstance(state, BoundaryFollowing):
            yield from self._follow(place, state)

    def _nodes(self, place: Point, also: Point | None = None) -> list[Tangent]:
        """The nodes in sight of the graph, about the obstacle that blocks the goal and the one at a place `also`."""
        reach = self.mission.sensor_range_m
        clear, blocking = self.known.first_hit(place, self.goal)
        ahead = min(clear, reach, math.dist(place, self.goal))
        free = Tangent(mark_at(np.array([place, self.goal]), ahead).place, 0.0, seen=True, dent=False)
        parts = {blocking} if clear < reach else set()
        if also is not None:
            parts.add(self.known.part_at(also))
        touched = self.known.tangents(place, parts, reach)
        # Where something hides an edge, the edges of that are taken as well.
        hiding = self.known.hiding(place, [each.place for each in touched if not each.seen])
        touched += self.known.tangents(place, hiding - parts, reach)
        return [node for node in (free, *touched) if node.seen]

    def _way_m(self, place: Point, node: Tangent) -> float:
        """d(x, V) + d(V, T): length (m) of the way from a place to a node and on to the goal."""
        return math.dist(place, node.place) + math.dist(node.place, self.goal)

    def _best_node(self, place: Point, nodes: list[Tangent], limit_m: float) -> Tangent | None:
        """The node to move to, past an obstacle rather than into a dent of it; None at a local minimum."""
        here = math.dist(place, self.goal)
        nearer = []
        for node in nodes:
            to, goal = np.subtract(node.place, place), np.subtract(self.goal, place)
            nearer_m = math.inf if math.dist(place, node.place) < self.keep_m else here
            if node.side and to @ goal > 0.0 and math.dist(node.place, self.goal) < min(limit_m, nearer_m):
                nearer.append(node)
        return min(nearer, key=lambda node: (node.dent, self._way_m(place, node)), default=None)

    def _slide(self, place: Point, node: Tangent) -> FloatArray:
        """The way to a node, then along the obstacle while that leads nearer to the goal and hides it."""
        way, met = self.straight(place, node.place)
        if met and length_of(way) < math.dist(place, node.place) - self.progress_m:
            return way
        along = self.known.boundary(node.place, node.side, self.horizon_m)
        to_goal = np.hypot(*(along - self.goal).T).tolist()
        last = 0
        while last < len(along) - 1 and to_goal[last + 1] <= to_goal[last]:
            here = float(along[last, 0]), float(along[last, 1])
            if self.known.first_hit(here, self.goal)[0] >= self.keep_m:
                break
            last += 1
        return np.concatenate((way, along[: last + 1]))

    def _leave_minimum(self, place: Point, hit: Point) -> BoundaryFollowing:
        """A local minimum: the boundary ahead is followed to the side of the better node.

        d_followed is of this boundary alone: else a round of it would prove nothing.
        """
        nodes = [node for node in self._nodes(place) if node.side]
        side = min(nodes, key=lambda node: self._way_m(place, node)).side if nodes else ON_RIGHT
        first = mark_at(self.known.boundary(hit, side, self.keep_m), 0.0)
        on_boundary = math.dist(place, hit) < self.progress_m
        return BoundaryFollowing(first, side, hit, 0.0, on_boundary, self._nearest_m(hit))

    def _nearest_m(self, anchor: Point) -> float:
        """Least distance (m) from the goal of the sensed boundary at a place."""
        return min(self.known.nearest_to_goal_m(anchor), math.dist(anchor, self.goal))

    def _leave_node(self, place: Point, state: BoundaryFollowing) -> Tangent | None:
        """The node to leave the boundary for: d_reach < d_followed, of these the one soonest reached; None if none."""
        limit = state.followed_m - self.progress_m
        nodes = self._nodes(place, state.anchor)
        nearer = [node for node in nodes if math.dist(node.place, self.goal) < limit]
        return min(nearer, key=lambda node: self._way_m(place, node), default=None)

    def _follow(self, place: Point, state: BoundaryFollowing) -> Iterator[WalkLeg[TangentBugState]]:
        """Yields legs along the boundary; its first part is cut short by a straight line to a place in sight."""
        way = self.known.boundary(state.anchor, state.side, self.horizon_m)
        closed = self.passes(way, state.hit, self.keep_m - state.walked_m)
        skip_m = self._in_sight(place, state, piece(way, 0.0, closed))
        if not (skip_m or state.on_boundary or self.known.sees(place, state.anchor)):
            yield from self.walk(place, Toward(state.followed_m))  # something has come before it
            return
        if skip_m > 0.0 or not state.on_boundary:
            onto = mark_at(way, skip_m).place
            state = replace(state, anchor=onto, walked_m=state.walked_m + skip_m)
            line, _ = self.straight(place, onto)
            yield WalkLeg(replace(state, on_boundary=False), line)
        yield WalkLeg(replace(state, on_boundary=True), piece(way, skip_m, closed))
        if math.isfinite(closed):
            yield WalkLeg(Enclosed(f"{self.enclosed()}: its whole boundary has been gone round"))

    def _in_sight(self, place: Point, state: BoundaryFollowing, way: FloatArray) -> float:
        """The furthest arc length of a boundary in sight with nothing between it and the straight way there."""
        whole = length_of(way)
        least_m = 2.0 * self.look_again_m() if state.on_boundary else 0.0
        for share in (np.arange(SHORTCUT_TRIES, 0, -1) / SHORTCUT_TRIES).tolist():
            ahead = piece(way, 0.0, share * whole)
            onto = place_at_end(ahead, place)
            shorter = math.dist(place, onto) < share * whole - self.progress_m
            if share * whole <= least_m or (state.on_boundary and not shorter):
                continue
            if self.known.sees(place, onto) and self.known.encloses_nothing(np.concatenate(([place], ahead))):
                return float(share * whole)
        return 0.0
