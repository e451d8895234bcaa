"""The true world: obstacles, area bounds, contact. Only the sensor and the judges of a flight may see it.

Frame: local ENU plane, x = east, y = north, metres; times are simulated seconds. A world never changes: every
answer is a function of its arguments alone. Exact geometry is asked only of obstacles that their bounds cannot rule
out.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from harness.world.ground import Ground
from harness.world.linear_motion import LinearMotions, gaps_to
from harness.world.obstacle import Circle, Obstacle, Polygon
from planner.interface import FloatArray, IntArray

if TYPE_CHECKING:
    from shapely import STRtree

    from harness.scenario.scenario import Scenario

__all__ = ["Circle", "Faces", "Fix", "Obstacle", "Polygon", "Surroundings", "World"]

Fix = tuple[float, float, float]  # east and north (m), and when (s)

TOUCH_M = 1e-3  # an overlap shorter than this along a way is no contact

NO_EDGES = np.zeros((4, 0))  # edges of a world without polygons

_BLOCK_ROWS = 256
"""A track is judged in blocks of this many rows: short enough for few candidates, long enough for numpy."""
_ROUNDING_M = 1e-6  # bounds are widened by this for rounding
_FEW_LISTED = 8
"""The exact distances from at most this many obstacles are computed without first comparing their boxes."""
_PAIRS_AT_ONCE = 1_000_000
"""At most this many pairs of points and boxes are compared at once, which takes some tens of megabytes."""
_FEW_STANDING = 512
"""Up to this many obstacles all boxes are compared at once, which is quicker than a query of the tree."""


@dataclass(frozen=True, eq=False)
class Faces:
    """Circles and edges that a ray can hit, at one instant.

    Attributes:
        circles_m: (3, c): centre east, centre north, radius.
        edges_m: (4, e) polygon edges: start east, start north, end east, end north. The end of an edge is,
            bit for bit, the start of the next one of its ring.
    """

    circles_m: FloatArray
    edges_m: FloatArray


class Surroundings:
    """Every face that comes near a place during an interval of time; made by `World.surroundings`.

    Args:
        still: faces of obstacles that stand for ever.
        changing: faces of obstacles that move or come and go, as they are at its epoch.
        motions: of the circles among these, and of the edges.
        until_s: the end of that interval; +inf in a world where nothing ever moves, comes or goes.
    """

    def __init__(
        self,
        still: Faces,
        changing: Faces | None = None,
        motions: tuple[LinearMotions, LinearMotions] | None = None,
        until_s: float = math.inf,
    ) -> None:
        self.until_s = until_s
        self._still, self._changing, self._motions = still, changing, motions

    def faces(self, time_s: float) -> Faces:
        """Returns the faces that are there at a time of the interval, where they are then."""
        if self._changing is None or self._motions is None:
            return self._still
        of_circles, of_edges = self._motions
        circles, edges = self._changing.circles_m.copy(), self._changing.edges_m.copy()
        circles[:2] += of_circles.shifts(time_s)
        edges += np.tile(of_edges.shifts(time_s), (2, 1))
        return Faces(
            np.hstack((self._still.circles_m, circles[:, of_circles.present(time_s, time_s)])),
            np.hstack((self._still.edges_m, edges[:, of_edges.present(time_s, time_s)])),
        )


class World:
    """Obstacles in a rectangular area, as they truly are.

    Those that stand for ever are found through a tree of their boxes, if they are many, so that an answer costs the
    same in a world of a thousand and of a hundred thousand; those that move or come and go are all looked at every
    time.

    Args:
        obstacles: their order gives their index.
        bounds_m: xmin, ymin, xmax, ymax of the area.
        ground: its heights; None where they are not known.
    """

    def __init__(
        self,
        obstacles: Iterable[Obstacle],
        bounds_m: tuple[float, float, float, float],
        ground: Ground | None = None,
    ) -> None:
        self.obstacles: tuple[Obstacle, ...] = tuple(obstacles)
        self.bounds_m = bounds_m
        self.ground = ground
        self._boxes = np.array([o.shape.rounded_box for o in self.obstacles]).reshape(-1, 5).T.copy()
        self._discs = self._boxes[[0, 1, 4]]
        self._circular = np.array([isinstance(o.shape, Circle) for o in self.obstacles], dtype=np.bool_)
        stands = np.array([o.stands_for_ever for o in self.obstacles], dtype=np.bool_)
        self._standing, self._changing = np.flatnonzero(stands), np.flatnonzero(~stands)
        self._motions = LinearMotions.of(self.obstacles[index] for index in self._changing.tolist())
        self._standing_boxes = self._boxes[:, self._standing]
        self._tree = None if len(self._standing) <= _FEW_STANDING else _tree(self._standing_boxes)

    @classmethod
    def from_scenario(cls, scenario: Scenario) -> World:
        """Makes the world that a scenario describes."""
        obstacles = []
        for each in scenario.obstacles:
            shape: Circle | Polygon
            if each.circle is not None:
                shape = Circle(each.circle.center_m, each.circle.radius_m)
            elif each.polygon is not None:
                shape = Polygon(each.polygon.vertices_m, each.polygon.holes_m or ())
            else:
                raise ValueError(f"an obstacle needs a circle or a polygon; got {each}")
            obstacles.append(Obstacle(shape, each.velocity_mps or (0.0, 0.0), each.active_s, each.heights_m))
        ground = None if scenario.ground is None else Ground(scenario.ground.field())
        return cls(obstacles, scenario.area.bounds_m, ground)

    @property
    def ground_heights(self) -> Callable[[FloatArray, FloatArray], FloatArray] | None:
        """Gives (k,) heights of the ground at east and north (m); None where it is not known anywhere."""
        return None if self.ground is None else self.ground.field.at

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
        """Returns the clearance at a contact on the straight way between two fixes; +inf if there surely is none.

        While nothing appears or goes, clearance changes no faster than the way is long: parts of it that are too
        short for a contact are left out, down to `TOUCH_M` (Piyavskii 1972, doi:10.1016/0041-5553(72)90115-2). The
        clearances given are those at both ends, or less.
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
                if (between_m := self.clearance_at(*middle)) < 0.0:
                    return between_m
                ways += [(middle, between_m, end, after_m), (begin, before_m, middle, between_m)]
        return math.inf

    def clearance(self, points_m: FloatArray, times_s: FloatArray) -> FloatArray:
        """(k,) true distance from (k, 2) points to the nearest obstacle edge, each at its own time.

        Negative inside an obstacle, +inf without obstacles, NaN where a row is not finite. Quick where neighbouring
        rows are near one another in place and time, as they are on a track.
        """
        result = np.full(len(points_m), math.nan)
        rows = np.flatnonzero(np.isfinite(points_m).all(axis=1) & np.isfinite(times_s))
        for first in range(0, len(rows), _BLOCK_ROWS):
            block = rows[first : first + _BLOCK_ROWS]
            result[block] = self._block_clearance(points_m[block], times_s[block])
        return result

    def near(self, east_m: float, north_m: float, radius_m: float, time_s: float) -> tuple[int, ...]:
        """Returns the indices, in rising order, of obstacles that at a time are within a radius of a point."""
        point, time = np.array([[east_m, north_m]]), np.array([time_s])
        close = np.union1d(self._candidates(east_m, north_m, radius_m + _ROUNDING_M), self._changing)
        return tuple(i for i in close.tolist() if self.obstacles[i].distance(point, time)[0] <= radius_m)

    def surroundings(
        self, east_m: float, north_m: float, radius_m: float, start_s: float, stop_s: float
    ) -> Surroundings:
        """Returns every face that comes within a radius of a point at some time of an interval.

        A few more may be among them: boxes are compared, not shapes. A caller that moves keeps the answer as
        long as it stays in a smaller circle (a neighbour list; Verlet 1967, doi:10.1103/PhysRev.159.98).
        """
        reach = radius_m + _ROUNDING_M
        if (still := self._faces(self._candidates(east_m, north_m, reach))).edges_m.size:
            starts, ends = still.edges_m[:2], still.edges_m[2:]
            boxes = np.vstack(((starts + ends) / 2, np.abs(ends - starts) / 2, np.zeros(starts.shape[1])))
            still = Faces(still.circles_m, still.edges_m[:, gaps_to(boxes, east_m, north_m) <= reach])
        if not len(self._changing):
            return Surroundings(still)
        gaps = self._motions.gaps(self._boxes[:, self._changing], east_m, north_m, (start_s + stop_s) / 2)
        near = gaps <= reach + self._motions.speeds_mps * (stop_s - start_s) / 2
        listed = self._changing[near & self._motions.present(start_s, stop_s)]
        obstacles = [self.obstacles[index] for index in listed.tolist()]
        circles = [each for each in obstacles if isinstance(each.shape, Circle)]
        edges = [each for each in obstacles for _ in range(each.shape.edges_m.shape[1])]
        moving = LinearMotions.of(circles), LinearMotions.of(edges)
        return Surroundings(still, self._faces(listed), moving, stop_s)

    def _faces(self, listed: IntArray) -> Faces:
        """Returns the faces of listed obstacles, each at its epoch, in the order of the list."""
        circular = self._circular[listed]
        edges = [self.obstacles[index].shape.edges_m for index in listed[~circular].tolist()]
        return Faces(self._discs[:, listed[circular]], np.hstack(edges) if edges else NO_EDGES)

    def _candidates(self, east: float, north: float, reach: float) -> IntArray:
        """Returns the indices of all standing obstacles within a reach of a point, and of some more."""
        if self._tree is None:
            return self._standing[gaps_to(self._standing_boxes, east, north) <= reach]
        import shapely

        corners = east - reach, north - reach, east + reach, north + reach
        return np.asarray(self._standing[np.sort(self._tree.query(shapely.box(*corners)))])

    def _nearest(self, east: float, north: float, slack: float) -> list[int]:
        """Returns the indices of standing obstacles that may be the nearest to a point within a slack of a place."""
        if not len(self._standing):
            return []
        if self._tree is None:
            gaps = gaps_to(self._standing_boxes, east, north)
            reach = self._reach(int(gaps.argmin()), east, north, slack)
            near: list[int] = self._standing[gaps <= reach].tolist()
            return near
        import shapely

        some = self._tree.query_nearest(shapely.Point(east, north), all_matches=False)[0]
        near = self._candidates(east, north, self._reach(some, east, north, slack)).tolist()
        return near

    def _reach(self, some: int, east: float, north: float, slack: float) -> float:
        """Bounds the distance (m) from a place to the nearest standing obstacle of any point within a slack of it.

        `some` is any of the standing obstacles; a nearer one gives a smaller bound.
        """
        probe = self.obstacles[self._standing[some]]
        nearest = float(probe.distance(np.array([[east, north]]), np.zeros(1))[0])
        return max(nearest, 0.0) + 2.0 * slack + _ROUNDING_M

    def _contenders(self, listed: list[int], points: FloatArray) -> list[int]:
        """Returns those of the listed standing obstacles that may be the nearest to one of the points.

        An obstacle touches all sides of its box, so it is no farther from a point than the box and its diagonal are.
        """
        if len(listed) <= _FEW_LISTED:
            return listed
        boxes = self._boxes[:, listed, None]
        diagonals = 2.0 * (np.hypot(boxes[2], boxes[3]) + boxes[4])
        near = np.zeros(len(listed), dtype=np.bool_)
        at_once = max(_PAIRS_AT_ONCE // len(listed), 1)
        for first in range(0, len(points), at_once):
            east, north = points[first : first + at_once].T
            gaps = gaps_to(boxes, east, north)
            near |= (gaps <= (np.maximum(gaps, 0.0) + diagonals).min(axis=0) + _ROUNDING_M).any(axis=1)
        return [index for index, may in zip(listed, near.tolist(), strict=True) if may]

    def _block_clearance(self, points: FloatArray, times: FloatArray) -> FloatArray:
        """`clearance` for finite rows near one another."""
        low, high = points.min(axis=0), points.max(axis=0)
        (east, north), half_m = ((low + high) / 2).tolist(), math.hypot(*(high - low)) / 2
        result = np.full(len(points), math.inf)
        for index in self._contenders(self._nearest(east, north, half_m), points):
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
    """Returns a tree of the bounds of rounded boxes (5, n), to be searched for those near a place."""
    import shapely

    east, north, half_width, half_height, rounding = boxes
    width, height = half_width + rounding, half_height + rounding
    return shapely.STRtree(shapely.box(east - width, north - height, east + width, north + height))
