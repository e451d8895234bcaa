"""What was planned, row by row of what was flown: where the plan in effect was, and how it bent there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.record import AcceptedPlan, FloatArray, Track
from harness.smoothness import CORNER_RAD, window_m

SAME_TURN = 1e-3
"""Curvatures that differ by no more than this share of them are equal."""


@dataclass(frozen=True, eq=False)
class PlannedRows:
    """The plan in effect at every row of a track; NaN before the first plan.

    Attributes:
        east_m: (n,) point of the plan that is flown at the row.
        north_m: (n,) the same.
        curvature_1pm: (n,) curvature of the plan there, positive = left. A corner counts as an arc of the
            length that `harness.smoothness` gives it.
    """

    east_m: FloatArray
    north_m: FloatArray
    curvature_1pm: FloatArray

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


def planned_rows(track: Track, plans: Sequence[AcceptedPlan]) -> PlannedRows:
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
            columns[:, rows] = _along(accepted, track.station_m[rows], corner_m)
    return PlannedRows(*columns)


def _along(accepted: AcceptedPlan, station_m: FloatArray, corner_m: float) -> FloatArray:
    """(3, k) east, north and curvature of a plan at stations; beyond its end straight on, or round again."""
    segments = accepted.segments
    joint = np.append(0.0, np.cumsum(segments[:, 5]))
    index = np.clip(np.searchsorted(joint, station_m, side="right") - 1, 0, len(segments) - 1)
    east, north, tangent_east, tangent_north, curvature, length = segments[index].T
    along = station_m - joint[index]
    arc = along if accepted.loiter else np.minimum(along, length)
    on = along - arc
    half = 0.5 * curvature * arc
    chord = arc * np.sinc(half / np.pi)
    ahead = chord * np.cos(half) + on * np.cos(2 * half)
    left = chord * np.sin(half) + on * np.sin(2 * half)
    at_corner = (along < corner_m) & (joint[index] > station_m[0])
    bend = np.where(on > 0, 0.0, curvature) + np.where(at_corner, _corners(segments)[index] / corner_m, 0.0)
    return np.stack(
        (
            east + ahead * tangent_east - left * tangent_north,
            north + ahead * tangent_north + left * tangent_east,
            bend,
        )
    )


def _corners(segments: FloatArray) -> FloatArray:
    """(n,) angle by which the tangent jumps at the start of each segment, positive = left."""
    turn = segments[:-1, 4] * segments[:-1, 5]
    out = (segments[:-1, 2] + 1j * segments[:-1, 3]) * np.exp(1j * turn)
    jump = np.angle((segments[1:, 2] + 1j * segments[1:, 3]) / out)
    return np.append(0.0, np.where(np.abs(jump) > CORNER_RAD, jump, 0.0))
