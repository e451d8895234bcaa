"""What a scan looked through: places, and cells of a grid. Compiled: see `planner.compiled`.

Most places that are asked were seen to be edges, or are hidden by them: what meets the ray towards one, or a
neighbour of that, is told by a bearing that need not be exact.
"""

from __future__ import annotations

import math

from planner.compiled import BOOL, BOOLS_OUT, COUNT, FLOAT, FLOATS, PLACES, compiled
from planner.interface import BoolArray, ComplexArray, FloatArray

CELLS, CELLS_OUT = "Array(boolean, 2, 'A', readonly=True)", "boolean[:, :]"
"""Parts of grids."""
NEARLY_RAD = 1e-5
"""Bearings by which `nearly_towards` finds a ray err by no more."""
TINY = 1e-300


@compiled(FLOAT, FLOAT, FLOAT, FLOAT)
def nearly_towards(east: float, north: float, start_rad: float, spacing_rad: float) -> int:
    """The ray towards a place, or the next one to either side; it may be one too many.

    The arc tangent is Hastings' polynomial (Abramowitz and Stegun, "Handbook of Mathematical Functions", 4.4.49).

    Args:
        east: of the place, from the sensor.
        north: of the place, from the sensor.
        start_rad: bearing of the first ray, in [0, 2 pi).
        spacing_rad: of the rays, more than twice `NEARLY_RAD`.
    """
    beside, ahead = abs(east), abs(north)
    ratio = min(beside, ahead) / max(beside, ahead, TINY)
    square = ratio * ratio
    bearing = 0.180141 + square * (-0.085133 + square * 0.0208351)
    bearing = ratio * (0.999866 + square * (-0.3302995 + square * bearing))
    if beside > ahead:
        bearing = 0.5 * math.pi - bearing
    if north < 0.0:
        bearing = math.pi - bearing
    if east < 0.0:
        bearing = math.tau - bearing
    clockwise = bearing - start_rad
    if clockwise < 0.0:
        clockwise += math.tau
    return int(clockwise / spacing_rad + 0.5)


@compiled(CELLS_OUT, CELLS, FLOATS, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT, BOOL, FLOAT, FLOAT)
def through_cells(
    seen: BoolArray,
    disc: BoolArray,
    ranges: FloatArray,
    x_first: float,
    y_first: float,
    cell: float,
    start_rad: float,
    spacing_rad: float,
    closed: bool,
    reach: float,
    noise: float,
) -> None:
    """Marks the cells of a disc about the sensor that all rays which meet them went beyond, and one to either side.

    So many rays to either side of the one towards its middle, or up to twice as many: 2^k - 1. The ends of the fan
    are joined.

    Args:
        seen: cells seen to be free.
        disc: of these, those to be asked.
        ranges: of all rays.
        x_first: corner of the first cell, from the sensor.
        y_first: corner of the first cell, from the sensor.
        cell: width of a cell.
        start_rad: bearing of the first ray.
        spacing_rad: of the rays.
        closed: the last ray is the neighbour of the first.
        reach: ranges count up to this one.
        noise: so much further than a cell the rays have to go.
    """
    rays, half, coarse = len(ranges), 0.75 * cell, spacing_rad > 2.0 * NEARLY_RAD
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
            if coarse:
                ray = nearly_towards(x, y, start_rad, spacing_rad)
                if 0 <= ray < rays and ranges[ray] <= beyond:
                    continue
            clockwise = math.atan2(x, y) - start_rad
            while clockwise < 0.0:
                clockwise += math.tau
            ray = round(clockwise / spacing_rad)
            level = math.ceil(half / spacing_rad / max(distance, half)) + 1
            if not closed and not level <= ray < rays - level:
                continue
            wide = 1
            while wide <= level:
                wide *= 2
            beside, left = (ray - wide + 1) % rays, 2 * wide - 1
            while left and ranges[beside] > beyond:
                beside = beside + 1 if beside + 1 < rays else 0
                left -= 1
            seen[column, row] = not left


@compiled(BOOLS_OUT, PLACES, FLOATS, FLOAT, FLOAT, FLOAT, FLOAT, BOOL, FLOAT, FLOAT, COUNT, FLOAT, COUNT)
def through_places(
    through: BoolArray,
    places: ComplexArray,
    ranges: FloatArray,
    east: float,
    north: float,
    start_rad: float,
    spacing_rad: float,
    closed: bool,
    within_m: float,
    sure_m: float,
    abreast: int,
    aimed_m: float,
    every: int,
) -> int:
    """How many places all rays to either side went beyond; `through` becomes true for these.

    Args:
        through: (k,) all false.
        places: (k,) east + i north.
        ranges: of all rays.
        east: of the sensor.
        north: of the sensor.
        start_rad: bearing of the first ray.
        spacing_rad: of the rays.
        closed: the last ray is the neighbour of the first.
        within_m: only nearer places are asked.
        sure_m: so much further than a place the rays have to go.
        abreast: so many rays to either side of the one towards it, one at least.
        aimed_m: how near that one passes by.
        every: only so many places on is one asked.
    """
    many, rays, coarse = 0, len(ranges), spacing_rad > 2.0 * NEARLY_RAD
    for i in range(0, len(places), every):
        dx, dy = places[i].real - east, places[i].imag - north
        distance = math.hypot(dx, dy)
        if distance >= within_m:
            continue
        if coarse:
            ray = nearly_towards(dx, dy, start_rad, spacing_rad)
            if 0 <= ray < rays and ranges[ray] <= distance + sure_m:
                continue
        clockwise = math.atan2(dx, dy) - start_rad
        while clockwise < 0.0:
            clockwise += math.tau
        towards = clockwise / spacing_rad
        ray = round(towards)
        if abs(towards - ray) * spacing_rad * distance >= aimed_m:
            continue
        if not closed and not abreast <= ray < rays - abreast:
            continue
        beside, left = (ray - abreast) % rays, 2 * abreast + 1
        while left and ranges[beside] > distance + sure_m:
            beside = beside + 1 if beside + 1 < rays else 0
            left -= 1
        if not left:
            through[i] = True
            many += 1
    return many
