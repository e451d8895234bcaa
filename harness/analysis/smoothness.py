"""How smooth a path is, planned and flown, in the same figures.

Both are brought to one form, a curvature profile: consecutive pieces of length `l_i` (m) and constant curvature `k_i`
(1/m, positive = left). A plan has this form already. A flown track gets it from the course over the ground, averaged
over `COURSE_WINDOW_S`, which is longer than the course jitter of turbulence and shorter than a turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from harness.flight.record import AcceptedPlan, FloatArray, Track
from planner.geometry.curves import along

if TYPE_CHECKING:
    from harness.run_files.run_tables import PlanRow

    FlownPlan = AcceptedPlan | PlanRow

COURSE_WINDOW_S = 1.0
"""Time over which the curvature rate is taken. The flown curvature is averaged over an odd number of rows' intervals,
the most that are no longer: 0.9 s at 10 Hz."""
CORNER_RAD = 1e-6  # a smaller change of tangent between two segments is rounding, not a corner
AWAY_RAD = math.radians(30.0)
"""A plan after the first is turned onto from this angle on: a gust may turn the aircraft off the one before."""
ROUNDING_M = 1e-6  # two joints of curvature profiles that are closer than this are taken for one


class Profile(NamedTuple):
    """Consecutive pieces of constant curvature, (n,) lengths and (n,) curvatures, positive = left."""

    length_m: FloatArray
    curvature_1pm: FloatArray


@dataclass(frozen=True)
class Smoothness:
    """Figures of a path; 0 for a straight one."""

    heading_change_deg: float  # total absolute change of direction, the sum of |k_i| l_i
    bending_energy_1pm: float
    """Integral of the squared curvature over the length, the sum of k_i^2 l_i (Horn, ACM TOMS 9, 1983)."""
    max_curvature_1pm: float  # largest |k_i|
    max_curvature_rate_1pm2: float
    """Largest |k(s + w) - k(s)| / w over a window w. The rate of curvature is what an aircraft turns into roll rate
    (Kanayama and Hartman, Smooth local path planning for autonomous vehicles, 1989); the window makes it finite where
    a line meets an arc."""


def smoothness(profile: Profile, window_m: float) -> Smoothness:
    """The figures of a curvature profile; `window_m` is the w of the curvature rate, > 0."""
    length, curvature = profile
    bent = np.abs(curvature)
    # Sums, not products of vectors: BLAS would wake its threads for these, which then spin for longer.
    return Smoothness(
        heading_change_deg=math.degrees(float((bent * length).sum())),
        bending_energy_1pm=float((bent * bent * length).sum()),
        max_curvature_1pm=float(bent.max(initial=0.0)),
        max_curvature_rate_1pm2=_max_rate(profile, window_m),
    )


def window_m(track: Track) -> float:
    """Returns the distance flown in `COURSE_WINDOW_S` at the mean ground speed."""
    return max(float(track.groundspeed_mps.mean()) * COURSE_WINDOW_S, 1e-3)


def flown_profile(track: Track) -> Profile:
    """Curvature profile of a flown track: course rate over ground speed.

    The curvature between rows i and i + 1 is minus the change of course, which is clockwise, over a window about them,
    divided by the distance flown in that window.
    """
    if len(track) < 2:
        return Profile(np.zeros(0), np.zeros(0))
    length = flown_lengths(track)
    station = np.append(0.0, np.cumsum(length))
    course = np.unwrap(np.radians(track.course_deg))
    half = max(round(0.5 * COURSE_WINDOW_S / float(np.median(np.diff(track.time_s)))), 1)
    piece = np.arange(len(length))
    first, last = np.maximum(piece - half + 1, 0), np.minimum(piece + half, len(length))
    distance = station[last] - station[first]
    change = course[first] - course[last]
    return Profile(length, np.divide(change, distance, out=np.zeros_like(distance), where=distance > 0))


def flown_lengths(track: Track) -> FloatArray:
    """(n - 1,) distances between consecutive rows, m."""
    return np.hypot(np.diff(track.east_m), np.diff(track.north_m))


def planned_profile(track: Track, plans: Sequence[FlownPlan], window_m: float) -> Profile:
    """Curvature profile of what was planned and in effect, plan after plan.

    Of every plan, the part between the stations at which it was taken up and replaced counts. A corner, within a plan
    or from one to the next, counts as an arc of length `window_m`.
    """
    pieces: list[tuple[float, float]] = []
    left: tuple[float, float] | None = None
    for index, start, end in stations_in_effect(track):
        if left is not None:
            pieces += _corner(left, tangent_of(plans[index], start), window_m)
        pieces += _stretch(plans[index], start, end, window_m)
        left = tangent_of(plans[index], end)
    length, curvature = np.array([each for each in pieces if each[0] > 0.0]).reshape(-1, 2).T
    return Profile(length, curvature)


def turn_onto_plan_1pm(track: Track, plans: Sequence[FlownPlan], window_m: float) -> float:
    """Curvature of the sharpest corner from the aircraft's course onto a plan that the rows take up; 0 without one."""
    turns = [0.0]
    for row in np.flatnonzero(np.diff(track.plan_index, prepend=-1) > 0).tolist():
        index, station_m = int(track.plan_index[row]), float(track.arc_length_m[row])
        course = math.radians(float(track.course_deg[row]))
        onto = _corner((math.sin(course), math.cos(course)), tangent_of(plans[index], station_m), window_m)
        if onto and station_m <= window_m and (index == 0 or abs(onto[0][1]) * window_m >= AWAY_RAD):
            turns.append(abs(onto[0][1]))
    return max(turns)


def polyline_profile(points_m: FloatArray, window_m: float) -> Profile:
    """Curvature profile of a polyline.

    The turn at a vertex is spread over half of the legs on either side of it, but over no more than
    `window_m`: vertices that sample a curve get its curvature, a corner between long legs that of a corner.
    """
    legs = np.diff(points_m[:, 0]) + 1j * np.diff(points_m[:, 1])
    length = np.abs(legs)
    turn = np.angle(legs[1:] / legs[:-1])
    half = np.minimum(0.5 * length, 0.5 * window_m)
    bent = half[:-1] + half[1:]
    lengths = np.zeros(2 * len(legs) - 1)
    curvatures = np.zeros_like(lengths)
    lengths[1::2] = bent
    lengths[::2] = length
    lengths[2::2] -= half[1:]
    lengths[:-1:2] -= half[:-1]
    curvatures[1::2] = turn / bent
    return Profile(lengths, curvatures)


def stations_in_effect(track: Track) -> list[tuple[int, float, float]]:
    """Which part of which plan was flown: (plan_index, first station, last station), in order of time.

    Between the last row of one plan and the first of the next the distance flown is given to the older plan.
    """
    index = track.plan_index
    starts = np.flatnonzero(np.diff(index, prepend=index[:1] - 1))
    ends = np.append(starts[1:], len(index)) - 1
    between = flown_lengths(track)
    stretches = []
    for first, last in zip(starts.tolist(), ends.tolist(), strict=True):
        if index[first] < 0:
            continue
        gap = float(between[last]) if last < len(between) else 0.0
        start, end = float(track.arc_length_m[first]), float(track.arc_length_m[last]) + gap
        stretches.append((int(index[first]), start, max(start, end)))
    return stretches


def _stretch(accepted: FlownPlan, start_m: float, end_m: float, window_m: float) -> list[tuple[float, float]]:
    """Length and curvature of pieces of a plan between two stations; beyond its end a line, or the circle again."""
    pieces: list[tuple[float, float]] = []
    begins, arrived = 0.0, None
    for row in accepted.segments.tolist():
        if arrived is not None and start_m < begins < end_m:
            pieces += _corner(arrived, row[2:4], window_m)
        ends = begins + row[5]
        pieces.append((min(ends, end_m) - max(begins, start_m), row[4]))
        begins, arrived = ends, along(row, row[5])[2:]
    pieces.append((end_m - max(start_m, begins), row[4] if accepted.loiter else 0.0))
    return pieces


def tangent_of(accepted: FlownPlan, arc_length_m: float) -> tuple[float, float]:
    """Unit tangent of a plan at a station; beyond its end that of the line, or the loiter circle, there."""
    *before, last = accepted.segments.tolist()
    away = max(arc_length_m, 0.0)
    for row in before:
        if away < row[5]:
            return along(row, away)[2:]
        away -= row[5]
    return along(last, away if accepted.loiter else min(away, last[5]))[2:]


def _corner(before: Sequence[float], after: Sequence[float], window_m: float) -> list[tuple[float, float]]:
    """Returns the arc, positive to the left, that counts for a change of direction; none for rounding."""
    (x0, y0), (x1, y1) = before, after
    angle = math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)
    return [(window_m, angle / window_m)] if abs(angle) > CORNER_RAD else []


def _max_rate(profile: Profile, window_m: float) -> float:
    """Largest |k(s + w) - k(s)| / w, exact for a piecewise constant k.

    The difference is itself piecewise constant; its joints are those of k, and those of k less w.
    """
    used = profile.length_m > 0
    length, curvature = profile.length_m[used], profile.curvature_1pm[used]
    joint = np.append(0.0, np.cumsum(length))
    edges = np.concatenate((joint, joint - window_m))
    edges = np.sort(edges[(edges >= 0.0) & (edges <= joint[-1] - window_m)], kind="stable")
    if not len(middle := 0.5 * (edges[:-1] + edges[1:])[np.diff(edges) > ROUNDING_M]):
        return 0.0
    pieces = (np.searchsorted(joint, at, side="right") - 1 for at in (middle, middle + window_m))
    here, there = (curvature[np.minimum(piece, len(length) - 1)] for piece in pieces)
    return float(np.abs(there - here).max() / window_m)
