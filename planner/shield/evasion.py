"""Evasion: where no way is safe, the way that keeps clear longest of what stands and of what moves.

Ways are rolled out from a little ahead: a turn at the least radius to one side, one back to the other, straight on,
and a full turn at the end. Each is judged by how near it comes to what was seen, where that will be when the aircraft
is there; what is far ahead counts less. (The rollouts of D. Fox, W. Burgard and S. Thrun, "The dynamic window approach
to collision avoidance", IEEE Robotics & Automation Magazine 4, 1997.)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.geometry.clearance import inside_bounds
from planner.geometry.curves import Limits, Point, Pose, Segment, along, poses_at, turn_off
from planner.interface import FloatArray, Mission, Path, PlanRequest
from planner.kernels.buckets import Buckets, bucketed
from planner.kernels.room import room_along
from planner.shield.encounters import EARLIEST, LATEST

AHEAD_S = 30.0  # moving obstacles are taken to keep their velocity for this time; a way is judged up to it

DISCOUNT = 0.05
"""For each metre along a way, an obstacle met there counts as this many metres further away: it can be evaded."""

UNKNOWN_MPS, UNKNOWN_S = 10.0, 8.0
"""An obstacle that has just appeared is taken to come nearer at this speed for this time: its velocity is not known."""

STEP_SHARE, LEAST_STEP_RADII = 0.25, 0.02
"""Ways are tested in steps of the first share of the clearance, but at least the second share of the turn radius."""

SQUARE_SIDE_STEPS = 8.0  # side of the squares that still edge points are sorted into, in steps

FIRST_TURNS_DEG, BACK_TURNS_DEG = (0.0, 20.0, 45.0, 75.0, 110.0, 150.0, 180.0), (0.0, 20.0, 45.0, 75.0, 110.0)
"""Angles of the first turn of a way, to one side, and of the second, back to the other; deg."""

WAYS = [
    (first, back, straight)
    for first in FIRST_TURNS_DEG
    for back in BACK_TURNS_DEG
    if back <= first
    for straight in (2.0, 0.0)
    if straight or not first or back == BACK_TURNS_DEG[1]
]
"""First turn, second turn (deg) and the straight after them (turn radii), of each way that is rolled out. Without a
straight all second turns that lead into the same last turn are one way."""


@dataclass(frozen=True, eq=False)
class Threats:
    """The edges near the aircraft: of obstacles that stand, and of those that move.

    A row of `moving` is an edge point now, or one of what is taken to lie behind, its velocity, and how fast it may
    come nearer beyond that.
    """

    still_m: FloatArray  # (n, 2)
    moving: FloatArray  # (k, 5)
    speed_mps: float  # of the aircraft
    step_m: float  # ways are tested at places this far apart

    @classmethod
    def within_reach(cls, request: PlanRequest, still_m: FloatArray, mission: Mission) -> Threats:
        """Collects the threats that can be met within `AHEAD_S`; `still_m` are all (n, 2) edge points that stand."""
        reach_m = AHEAD_S * LATEST * mission.speed_mps + mission.clearance_m
        east, north = still_m[:, 0] - request.position_m[0], still_m[:, 1] - request.position_m[1]
        near_m = still_m.compress(east * east + north * north < reach_m * reach_m, axis=0)
        moving = [np.zeros((0, 5))]
        for each in request.seen.moving:
            seen = each.points_m + np.array(each.velocity_mps) * (request.time_s - each.time_s)
            now = np.concatenate((seen, far_side(seen, request.position_m)))
            motion = (*each.velocity_mps, 0.0 if any(each.velocity_mps) else UNKNOWN_MPS)
            moving.append(np.column_stack((now, np.broadcast_to(motion, (len(now), 3)))))
        return cls(near_m, np.concatenate(moving), mission.speed_mps, step_along_m(mission))

    def room_m(self, path: Path, least_m: float = -math.inf, later: float = DISCOUNT) -> float:
        """Distance (m) that a way from the aircraft keeps from all threats; far along it they count for less (`later`).

        With less than `least_m` it is not looked at to its end.
        """
        at_m = np.arange(0.0, AHEAD_S * self.speed_mps, self.step_m)
        if path.loiter:
            turn = float(path.segments[-1, 5])
            begin = path.length_m - turn
            at_m = np.where(at_m > begin, begin + (at_m - begin) % turn, at_m)
        places = np.ascontiguousarray(poses_at(path, at_m)[:, :2])
        how = (self.step_m, self.speed_mps, least_m, later, EARLIEST, LATEST, UNKNOWN_S)
        return room_along(places, self._still_squares, self.moving, *how)

    @cached_property
    def _still_squares(self) -> Buckets:
        """The edge points of obstacles that stand, sorted into squares."""
        return bucketed(self.still_m, np.zeros(len(self.still_m)), SQUARE_SIDE_STEPS * self.step_m)[1]


def step_along_m(mission: Mission) -> float:
    """Step (m) in which ways are tested."""
    return max(STEP_SHARE * mission.clearance_m, LEAST_STEP_RADII * mission.turn_radius_m)


def far_side(face_m: FloatArray, position_m: Point) -> FloatArray:
    """(k, 2) assumed far side of a body whose (k, 2) face is seen from a place: half a circle."""
    middle, half = 0.5 * (face_m[0] + face_m[-1]), 0.5 * (face_m[-1] - face_m[0])
    away = np.array((-half[1], half[0]))
    away *= np.copysign(1.0, away @ (middle - position_m))
    angle = np.linspace(0.0, np.pi, len(face_m))[:, None]
    return np.asarray(middle - half * np.cos(angle) + away * np.sin(angle))


def rolled_out(prefix: Sequence[Segment], limits: Limits) -> Iterator[Path]:
    """Ways on: a turn, one back, straight on or not, a full turn on to the same side; the gentlest first."""
    last = prefix[-1]
    pose, curvature = along(last, last[5]), last[4]
    for first_deg, back_deg, straight in WAYS:
        for side in (1.0, -1.0) if curvature >= 0.0 else (-1.0, 1.0):
            onto, straight_m = -side if back_deg else side, straight * limits.radius_m
            turns = ((side, first_deg, 0.0), (-side, back_deg, straight_m), (onto, 360.0, 0.0))
            yield Path(np.array([*prefix, *_chain(pose, curvature, turns, limits)]), loiter=True)


def clearest(
    ways: Iterable[Path], bounds_m: tuple[float, float, float, float], threats: Threats, more_than_m: float
) -> Path | None:
    """The way in the area with the most room from the threats, if more than `more_than_m` (m); else None."""
    best: Path | None = None
    for way in ways:
        if inside_bounds(way, bounds_m) and (room_m := threats.room_m(way, more_than_m)) > more_than_m:
            best, more_than_m = way, room_m
    return best


def _chain(
    pose: Pose, curvature: float, turns: tuple[tuple[float, float, float], ...], limits: Limits
) -> list[Segment]:
    """Chains turns (side, degrees, straight after it, m), with a straight to roll on before a change of side."""
    out: list[Segment] = []
    for side, degrees, straight_m in turns:
        if degrees > 0.0:
            *roll, turn = turn_off(pose, curvature, side, limits)
            arc = (*turn[:5], turn[5] * degrees / 360.0)
            out += [*roll, arc]
            pose, curvature = along(arc, arc[5]), arc[4]
        if straight_m > 0.0:
            out.append((*pose, 0.0, straight_m))
            pose, curvature = along(out[-1], straight_m), 0.0
    return out
