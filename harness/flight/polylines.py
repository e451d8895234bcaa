"""Points along paths of lines and arcs, to be drawn and kept; and which points of a polyline are needed."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from planner.interface import ComplexArray, FloatArray

SAME_PLACE_M: Final = 0.01  # points no further apart than this are one point
SAME_LINE_M: Final = 0.01  # a point nearer than this to the line of its neighbours is taken to lie on it
ROUNDED_M: Final = 0.015  # so far from it lie points that are rounded to centimetres
CHORD_ERROR_M = 0.5  # drawn arcs are at most this far off


def polylines(paths: Sequence[FloatArray], chord_error_m: float = CHORD_ERROR_M) -> list[FloatArray]:
    """Returns points along paths, so dense that no chord leaves its arc by more than an error.

    A chord that spans the angle `a` of an arc of curvature `k` leaves it by (1 - cos(a / 2)) / k.

    Args:
        paths: each (n, 6), one at least, joined lines and arcs: start east, start north, unit tangent east, unit
            tangent north, curvature (1/m, positive = left), length (m).
        chord_error_m: largest distance between a chord and its arc.

    Returns:
        For each path (k, 2) points, the ends of every segment among them.
    """
    if not paths:
        return []
    east, north, tangent_east, tangent_north, curvature, length = np.concatenate(paths).T
    last = np.cumsum([len(path) for path in paths]) - 1
    bent = np.abs(curvature)
    sharpest = 2.0 * np.arccos(np.clip(1.0 - chord_error_m * bent, 0.0, 1.0))
    shares = np.divide(bent * length, sharpest, out=np.ones_like(bent), where=sharpest > 0)
    pieces = np.maximum(np.ceil(shares), 1)
    counts = pieces.astype(np.int64)
    counts[last] += 1  # the end of each path
    row = np.repeat(np.arange(len(counts)), counts)
    ends = np.cumsum(counts)
    station = (np.arange(len(row)) - (ends - counts)[row]) / pieces[row] * length[row]
    half = 0.5 * curvature[row] * station
    chord = station * np.sinc(half / np.pi)
    ahead, left = chord * np.cos(half), chord * np.sin(half)
    points = np.column_stack(
        (
            east[row] + ahead * tangent_east[row] - left * tangent_north[row],
            north[row] + ahead * tangent_north[row] + left * tangent_east[row],
        )
    )
    return [points[first:stop] for first, stop in pairwise((0, *ends[last].tolist()))]


def needed(points_m: FloatArray, tolerance_m: float = SAME_LINE_M) -> NDArray[np.int64]:
    """Returns the indices of the points that keep its shape, and where it turns back.

    After each comes the last whose chord is within the tolerance of those between, so that points that sample a curve
    evenly leave an even polyline; halves, as of Douglas and Peucker (1973), would not.
    """
    import shapely

    # Heights are not looked at: each point carries its number there.
    numbered = shapely.LineString(np.column_stack((points_m, np.arange(len(points_m)))))
    apart = shapely.get_coordinates(shapely.remove_repeated_points(numbered, SAME_PLACE_M), include_z=True)
    place = apart[:, 0] + 1j * apart[:, 1]
    leg = np.diff(place)
    # Where three points are within the tolerance of a chord, the middle one is within two of the others' chord.
    corner = np.abs((leg[1:] * np.conj(leg[:-1])).imag) > 2.0 * tolerance_m * np.abs(leg[1:] + leg[:-1])
    chosen, step = [0], 1
    for first, last in pairwise((0, *(1 + np.flatnonzero(corner)).tolist(), len(leg))):
        while chosen[-1] < last:
            step = _furthest(place[chosen[-1] : last + 1], step, tolerance_m)
            chosen.append(chosen[-1] + step)
        if chosen[-2] > first:  # the last chord, which may be short, shares the points of the one before
            half = (chosen[-3] + last) // 2
            if _serves(place[chosen[-3] : half + 1], tolerance_m) and _serves(place[half : last + 1], tolerance_m):
                chosen[-2] = half
    return np.asarray(apart[chosen, 2], np.int64)


def _furthest(place: ComplexArray, likely: int, tolerance_m: float) -> int:
    """Returns the index of the last place whose chord from the first serves; looks about `likely` first."""
    reach = 2 * likely
    while reach < len(place) and _serves(place[: reach + 1], tolerance_m):
        reach *= 2
    looked = range(2, min(reach + 1, len(place)))
    return 1 + bisect_left(looked, True, key=lambda last: not _serves(place[: last + 1], tolerance_m))


def _serves(place: ComplexArray, tolerance_m: float) -> bool:
    """Whether the chord from the first place to the last is near all between, and these go on along it."""
    chord = place[-1] - place[0]
    to = (place - place[0]) / (chord / abs(chord) if chord else 1.0)
    off = np.abs(to - np.clip(to.real, 0.0, abs(chord))) > tolerance_m
    return not (off | (to.real < np.maximum.accumulate(to.real) - tolerance_m)).any()
