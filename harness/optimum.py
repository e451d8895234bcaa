"""The clairvoyant optimum: the shortest way for a point that knows the whole world and keeps a clearance.

A shortest path among discs is a sequence of straight bitangents and arcs (the tangent graph; Liu and Arimoto,
Path planning using a tangent graph, IJRR 11, 1992). A circle grown by the clearance C is a disc of radius
r + C, a convex corner of a polygon one of radius C that can be touched only between the normals of its two
edges, start and goal are discs of radius 0. A path keeps a disc on its left (side +1) or its right (side -1).
The graph is searched with A*; the tangents of a disc are made when the search first comes to it. No boundary
is sampled: free and blocked arcs of a rim alternate only where it crosses another grown edge, so one point
between two neighbouring crossings decides for all of them.

Frame: local ENU plane, metres; angles are mathematical (counter-clockwise from east), radians.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.obstacle import Circle, Obstacle, Polygon

if TYPE_CHECKING:
    import shapely

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

SLACK = 1e-8
"""How far, as a share of the area's longer side, a path may graze what it must not enter: rounding."""

ANGLE_SLACK_RAD = 1e-9
DRAWN_STEP_RAD = math.radians(1.0)


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


def shortest_path(
    obstacles: Sequence[Obstacle],
    bounds_m: tuple[float, float, float, float],
    start_m: tuple[float, float],
    goal_m: tuple[float, float],
    clearance_m: float,
) -> Optimum:
    """The shortest path of a point from start to goal.

    Args:
        obstacles: the whole world.
        bounds_m: xmin, ymin, xmax, ymax; a path may touch them.
        start_m: (east, north).
        goal_m: (east, north).
        clearance_m: distance kept from every obstacle edge, at least 0.
    """
    if any(each.velocity_mps != (0.0, 0.0) or each.active_s is not None for each in obstacles):
        return _none("an obstacle moves, appears or disappears: the optimum is defined for standing ones")
    scene = _Scene([each.shape for each in obstacles], bounds_m, start_m, goal_m, clearance_m)
    free = scene.free_points(np.array([start_m, goal_m]))
    if not free.all():
        end = "goal" if free[0] else "start"
        return _none(f"the {end} is outside the area or nearer than the clearance to an obstacle")
    return _search(scene)


def _none(reason: str) -> Optimum:
    return Optimum(None, np.zeros((0, 2)), reason)


class _Tangents(NamedTuple):
    """Free tangents that leave one disc on one side."""

    leaves_at: FloatArray
    """(k,) angle of the point where each leaves the rim."""
    disc: NDArray[np.intp]
    """(k,) disc at which each arrives."""
    side: NDArray[np.intp]
    """(k,) on which side it passes that disc."""
    arrives_at: FloatArray
    """(k,) angle of the point on that disc's rim."""
    length_m: FloatArray
    to_go_m: FloatArray
    """(k,) straight distance from that point to the goal."""
    best_m: FloatArray
    """(k,) shortest way found so far to the end of each; changes during the search."""


class _Scene:
    """Discs that a path may bend on, and all that blocks it. The last two discs are start and goal."""

    def __init__(
        self,
        shapes: Sequence[Circle | Polygon],
        bounds_m: tuple[float, float, float, float],
        start_m: tuple[float, float],
        goal_m: tuple[float, float],
        clearance_m: float,
    ) -> None:
        import shapely

        self.low, self.high = np.array(bounds_m[:2]), np.array(bounds_m[2:])
        self.slack_m = SLACK * float((self.high - self.low).max())
        self.clearance_m = clearance_m
        circles = [each for each in shapes if isinstance(each, Circle)]
        self.hubs = np.array([each.center_m for each in circles]).reshape(-1, 2)
        self.hub_radii = np.array([each.radius_m + clearance_m for each in circles])
        merged = shapely.union_all(
            [shapely.Polygon(each.vertices_m) for each in shapes if isinstance(each, Polygon)]
        )
        solids = [shapely.orient_polygons(part) for part in shapely.get_parts(merged) if part.area > 0]
        self._tree = shapely.STRtree([each.buffer(-self.slack_m, join_style="mitre") for each in solids])
        self._edges = np.vstack([np.zeros((0, 2, 2)), *map(_edges, solids)])
        corners, cone_from, cone_width = _convex_corners(solids)
        whole = np.full(len(circles), math.tau)
        self.centres = np.vstack((self.hubs, corners, [start_m, goal_m]))
        self.radii = np.concatenate((self.hub_radii, np.full(len(corners), clearance_m), [0.0, 0.0]))
        self.cone_from = np.concatenate((0.0 * whole, cone_from, [0.0, 0.0]))
        self.cone_width = np.concatenate((whole, cone_width, [math.tau, math.tau]))
        self.start, self.goal = len(self.centres) - 2, len(self.centres) - 1
        self._walls = self._offset_edges()

    def contacts(self, disc: NDArray[np.intp] | int, angle: FloatArray) -> FloatArray:
        """(k, 2) points of rims."""
        rim: FloatArray = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
        points: FloatArray = self.centres[disc] + self.radii[disc, None] * rim
        return points

    def in_cone(self, disc: NDArray[np.intp] | int, angle: FloatArray) -> BoolArray:
        """(k,) whether a path may touch a disc at an angle."""
        within: BoolArray = (angle - self.cone_from[disc] + ANGLE_SLACK_RAD) % math.tau <= (
            self.cone_width[disc] + 2 * ANGLE_SLACK_RAD
        )
        return within

    def free_points(self, points: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points may lie on a path."""
        import shapely

        free = self._inside(points)
        gaps: FloatArray = np.hypot(*(points[:, None] - self.hubs).T).T
        free &= (gaps >= self.hub_radii - self.slack_m).all(axis=1)
        free[self._tree.query(shapely.points(points), "dwithin", self.clearance_m)[0]] = False
        return free

    def free_segments(self, begin: FloatArray, end: FloatArray) -> BoolArray:
        """(k,) whether each segment between (k, 2) points may be part of a path."""
        import shapely

        free = self._inside(begin) & self._inside(end)
        rows = np.flatnonzero(free)
        x, y = (end[rows] - begin[rows]).T[:, :, None]
        # From where each begins to each hub, and from the nearest place on it.
        east, north = self.hubs.T[:, None] - begin[rows].T[:, :, None]
        share = np.clip((east * x + north * y) / np.maximum(x * x + y * y, 1e-300), 0.0, 1.0)
        east, north = east - share * x, north - share * y
        least = np.maximum(self.hub_radii - self.slack_m, 0.0)
        free[rows] = (east * east + north * north >= least * least).all(axis=1)
        rows = np.flatnonzero(free)
        lines = shapely.linestrings(np.stack((begin[rows], end[rows]), axis=1))
        free[rows[self._tree.query(lines, "dwithin", self.clearance_m)[0]]] = False
        return free

    def tangents(self, disc: int, side: int) -> _Tangents:
        """All free tangents that leave a disc on a side.

        The signed distance of a centre to the left of the path is side * radius; over the length of a tangent
        in direction phi it changes by (s_j r_j - s_i r_i) = d sin(alpha - phi).
        """
        others = np.flatnonzero(np.arange(len(self.centres)) != disc)
        others = others[others != self.start]
        away = self.centres[others] - self.centres[disc]
        others, sides = np.tile(others, 2), np.repeat((1, -1), len(others))
        distance, bearing = np.tile(np.hypot(*away.T), 2), np.tile(np.arctan2(away[:, 1], away[:, 0]), 2)
        shift = sides * self.radii[others] - side * self.radii[disc]
        apart = (distance > self.slack_m) & (np.abs(shift) <= distance + self.slack_m)
        others, sides, shift = others[apart], sides[apart], shift[apart]
        direction = bearing[apart] - np.arcsin(np.clip(shift / distance[apart], -1.0, 1.0))
        leaves, arrives = direction - side * math.pi / 2, direction - sides * math.pi / 2
        touching = self.in_cone(disc, leaves) & self.in_cone(others, arrives)
        others, sides, leaves, arrives = (
            others[touching],
            sides[touching],
            leaves[touching],
            arrives[touching],
        )
        begin, end = self.contacts(np.full(len(others), disc), leaves), self.contacts(others, arrives)
        free = self.free_segments(begin, end)
        begin, end = begin[free], end[free]
        return _Tangents(
            leaves[free],
            others[free],
            sides[free],
            arrives[free],
            np.hypot(*(end - begin).T),
            np.hypot(*(end - self.centres[self.goal]).T),
            np.full(len(begin), math.inf),
        )

    def blocked_arcs(self, disc: int) -> FloatArray:
        """(k, 2) arcs of a rim that no path may use: first angle, width, counter-clockwise."""
        cone_from, cone_width = self.cone_from[disc], self.cone_width[disc]
        outside = [(cone_from + cone_width, math.tau - cone_width)] if cone_width < math.tau else []
        if self.radii[disc] == 0.0:
            return np.array(outside).reshape(-1, 2)
        ends = [cone_from, cone_from + cone_width]
        angles = np.unique(np.concatenate((ends, self._crossings(disc))) % math.tau)
        widths = np.diff(np.append(angles, angles[0] + math.tau))
        middles = angles + widths / 2
        free = self.free_points(self.contacts(np.full(len(middles), disc), middles))
        touchable = (middles - cone_from) % math.tau < cone_width
        blocked = np.flatnonzero(np.logical_and(~free, touchable))
        arcs = np.column_stack((angles[blocked], widths[blocked]))
        return np.vstack((np.array(outside).reshape(-1, 2), arcs))

    def _inside(self, points: FloatArray) -> BoolArray:
        low, high = self.low - self.slack_m, self.high + self.slack_m
        within: BoolArray = np.logical_and.reduce((points >= low) & (points <= high), axis=1)
        return within

    def _offset_edges(self) -> FloatArray:
        """(k, 2, 2) polygon edges moved to the clearance on either side, and the edges of the area."""
        along = self._edges[:, 1] - self._edges[:, 0]
        normal = np.column_stack((along[:, 1], -along[:, 0])) / np.hypot(*along.T)[:, None]
        aside = (self.clearance_m * normal)[:, None]
        (west, south), (east, north) = self.low, self.high
        area = np.array([[west, south], [east, south], [east, north], [west, north]])
        border = np.stack((area, np.roll(area, -1, axis=0)), axis=1)
        return np.vstack((self._edges + aside, self._edges - aside, border))

    def _crossings(self, disc: int) -> FloatArray:
        """Angles at which a rim crosses a grown circle, a grown corner, a grown edge or the border."""
        centre, radius = self.centres[disc], self.radii[disc]
        away = np.vstack((self.hubs, self._edges[:, 0])) - centre
        reach = np.concatenate((self.hub_radii, np.full(len(self._edges), self.clearance_m)))
        distance = np.hypot(*away.T)
        cosine = (distance**2 + radius**2 - reach**2) / np.maximum(2 * distance * radius, 1e-300)
        meet = np.abs(cosine) <= 1.0
        bearing, half = np.arctan2(away[meet, 1], away[meet, 0]), np.arccos(cosine[meet])
        begin, along = self._walls[:, 0] - centre, self._walls[:, 1] - self._walls[:, 0]
        length = np.hypot(*along.T)
        unit = along / length[:, None]
        foot = -(begin * unit).sum(axis=1)
        root = radius**2 - (begin + foot[:, None] * unit) ** 2 @ (1.0, 1.0)
        angles = [bearing - half, bearing + half]
        for sign in (-1.0, 1.0):
            station = foot + sign * np.sqrt(np.maximum(root, 0.0))
            on = (root >= 0.0) & (station >= -self.slack_m) & (station <= length + self.slack_m)
            at = begin[on] + station[on, None] * unit[on]
            angles.append(np.arctan2(at[:, 1], at[:, 0]))
        return np.concatenate(angles)


def _edges(solid: shapely.Polygon) -> FloatArray:
    """(k, 2, 2) begin and end of the edges of a polygon and its holes; the solid lies on the left."""
    rings = [np.array(ring.coords) for ring in (solid.exterior, *solid.interiors)]
    return np.vstack([np.stack((ring[:-1], ring[1:]), axis=1) for ring in rings])


def _convex_corners(solids: Sequence[shapely.Polygon]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(k, 2) corners where solids are convex, and the angle and width of the cone between their normals."""
    corners, begins, widths = [np.zeros((0, 2))], [np.zeros(0)], [np.zeros(0)]
    for solid in solids:
        for ring in (solid.exterior, *solid.interiors):
            points = np.array(ring.coords)[:-1]
            along = np.roll(points, -1, axis=0) - points
            normal = np.arctan2(-along[:, 0], along[:, 1])
            before = np.roll(normal, 1)
            turn = (normal - before + math.pi) % math.tau - math.pi
            convex = turn > ANGLE_SLACK_RAD
            corners.append(points[convex])
            begins.append(before[convex])
            widths.append(turn[convex])
    return np.vstack(corners), np.concatenate(begins), np.concatenate(widths)


class _Arrival(NamedTuple):
    """A path so far: it has come to the rim of a disc."""

    disc: int
    side: int
    angle: float
    before: _Arrival | None
    left_at: float
    """Angle at which it left the disc before."""


def _search(scene: _Scene) -> Optimum:
    """A* over arrivals; the straight distance to the goal never exceeds the way that is left."""
    tangents: dict[tuple[int, int], _Tangents] = {}
    blocked: dict[int, FloatArray] = {}
    arrivals = [_Arrival(scene.start, 1, 0.0, None, 0.0)]
    queue = [(0.0, 0, 0.0)]
    while queue:
        _, number, way_m = heapq.heappop(queue)
        arrival = arrivals[number]
        disc, side = arrival.disc, arrival.side
        if disc == scene.goal:
            return Optimum(way_m, _drawn(scene, arrival))
        if (disc, side) not in tangents:
            tangents[disc, side] = scene.tangents(disc, side)
        if disc not in blocked:
            blocked[disc] = scene.blocked_arcs(disc)
        out = tangents[disc, side]
        sweep = _sweep(arrival, out.leaves_at)
        way = way_m + sweep * scene.radii[disc] + out.length_m
        open_ = (sweep <= _free_sweep(arrival, blocked[disc]) + ANGLE_SLACK_RAD) | (disc == scene.start)
        for k in np.flatnonzero(open_ & (way < out.best_m - ANGLE_SLACK_RAD)).tolist():
            out.best_m[k] = way[k]
            heapq.heappush(queue, (float(way[k] + out.to_go_m[k]), len(arrivals), float(way[k])))
            arrivals.append(
                _Arrival(
                    int(out.disc[k]), int(out.side[k]), float(out.arrives_at[k]), arrival, out.leaves_at[k]
                )
            )
    return _none("there is no way that keeps the clearance inside the area")


def _sweep(arrival: _Arrival, leaves_at: FloatArray) -> FloatArray:
    """(k,) angles from an arrival on along the rim; a backward one of the size of rounding is none."""
    sweep = (arrival.side * (leaves_at - arrival.angle)) % math.tau
    return np.where(sweep > math.tau - ANGLE_SLACK_RAD, 0.0, sweep)


def _free_sweep(arrival: _Arrival, blocked: FloatArray) -> float:
    """How far round the rim is free from an arrival on; one just inside a blocked arc may turn back only."""
    first, width = blocked.T
    entry = first if arrival.side > 0 else first + width
    into = (arrival.side * (arrival.angle - entry)) % math.tau
    return float(np.where(into < width / 2, 0.0, math.tau - into).min(initial=math.inf))


def _drawn(scene: _Scene, last: _Arrival) -> FloatArray:
    """Points along the path that ends with an arrival at the goal."""
    pieces = [scene.centres[[scene.goal]]]
    here = last
    while here.before is not None:
        before, left_at = here.before, here.left_at
        sweep = 0.0 if before.disc == scene.start else float(_sweep(before, np.array([left_at]))[0])
        angles = left_at - before.side * np.linspace(sweep, 0.0, math.ceil(sweep / DRAWN_STEP_RAD) + 1)
        pieces.append(scene.contacts(np.full(len(angles), before.disc), angles))
        here = before
    return np.vstack(pieces[::-1])
