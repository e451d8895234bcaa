"""Makes a planner's path flyable: pursuit at the turn radius with a limited change of curvature.

A path may have corners, or begin beside the aircraft: it is tracked by pure pursuit (R. C. Coulter, "Implementation of
the pure pursuit path tracking algorithm", CMU-RI-TR-92-01, 1992), and the track is what is certified and flown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner.geometry.curves import Limits, Pose, Segment, along, sample
from planner.interface import FloatArray, Path

STEP_RADII, AHEAD_RADII = 1.0 / 12.0, 0.6
"""Length of a step of the track, and look-ahead distance of the pursuit, in turn radii."""

SMOOTH_RAD, SMOOTH_M = math.radians(2.0), 1.0
"""A path can be flown as it is if none of its stretches, joints included, turns by more than this beyond what the turn
radius allows over its length, and if its joints jump by no more than this in all."""

MOST_TRACK_RADII = 30.0  # longest track of a path, in turn radii; the sensing range limits it as well


@dataclass(frozen=True, eq=False)
class Tracked:
    """A path that can be flown, and how far along the planner's path it has come at each of its segments."""

    path: Path
    stations_m: FloatArray  # (n + 1,) of the planner's path, at the beginning of each segment and at the end

    def station_m(self, arc_length_m: float) -> float:
        """Arc length of the planner's path abeam of an arc length of the track."""
        ends = np.concatenate(((0.0,), np.cumsum(self.path.segments[:, 5])))
        return float(np.interp(arc_length_m, ends, self.stations_m))


def tracked(pose: Pose, curvature: float, path: Path, from_m: float, limits: Limits, most_m: float) -> Tracked | None:
    """A track of a path from a pose and curvature (1/m) on, at most `most_m` long; None: the path ends behind it.

    Before the arc length `from_m` the pose is not beside the path.
    """
    step_m, ahead_m = STEP_RADII * limits.radius_m, AHEAD_RADII * limits.radius_m
    places = sample(path, step_m)
    stations = np.concatenate(((0.0,), np.cumsum(np.hypot(*np.diff(places, axis=0).T))))
    stations *= path.length_m / max(float(stations[-1]), 1e-9)
    rows = places.tolist()
    at = stations.tolist()
    last = len(rows) - 1
    i = min(int(np.searchsorted(stations, from_m)), last)
    near = np.hypot(places[i:, 0] - pose.east_m, places[i:, 1] - pose.north_m)
    i += int(np.argmin(np.where(stations[i:] <= from_m + 2.0 * limits.radius_m, near, math.inf)))
    most_bend = 1.0 / limits.radius_m
    most_change = most_bend * min(1.0, step_m / max(limits.roll_m, step_m))
    out: list[Segment] = []
    passed = [at[i]]
    while len(out) * step_m < most_m and i < last:
        j = i
        while j < last and at[j] < at[i] + ahead_m:
            j += 1
        east, north = rows[j][0] - pose.east_m, rows[j][1] - pose.north_m
        aside = pose.tangent_east * north - pose.tangent_north * east
        forward = pose.tangent_east * east + pose.tangent_north * north
        square = max(east * east + north * north, 1e-9)
        wanted = 2.0 * aside / square if forward > 0.0 else math.copysign(most_bend, aside)
        wanted = min(max(wanted, -most_bend), most_bend)
        curvature = min(max(wanted, curvature - most_change), curvature + most_change)
        curvature = min(max(curvature, -most_bend), most_bend)
        segment: Segment = (*pose, curvature, step_m)
        out.append(segment)
        pose = along(segment, step_m)
        while i < last and math.dist(rows[i + 1], pose[:2]) <= math.dist(rows[i], pose[:2]):
            i += 1
        passed.append(at[i])
    return Tracked(Path(np.array(out)), np.array(passed)) if out else None


def can_be_flown(path: Path, pose: Pose, curvature: float, limits: Limits) -> bool:
    """Whether a path turns no tighter than the limits, at joints or between them, and begins at a pose.

    The direction of such a path is nowhere further than half of `SMOOTH_RAD` from that of one without a joint. Between
    turns to opposite sides it has the length to roll; `curvature` (1/m) is that flown just before it.
    """
    most = (1.0 + 1e-6) / limits.radius_m
    if path.max_curvature_1pm > most:
        return False
    left = right = jumped_m = 0.0  # turn beyond what is allowed, of that stretch up to here which has most
    straight_m = 0.0  # flown since the last turn
    for row in path.rows:
        aside = pose.tangent_east * row[3] - pose.tangent_north * row[2]
        turn = math.atan2(aside, pose.tangent_east * row[2] + pose.tangent_north * row[3])
        left, right = max(left, 0.0) + turn, max(right, 0.0) - turn
        jumped_m += math.dist(pose[:2], row[:2])
        rolls = straight_m < limits.roll_m and abs(row[4] - curvature) > most
        if rolls or jumped_m > SMOOTH_M or max(left, right) > SMOOTH_RAD:
            return False
        straight_m = 0.0 if row[4] else straight_m + row[5]
        curvature = row[4] or curvature
        left, right = left + (row[4] - most) * row[5], right - (row[4] + most) * row[5]
        pose = along(row, row[5])
    return True
