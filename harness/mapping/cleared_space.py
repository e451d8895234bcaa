"""What a scan looked through: places, and cells of a grid. Compiled: see `planner.compiled`.

`beams` are those of the scan, as `harness.mapping.scan.RangeScan.beams` has them; bearings are clockwise from the axis
of the first one, in [0, 2 pi).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from harness.mapping.scan import Beams
from planner.compiled import COUNT, FLOAT, FLOATS, PLACES, compiled
from planner.interface import BoolArray, ComplexArray, FloatArray

FLAGS, FLAGS_OUT, LOOKS_OUT = "Array(boolean, 2, 'A', readonly=True)", "boolean[:, :]", "uint8[:, :]"
"""Numba types of parts of grids; _OUT is written to."""
BEAMS = "UniTuple(float64, 5)"  # numbers that describe the beams of a scan


@compiled(FLOAT, FLOAT, FLOAT, COUNT, inner=True)
def first_over(bearing_rad: float, spacing_rad: float, beam_rad: float, aside: int) -> int:
    """Returns the last beam that begins before a bearing, less `aside`; where beams do not touch, it may end before it.

    Beams are counted from the first, and the bearing is clockwise from the axis of the first beam.
    """
    return math.floor((bearing_rad + 0.5 * min(beam_rad, spacing_rad)) / spacing_rad) - aside


@compiled(FLOAT, FLOAT, FLOAT, inner=True)
def clockwise_of(east: float, north: float, start_rad: float) -> float:
    """Returns the bearing (rad) of an offset, clockwise from `start_rad`, in [0, 2 pi)."""
    turned = math.atan2(east, north) - start_rad
    while turned < 0.0:
        turned += math.tau
    return turned


@compiled(FLOATS, COUNT, COUNT, FLOAT, inner=True)
def first_short(ranges: FloatArray, first: int, many: int, beyond: float) -> int:
    """Returns the first of `many` neighbouring beams that does not go beyond a distance; -1 where all do."""
    rays = len(ranges)
    beside = first % rays
    for _ in range(many):
        if not ranges[beside] > beyond:
            return beside
        beside = beside + 1 if beside + 1 < rays else 0
    return -1


@compiled(FLAGS_OUT, LOOKS_OUT, FLAGS, FLOATS, BEAMS, *[FLOAT] * 5, COUNT, COUNT)
def through_cells(
    seen: BoolArray,
    looks: NDArray[np.uint8],
    disc: BoolArray,
    ranges: FloatArray,
    beams: Beams,
    x_low: float,
    y_low: float,
    cell: float,
    reach: float,
    noise: float,
    aside: int,
    needed: int,
) -> None:
    """Marks the cells of a disc about the sensor if all beams that meet them went beyond.

    Beams that touch cover all of a cell. Where they do not, one more to either side has to go beyond it, and the caller
    chooses `reach` so that nothing is narrow enough to be missed between them.

    Only the cells of `disc` that are not yet `seen` to be free are tested. `looks` counts how often each was looked
    through, and `needed` times make it free. The first cell's corner lies at `x_low`, `y_low`. Ranges count up to
    `reach`; beams have to go beyond a cell by `noise`, and so have `aside` more to either side.
    """
    east, north, start_rad, spacing_rad, beam_rad = beams
    rays, half, x_first, y_first = len(ranges), 0.75 * cell, x_low - east, y_low - north
    closed = rays * spacing_rad > math.tau - 1e-9
    for column in range(seen.shape[0]):
        x = (column + 0.5) * cell + x_first
        for row in range(seen.shape[1]):
            # Most of what is in reach has been seen from the places before.
            if seen[column, row] or not disc[column, row]:
                continue
            y = (row + 0.5) * cell + y_first
            distance = math.sqrt(x * x + y * y)
            beyond = distance + half + noise
            if beyond >= reach:
                continue
            clockwise = clockwise_of(x, y, start_rad)
            wide = math.asin(half / distance) if distance > half else math.pi
            first = first_over(clockwise - wide, spacing_rad, beam_rad, aside)
            # Seen from the other side, the last is the first.
            last = -first_over(-clockwise - wide, spacing_rad, beam_rad, aside)
            many = min(last - first + 1, rays)
            if not closed and (many == rays or not 0 <= first <= last < rays):
                continue
            short = first_short(ranges, first, many, beyond)
            if short < 0:
                looks[column, row] += 1
                seen[column, row] = looks[column, row] >= needed
            elif ranges[short] > distance - half - noise:
                looks[column, row] = 0


@compiled(PLACES, FLOATS, BEAMS, FLOAT, FLOAT, COUNT, FLOAT, COUNT)
def through_places(
    places: ComplexArray,
    ranges: FloatArray,
    beams: Beams,
    within_m: float,
    sure_m: float,
    abreast: int,
    aimed_m: float,
    every: int,
) -> BoolArray:
    """Tells which of (k,) places, east + i north, all beams to either side went beyond.

    Only one place in `every` is tested, and only if it is nearer than `within_m`. The beam towards a place and
    `abreast` to either side have to go further by `sure_m`, and the middle of that one beam to pass by no further than
    `aimed_m`.
    """
    east, north, start_rad, spacing_rad, beam_rad = beams
    through, rays = np.zeros(len(places), dtype=np.bool_), len(ranges)
    closed = rays * spacing_rad > math.tau - 1e-9
    for i in range(0, len(places), every):
        dx, dy = places[i].real - east, places[i].imag - north
        distance = math.hypot(dx, dy)
        if distance >= within_m:
            continue
        towards = clockwise_of(dx, dy, start_rad) / spacing_rad
        ray = round(towards)
        if (abs(towards - ray) * spacing_rad - 0.5 * beam_rad) * distance >= aimed_m:
            continue
        if not closed and not abreast <= ray < rays - abreast:
            continue
        through[i] = first_short(ranges, ray - abreast, 2 * abreast + 1, distance + sure_m) < 0
    return through
