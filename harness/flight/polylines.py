"""Points along paths of lines and arcs, to be drawn and kept."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from planner.interface import FloatArray

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
    pieces = np.maximum(
        np.ceil(np.divide(bent * length, sharpest, out=np.ones_like(bent), where=sharpest > 0)), 1
    )
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
