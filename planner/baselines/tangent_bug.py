"""TangentBug: straight to the goal, round obstacles by the edges in sight, along a boundary only where caught.

I. Kamon, E. Rimon and E. Rivlin, "A new range-sensor based globally convergent navigation algorithm for mobile
robots", IEEE International Conference on Robotics and Automation, 1996; and "TangentBug: a
range-sensor-based navigation algorithm", International Journal of Robotics Research 17(9), 1998.

The local tangent graph has the goal, where it is in sight, or the end of what is free towards it; and the places
V at which the edges of free sectors touch an obstacle within the sensing range.

1. Motion to the goal: move to the V of the graph with the least d(x, V) + d(V, T) among those nearer to the goal
   T than the aircraft x (and than the last boundary that was left), and along the obstacle it touches while that
   leads nearer to T. Where there is no such V, a local minimum: go to 2.
2. Follow the boundary of the obstacle that blocks the goal, cutting across its dents, until
   (a) a V is in sight that is nearer to T than any place of that boundary sensed so far, d_reach < d_followed:
   move to it (transition) and go to 1;
   (b) the whole boundary has been gone round: the goal is enclosed and cannot be reached.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.baselines.walk import Enclosed, Mark, PointConfig, Walker, WalkLeg, cut, length_of, mark_at
from planner.geometry.curves import Point, Segment, along
from planner.interface import Mission
from planner.rolling_window.window import Window

PROGRESS_SHARE = 0.05
"""What is to be nearer to the goal is nearer by this share of the kept distance."""

LOOKS = 40.0
"""The graph is looked at anew this many times in a sensing range, and when the way is blocked."""

SHORTER = 0.005
"""A way to the goal is dropped only for one that is shorter by this share."""

SHORTCUTS = 24
"""So many places of a boundary are tried for a way across its dents."""


@dataclass(frozen=True)
class Toward:
    """Motion to the goal.

    Attributes:
        limit_m: only places nearer to the goal than this are aimed at.
    """

    limit_m: float


@dataclass(frozen=True)
class BoundaryFollowing:
    """BoundaryFollowing a boundary.

    Attributes:
        hit: where it was begun.
        side: 1 for the obstacle on the left, -1 for on the right.
        anchor: the place on the boundary from which it is followed on.
        walked_m: how much of it lies before the anchor.
        on_boundary: at the anchor, not on a way across a dent.
        followed_m: d_followed, how near to the goal this boundary and all left before come.
    """

    hit: Mark
    side: float
    anchor: Point
    walked_m: float
    on_boundary: bool
    followed_m: float


TangentBugState = Toward | BoundaryFollowing | Enclosed


@dataclass(frozen=True)
class TangentNode:
    """A place V of the local tangent graph, and which obstacle it touches on which side (0: none)."""

    place: Point
    to_goal_m: float
    way_m: float
    side: float


class TangentBugConfig(PointConfig):
    """Keys of `planner.kind: tangent_bug`."""


class TangentBug(Walker[TangentBugState]):
    """The planner for one flight."""

    def __init__(self, config: TangentBugConfig, mission: Mission) -> None:
        super().__init__(config, mission)
        self._progress_m = PROGRESS_SHARE * self.keep_m

    def begin(self, place: Point) -> TangentBugState:
        """Motion to the goal."""
        return Toward(math.inf)

    def after(self, state: TangentBugState, flown: Sequence[Segment]) -> TangentBugState:
        """Moves the anchor along with the aircraft."""
        if not isinstance(state, BoundaryFollowing):
            return state
        followed = min(state.followed_m, self._nearest_m(state.anchor))
        if not state.on_boundary or not flown:
            return replace(state, followed_m=followed)
        place, walked = mark_at(flown, math.inf).place, state.walked_m + length_of(flown)
        return replace(state, anchor=place, walked_m=walked, followed_m=followed)

    def follows(self, place: Point, state: TangentBugState) -> tuple[Point, ...]:
        """The boundary where it is followed on, and where that began."""
        return (state.anchor, state.hit.place) if isinstance(state, BoundaryFollowing) else ()

    def says(self, state: TangentBugState) -> str:
        """What the planner does."""
        if isinstance(state, BoundaryFollowing):
            return f"local minimum, following a boundary for {state.walked_m / 1000:.1f} km"
        return "motion to the goal"

    def look_again_m(self) -> float:
        """The graph is looked at several times in a sensing range."""
        return self.mission.sensor_range_m / LOOKS

    def prefers(self, new: tuple[WalkLeg[TangentBugState], ...], left_m: float) -> bool:
        """A change of behaviour, a way across a dent, or a shorter or a free way to the goal."""
        state = new[0].state
        if isinstance(state, BoundaryFollowing):
            return not state.on_boundary and length_of(new[0].segments) > self.look_again_m()
        was_caught = any(isinstance(leg.state, BoundaryFollowing) for leg in self.legs)
        shorter = sum(length_of(leg.segments) for leg in new) < (1.0 - SHORTER) * left_m
        return was_caught or shorter or math.isfinite(self.breach_m)

    def walk(self, place: Point, state: TangentBugState) -> Iterator[WalkLeg[TangentBugState]]:
        """Steps 1 and 2 in turn."""
        if isinstance(state, BoundaryFollowing) and (node := self._leave(place, state)) is not None:
            way, _ = self.straight(place, node.place)
            state = Toward(state.followed_m)
            yield WalkLeg(state, way)
            place = node.place
        while isinstance(state, Toward):
            line, met = self.straight(place, self.goal)
            if not met or length_of(line) >= self.mission.sensor_range_m:
                yield WalkLeg(state, line)
                return
            node = self._best(place, self._nodes(place), state.limit_m)
            slide = self._slide(place, node) if node is not None else ()
            onto = mark_at(slide, math.inf).place if slide else place
            if math.dist(place, self.goal) - math.dist(onto, self.goal) <= self._progress_m:
                state = self._caught(place, line, state.limit_m)
            else:
                yield WalkLeg(state, slide)
                place = onto
        if isinstance(state, BoundaryFollowing):
            yield from self._follow(place, state)

    def _nodes(self, place: Point, also: Point | None = None) -> list[TangentNode]:
        """The local tangent graph: what lies about the obstacle that blocks the goal, and about another one.

        Args:
            place: where the aircraft is.
            also: a place on the boundary of the other one.
        """
        reach = self.mission.sensor_range_m
        clear, blocking = self.known.first_hit(place, self.goal)
        ahead = min(clear, reach, math.dist(place, self.goal))
        nodes = [self._node(place, self._towards(place, ahead), 0.0)]
        labels = self.known.labels
        wanted = {int(labels[blocking])} if clear < reach else set()
        if also is not None:
            wanted.add(int(labels[self.known.seat(also)[0]]))
        distance = np.hypot(*(self.known.points_m - place).T)
        near = np.flatnonzero((distance < reach) & (distance > self.known.radii_m * (1.0 + 1e-9)))
        window = Window(
            place, self.known.points_m[near], labels[near], self.known.cell_m, self.known.radii_m[near]
        )
        for label in sorted(wanted & set(np.unique(window.labels).tolist())):
            for edge in window.sector_edges(place, [label]):
                touch = place[0] + edge.touch_m * edge.ux, place[1] + edge.touch_m * edge.uy
                disc, _ = self.known.seat(touch)
                x, y = self.known.points_m[disc].tolist()
                left = edge.ux * (y - touch[1]) - edge.uy * (x - touch[0])
                nodes.append(self._node(place, touch, math.copysign(1.0, left)))
        return nodes

    def _towards(self, place: Point, distance_m: float) -> Point:
        whole = max(math.dist(place, self.goal), 1e-9)
        share = distance_m / whole
        return place[0] + share * (self.goal[0] - place[0]), place[1] + share * (self.goal[1] - place[1])

    def _node(self, place: Point, touch: Point, side: float) -> TangentNode:
        to_goal = math.dist(touch, self.goal)
        return TangentNode(touch, to_goal, math.dist(place, touch) + to_goal, side)

    def _best(self, place: Point, nodes: list[TangentNode], limit_m: float) -> TangentNode | None:
        """The node to move to; None at a local minimum."""
        here = math.dist(place, self.goal)
        nearer = []
        for node in nodes:
            dx, dy = node.place[0] - place[0], node.place[1] - place[1]
            onward = dx * (self.goal[0] - place[0]) + dy * (self.goal[1] - place[1]) > 0.0
            touching = math.hypot(dx, dy) < self.keep_m
            if node.side and onward and node.to_goal_m < limit_m and (touching or node.to_goal_m < here):
                nearer.append(node)
        return min(nearer, key=lambda node: node.way_m, default=None)

    def _slide(self, place: Point, node: TangentNode) -> tuple[Segment, ...]:
        """To a node and along the obstacle while that leads nearer to the goal and the goal is behind it."""
        way, met = self.straight(place, node.place)
        if met and length_of(way) < math.dist(place, node.place) - self._progress_m:
            return way
        segments = (*way, *self.boundary(node.place, node.side, self.horizon_m))
        here = math.dist(node.place, self.goal)
        arc_length_m = length_of(way)
        for segment in segments[len(way) :]:
            end = along(segment, segment[5])[:2]
            there = math.dist(end, self.goal)
            if there > here or not self.known.turned_back(segment[:2], self.goal):
                break
            here = there
            arc_length_m += segment[5]
        return cut(segments, arc_length_m)

    def _caught(self, place: Point, line: Sequence[Segment], limit_m: float) -> BoundaryFollowing:
        """A local minimum: the boundary ahead is followed to the side of the better node."""
        nodes = [node for node in self._nodes(place) if node.side]
        side = min(nodes, key=lambda node: node.way_m).side if nodes else self.side
        hit = along(line[0], line[0][5])[:2] if line else place
        first = mark_at(self.boundary(hit, side, self.keep_m), 0.0)
        on_boundary = math.dist(place, hit) < self._progress_m
        return BoundaryFollowing(first, side, hit, 0.0, on_boundary, min(limit_m, self._nearest_m(hit)))

    def _nearest_m(self, anchor: Point) -> float:
        """How near to the goal the boundary at a place comes, as far as it has been sensed."""
        labels = self.known.labels
        mine = labels == labels[self.known.seat(anchor)[0]]
        east, north = self.goal
        points = self.known.points_m[mine]
        return float((np.hypot(points[:, 0] - east, points[:, 1] - north) - self.known.radii_m[mine]).min())

    def _leave(self, place: Point, state: BoundaryFollowing) -> TangentNode | None:
        """The node to leave the boundary for: d_reach < d_followed."""
        limit = state.followed_m - self._progress_m
        nearer = [node for node in self._nodes(place, state.anchor) if node.to_goal_m < limit]
        return min(nearer, key=lambda node: node.way_m, default=None)

    def _follow(self, place: Point, state: BoundaryFollowing) -> Iterator[WalkLeg[TangentBugState]]:
        """Along the boundary, the first part of it cut short by a way across a dent."""
        segments = self.boundary(state.anchor, state.side, self.horizon_m)
        off = math.dist(place, state.anchor) > self._progress_m or not state.on_boundary
        least_m = 0.0 if off else 2.0 * self.look_again_m()
        # From off it, more than half of what is left of the round is seen past the other side of the obstacle.
        left_m = self.passes(segments, state.hit, self.keep_m - state.walked_m)
        ahead = cut(segments, 0.5 * left_m if off else left_m)
        arc_length_m = self._beyond_a_dent(place, ahead, state.side, least_m)
        if off and not arc_length_m and not self._sees(place, state.anchor):
            arc_length_m = self._seen_from(place, ahead)
        if off or arc_length_m > 0.0:
            onto = mark_at(segments, arc_length_m).place
            way, _ = self.straight(place, onto)
            if off or length_of(way) < arc_length_m - self._progress_m:
                yield WalkLeg(replace(state, on_boundary=False), way)
                skipped = cut(segments, arc_length_m)
                if math.isfinite(self.passes(skipped, state.hit, self.keep_m - state.walked_m)):
                    yield WalkLeg(self._gone_round())
                    return
                state = replace(state, anchor=onto, walked_m=state.walked_m + arc_length_m)
                segments = self.boundary(onto, state.side, self.horizon_m)
        closed = self.passes(segments, state.hit, self.keep_m - state.walked_m)
        yield WalkLeg(replace(state, on_boundary=True), cut(segments, closed))
        if math.isfinite(closed):
            yield WalkLeg(self._gone_round())

    def _gone_round(self) -> Enclosed:
        return Enclosed(f"{self.enclosed()}: its whole boundary has been gone round")

    def _beyond_a_dent(self, place: Point, segments: Sequence[Segment], side: float, least_m: float) -> float:
        """The furthest arc length of a boundary in sight across a dent; 0 where none is beyond the least.

        A dent lies on the other side of the way than the obstacle. A way that encloses the obstacle leads round it:
        its end is in sight as well, behind.
        """
        arc_lengths_m = np.linspace(0.0, length_of(segments), SHORTCUTS + 1)
        corners = np.array([mark_at(segments, arc_length_m).place for arc_length_m in arc_lengths_m]) - place
        doubled = np.cumsum(corners[:-1, 0] * corners[1:, 1] - corners[:-1, 1] * corners[1:, 0])
        dents = 0.5 * side * doubled <= self.keep_m * np.hypot(*corners[1:].T)
        return self._seen_from(place, segments, least_m, dents.tolist())

    def _seen_from(
        self, place: Point, segments: Sequence[Segment], least_m: float = 0.0, among: Sequence[bool] = ()
    ) -> float:
        """The furthest arc length of a boundary in sight from a place, of some; 0 where none is beyond the least."""
        whole = length_of(segments)
        for i in range(SHORTCUTS, 0, -1):
            arc_length_m = whole * i / SHORTCUTS
            if arc_length_m <= least_m:
                break
            if among and not among[i - 1]:
                continue
            if self._sees(place, mark_at(segments, arc_length_m).place):
                return arc_length_m
        return 0.0

    def _sees(self, place: Point, target: Point) -> bool:
        """Whether a straight way leads to a target, but for a little."""
        return self.known.first_hit(place, target)[0] > math.dist(place, target) - self._progress_m
