"""The tangent graph among grown obstacles: which tangents of a disc are free, and which arcs of its rim.

No boundary is sampled: free and blocked arcs of a rim alternate only where it crosses another grown edge, so one point
between two neighbouring crossings decides for all of them. What discs, sides and angles are: `harness.world.optimum`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.world.obstacle import Circle, Polygon
from planner.compiled import FLOATS, ROWS, compiled
from planner.interface import BoolArray, FloatArray

if TYPE_CHECKING:
    import shapely

SLACK_SHARE = 1e-8
"""A path may enter what blocks it by this share of the area's longer side, which is rounding."""

ANGLE_SLACK_RAD = 1e-9  # angles closer than this rounding are the same


@compiled(ROWS, ROWS, ROWS, FLOATS)
def _clear(begin: FloatArray, end: FloatArray, hubs: FloatArray, least: FloatArray) -> BoolArray:
    """(k,) whether each segment between (k, 2) points keeps from all (m, 2) hubs the distance of each, (m,)."""
    clear = np.ones(len(begin), dtype=np.bool_)
    for i in range(len(begin)):
        x, y = end[i, 0] - begin[i, 0], end[i, 1] - begin[i, 1]
        squared = max(x * x + y * y, 1e-300)
        for j in range(len(hubs)):
            east, north = hubs[j, 0] - begin[i, 0], hubs[j, 1] - begin[i, 1]
            share = min(max((east * x + north * y) / squared, 0.0), 1.0)
            east, north = east - share * x, north - share * y
            if east * east + north * north < least[j] * least[j]:
                clear[i] = False
                break
    return clear


class Tangents(NamedTuple):
    """Free tangents that leave one disc on one side."""

    leaves_at: FloatArray  # (k,) angle of the point where each leaves the rim
    disc: NDArray[np.intp]  # (k,) disc at which each arrives
    side: NDArray[np.intp]  # (k,) on which side it passes that disc
    arrives_at: FloatArray  # (k,) angle of the point on that disc's rim
    length_m: FloatArray
    to_go_m: FloatArray  # (k,) straight distance from that point to the goal
    best_m: FloatArray  # (k,) shortest way found so far to the end of each; changes during the search


class TangentScene:
    """Discs about which a path may bend, and all that blocks it. The last two discs are start and goal."""

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
        self.slack_m = SLACK_SHARE * float((self.high - self.low).max())
        self.clearance_m = clearance_m
        circles = [each for each in shapes if isinstance(each, Circle)]
        self.hubs = np.array([each.center_m for each in circles]).reshape(-1, 2)
        self.hub_radii = np.array([each.radius_m + clearance_m for each in circles])
        polygons = [each for each in shapes if isinstance(each, Polygon)]
        merged = shapely.union_all([shapely.Polygon(each.vertices_m, each.holes_m) for each in polygons])
        solids = [shapely.orient_polygons(part) for part in shapely.get_parts(merged) if part.area > 0]
        self._tree = shapely.STRtree([each.buffer(-self.slack_m, join_style="mitre") for each in solids])
        shapely.prepare(self._tree.geometries)
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
        """(k, 2) points (m) on the rims of discs at angles (rad)."""
        rim: FloatArray = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
        return self.centres[disc] + self.radii[disc, None] * rim

    def in_cone(self, disc: NDArray[np.intp] | int, angle: FloatArray) -> BoolArray:
        """(k,) whether a path may touch a disc at an angle."""
        within: BoolArray = (angle - self.cone_from[disc] + ANGLE_SLACK_RAD) % math.tau <= (
            self.cone_width[disc] + 2 * ANGLE_SLACK_RAD
        )
        return within

    def free_points(self, points: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points is in the area and keeps the clearance, as on a path."""
        import shapely

        free = self._inside_area(points)
        gaps: FloatArray = np.hypot(*(points[:, None] - self.hubs).T).T
        free &= (gaps >= self.hub_radii - self.slack_m).all(axis=1)
        if not len(self._edges):
            return free
        free[self._too_near(shapely.points(points))] = False
        return free

    def free_segments(self, begin: FloatArray, end: FloatArray) -> BoolArray:
        """(k,) whether each segment between (k, 2) points is in the area and keeps the clearance."""
        import shapely

        free = self._inside_area(begin) & self._inside_area(end)
        rows = np.flatnonzero(free)
        free[rows] = _clear(begin[rows], end[rows], self.hubs, np.maximum(self.hub_radii - self.slack_m, 0.0))
        if not len(self._edges):
            return free
        rows = np.flatnonzero(free)
        free[rows[self._too_near(shapely.linestrings(np.stack((begin[rows], end[rows]), axis=1)))]] = False
        return free

    def _too_near(self, shapes: NDArray[np.object_]) -> NDArray[np.intp]:
        """Returns the indices of points or lines that come nearer than the clearance to a polygon."""
        import shapely

        (west, south, east, north), reach = shapely.bounds(shapes).T, self.clearance_m
        rows, solids = self._tree.query(shapely.box(west - reach, south - reach, east + reach, north + reach))
        # The polygons are prepared: the tree's own query would go through all edges of one every time.
        return np.asarray(rows[shapely.dwithin(self._tree.geometries[solids], shapes[rows], reach)])

    def tangents(self, disc: int, side: int) -> Tangents:
        """Returns all free tangents that leave a disc on a side.

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
        others, sides, leaves, arrives = (each[touching] for each in (others, sides, leaves, arrives))
        begin, end = self.contacts(np.full(len(others), disc), leaves), self.contacts(others, arrives)
        free = self.free_segments(begin, end)
        begin, end = begin[free], end[free]
        return Tangents(
            leaves[free],
            others[free],
            sides[free],
            arrives[free],
            np.hypot(*(end - begin).T),
            np.hypot(*(end - self.centres[self.goal]).T),
            np.full(len(begin), math.inf),
        )

    def blocked_arcs(self, disc: int) -> FloatArray:
        """(k, 2) arcs of a rim that no path may touch: first angle and width, rad, counter-clockwise."""
        cone_from, cone_width = self.cone_from[disc], self.cone_width[disc]
        outside = [(cone_from + cone_width, math.tau - cone_width)] if cone_width < math.tau else []
        if self.radii[disc] == 0.0:
            return np.array(outside).reshape(-1, 2)
        ends, crossings = [cone_from, cone_from + cone_width], self._crossings(disc)
        angles = np.unique(np.concatenate((ends, crossings[self.in_cone(disc, crossings)])) % math.tau)
        widths = np.diff(np.append(angles, angles[0] + math.tau))
        middles = angles + widths / 2
        free = self.free_points(self.contacts(np.full(len(middles), disc), middles))
        blocked = np.flatnonzero(~free & ((middles - cone_from) % math.tau < cone_width))
        arcs = np.column_stack((angles[blocked], widths[blocked]))
        return np.vstack((np.array(outside).reshape(-1, 2), arcs))

    def _inside_area(self, points: FloatArray) -> BoolArray:
        low, high = self.low - self.slack_m, self.high + self.slack_m
        return np.asarray(np.logical_and.reduce((points >= low) & (points <= high), axis=1))

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
        """Returns the angles at which a rim crosses a grown circle, a grown corner, a grown edge or the border."""
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
