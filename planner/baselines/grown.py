"""The known obstacles grown by the distance to be kept: what a BUG follows.

Every edge point is the centre of a disc that must not be entered, and so is all that lies outside of the area. shapely
unites them. Their outline is simplified by less than the margin: neighbouring discs leave no dents between them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner.baselines.polyline import NOWHERE, piece
from planner.geometry.curves import Point
from planner.interface import FloatArray, IntArray, MapView, Mission
from planner.memory import ObstacleMemory

SIMPLER = 0.2
"""The outline is simplified by this share of the margin."""

GRAZED_M = 0.01
"""A line that goes less deep into an obstacle passes it."""

TOUCH_SHARE = 0.05
"""A line that begins on a boundary and enters within this share of the kept distance leads inside."""

QUARTER_CORNERS = 12
"""Corners of a quarter of a disc."""

CELL_SHARE = 0.35
"""Points in one square of this share of the kept distance are grown as one, with what lies between them."""


class GrownObstacles:
    """The obstacles of one flight: discs of the radius `keep_m`, clearance and margin; the border keeps the margin."""

    def __init__(self, mission: Mission, margin_m: float) -> None:
        self.keep_m, self._margin_m, self._mission = mission.clearance_m + margin_m, margin_m, mission
        self._memory = ObstacleMemory(mission.clearance_m)
        self._points_m, self._united = NOWHERE, 0
        self._discs: Any = None  # of the first `_united` points
        self._core: Any = None  # what must not be entered
        self._rings: list[Any] = []  # boundaries, the obstacle on the left
        self._parts: IntArray = np.zeros(0, dtype=np.intp)  # which obstacle each ring belongs to

    def take_in(self, seen: MapView) -> tuple[FloatArray, bool]:
        """Remembers what has come in.

        Returns the (k, 2) new edge points, and whether some were taken back: then everything may be different.
        """
        self._memory.take_in(seen)
        # What moves comes last there: where it has moved, or new edges have come before it, all is united anew.
        points, known = self._memory.points_m, len(self._points_m)
        taken_back = not np.array_equal(points[:known], self._points_m)
        if taken_back:
            self._discs, self._core, self._united, known = None, None, 0, 0
        self._points_m = points
        return points[known:], taken_back

    @property
    def taken_back(self) -> bool:
        """Whether any edge that was seen has been taken back so far."""
        return self._memory.ever_cleared

    def _unite(self) -> None:
        """Brings the shapes up to date: only where a walk is asked for, which is seldom."""
        import shapely

        fresh = self._points_m[self._united :]
        if not len(fresh) and self._core is not None:
            return
        goal, bounds = np.array(self._mission.goal_m), np.array(self._mission.bounds_m)
        # The goal itself may lie nearer to an edge or the border than what is kept elsewhere.
        room = np.hypot(*(fresh - goal).T) - 1e-3
        radii = np.clip(room, min(self._mission.clearance_m, self.keep_m), self.keep_m)
        _, cells = np.unique(np.floor(fresh / (CELL_SHARE * self.keep_m)), axis=0, return_inverse=True)
        order = np.argsort(cells.ravel(), kind="stable")
        hulls = shapely.convex_hull(shapely.multipoints(fresh[order], indices=cells.ravel()[order]))
        least = np.full(len(hulls), self.keep_m)
        np.minimum.at(least, cells.ravel(), radii)
        discs = shapely.buffer(hulls, least, quad_segs=QUARTER_CORNERS)
        added = shapely.simplify(shapely.union_all(discs), SIMPLER * self._margin_m)
        self._discs = added if self._discs is None else shapely.union(self._discs, added)
        self._united = len(self._points_m)
        inset = max(0.0, min(self._margin_m, float(np.abs(goal - bounds.reshape(2, 2)).min()) - 1e-3))
        beyond = 10.0 * self.keep_m * np.array((-1.0, -1.0, 1.0, 1.0))
        frame = shapely.box(*(bounds + beyond)) - shapely.box(*(bounds - inset * np.sign(beyond)))
        parts = shapely.get_parts(
            shapely.simplify(shapely.union(self._discs, frame), SIMPLER * self._margin_m)
        )
        self._core = shapely.buffer(shapely.multipolygons(parts), -GRAZED_M, join_style="mitre")
        shapely.prepare(self._core)
        self._rings, owners = [], []
        for number, part in enumerate(shapely.orient_polygons(parts)):
            holes = [hole for hole in part.interiors if shapely.Polygon(hole).area > self.keep_m**2 / 4.0]
            outer = [] if part.bounds[0] < bounds[0] - 5.0 * self.keep_m else [part.exterior]
            self._rings += [*outer, *holes]
            owners += [number] * (len(outer) + len(holes))
        self._parts = np.array(owners, dtype=np.intp)

    def first_hit(self, a: Point, b: Point) -> tuple[float, int]:
        """Where the line from a to b first enters an obstacle: distance (m) and obstacle; infinite and -1 for never.

        A line that begins inside, as of an aircraft that cuts corners, and is out at once, does not enter there.
        """
        import shapely

        self._unite()
        line, here = shapely.linestrings([a, b]), shapely.Point(a)
        inside = shapely.get_parts(shapely.intersection(self._core, line))
        begins = shapely.distance(inside, here)
        entered = (begins > 1e-6) | (shapely.length(inside) > 0.5 * self.keep_m)
        if not entered.any():
            return math.inf, -1
        distance = float(begins[entered].min())
        return distance, self.part_at(line.interpolate(distance).coords[0])

    def leads_inside(self, place: Point, target: Point) -> bool:
        """Whether the line from a place on the boundary to a target begins inside the obstacle."""
        return self.first_hit(place, target)[0] < TOUCH_SHARE * self.keep_m

    def sees(self, place: Point, target: Point) -> bool:
        """Whether a straight way leads to a target on a boundary, but for a little."""
        return self.first_hit(place, target)[0] > math.dist(place, target) - TOUCH_SHARE * self.keep_m

    def part_at(self, place: Point) -> int:
        """The obstacle next to a place; the border of the area is one."""
        nearest = self._nearest(place)
        return int(self._parts[nearest])

    def off_m(self, place: Point) -> float:
        """How far a place is from the next boundary; infinite where there is none."""
        import shapely

        self._unite()
        return float(min((ring.distance(shapely.Point(place)) for ring in self._rings), default=math.inf))

    def _nearest(self, place: Point) -> int:
        import shapely

        self._unite()
        return int(np.argmin(shapely.distance(self._rings, shapely.Point(place))))

    def boundary(self, place: Point, side: float, length_m: float) -> FloatArray:
        """(n, 2) at most so much of the boundary next to a place, from there on and at most once round.

        Side 1 has the obstacle on the left, -1 on the right.
        """
        import shapely

        nearest = self._nearest(place)
        ring = self._rings[nearest]
        corners, at, off = (
            shapely.get_coordinates(ring),
            ring.project(shapely.Point(place)),
            self.off_m(place),
        )
        if side < 0.0:
            corners, at = corners[::-1], ring.length - at
        at = (at + (2.0 * off if off < 0.5 * self.keep_m else 0.0)) % ring.length  # no corner onto it
        return piece(np.concatenate((corners, corners[1:])), at, at + min(length_m, ring.length))

    def nearest_to_goal_m(self, place: Point) -> float:
        """How near to the goal the obstacle beside a place comes, as far as it is known; the border is none."""
        import shapely

        self._unite()
        each = shapely.get_parts(self._discs)
        mine = each[shapely.distance(each, shapely.Point(place)) < TOUCH_SHARE * self.keep_m + self._margin_m]
        goal = shapely.Point(self._mission.goal_m)
        return float(min((shape.distance(goal) for shape in mine), default=math.inf))

    def tangents(self, place: Point, parts: set[int], reach_m: float) -> list[tuple[Point, float, bool]]:
        """The corners within reach at which lines from a place touch some obstacles, sides, and which are in sight.

        Of side 1 are those that lie on the left of the line.
        """
        import shapely

        self._unite()
        found: list[tuple[Point, float, bool]] = []
        for ring, part in zip(self._rings, self._parts.tolist(), strict=True):
            if part not in parts:
                continue
            corners = shapely.get_coordinates(ring)[:-1]
            before, after = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
            to = corners - place
            sides = np.stack([_cross(to, before), _cross(to, after)])
            away = np.hypot(*to.T)
            touched = (sides[0] * sides[1] >= 0.0) & (_cross(before, after) < 0.0)
            chosen = np.flatnonzero(touched & (away < reach_m) & (away > 1e-6))
            lines = (
                shapely.linestrings([[place, corner] for corner in corners[chosen]]) if len(chosen) else []
            )
            hidden = shapely.intersects(self._core, lines)
            for i, out in zip(chosen.tolist(), np.atleast_1d(hidden).tolist(), strict=True):
                side = math.copysign(1.0, float(sides[:, i].sum()))
                found.append(((float(corners[i, 0]), float(corners[i, 1])), side, not out))
        return found

    def encloses_nothing(self, outline: FloatArray) -> bool:
        """Whether no obstacle lies within a closed outline, but for a little beside it."""
        import shapely

        shape = shapely.Polygon(outline).buffer(-TOUCH_SHARE * self.keep_m) if len(outline) > 2 else None
        return shape is None or not shapely.intersects(self._core, shape)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
