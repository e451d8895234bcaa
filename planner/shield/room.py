"""Where curves may lie: the distances that are kept from what is remembered, and the area."""

from __future__ import annotations

import numpy as np

from planner.geometry.curves import Limits
from planner.geometry.terrain import Terrain, WorkCount
from planner.interface import Mission
from planner.memory import ObstacleMemory


class Room:
    """The space of one flight.

    Attributes:
        limits: of turns.
        holds: of the full turns that plans end in.
        path_keeps_m: what paths keep from every edge point where there is room.
    """

    def __init__(
        self, mission: Mission, memory: ObstacleMemory, path_keeps_m: float, work_count: WorkCount
    ) -> None:
        self._mission, self._memory, self._work_count = mission, memory, work_count
        self.path_keeps_m = path_keeps_m
        self.limits, self.holds = Limits.of(mission), Limits.of_holds(mission)

    def terrain(self, keep_m: float, standing: bool = False) -> Terrain:
        """Where a curve may lie that keeps one distance from all edge points, or from those that were seen to stand."""
        points = self._memory.genuine_m if standing else self._memory.points_m
        return Terrain(points, np.full(len(points), keep_m), self._mission.bounds_m, self._work_count)
