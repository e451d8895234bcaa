"""A tree of Dubins curves, grown anew whenever the way is blocked: RRT.

S. M. LaValle and J. J. Kuffner, "Randomized kinodynamic planning", International Journal of Robotics Research 20(5),
2001 (RRT).

A branch leads from a pose to a place: a turn at the turn radius and straight on, the shortest such curve (Dubins, 1957)
to a place outside the turning circles on whatever course. What has not been seen is taken to be free. The tree grows
for a number of iterations from a seed. Every new branch tries the goal; from a way that is found the places that can be
passed by are left out, and no place is tried any more through which no shorter way can lead. The shortest way is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.baselines.steering import Replanner, Start
from planner.geometry.curves import Point, Pose, Segment, along, between, turn_onto
from planner.geometry.terrain import Terrain
from planner.interface import Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.keys import MarginConfig, key

MARGIN_SHARES = (1.0, 0.125)  # shares of the margin that a tree keeps, in the order in which they are tried

HOLD_REGROW_S = 5.0  # in a turn that a shield holds, a new tree is grown no sooner than this after the last


@dataclass(frozen=True)
class DubinsTreeConfig(MarginConfig):
    """Keys of `planner.kind: dubins_tree`."""

    iterations: int = key(300, "how many times the tree is grown", minimum=1, maximum=1_000_000)
    tree_seed: int = key(1, "seed of the samples", minimum=1, maximum=1_000_000)


class Node(NamedTuple):
    """A pose of the tree, the curves that lead there from its root, and their length (m)."""

    pose: Pose
    ways: tuple[list[Segment], ...]
    length_m: float

    @property
    def places(self) -> list[Point]:
        """The places (east, north) at which the curves end."""
        return [along(way[-1], way[-1][5])[:2] for way in self.ways]


class DubinsTree(Replanner):
    """The planner for one flight."""

    def __init__(self, config: DubinsTreeConfig, mission: Mission) -> None:
        super().__init__(mission)
        self._iterations, self._margin_m = config.iterations, config.margin(mission)
        self._random = np.random.default_rng(config.tree_seed)
        self._last_reason = ""

    def plan(self, request: PlanRequest) -> Plan:
        """Keeps the path or plans a new one; in a turn that a shield holds, `HOLD_REGROW_S` or more after the last."""
        if request.committed and not request.flown and request.time_s - self._planned_s < HOLD_REGROW_S:
            return Plan(PlanStatus.KEPT, f"{self._last_reason}; no new tree is due")
        answer = super().plan(request)
        self._last_reason = answer.reason
        return answer

    def due(self, path: Path, left_m: float, age_s: float) -> bool:
        """Tells whether to plan anew: at the end of a way, and from time to time in a holding turn."""
        return age_s >= HOLD_REGROW_S if path.loiter else left_m <= 0.0

    def replanned(self, request: PlanRequest, start: Start) -> Plan:
        """A way to the goal, straight there where that is free, else by a tree."""
        points, ends = self.memory.points_m, (start.pose[:2], self.mission.goal_m)
        # Start and goal may be nearer to an edge than what is kept elsewhere.
        room_m = np.minimum(*(np.hypot(*(points - end).T) - 1e-3 for end in ends))
        for share in MARGIN_SHARES:
            keep_m = np.minimum(self.mission.clearance_m + share * self._margin_m, room_m)
            if (found := self.grow(start.pose, Terrain(points, keep_m, self.mission.bounds_m))) is None:
                continue
            nodes = np.array([request.position_m, *found.places])
            guide, count = np.array([request.position_m, self.mission.goal_m]), len(found.ways)
            return Plan(
                PlanStatus.FOUND,
                f"{count} Dubins curves to the goal" if count > 1 else "way to the goal in view",
                nodes,
                Path(np.array([*start.before, *(row for way in found.ways for row in way)])),
                partial(PlanPicture, guide, self.mission.sensor_range_m, candidates=(nodes,)),
            )
        return self.holding_plan("the tree found no way", request)

    def grow(self, start: Pose, terrain: Terrain) -> Node | None:
        """The goal as a node: straight from the start where that is free, else of a tree; None where none is found."""
        goal, reach_m = self.mission.goal_m, self.mission.sensor_range_m
        nodes = [Node(start, (), 0.0)]
        if (best := self._branch(nodes[0], goal, terrain)) is not None:
            return best
        ends, bounds = np.array([start[:2], goal]), np.array(self.mission.bounds_m).reshape(2, 2)
        low = np.maximum(ends.min(axis=0) - reach_m, bounds[0])
        high = np.minimum(ends.max(axis=0) + reach_m, bounds[1])
        for east, north in self._random.uniform(low, high, (self._iterations, 2)).tolist():
            aim, best_m = (east, north), math.inf if best is None else best.length_m
            if math.dist(start[:2], aim) + math.dist(aim, goal) >= best_m:
                continue
            nearest = min(nodes, key=lambda node: math.dist(node.pose[:2], aim))
            if (new := self._branch(nearest, aim, terrain, 0.5 * reach_m)) is None:
                continue
            nodes.append(new)
            if (there := self._branch(new, goal, terrain)) is not None:
                shorter = self._shorten(nodes[0], there, terrain)
                best = min(shorter, best or there, key=lambda node: node.length_m)
        return best

    def _branch(self, node: Node, place: Point, terrain: Terrain, most_m: float = math.inf) -> Node | None:
        """The node at the end of a branch towards a place, at most `most_m` long; None where the branch is not free."""
        if (way := turn_onto(node.pose, place, self.mission.turn_radius_m)) and math.isfinite(most_m):
            way = between(Path(np.array(way)), 0.0, most_m)
        if not way or not terrain.admits(Path(np.array(way))):
            return None
        return Node(along(way[-1], way[-1][5]), (*node.ways, way), node.length_m + sum(row[5] for row in way))

    def _shorten(self, root: Node, found: Node, terrain: Terrain) -> Node:
        """Shortens a way: each branch leads to the furthest place that a branch from there can reach."""
        places, node, passed = found.places, root, 0
        while passed < len(places):
            for k in range(len(places), passed, -1):
                if (onward := self._branch(node, places[k - 1], terrain)) is not None:
                    node, passed = onward, k
                    break
            else:
                return found  # the turns onto other places leave no room for its own
        return node
