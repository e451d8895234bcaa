"""Joints of planners whose paths bend: how a path leaves the one before, and the turn where there is none."""

from __future__ import annotations

import math

import numpy as np

from planner.geometry.curves import Limits, Pose, Segment, between, pose_at
from planner.interface import FloatArray, Mission, Path, Plan, PlanRequest, PlanStatus
from planner.rolling_window.config import LEAD_S
from planner.rolling_window.loiter import divert_to_loiter
from planner.rolling_window.route_optimisation import Terrain

SHARES = (1.0, 0.5, 0.1)
"""Shares of the clearance. A turn is looked for with one after the other: a turn too near to something is better than
none."""

AHEAD_RADII = 4.0
"""The turn begins within so many turn radii ahead of the aircraft."""


def stuck(why: str, request: PlanRequest, mission: Mission, points_m: FloatArray) -> Plan:
    """The answer where there is no way on.

    Args:
        why: the beginning of the sentence.
        request: what was asked.
        mission: what stays the same for the flight.
        points_m: (m, 2) edge points.
    """
    path = request.flown.path if request.flown else None
    if path is not None and path.loiter:
        return Plan(PlanStatus.NO_PATH, f"{why}; holding")
    limits = Limits.of(mission)
    arc_length_m = request.arc_length_m
    if path is None or path.length_m - arc_length_m < limits.roll_m:
        path = Path(np.array([(*request.position_m, *request.direction, 0.0, max(limits.roll_m, 1.0))]))
        arc_length_m = 0.0
    until = min(path.length_m, arc_length_m + AHEAD_RADII * limits.radius_m)
    for share in SHARES:
        terrain = Terrain(points_m, np.full(len(points_m), share * mission.clearance_m), mission.bounds_m)
        turn = divert_to_loiter(path, arc_length_m, until, limits, terrain)
        if turn is not None:
            waypoints = np.array([request.position_m, *turn.segments[1:, :2].tolist()])
            return Plan(PlanStatus.FOUND, f"{why}; holding", waypoints, turn)
    return Plan(PlanStatus.NO_PATH, f"{why} and there is no room to hold")


def branch_off(request: PlanRequest, mission: Mission) -> tuple[Pose, list[Segment]]:
    """Where a new path leaves the one in effect, and the stretch up to there; the aircraft where it is off it.

    From a holding turn a new path leaves at once.
    """
    path, arc_length_m = request.flown.path if request.flown else None, request.arc_length_m
    here = Pose(*request.position_m, *request.direction)
    if path is None or path.loiter or arc_length_m >= path.length_m:
        return here, []
    if math.dist(pose_at(path, arc_length_m)[:2], here[:2]) > mission.off_path_m:
        return here, []
    leave = arc_length_m + mission.ground_speed_mps * (LEAD_S + mission.compute_latency_s)
    return pose_at(path, leave), between(path, arc_length_m, leave)
