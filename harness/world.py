"""The true world: obstacles, area bounds, contact. Only the sensor and the judges of a flight may see it.

Frame: local ENU plane, x = east, y = north, metres; times are simulated seconds. A world never changes: every
answer is a function of its arguments alone. Exact geometry is asked only of obstacles that their bounds cannot rule
out.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from harness.motions import Motions, gaps_to
from harness.obstacle import Circle, Obstacle, Polygon
from planner.interface import FloatArray, IntArray

if TYPE_CHECKING:
    from shapely import STRtree

    from harness.scenario import Scenario

__all__ = ["Circle", "Faces", "Fix", "Obstacle", "Polygon", "Surroundings", "World"]

Fix = tuple[float, float, float]
"""East and north (m), and when (s)."""

TOUCH_M = 1e-3
"""What is thinner along a way is no contact."""

# A track is judged in blocks of this many rows: short enough for few candidates, long enough for numpy.
_BLOCK_ROWS = 256
# What bounds are given to spare, for rounding.
_ROUNDING_M = 1e-6
# The boxes of no more obstacles than these are compared all at once, which is sooner done than to ask the tree.
_FEW = 512


@dataclass(frozen=True, eq=False)
class Faces:
    """What a ray can hit, at one instant.

    Attributes:
        circles_m: (3, c): centre east, centre north, radius.
        edges_m: (4, e) polygon edges: start east, start north, end east, end north. The end of an edge is,
            bit for bit, the start of the next one of its polygon.
    """

    circles_m: FloatArray
    edges_m: FloatArray


class Surroundings:
    """Every face that comes near a place during an interval of time; made by `World.surroundings`.

    Attributes:
        until_s: the end of that interval; +inf in a world where nothing ever moves, comes or goes.
    """

    def __init__(self, faces: Faces, circle_motions: Motions, edge_motions: Motions, until_s: float) -> None:
        self.until_s = until_s
        self._faces = faces
        self._circle_motions = circle_motions
        self._edge_motions = edge_motions
        self._still = not (circle_motions.matter or edge_motions.matter)

    def faces(self, time_s: float) -> Faces:
        """Those that are there at a time of the interval, where they are then."""
        if self._still:
            return self._faces
        circles, edges = self._faces.circles_m, self._faces.edges_m
        if self._circle_motions.matter:
            there = self._circle_motions.present(time_s, time_s)
            circles = np.vstack((circles[:2] + self._circle_motions.shifts(time_s), circles[2:]))[:, there]
        if self._edge_motions.matter:
            there = self._edge_motions.present(time_s, time_s)
            edges = (edges + np.tile(self._edge_motions.shifts(time_s), (2, 1)))[:, there]
        return Faces(circles, edges)


class World:
    """Obstacles in a rectangular area, as they truly are.

    Those that stand for ever are found through a tree of their boxes, if they are many, so that an answer costs the
    same in a world of a thousand and of a hundred thousand; those that move or come and go are all looked at every
    time.

    Args:
        obstacles: their order gives their index.
        bounds_m: xmin, ymin, xmax, ymax of the area.
    """

    def __init__(self, obstacles: Iterable[Obstacle], bounds_m: tuple[float, float, float, float]) -> None:
        self.obstacles: tuple[Obstacle, ...] = tuple(obstacles)
        self.bounds_m = bounds_m
        self._boxes = np.array([o.shape.rounded_box for o in self.obstacles]).reshape(-1, 5).T.copy()
        stands = np.array([o.stands_for_ever for o in self.obstacles], dtype=np.bool_)
        self._standing, self._changing = np.flatnonzero(stands), np.flatnonzero(~stands)
        self._motions = Motions.of(self.obstacles[index] for index in self._changing.tolist())
        self._standing_boxes = self._boxes[:, self._standing]
        self._tree = None if len(self._standing) <= _FEW else _tree(self._standing_boxes)

    @classmethod
    def from_scenario(cls, scenario: Scenario) -> World:
        """The world that a scenario describes."""
        obstacles = []
        for each in scenario.obstacles:
            shape: Circle | Polygon
            if each.circle is not None:
                shape = Circle(each.circle.center_m, each.circle.radius_m)
            elif each.polygon is not None:
                shape = Polygon(each.polygon.vertices_m)
            else:
                raise ValueError(f"an obstacle needs a circle or a polygon; got {each}")
            obstacles.append(Obstacle(shape, each.velocity_mps or (0.0, 0.0), each.active_s))
        return cls(obstacles, scenario.area.bounds_m)

    @cached_property
    def max_obstacle_speed_mps(self) -> float:
        """Speed of the fastest obstacle.

        Until an obstacle appears, clearance shrinks no faster than by this and one's own speed together.
        """
        return float(self._motions.speeds_mps.max(initial=0.0))

    def next_appearance(self, time_s: float) -> float:
        """First time after `time_s` at which an obstacle appears, +inf if none does."""
        return self._motions.next_start(time_s)

    def inside_bounds(self, east_m: float, north_m: float) -> bool:
        """Whether a point is in the area; its boundary belongs to it."""
        xmin, ymin, xmax, ymax = self.bounds_m
        return xmin <= east_m <= xmax and ymin <= north_m <= ymax

    def clearance_at(self, east_m: float, north_m: float, time_s: float) -> float:
        """`clearance` of one point, in metres."""
        point, time = np.array([[east_m, north_m]]), np.array([time_s])
        best = math.inf
        for index in self._nearest(east_m, north_m, 0.0):
            best = min(best, float(self.obstacles[index].distance(point, time)[0]))
        if len(self._changing):
            gaps = self._motions.gaps(self._boxes[:, self._changing], east_m, north_m, time_s)
            for index in self._changing[gaps <= best].tolist():
                best = min(best, float(self.obstacles[index].distance(point, time)[0]))
        return best

    def contact_between(self, begin: Fix, before_m: float, end: Fix, after_m: float) -> float:
        """Clearance at a contact on the straight way between two fixes; +inf if there surely is none.

        While nothing appears or goes, clearance changes no faster than the way is long: parts of it that are too
        short for a contact are left out, down to `TOUCH_M` (Piyavskii 1972, doi:10.1016/0041-5553(72)90115-2).

        Args:
            begin: where and when the way begins.
            before_m: clearance there, or less.
            end: where it ends.
            after_m: clearance there, or less.
        """
        known = [(begin, before_m)]
        for time_s in self._motions.changes(begin[2], end[2]) if len(self._changing) else ():
            share = (time_s - begin[2]) / (end[2] - begin[2])
            there = begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1]), time_s
            known.append((there, self.clearance_at(*there)))
            if known[-1][1] < 0.0:
                return known[-1][1]
        known.append((end, after_m))
        ways = [(*first, *second) for first, second in itertools.pairwise(known)]
        while ways:
            begin, before_m, end, after_m = ways.pop()
            way_m = math.dist(begin[:2], end[:2]) + self.max_obstacle_speed_mps * (end[2] - begin[2])
            if before_m + after_m <= way_m and way_m > TOUCH_M:
                middle = (0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]), 0.5 * (begin[2] + end[2]))
                between_m = self.clearance_at(*middle)
                if between_m < 0.0:
                    return between_m
                ways += [(middle, between_m, end, after_m), (begin, before_m, middle, between_m)]
        return math.inf

    def clearance(self, points_m: FloatArray, times_s: FloatArray) -> FloatArray:
        """True distance from points to the nearest obstacle edge, each at its own time.

        Quick where neighbouring rows are near one another in place and time, as they are on a track.

        Args:
            points_m: (k, 2).
            times_s: (k,).

        Returns:
            (k,) metres: negative inside an obstacle, +inf without obstacles, NaN where a row is not finite.
        """
        result = np.full(len(points_m), math.nan)
        rows = np.flatnonzero(np.isfinite(points_m).all(axis=1) & np.isfinite(times_s))
        for first in range(0, len(rows), _BLOCK_ROWS):
            block = rows[first : first + _BLOCK_ROWS]
            result[block] = self._block_clearance(points_m[block], times_s[block])
        return result

    def near(self, east_m: float, north_m: float, radius_m: float, time_s: float) -> tuple[int, ...]:
        """Indices of the obstacles there at a time that come within a radius of a point, in rising order."""
        point, time = np.array([[east_m, north_m]]), np.array([time_s])
        close = np.union1d(self._listed(east_m, north_m, radius_m + _ROUNDING_M), self._changing)
        return tuple(i for i in close.tolist() if self.obstacles[i].distance(point, time)[0] <= radius_m)

    def surroundings(
        self, east_m: float, north_m: float, radius_m: float, start_s: float, stop_s: float
    ) -> Surroundings:
        """Every face that comes within a radius of a point at some time of an interval.

        A few more may be among them: boxes are compared, not shapes. A caller that moves keeps the answer as
        long as it stays in a smaller circle (a neighbour list; Verlet 1967, doi:10.1103/PhysRev.159.98).
        """
        middle, half_s = (start_s + stop_s) / 2, (stop_s - start_s) / 2
        listed = np.union1d(self._listed(east_m, north_m, radius_m + _ROUNDING_M), self._changing)
        obstacles = [self.obstacles[index] for index in listed.tolist()]
        boxes, motions = self._boxes[:, listed], Motions.of(obstacles)
        reach = radius_m + _ROUNDING_M + motions.speeds_mps * half_s
        close = (motions.gaps(boxes, east_m, north_m, middle) <= reach) & motions.present(start_s, stop_s)
        is_circle = np.array([isinstance(o.shape, Circle) for o in obstacles], dtype=np.bool_)
        circles, polygons = np.flatnonzero(close & is_circle), np.flatnonzero(close & ~is_circle)
        edges_of = [obstacles[index].shape.edges_m for index in polygons.tolist()]
        edges = np.hstack([np.zeros((4, 0)), *edges_of])
        owners = np.repeat(polygons, np.array([each.shape[1] for each in edges_of], dtype=np.intp))
        ends = edges + np.tile(motions.shifts(middle)[:, owners], (2, 1))
        edge_boxes = np.vstack(((ends[:2] + ends[2:]) / 2, np.abs(ends[2:] - ends[:2]) / 2, 0 * owners))
        within = gaps_to(edge_boxes, east_m, north_m) <= reach[owners]
        return Surroundings(
            Faces(boxes[:, circles][[0, 1, 4]], edges[:, within]),
            motions.take(circles),
            motions.take(owners[within]),
            stop_s if len(self._changing) else math.inf,
        )

    def _listed(self, east: float, north: float, reach: float) -> IntArray:
        """Indices of the standing obstacles that may come within a reach of a point, and some more."""
        if self._tree is None:
            return self._standing[gaps_to(self._standing_boxes, east, north) <= reach]
        import shapely

        corners = east - reach, north - reach, east + reach, north + reach
        listed: IntArray = self._standing[self._tree.query(shapely.box(*corners))]
        return listed

    def _nearest(self, east: float, north: float, slack: float) -> list[int]:
        """Indices of the standing obstacles that may be the nearest one to a point within a slack of a place."""
        if not len(self._standing):
            return []
        if self._tree is None:
            gaps = gaps_to(self._standing_boxes, east, north)
            near: list[int] = self._standing[
                gaps <= self._reach(int(gaps.argmin()), east, north, slack)
            ].tolist()
            return near
        import shapely

        some = self._tree.query_nearest(shapely.Point(east, north), all_matches=False)[0]
        near = self._listed(east, north, self._reach(some, east, north, slack)).tolist()
        return near

    def _reach(self, some: int, east: float, north: float, slack: float) -> float:
        """So near to a place are all standing obstacles that may be the nearest to a point within a slack of it.

        Args:
            some: any of the standing obstacles; the nearer, the less.
            east: of the place, m.
            north: of the place, m.
            slack: m.
        """
        probe = self.obstacles[self._standing[some]]
        nearest = float(probe.distance(np.array([[east, north]]), np.zeros(1))[0])
        return max(nearest, 0.0) + 2.0 * slack + _ROUNDING_M

    def _block_clearance(self, points: FloatArray, times: FloatArray) -> FloatArray:
        """`clearance` for finite rows near one another."""
        low, high = points.min(axis=0), points.max(axis=0)
        (east, north), half_m = ((low + high) / 2).tolist(), math.hypot(*(high - low)) / 2
        result = np.full(len(points), math.inf)
        for index in self._nearest(east, north, half_m):
            np.minimum(result, self.obstacles[index].distance(points, times), out=result)
        if len(self._changing):
            start, stop = float(times.min()), float(times.max())
            gaps = self._motions.gaps(self._boxes[:, self._changing], east, north, (start + stop) / 2)
            gaps -= half_m + self._motions.speeds_mps * (stop - start) / 2
            near = (gaps <= result.max() + _ROUNDING_M) & self._motions.present(start, stop)
            for index in self._changing[near].tolist():
                np.minimum(result, self.obstacles[index].distance(points, times), out=result)
        return result


def _tree(boxes: FloatArray) -> STRtree:
    """The bounds of rounded boxes (5, n), to be asked for those near a place."""
    import shapely

    east, north, half_width, half_height, rounding = boxes
    width, height = half_width + rounding, half_height + rounding
    return shapely.STRtree(shapely.box(east - width, north - height, east + width, north + height))
