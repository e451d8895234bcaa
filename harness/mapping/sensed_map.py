"""All that the sensor has shown so far: edges of what stands still, what moves, and space seen to be free."""

from __future__ import annotations

import math

import numpy as np

from harness.mapping.edge_grid import EdgePoints
from harness.mapping.free_space import FreeSpace
from harness.mapping.moving_obstacles import MovingObstacles
from harness.mapping.obstacle_map import ObstacleMap
from harness.mapping.reflection_map import ReflectionMap
from harness.mapping.scan import RangeScan
from harness.mapping.smoothed_scan import MEDIAN_ERROR_SHARE, smoothed
from planner.interface import BoolArray, FloatArray, MovingEdges
from planner.nearest_edge import NearestEdge

NOISY_SHARE = 0.1
"""Ranges that err by more than this share of the clearance go to a `ReflectionMap`, and moving obstacles to medians."""


class SensedMap:
    """The planner's only source of knowledge about obstacles (`planner.interface.MapView`).

    Args:
        bounds_m: xmin, ymin, xmax, ymax of the area.
        clearance_m: wanted distance from obstacles.
        noise_m: standard deviation of ranges, as the sensor's maker states it.
        false_returns: the sensor is known to return ranges where nothing is.
        lost: share of the returns that get lost or are false, likewise.
        least_width_m: as `harness.mapping.free_space.FreeSpace` has it.
        pose_error_m: standard deviation of how far returns are shifted from one look at an obstacle to a later one,
            because the poses of the scans are not known exactly. What moves less is not told to move.
    """

    def __init__(
        self,
        bounds_m: tuple[float, float, float, float],
        clearance_m: float,
        range_m: float,
        *,
        noise_m: float = 0.0,
        false_returns: bool = False,
        lost: float = 0.0,
        least_width_m: float | None = None,
        pose_error_m: float = 0.0,
    ) -> None:
        self._area = bounds_m, clearance_m, range_m
        self._noise, self._false_returns = noise_m, false_returns
        self._lost, self._least_width = lost, least_width_m
        self._pose_error, self._shifted = pose_error_m, math.hypot(noise_m, pose_error_m)
        self._clearance, self._noisy = clearance_m, noise_m > NOISY_SHARE * clearance_m
        self._begin(revision=0)
        self.moving: tuple[MovingEdges, ...] = ()
        """What is known to move; its edges are not among the others."""
        self.last_contradiction_s = -math.inf
        """When something last stood, or seemed to stand, in space that had been seen to be free; -inf: never."""
        self.revision = self._edges.revision
        """Grows with every change of the set of edge points."""
        self._asked: tuple[int, int, FloatArray] = (0, -1, np.zeros((0, 2)))
        self._nearest = NearestEdge(self)

    def _begin(self, revision: int) -> None:
        """Empties the map."""
        self._free = FreeSpace(*self._area, self._noise, self._lost, self._least_width)
        self._edges: EdgePoints
        if self._noisy:
            self._edges = edges = ReflectionMap(*self._area, self._noise, revision)
            self._moving = MovingObstacles(
                self._clearance,
                max(MEDIAN_ERROR_SHARE * self._noise, self._pose_error),
                is_free=self._free.surrounds,
                stands=edges.stands,
            )
        else:
            self._edges = ObstacleMap(*self._area, self._false_returns, revision, self._pose_error > 0.0)
            self._moving = MovingObstacles(self._clearance, self._shifted, self._false_returns)

    def start_over(self, time_s: float) -> None:
        """Forgets everything because the believed position has jumped, so that all that was entered lies elsewhere."""
        self._begin(self.revision + 1)
        self.revision, self.moving, self.last_contradiction_s = self._edges.revision, (), time_s

    @property
    def spacing_m(self) -> float:
        """Edge points of one wall are about this far apart."""
        return self._edges.spacing_m

    @property
    def last_removal_revision(self) -> int:
        """The last revision at which edge points were taken away again."""
        return self._edges.last_removal_revision

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) edge points that came in after `revision`, in the order in which they did."""
        since, now, points = self._asked
        if since != revision or now != self.revision:
            points = self._edges.edges_since(revision)
            self._asked = (revision, self.revision, points)
        return points

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """(k,) distance of each of (k, 2) points to the nearest edge point, moving ones as last seen; +inf: none."""
        return self._nearest.distance_m(points_m)

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points lies in space seen to be free."""
        return self._free.contains(points_m)

    def update(self, scan: RangeScan) -> None:
        """Takes in one scan."""
        ignored = self._moving.update(smoothed(scan, self._clearance) if self._noisy else scan)
        before = self.revision
        self._edges.update(scan, ignored)
        self.revision = self._edges.revision
        if self.revision != before:
            self._clear_free_space(scan, self.edges_since(before))
        if self.moving or self._moving.follows:
            self._note_moving(scan)
        self._free.update(scan)

    def _note_moving(self, scan: RangeScan) -> None:
        """Takes away edges and free space where something moves."""
        if len(trail_m := self._moving.trail_m):
            self._edges.forget(trail_m, self._clearance)
            self.revision = self._edges.revision
        self.moving = self._moving.found
        for each in self.moving:
            self._clear_free_space(scan, each.points_m)

    def _clear_free_space(self, scan: RangeScan, edges_m: FloatArray) -> None:
        """Takes back free space where edges stand in it."""
        if self._free.take_back(scan, edges_m):
            self.last_contradiction_s = scan.available_s
