"""Joins paths: how a new path leaves the one in effect, and the holding turn where no path is found."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from planner.geometry.clearance import first_breach
from planner.geometry.curves import Limits, Pose, Segment, between, place_on, sample, turn_off
from planner.geometry.terrain import Terrain
from planner.interface import FloatArray, MapView, Mission, Path, Plan, PlanRequest, PlanStatus

LEAD_S = 1.0
"""A new plan leaves the old one this much flying time ahead, so that guidance has seen the joint coming."""

HOLD_KEEP_SHARES = (1.0, 0.5, 0.1)
"""Shares of the clearance that a holding turn keeps, tried in this order: a turn too near is better than none. Turns in
space that has been seen to be free come first."""

HOLD_AHEAD_RADII, HOLD_STEP_RADII = 4.0, 0.25
"""A holding turn begins at most the first number of turn radii ahead, at places the second number apart."""


def holding_plan(why: str, request: PlanRequest, mission: Mission, points_m: FloatArray) -> Plan:
    """The answer where a planner finds no way: a holding turn, the one being flown, or none where there is no room."""
    path = request.flown.path if request.flown else None
    if path is not None and path.loiter:
        turn = Path(path.segments[-1:])
        if math.isinf(first_breach(turn, points_m, HOLD_KEEP_SHARES[-1] * mission.clearance_m)):
            return Plan(PlanStatus.NO_PATH, f"{why}; holding")
    limits = Limits.of(mission)
    arc_length_m = request.arc_length_m
    if path is None or path.loiter or path.length_m - arc_length_m < limits.roll_m:
        path = Path(np.array([(*request.position_m, *request.direction, 0.0, max(limits.roll_m, 1.0))]))
        arc_length_m = 0.0
    to_m = min(path.length_m, arc_length_m + HOLD_AHEAD_RADII * limits.radius_m)
    for seen, share in product((request.seen, None), HOLD_KEEP_SHARES):
        terrain = Terrain(points_m, np.full(len(points_m), share * mission.clearance_m), mission.bounds_m)
        if (hold := divert_to_loiter(path, arc_length_m, to_m, limits, terrain, seen, 0.0)) is not None:
            waypoints = np.array([request.position_m, *hold.segments[1:, :2].tolist()])
            return Plan(PlanStatus.FOUND, f"{why}; holding", waypoints, hold)
    return Plan(PlanStatus.NO_PATH, f"{why} and there is no room to hold")


def divert_to_loiter(
    path: Path, from_m: float, to_m: float, limits: Limits, room: Terrain, seen: MapView | None, late_m: float
) -> Path | None:
    """The path in effect from arc length `from_m` on, left as late as possible before `to_m` for a full turn.

    The turn lies in `room` and, if given, in space `seen` to be free; `late_m` is flown first. None: there is no room.
    """
    # Where the way there comes too near to something, it is left before.
    way = between(path, from_m, to_m)
    breach = first_breach(Path(np.array(way)), room.points_m, room.keep_m) if way else math.inf
    if breach < math.inf:
        to_m = max(from_m, from_m + breach - float(room.keep_m.max()))
    step_m = HOLD_STEP_RADII * limits.radius_m
    last = int(late_m / step_m)
    for i in range(max(int((to_m - from_m) / step_m), last), last - 1, -1):
        leave_m = from_m + max(i * step_m, late_m)
        pose, curvature = place_on(path, leave_m)
        for side in (1.0, -1.0) if curvature >= 0.0 else (-1.0, 1.0):
            turn = Path(np.array(turn_off(pose, curvature, side, limits)))
            if seen is not None and not seen.seen_free(sample(turn, step_m)).all():
                continue
            if room.admits(turn):
                return Path(np.array([*between(path, from_m, leave_m), *turn.segments.tolist()]), loiter=True)
    return None


def lead_of(mission: Mission) -> float:
    """Length (m) of the plan in effect that is flown before a new plan begins."""
    return mission.ground_speed_mps * (LEAD_S + mission.compute_latency_s)


def branch_off(request: PlanRequest, mission: Mission) -> tuple[Pose, list[Segment]]:
    """Where a new path leaves the one in effect, and the stretch up to there; at the aircraft if off it or holding."""
    path, arc_length_m = request.flown.path if request.flown else None, request.arc_length_m
    here = Pose(*request.position_m, *request.direction)
    if path is None or path.loiter or arc_length_m >= path.length_m:
        return here, []
    if math.dist(place_on(path, arc_length_m)[0][:2], here[:2]) > mission.off_path_m:
        return here, []
    leave = arc_length_m + lead_of(mission)
    return place_on(path, leave)[0], between(path, arc_length_m, leave)
