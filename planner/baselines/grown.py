"""Known obstacles grown by the distance to be kept; a BUG follows their boundaries.

Every edge point is the centre of a disc that must not be entered, and so is all that lies outside of the area. shapely
unites them. Their outline is simplified by less than the margin: neighbouring discs leave no dents between them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely

from planner.baselines.polyline import NOWHERE, Tangent, piece
from planner.geometry.curves import Point
from planner.interface import FloatArray, IntArray, MapView, Mission, NoWayToBegin
from planner.memory import ObstacleMemory

SIMPLIFY_SHARE = 0.2  # the outline of grown obstacles is simplified by at most this share of the margin
GRAZED_M, TOUCH_SHARE = 0.01, 0.05
"""A line that goes less deep into an obstacle passes it; one that enters within this share of the kept distance from
where it begins on a boundary leads inside."""
QUARTER_CORNERS = 12  # a disc about edge points is drawn with this many corners a quarter
DENT_SHARE = 4.0
"""A line that touches an obstacle and meets it again within this many kept distances leads into a dent."""
CELL_SHARE = 0.35
"""Points in one square of this share of the kept distance are grown as one, with what lies between them."""


class GrownObstacles:
    """The obstacles of one flight: discs of the radius `keep_m`, clearance and margin; the border keeps the margin.

    Each obstacle has a shape, a core that must not be entered, and rings: its boundaries, the obstacle on the left.
    """

    def __init__(self, mission: Mission, margin_m: float) -> None:
        self.keep_m, self._margin_m, self._mission = mission.clearance_m + margin_m, margin_m, mission
        self._memory = ObstacleMemory(mission.clearance_m)
        self._points_m = NOWHERE
        self._united = -1  # number of points that the discs belong to
        self._discs: Any = None
        self._shapes: Any = None
        self.cores: Any = None
        self._border = 0  # the obstacle that is the border of the area and what touches it
        self.rings: list[Any] = []
        self._owners: IntArray = np.zeros(0, dtype=np.intp)  # index of the obstacle that each ring belongs to

    def take_in(self, seen: MapView) -> tuple[FloatArray, bool]:
        """Takes in the edge points of a map.

        Returns the (k, 2) new edge points, and whether some were taken back: then everything may be different.
        """
        self._memory.take_in(seen)
        # What moves comes last there: where it has moved, or new edges have come before it, it is taken back.
        points, known = self._memory.points_m, len(self._points_m)
        if edges_removed := not np.array_equal(points[:known], self._points_m):
            self._united = -1
        self._points_m = points
        return points[0 if edges_removed else known :], edges_removed

    @property
    def edges_removed(self) -> bool:
        """Whether any edge that was seen has been taken back so far."""
        return self._memory.ever_cleared

    def _unite(self) -> None:
        """Brings shapes and boundaries up to date with the edge points."""
        if self._united == len(self._points_m):
            return
        if self._united < 0:
            reach = 10.0 * self.keep_m * np.array((-1.0, -1.0, 1.0, 1.0))
            self._united, self._discs = 0, shapely.box(*(self._mission.bounds_m + reach)) - self._free_area()
        self._discs = shapely.union(self._discs, self._grow(self._points_m[self._united :], self._margin_m))
        self._united = len(self._points_m)
        parts = shapely.simplify(shapely.get_parts(self._discs), SIMPLIFY_SHARE * self._margin_m)
        self._shapes = shapely.orient_polygons(parts)
        self.cores = shapely.buffer(self._shapes, -GRAZED_M, join_style="mitre")
        shapely.prepare(self.cores)
        self._border = int(np.argmin(shapely.bounds(self._shapes)[:, 0]))
        owned = []
        for i, shape in enumerate(self._shapes):
            owned += [(i, shape.exterior)] if i != self._border else []
            # No hole that is too small to be in.
            holes = (hole for hole in shape.interiors if shapely.Polygon(hole).area > self.keep_m**2 / 4.0)
            owned += [(i, hole) for hole in holes]
        self.rings = [ring for _, ring in owned]
        self._owners = np.array([i for i, _ in owned], dtype=np.intp)

    def _free_area(self) -> Any:
        """The area without the margin kept from its border."""
        goal, bounds = np.array(self._mission.goal_m), np.array(self._mission.bounds_m)
        inset = max(0.0, min(self._margin_m, float(np.abs(goal - bounds.reshape(2, 2)).min()) - 1e-3))
        return shapely.box(*(bounds + inset * np.array((1.0, 1.0, -1.0, -1.0))))

    def _grow(self, fresh: FloatArray, margin_m: float) -> Any:
        """The union of discs about (k, 2) points, of clearance and margin, less wide about the goal."""
        # The goal itself may lie nearer to an edge than what is kept elsewhere.
        room = np.hypot(*(fresh - self._mission.goal_m).T) - 1e-3
        keep_m = self._mission.clearance_m + margin_m
        radii = np.clip(room, min(self._mission.clearance_m, keep_m), keep_m)
        _, cells = np.unique(np.floor(fresh / (CELL_SHARE * self.keep_m)), axis=0, return_inverse=True)
        order = np.argsort(cells.ravel(), kind="stable")
        hulls = shapely.convex_hull(shapely.multipoints(fresh[order], indices=cells.ravel()[order]))
        least = np.full(len(hulls), keep_m)
        np.minimum.at(least, cells.ravel(), radii)
        discs = shapely.buffer(hulls, least, quad_segs=QUARTER_CORNERS)
        return shapely.simplify(shapely.union_all(discs), SIMPLIFY_SHARE * max(margin_m, 0.0))

    def first_hit(self, a: Point, b: Point) -> tuple[float, int]:
        """Where the line from a to b first enters an obstacle: distance (m) and obstacle; infinite and -1 for never.

        A line that begins inside, as of an aircraft that cuts corners, and is out at once, does not enter there.
        """
        self._unite()
        line = shapely.linestrings([a, b])
        met = np.flatnonzero(shapely.intersects(self.cores, line))
        inside, which = shapely.get_parts(shapely.intersection(self.cores[met], line), return_index=True)
        begins = shapely.distance(inside, shapely.Point(a))
        entered = (begins > 1e-6) | (shapely.length(inside) > 0.5 * self.keep_m)
        if not entered.any():
            return math.inf, -1
        first = int(np.argmin(np.where(entered, begins, math.inf)))
        return float(begins[first]), int(met[which[first]])

    def hiding(self, place: Point, corners: list[Point]) -> set[int]:
        """The obstacles that lines from a place to corners of what is known enter first."""
        lines = shapely.linestrings(np.array([(place, corner) for corner in corners]).reshape(-1, 2, 2))
        met = shapely.intersects(self.cores[:, None], lines)
        alone = (met.sum(axis=0) == 1) & ~shapely.intersects_xy(self.cores, *place).any()
        doubtful = {self.first_hit(place, corners[i])[1] for i in np.flatnonzero(~alone).tolist()}
        return doubtful | set(np.flatnonzero(met[:, alone].any(axis=1)).tolist())

    def leads_inside(self, place: Point, target: Point) -> bool:
        """Whether the line from a place on the boundary to a target begins inside the obstacle."""
        return self.first_hit(place, target)[0] < TOUCH_SHARE * self.keep_m

    def sees(self, place: Point, target: Point) -> bool:
        """Whether a straight way leads to a target on a boundary, but for a little."""
        return self.first_hit(place, target)[0] > math.dist(place, target) - TOUCH_SHARE * self.keep_m

    def separates(self, *places: Point) -> bool:
        """Whether two places are in, or nearest to, different parts of what is surely free at the bare clearance."""
        solid = self._grow(self._points_m, -self._mission.edge_error_m)
        free = shapely.get_parts(shapely.box(*self._mission.bounds_m) - solid)
        return len({int(shapely.distance(free, shapely.Point(each)).argmin()) for each in places}) > 1

    def part_at(self, place: Point) -> int:
        """Index of the obstacle nearest to a place; the border of the area is one of them."""
        ring, _ = self._nearest(place)
        return int(self._owners[ring])

    def off_m(self, place: Point) -> float:
        """Distance of a place from the nearest boundary."""
        return self._nearest(place)[1]

    def _nearest(self, place: Point) -> tuple[int, float]:
        """Index of the ring nearest to a place, and its distance (m)."""
        self._unite()
        if not self.rings:
            raise NoWayToBegin(f"nowhere in the area is room {self.keep_m:,.0f} m away from what was seen")
        away = shapely.distance(self.rings, shapely.Point(place))
        return int(np.argmin(away)), float(away.min())

    def boundary(self, place: Point, side: float, length_m: float) -> FloatArray:
        """(n, 2) corners of the boundary nearest to a place, for `length_m` from there on, at most once round.

        Side 1 has the obstacle on the left, -1 on the right.
        """
        nearest, off = self._nearest(place)
        ring = self.rings[nearest]
        corners, at = shapely.get_coordinates(ring), ring.project(shapely.Point(place))
        if side < 0.0:
            corners, at = corners[::-1], ring.length - at
        at = (at + (2.0 * off if off < 0.5 * self.keep_m else 0.0)) % ring.length  # no corner onto it
        return piece(np.concatenate((corners, corners[1:])), at, at + min(length_m, ring.length))

    def nearest_to_goal_m(self, place: Point) -> float:
        """Least distance (m) from the goal of obstacles beside a place, of their part inside the border; inf: none."""
        self._unite()
        beside_m, here = TOUCH_SHARE * self.keep_m + self._margin_m, shapely.Point(place)
        # What the border joins are obstacles of their own.
        joined = shapely.get_parts(self._shapes[self._border] & self._free_area())
        parts = np.concatenate((np.delete(self._shapes, self._border), joined))
        beside = parts[shapely.distance(parts, here) < beside_m]
        return float(shapely.distance(beside, shapely.Point(self._mission.goal_m)).min(initial=math.inf))

    def tangents(self, place: Point, parts: set[int], reach_m: float) -> list[Tangent]:
        """The corners within reach at which lines from a place touch the obstacles of indices `parts`."""
        self._unite()
        found: list[Tangent] = []
        for own, ring in zip(self._owners.tolist(), self.rings, strict=True):
            if own not in parts:
                continue
            corners = shapely.get_coordinates(ring)[:-1]
            before, after = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
            to = corners - place
            sides = np.stack([cross(to, before), cross(to, after)])
            away = np.hypot(*to.T)
            touched = (sides[0] * sides[1] >= 0.0) & (cross(before, after) < 0.0)
            chosen = np.flatnonzero(touched & (away < reach_m) & (away > 1e-6))
            lines = shapely.linestrings(np.stack(np.broadcast_arrays(place, corners[chosen]), axis=1))
            hidden = shapely.intersects(self.cores[:, None], lines).any(axis=0)
            beyond = corners[chosen] + DENT_SHARE * self.keep_m * to[chosen] / away[chosen, None]
            rays = shapely.linestrings(np.stack((corners[chosen], beyond), axis=1))
            dents = shapely.intersects(self.cores[own], rays) & (own != self._border)
            for i, out, dent in zip(chosen.tolist(), hidden.tolist(), dents.tolist(), strict=True):
                side = math.copysign(1.0, float(sides[:, i].sum()))
                found.append(Tangent((float(corners[i, 0]), float(corners[i, 1])), side, not out, dent))
        return found

    def encloses_nothing(self, outline: FloatArray) -> bool:
        """Tells whether no obstacle lies within a closed outline, a narrow strip along it left out."""
        shape = shapely.Polygon(outline).buffer(-TOUCH_SHARE * self.keep_m) if len(outline) > 2 else None
        return shape is None or not shapely.intersects(self.cores, shape).any()


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """(...) cross products of (..., 2) vectors."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
