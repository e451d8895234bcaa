"""The clairvoyant optimum: the shortest way for a point that knows the whole world and keeps a clearance.

A shortest path among discs is a sequence of straight bitangents and arcs (the tangent graph; Liu and Arimoto,
Path planning using a tangent graph, IJRR 11, 1992). A circle grown by the clearance C is a disc of radius
r + C, a convex corner of a polygon one of radius C that can be touched only between the normals of its two
edges, start and goal are discs of radius 0. A path keeps a disc on its left (side +1) or its right (side -1).
The graph (`harness.world.tangent_graph`) is searched with A*; the tangents of a disc are made when the search first
comes to it.

Frame: local ENU plane, metres; angles are mathematical (counter-clockwise from east), radians.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.scenario.scenario import Scenario
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.tangent_graph import ANGLE_SLACK_RAD, Tangents, TangentScene
from harness.world.world import World
from planner.interface import FloatArray

DRAWN_STEP_RAD = math.radians(1.0)  # step between points of a drawn arc
SHORTER_M = 1e-9  # a way shorter by less than this rounding counts as no shorter


@dataclass(frozen=True, eq=False)
class Optimum:
    """A shortest path, or why there is none.

    Attributes:
        length_m: its length; None where there is none.
        points_m: (k, 2) the path for drawing, arcs in steps of at most a degree; its chords cut arcs short.
        reason: a sentence where there is none, else empty.
    """

    length_m: float | None
    points_m: FloatArray
    reason: str = ""


def optimum_of(scenario: Scenario) -> Optimum:
    """The shortest path of a point that knows the whole world and keeps the wanted clearance."""
    world, mission = World.from_scenario(scenario), scenario.mission
    return shortest_path(
        world.obstacles,
        world.bounds_m,
        mission.start_m,
        mission.goal_m,
        scenario.planner.clearance_m,
        mission.goal_radius_m,
    )


def shortest_path(
    obstacles: Sequence[Obstacle],
    bounds_m: tuple[float, float, float, float],
    start_m: tuple[float, float],
    goal_m: tuple[float, float],
    clearance_m: float,
    goal_radius_m: float = 0.0,
) -> Optimum:
    """The shortest path of a point from start to the goal circle; no path that keeps the clearance is shorter.

    Where the goal circle is free, the shortest path to its centre leads straight through it, and the one to the circle
    is shorter by its radius. What of obstacles lies within the clearance of the circle is left out for the length,
    which makes it a lower bound; the points are those of a path round all obstacles.

    Bounds are xmin, ymin, xmax, ymax; a path may touch them. The points stop at the rim of the goal circle.
    """
    if not all(each.stands_for_ever for each in obstacles):
        return _no_path("an obstacle moves, appears or disappears: the optimum is defined for standing ones")
    scene = TangentScene([each.shape for each in obstacles], bounds_m, start_m, goal_m, clearance_m)
    free = scene.free_points(np.array([start_m, goal_m]))
    if not free.all():
        end = ("start", "goal")[int(free.argmin())]
        return _no_path(f"the {end} is outside the area or nearer than the clearance to an obstacle")
    found = _search(scene)
    if found.length_m is None or goal_radius_m <= 0.0:
        return found
    shapes = [part for each in obstacles for part in _beyond(each.shape, goal_m, goal_radius_m + clearance_m)]
    length = found.length_m
    if shapes != [each.shape for each in obstacles]:
        length = _search(TangentScene(shapes, bounds_m, start_m, goal_m, clearance_m)).length_m or 0.0
    return Optimum(max(length - goal_radius_m, 0.0), _to_circle(found.points_m, goal_m, goal_radius_m))


def _beyond(shape: Circle | Polygon, goal_m: tuple[float, float], radius_m: float) -> list[Circle | Polygon]:
    """Returns what of a shape is further away from the goal than a radius, a cut circle as a polygon inside of it."""
    import shapely

    if shape.distance(*np.array([goal_m]).T)[0] >= radius_m:
        return [shape]
    if isinstance(shape, Circle):
        whole = shapely.Point(shape.center_m).buffer(shape.radius_m)
    else:
        whole = shapely.Polygon(shape.vertices_m, shape.holes_m)
    goal = shapely.Point(goal_m).buffer(radius_m / math.cos(math.pi / 64.0))  # it has 64 corners
    return [
        Polygon(tuple(part.exterior.coords[:-1]), tuple(tuple(ring.coords[:-1]) for ring in part.interiors))
        for part in shapely.get_parts(whole.difference(goal))
        if not part.is_empty
    ]


def _to_circle(points_m: FloatArray, goal_m: tuple[float, float], radius_m: float) -> FloatArray:
    """(k, 2) the part of a path up to the rim of the goal circle."""
    import shapely

    line = shapely.LineString(points_m).difference(shapely.Point(goal_m).buffer(radius_m))
    return np.asarray(shapely.get_coordinates(shapely.get_parts(line)[:1]))


def _no_path(reason: str) -> Optimum:
    return Optimum(None, np.zeros((0, 2)), reason)


class _Arrival(NamedTuple):
    """A path so far, which has come to the rim of a disc."""

    disc: int
    side: int
    angle: float
    before: _Arrival | None
    left_at: float  # angle at which it left the disc before


def _search(scene: TangentScene) -> Optimum:
    """Finds the shortest path with A*; the straight distance to the goal never exceeds the way that is left."""
    tangents: dict[tuple[int, int], Tangents] = {}
    blocked: dict[int, FloatArray] = {}
    arrivals = [_Arrival(scene.start, 1, 0.0, None, 0.0)]
    queue = [(0.0, 0, 0.0)]
    while queue:
        _, number, way_m = heapq.heappop(queue)
        arrival = arrivals[number]
        disc, side = arrival.disc, arrival.side
        if disc == scene.goal:
            return Optimum(way_m, _path_points(scene, arrival))
        if (disc, side) not in tangents:
            tangents[disc, side] = scene.tangents(disc, side)
        if disc not in blocked:
            blocked[disc] = scene.blocked_arcs(disc)
        out = tangents[disc, side]
        sweep = _sweep(arrival, out.leaves_at)
        way = way_m + sweep * scene.radii[disc] + out.length_m
        open_ = (sweep <= _free_sweep(arrival, blocked[disc]) + ANGLE_SLACK_RAD) | (disc == scene.start)
        for k in np.flatnonzero(open_ & (way < out.best_m - SHORTER_M)).tolist():
            out.best_m[k] = way[k]
            heapq.heappush(queue, (float(way[k] + out.to_go_m[k]), len(arrivals), float(way[k])))
            arrivals.append(
                _Arrival(int(out.disc[k]), int(out.side[k]), float(out.arrives_at[k]), arrival, out.leaves_at[k])
            )
    return _no_path("there is no way that keeps the clearance inside the area")


def _sweep(arrival: _Arrival, leaves_at: FloatArray) -> FloatArray:
    """(k,) angles along the rim from an arrival; a backward angle of the size of rounding counts as 0."""
    sweep = (arrival.side * (leaves_at - arrival.angle)) % math.tau
    return np.where(sweep > math.tau - ANGLE_SLACK_RAD, 0.0, sweep)


def _free_sweep(arrival: _Arrival, blocked: FloatArray) -> float:
    """Returns the angle (rad) that a path may turn about a disc from its arrival until a blocked arc begins.

    `blocked` is (k, 2): where each arc begins, and its width. Rounding may put an arrival just inside of an arc. In the
    half where the arc begins it then turns no further; in the other half it leaves the arc.
    """
    first, width = blocked.T
    into = (arrival.side * (arrival.angle - (first if arrival.side > 0 else first + width))) % math.tau
    return float(np.where(into < width / 2, 0.0, math.tau - into).min(initial=math.inf))


def _path_points(scene: TangentScene, last: _Arrival) -> FloatArray:
    pieces = [scene.centres[[scene.goal]]]
    here = last
    while here.before is not None:
        before, left_at = here.before, here.left_at
        sweep = 0.0 if before.disc == scene.start else float(_sweep(before, np.array([left_at]))[0])
        angles = left_at - before.side * np.linspace(sweep, 0.0, math.ceil(sweep / DRAWN_STEP_RAD) + 1)
        pieces.append(scene.contacts(np.full(len(angles), before.disc), angles))
        here = before
    return np.vstack(pieces[::-1])
