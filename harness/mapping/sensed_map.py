"""All that the sensor has shown so far: edges of what stands still, what moves, and space seen to be free."""

from __future__ import annotations

import math
from typing import NamedTuple

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


class ScanErrors(NamedTuple):
    """How scans err: 1 sigma of their ranges as the sensor's maker states it, and of how far their poses shift returns.

    `lost` is the share of the returns that get lost or are false, `false_returns` whether ranges are known to be
    returned where nothing is. A motion smaller than the shift of the poses is not recognised.
    """

    noise_m: float = 0.0
    false_returns: bool = False
    lost: float = 0.0
    pose_error_m: float = 0.0


class SensedMap:
    """The planner's only source of knowledge about obstacles (`planner.interface.MapView`).

    Args:
        bounds_m: xmin, ymin, xmax, ymax of the area.
        clearance_m: wanted distance from obstacles.
        least_width_m: as `harness.mapping.free_space.FreeSpace` has it.
    """

    def __init__(
        self,
        bounds_m: tuple[float, float, float, float],
        clearance_m: float,
        range_m: float,
        errors: ScanErrors = ScanErrors(),
        least_width_m: float | None = None,
    ) -> None:
        self._area, self._errors, self._least_width = (bounds_m, clearance_m, range_m), errors, least_width_m
        self._shifted = math.hypot(errors.noise_m, errors.pose_error_m)
        self._clearance, self._noisy = clearance_m, errors.noise_m > NOISY_SHARE * clearance_m
        self._begin(revision=0)
        self.moving: tuple[MovingEdges, ...] = ()  # what is known to move; its edges are not among the others
        self.last_contradiction_s = -math.inf
        """When something last stood, or seemed to stand, in space that had been seen to be free; -inf: never."""
        self.revision = self._edges.revision  # grows with every change of the set of edge points
        self._cached: tuple[int, int, FloatArray] = (0, -1, np.zeros((0, 2)))
        self._nearest = NearestEdge(self)

    def _begin(self, revision: int) -> None:
        """Empties the map."""
        noise_m, false_returns, lost, pose_error_m = self._errors
        self._free = FreeSpace(*self._area, noise_m, lost, self._least_width)
        self._edges: EdgePoints
        if self._noisy:
            self._edges = edges = ReflectionMap(*self._area, noise_m, revision)
            self._moving = MovingObstacles(
                self._clearance,
                max(MEDIAN_ERROR_SHARE * noise_m, pose_error_m),
                is_free=self._free.surrounds,
                stands=edges.stands,
            )
        else:
            self._edges = ObstacleMap(*self._area, false_returns, revision, pose_error_m > 0.0)
            self._moving = MovingObstacles(self._clearance, self._shifted, false_returns)

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
        since, now, points = self._cached
        if since != revision or now != self.revision:
            points = self._edges.edges_since(revision)
            self._cached = (revision, self.revision, points)
        return points

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """(k,) distance of each of (k, 2) points to the nearest edge point, moving ones as last seen; +inf: none."""
        return self._nearest.distance_m(points_m)

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether each of (k, 2) points lies in space seen to be free."""
        return self._free.contains(points_m)

    def update(self, scan: RangeScan) -> None:
        """Takes in one scan: first what moves, then edge points, then free space."""
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
