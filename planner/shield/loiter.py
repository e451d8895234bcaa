"""Holding: a turn that can be flown for ever, for when there is no way to go on."""

from __future__ import annotations

import math

import numpy as np

from planner.geometry.clearance import first_breach
from planner.geometry.curves import Limits, Pose, Segment, between, full_turn, place_on
from planner.geometry.terrain import Terrain
from planner.interface import Path


def divert_to_loiter(path: Path, from_m: float, to_m: float, limits: Limits, terrain: Terrain) -> Path | None:
    """The path in effect, left as late as may be for a full turn at the minimum radius.

    Args:
        path: the path in effect.
        from_m: arc length of the aircraft on it.
        to_m: arc length up to which it can still be flown.
        limits: smallest radius and room to roll.
        terrain: where the turn and the way there may lie.

    Returns:
        A path from `from_m` on that ends in a loiter circle; None where no place on it has room for one.
    """
    # Where the way there comes too near to something, it is left before.
    way = between(path, from_m, to_m)
    breach = first_breach(Path(np.array(way)), terrain.points_m, terrain.keep_m) if way else math.inf
    if breach < math.inf:
        to_m = max(from_m, from_m + breach - float(terrain.keep_m.max()))
    count = max(int((to_m - from_m) / (0.25 * limits.radius_m)), 0)
    for i in range(count, -1, -1):
        arc_length_m = from_m + i * 0.25 * limits.radius_m
        pose, curvature = place_on(path, arc_length_m)
        for side in (1.0, -1.0) if curvature >= 0.0 else (-1.0, 1.0):
            roll: list[Segment] = []
            start = pose
            if side * curvature < 0.0:
                roll = [(*pose, 0.0, limits.roll_m)]
                start = _ahead(pose, limits.roll_m)
            turn = full_turn(start, limits.radius_m, side)
            if terrain.admits(Path(np.array([*roll, turn]))):
                return Path(np.array([*between(path, from_m, arc_length_m), *roll, turn]), loiter=True)
    return None


def _ahead(pose: Pose, distance_m: float) -> Pose:
    x, y, tx, ty = pose
    return Pose(x + tx * distance_m, y + ty * distance_m, tx, ty)
