"""An exact point robot: the shortest way through what it has seen, taken anew whenever something seen blocks that.

It turns on the spot, sees every edge point within its range that nothing hides, forgets nothing, and takes what it has
not seen to be free. No planner of that sensing range and memory that trusts free space is shorter at every turn: its
tail is what the tail of an aircraft is measured against. `python -m tests.closed_loop.point_robot WORLD.json...` prints
its length over the optimum in shared worlds.
"""

import json
import math
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from planner.baselines.grown import GrownObstacles, cross
from planner.baselines.polyline import length_of, piece
from planner.contract import GivenMap
from planner.geometry.curves import Point
from planner.interface import FloatArray
from wayproof import Mission

SIMPLER_SHARE: Final = 0.03  # outlines at the clearance are simplified by a fifth of this share of it
SPACING_SHARE: Final = 1.0 / 6.0
"""Edge points are this share of the clearance apart: outlines have dents of 0.4 % of it."""
LOOKS: Final = 40  # it looks this many times in a sensing range
HIDDEN_M: Final = 0.5  # an edge point is seen unless the line to it goes this deep through an obstacle
FURTHEST: Final = 30.0  # it gives up after this many times the optimum


class Seen(GivenMap):
    """The edge points of true obstacles that have been in sight from somewhere."""

    def __init__(self, obstacles: list[Any], range_m: float, spacing_m: float) -> None:
        super().__init__(np.zeros((0, 2)))
        self.revision, self._range = 0, range_m
        self._unseen = shapely.get_coordinates(shapely.segmentize(shapely.boundary(obstacles), spacing_m))
        self._shown: list[FloatArray] = []
        self._solid = shapely.union_all(shapely.buffer(obstacles, -HIDDEN_M))
        shapely.prepare(self._solid)

    def look(self, place: Point) -> bool:
        near = np.flatnonzero(np.hypot(*(self._unseen - place).T) < self._range)
        lines = shapely.linestrings(np.stack(np.broadcast_arrays(place, self._unseen[near]), axis=1))
        if len(fresh := near[~shapely.intersects(self._solid, lines)]):
            self._shown.append(self._unseen[fresh])
            self._unseen = np.delete(self._unseen, fresh, axis=0)
            self.revision += 1
        return len(fresh) > 0

    def edges_since(self, revision: int) -> FloatArray:
        return np.concatenate([self._points, *self._shown[max(revision, 0) :]])


def shortest(known: GrownObstacles, start: Point, goal: Point) -> list[Point]:
    """The shortest way through what is known, by Dijkstra on the visibility graph; none where none leads there.

    The graph has the convex corners of the outlines, and of the lines between two of them those that pass both.
    """
    rings = [shapely.get_coordinates(each)[:-1] for each in known.rings]
    corners, before, after = (np.concatenate([np.roll(each, turn, axis=0) for each in rings]) for turn in (0, 1, -1))
    convex = cross(before - corners, after - corners) < 0.0
    solid, here = shapely.multipolygons(known.cores), shapely.Point(start)
    shapely.prepare(solid)
    if solid.intersects(here):  # an outline has grown over it by a hair
        here = shapely.shortest_line(shapely.MultiLineString(known.rings), here)
    ends = np.concatenate((shapely.get_coordinates(here)[:1], [goal]))
    places = np.concatenate((ends, corners[convex]))
    sides = [
        cross(places[:, None] - places, np.concatenate((0.0 * ends, (each - corners)[convex])))
        for each in (before, after)
    ]
    passes = sides[0] * sides[1] >= 0.0  # the line from one place, a row, at another
    passes[0] = True  # rounding must not take the edge along an outline that it is on
    i, j = np.nonzero(np.triu(passes & passes.T, 1))
    clear = ~shapely.intersects(solid, shapely.linestrings(np.stack((places[i], places[j]), axis=1)))
    i, j = i[clear], j[clear]
    graph = sparse.coo_matrix((np.hypot(*(places[i] - places[j]).T), (i, j)), shape=passes.shape)
    left_m, onward = dijkstra(graph.tocsr(), directed=False, indices=[1], return_predecessors=True)
    if math.isinf(left_m[0, 0]):
        return []
    way, at = [start], 0
    while at >= 0:
        way.append((float(places[at, 0]), float(places[at, 1])))
        at = int(onward[0, at])
    return way


def walked_m(obstacles: list[Any], mission: Mission, start: Point, most_m: float) -> float:
    """Length of its way to the goal circle; infinite where it finds none, or none so short."""
    keep_m, step_m = mission.clearance_m, mission.sensor_range_m / LOOKS
    margin_m = SIMPLER_SHARE * keep_m
    known = GrownObstacles(replace(mission, clearance_m=keep_m - margin_m), margin_m)
    seen = Seen(obstacles, mission.sensor_range_m, SPACING_SHARE * keep_m)
    place, way, length_m = start, [start, mission.goal_m], 0.0
    while math.dist(place, mission.goal_m) > mission.goal_radius_m and length_m < most_m:
        if seen.look(place):
            known.take_in(seen)
            cut = any(math.isfinite(known.first_hit(a, b)[0]) for a, b in pairwise(way))
            if cut and not (way := shortest(known, place, mission.goal_m)):
                return math.inf
        left_m = min(step_m, math.dist(place, mission.goal_m) - 0.99 * mission.goal_radius_m)
        flown = piece(np.array(way), 0.0, left_m)
        length_m += length_of(flown)
        place = (float(flown[-1, 0]), float(flown[-1, 1]))
        way = [place, *map(tuple, piece(np.array(way), left_m, math.inf)[1:].tolist())]
    return length_m if length_m < most_m else math.inf


def over_the_optimum(world: dict[str, Any]) -> float:
    """Its length over the optimum in a shared world, to the goal circle as flights are."""
    circles = [shapely.Point(each[:2]).buffer(each[2], quad_segs=64) for each in world["circles_m"]]
    obstacles = [*circles, *(shapely.Polygon(each) for each in world["polygons_m"])]
    kept_m, range_m = world["clearance_m"], world["sensor_range_m"]
    goal, bounds = tuple(world["goal_m"]), tuple(world["bounds_m"])
    mission = Mission(goal, world["goal_radius_m"], bounds, kept_m, 1.0, 1.0, 1.0, 1.0, range_m)
    optimum_m = float(world["optimum_m"])
    return walked_m(obstacles, mission, tuple(world["start_m"]), FURTHEST * optimum_m) / optimum_m


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(Path(name).stem, f"{over_the_optimum(json.loads(Path(name).read_text())):.3f}", flush=True)
