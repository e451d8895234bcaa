"""How far a flown track and the path that was given are from one another, both ways.

Every row of the track is measured against the path, and every point of the path against the track: none may be left
out. A point is compared with that part of the other line which is about as far along: who takes another leg of a path
that comes by again has not flown this one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from harness.flight.record import FloatArray, Track
from harness.run_files.given_path import CutCorner

Rows = np.ndarray[tuple[int], np.dtype[np.intp]]

POINTS_PER_BLOCK = 64
"""This many points are measured together: the part of the other line that is near them is short and fits the cache."""
MOST_SAMPLES = 400_000  # a path has no more points measured than this, however long it is

CORNER_REACH = 3.0  # a corner's limit holds up to this many limits before and behind it on the path


@dataclass(frozen=True, eq=False)
class Deviation:
    """Distances between a track and the path as given."""

    rows_m: FloatArray  # (n,) of each row of the track from the path
    points_m: FloatArray  # (k,) of points along the path from the track, as far along it as the flight came
    point_rows: Rows  # (k,) the row of the track that is as far along as each of these

    @property
    def by_row_m(self) -> FloatArray:
        """(n,) for each row the larger of its own distance and those of the points of the path that belong to it."""
        largest = self.rows_m.copy()
        np.maximum.at(largest, self.point_rows, self.points_m)
        return largest

    def figures(self) -> dict[str, float | None]:
        """95th percentile and maximum of all of them; None where nothing was flown."""
        every = error_figures(np.concatenate((self.rows_m, self.points_m)))
        return {name: every[name] for name in ("p95", "max")}


def error_figures(error: FloatArray) -> dict[str, float | None]:
    """rms, 95th percentile and maximum of an absolute error, NaN left out; None without a value."""
    if not len(size := np.abs(error[np.isfinite(error)])):
        return {"rms": None, "p95": None, "max": None}
    return {
        "rms": math.sqrt(float(np.mean(size * size))),
        "p95": float(np.percentile(size, 95)),
        "max": float(size.max()),
    }


def deviation(track: Track, given_m: FloatArray, spacing_m: float, window_m: float) -> Deviation:
    """Measures a track, as far as the path's end, against the path (k, 3) and back, up to `window_m` further along."""
    # What is flown beyond the end is no part of the path.
    flown = np.flatnonzero(track.arc_length_m <= given_m[-1, 2])
    rows = np.full(len(track), math.nan)
    if not len(flown):
        return Deviation(rows, np.zeros(0), np.zeros(0, dtype=np.intp))
    line = np.column_stack((track.east_m[flown], track.north_m[flown], track.arc_length_m[flown]))
    line[:, 2] = np.maximum.accumulate(line[:, 2])
    rows[flown] = distances_m(line, given_m, window_m)
    points = _along(given_m, spacing_m)
    points = points[points[:, 2] <= line[-1, 2]]
    return Deviation(rows, distances_m(points, line, window_m), flown[_rows_at(line[:, 2], points[:, 2])])


class Stations:
    """The rows of a track by how far along its path they are."""

    def __init__(self, track: Track) -> None:
        self._along_m = track.arc_length_m
        self._flown = np.flatnonzero(np.isfinite(self._along_m))
        along = self._along_m[self._flown]
        # Both rise, so that the rows about a place are found without a look at all others.
        self._furthest_m = np.maximum.accumulate(along)
        self._least_ahead_m = np.minimum.accumulate(along[::-1])[::-1]
        self.reached_m = float(along.max(initial=-math.inf))

    def at_corner(self, corner: CutCorner) -> Rows:
        """(k,) the rows that are held against a corner's limit: those about it, and at least the one that passes it.

        They reach one limit further than the planned path is off the corner's legs, and at least `CORNER_REACH` limits
        to each side: within these an aircraft that overshoots has come back to the next leg.
        """
        reach_m = max(corner.half_m + corner.allowed_cut_m, CORNER_REACH * corner.allowed_cut_m)
        at_m, wider_m = corner.arc_length_m, 1.001 * reach_m
        first = np.searchsorted(self._furthest_m, at_m - wider_m)
        near = self._flown[first : np.searchsorted(self._least_ahead_m, at_m + wider_m, side="right")]
        near = near[np.abs(self._along_m[near] - at_m) <= reach_m]
        return np.union1d(near, self._flown[_rows_at(self._furthest_m, at_m)] if len(self._flown) else near)

    def allowed_m(self, tolerance_m: float, corners: Iterable[CutCorner]) -> FloatArray:
        """(n,) what each row may be off the path as given: the tolerance, or what all corners about it allow."""
        of_corners = np.full(len(self._along_m), np.inf)
        for corner in corners:
            rows = self.at_corner(corner)
            of_corners[rows] = np.minimum(of_corners[rows], corner.allowed_cut_m)
        return np.where(np.isfinite(of_corners), of_corners, tolerance_m)


def distances_m(points: FloatArray, line: FloatArray, window_m: float) -> FloatArray:
    """(n,) distances of points (n, 3) from those parts of a line (k, 3) that are as far along, within `window_m`."""
    line = np.concatenate((line, line[-1:])) if len(line) == 1 else line
    along = line[:, 2]
    found = np.empty(len(points))
    for first in range(0, len(points), POINTS_PER_BLOCK):
        block = points[first : first + POINTS_PER_BLOCK]
        low, high = block[:, 2].min() - window_m, block[:, 2].max() + window_m
        begin = int(np.clip(np.searchsorted(along, low, side="right") - 1, 0, len(line) - 2))
        end = int(np.clip(np.searchsorted(along, high, side="left"), begin + 1, len(line) - 1))
        found[first : first + POINTS_PER_BLOCK] = _block_distances(block, line[begin : end + 1], window_m)
    return found


def _rows_at(along_m: FloatArray, at_m: FloatArray | float) -> Rows:
    """Finds the first row that is at least so far along, for each of `at_m`, or the last row where none is."""
    return np.minimum(np.searchsorted(along_m, at_m), len(along_m) - 1)


def _block_distances(points: FloatArray, line: FloatArray, window_m: float) -> FloatArray:
    """`distances_m` of a few points from a short line. The part of an edge outside of the window is left out."""
    (east, north, along), (step_east, step_north, step) = line[:-1].T, np.diff(line, axis=0).T
    off_east, off_north = points[:, :1] - east, points[:, 1:2] - north
    share = (off_east * step_east + off_north * step_north) / np.maximum(step_east**2 + step_north**2, 1e-18)
    ahead = points[:, 2:] - along
    length = np.maximum(step, 1e-9)
    lowest, highest = (ahead - window_m) / length, (ahead + window_m) / length
    inside = (lowest <= 1.0) & (highest >= 0.0)
    # The nearest edge counts where none is in the window: before the line's begin and beyond its end.
    inside |= ~inside.any(axis=1, keepdims=True)
    share = np.clip(share, np.clip(lowest, 0.0, 1.0), np.clip(highest, 0.0, 1.0))
    away = np.hypot(off_east - share * step_east, off_north - share * step_north)
    return np.asarray(np.where(inside, away, np.inf).min(axis=1))


def _along(line: FloatArray, spacing_m: float) -> FloatArray:
    """(k, 3) points along a line, its vertices among them, at most `spacing_m` or length / `MOST_SAMPLES` apart."""
    length = np.hypot(*np.diff(line[:, :2], axis=0).T)
    spacing = max(spacing_m, float(length.sum()) / MOST_SAMPLES)
    pieces = np.maximum(np.ceil(length / spacing), 1.0).astype(np.intp)
    edge = np.repeat(np.arange(len(length)), pieces)
    share = (np.arange(len(edge)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) / pieces[edge]
    return np.concatenate((line[edge] + share[:, None] * (line[edge + 1] - line[edge]), line[-1:]))
