"""What was planned, row by row of what was flown: where the plan in effect was, and how it bent there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harness.analysis.smoothness import CORNER_RAD, window_m
from harness.flight.record import AcceptedPlan, FloatArray, Track

if TYPE_CHECKING:
    from harness.run_files.run_tables import PlanRow

SAME_TURN = 1e-3
"""Curvatures that differ by no more than this share of them are equal."""


@dataclass(frozen=True, eq=False)
class PlannedRows:
    """The plan in effect at every row of a track; NaN before the first plan.

    Attributes:
        east_m: (n,) point of the plan that is flown at the row.
        north_m: (n,) the same.
        curvature_1pm: (n,) curvature of the plan there, positive = left. A corner counts as an arc of the
            length that `harness.analysis.smoothness` gives it, and so does the angle between the course flown and a
            plan that takes effect, where that is tighter than the plan itself.
    """

    east_m: FloatArray
    north_m: FloatArray
    curvature_1pm: FloatArray

    @property
    def tightest_1pm(self) -> float:
        """The largest absolute curvature; 0 without a plan."""
        return float(np.nan_to_num(np.abs(self.curvature_1pm)).max(initial=0.0))

    @property
    def tightest(self) -> int | None:
        """The row in the middle of the tightest turn, of equal ones the longest; None where no plan bends."""
        bend = np.nan_to_num(np.abs(self.curvature_1pm))
        if not bend.any():
            return None
        tight = np.concatenate(([False], bend >= (1.0 - SAME_TURN) * bend.max(), [False]))
        first, stop = np.flatnonzero(np.diff(tight)).reshape(-1, 2).T
        longest = int((stop - first).argmax())
        return int(first[longest] + stop[longest] - 1) // 2


def planned_rows(track: Track, plans: Sequence[AcceptedPlan | PlanRow]) -> PlannedRows:
    """Looks up the plan in effect at every row.

    Args:
        track: the flown track, with stations.
        plans: `plans[i]` is the plan of rows with `plan_index` i.
    """
    columns = np.full((3, len(track)), np.nan)
    corner_m = window_m(track) if len(track) else 0.0
    for accepted in plans:
        rows = np.flatnonzero(track.plan_index == accepted.plan_index)
        if len(rows):
            place, bend, direction = along_plan(accepted, track.arc_length_m[rows], corner_m)
            turn = _asked_for(track, int(rows[0]), float(direction[0])) / corner_m
            taking_up = track.arc_length_m[rows] - track.arc_length_m[rows[0]] < corner_m
            bend[taking_up & (np.abs(bend) < abs(turn))] = turn
            columns[:, rows] = np.vstack((place, bend))
    return PlannedRows(*columns)


def _asked_for(track: Track, row: int, direction_rad: float) -> float:
    """The turn that a plan asks for as it takes effect at a row, from the course of the row before."""
    course = math.pi / 2 - math.radians(track.course_deg[max(row - 1, 0)])
    return math.remainder(direction_rad - course, math.tau)


def along_plan(
    accepted: AcceptedPlan | PlanRow, arc_length_m: FloatArray, corner_m: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A plan at stations: (2, k) places, (k,) curvatures, (k,) directions, counter-clockwise from east.

    Beyond its end it goes straight on, or round again.
    """
    segments = accepted.segments
    joint = np.append(0.0, np.cumsum(segments[:, 5]))
    index = np.clip(np.searchsorted(joint, arc_length_m, side="right") - 1, 0, len(segments) - 1)
    east, north, tangent_east, tangent_north, curvature, length = segments[index].T
    along = arc_length_m - joint[index]
    arc = along if accepted.loiter else np.minimum(along, length)
    on = along - arc
    half = 0.5 * curvature * arc
    chord = arc * np.sinc(half / np.pi)
    ahead = chord * np.cos(half) + on * np.cos(2 * half)
    left = chord * np.sin(half) + on * np.sin(2 * half)
    at_corner = (along < corner_m) & (joint[index] > arc_length_m[0])
    bend = np.where(on > 0, 0.0, curvature) + np.where(at_corner, _corners(segments)[index] / corner_m, 0.0)
    place = np.stack(
        (
            east + ahead * tangent_east - left * tangent_north,
            north + ahead * tangent_north + left * tangent_east,
        )
    )
    return place, bend, np.arctan2(tangent_north, tangent_east) + 2 * half


def _corners(segments: FloatArray) -> FloatArray:
    """(n,) angle by which the tangent jumps at the start of each segment, positive = left."""
    turn = segments[:-1, 4] * segments[:-1, 5]
    out = (segments[:-1, 2] + 1j * segments[:-1, 3]) * np.exp(1j * turn)
    jump = np.angle((segments[1:, 2] + 1j * segments[1:, 3]) / out)
    return np.append(0.0, np.where(np.abs(jump) > CORNER_RAD, jump, 0.0))
