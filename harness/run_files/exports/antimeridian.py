"""A path in pieces, none of which crosses the antimeridian (180 degrees): RFC 7946, section 3.1.9, wants them so."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from harness.flight.record import FloatArray
from harness.run_files.exports.exported_path import ExportedPath

HALF_TURN_DEG: Final = 180.0
HALVINGS: Final = 40
"""Of a segment, until the place of its crossing is known to less than a micrometre."""
HEADINGS: Final = ("course_deg", "heading_deg")
"""Attributes that go on at 0 after 360."""


def pieces(path: ExportedPath) -> list[ExportedPath]:
    """The path cut wherever it crosses 180 degrees; one piece where it does not.

    A piece ends and the next begins at the place where the segment, a straight line in the plane, crosses: the one at
    180, the other at -180 degrees, or the other way round. Their time, altitude and attributes are linear in the
    segment; the index of the plan is the one before it.
    """
    before = np.flatnonzero(np.abs(np.diff(path.longitude_deg)) > HALF_TURN_DEG).tolist()
    shares = [_crossing(path, row) for row in before]
    found = []
    for first, last in zip([None, *range(len(before))], [*range(len(before)), None], strict=True):
        begin = 0 if first is None else before[first] + 1
        end = len(path.latitude_deg) if last is None else before[last] + 1
        head = None if first is None or shares[first] == 1.0 else (before[first], shares[first])
        tail = None if last is None or shares[last] == 0.0 else (before[last], shares[last])
        piece = _piece(path, begin, end, head, tail)
        if len(piece.latitude_deg) > 1:
            found.append(piece)
    return found


def _crossing(path: ExportedPath, row: int) -> float:
    """Share of the segment after a row at which it crosses; exactly 0 or 1 where that end lies on 180 degrees."""
    start, end = path.points_m[row], path.points_m[row + 1]
    if abs(path.longitude_deg[row]) == HALF_TURN_DEG:
        return 0.0
    if abs(path.longitude_deg[row + 1]) == HALF_TURN_DEG:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        longitude = path.plane.geodetic(*(start + middle * (end - start)).tolist())[1]
        if longitude * path.longitude_deg[row] > 0.0:
            low = middle
        else:
            high = middle
    return low


def _piece(
    path: ExportedPath,
    begin: int,
    end: int,
    head: tuple[int, float] | None,
    tail: tuple[int, float] | None,
) -> ExportedPath:
    """Rows `begin` to before `end`, after a crossing and before another: row before it, share of its segment."""

    def column(values: FloatArray, turn: float = 0.0) -> FloatArray:
        ends = [_between(values, *each, turn) if each else values[:0] for each in (head, tail)]
        return np.concatenate((ends[0], values[begin:end], ends[1]))

    points = np.column_stack([column(path.points_m[:, axis]) for axis in (0, 1)])
    longitude, latitude = column(path.longitude_deg), column(path.latitude_deg)
    for place, inner in ((0, begin), (-1, end - 1)):
        if (head if place == 0 else tail) is not None:
            latitude[place] = path.plane.geodetic(*points[place].tolist())[0]
            longitude[place] = math.copysign(HALF_TURN_DEG, path.longitude_deg[inner])
    attributes = {
        name: column(values, 360.0 if name in HEADINGS else 0.0) for name, values in path.attributes.items()
    }
    for place, crossing in ((0, head), (-1, tail)):
        if crossing is not None and "plan_index" in attributes:
            attributes["plan_index"][place] = path.attributes["plan_index"][crossing[0]]
    return replace(
        path,
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=column(path.altitude_m),
        points_m=points,
        time_s=column(path.time_s),
        attributes=attributes,
    )


def _between(values: FloatArray, row: int, share: float, turn: float) -> FloatArray:
    """(1,) value at a share of the way from a row to the next, the first where one is not finite.

    Of angles it goes the shorter way, where a turn is given.
    """
    if not np.isfinite(values[row : row + 2]).all():  # the clearance where there is no obstacle
        return values[row : row + 1]
    change = values[row + 1] - values[row]
    if turn:
        return np.array([(values[row] + share * math.remainder(change, turn)) % turn])
    return np.array([values[row] + share * change])
