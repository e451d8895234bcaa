"""A wave that spreads through a grid and finds distances to go; compiled, see `planner.kernels`."""

from __future__ import annotations

import math

from planner.compiled import BOOLS_OUT, COUNT, COUNTS_OUT, FLOAT, FLOATS, FLOATS_OUT, POINT, ROWS, compiled
from planner.interface import BoolArray, FloatArray, IntArray

CORNER_LEVELS = (2, 4)
"""These two of five levels of the wave spread to all 8 neighbours of a cell, the others to 4: a counted length is then
between 1.01 and 0.92 of the true length of a way, to a cell."""


@compiled(BOOLS_OUT, ROWS, FLOATS, POINT, FLOAT, COUNT, COUNT)
def close_cells(
    open_: BoolArray,
    points: FloatArray,
    keep: FloatArray,
    corner: tuple[float, float],
    cell: float,
    columns: int,
    rows: int,
) -> None:
    """Closes cells of the grid from its south-west corner that lie wholly within the distance `keep` of a point."""
    for i in range(len(points)):
        x, y, within = points[i, 0] - corner[0], points[i, 1] - corner[1], keep[i] - math.sqrt(0.5) * cell
        if within <= 0.0:
            continue
        for column in range(max(int((x - within) / cell), 0), min(int((x + within) / cell) + 1, columns - 2)):
            east = (column + 0.5) * cell - x
            for row in range(max(int((y - within) / cell), 0), min(int((y + within) / cell) + 1, rows - 2)):
                north = (row + 0.5) * cell - y
                if east * east + north * north < within * within:
                    open_[(column + 1) * rows + row + 1] = False


@compiled(FLOATS_OUT, BOOLS_OUT, COUNTS_OUT, COUNTS_OUT, COUNT, COUNT)
def spread_wave(levels: FloatArray, open_: BoolArray, order: IntArray, state: IntArray, rows: int, most: int) -> None:
    """Spreads the wave by `most` cells and on to the end of a level.

    `levels`, `open_` (the wave may go there, and has not) are of each cell; `order` are cells as the wave came to them.
    `state` is the level, the first in that order that has yet to go on to what touches it at a corner, where the last
    level begins, and where it ends.
    """
    level, cornered, begin, end = state
    enough = end + most
    while cornered < end < enough:
        level += 1
        corners = level % 5 in CORNER_LEVELS
        # What touches only at a corner is come to later, from all that was new since the last time.
        front, begin = (cornered if corners else begin), end
        for i in range(front, begin):
            for across in (-rows, 0, rows):
                for up in (-1, 0, 1):
                    cell = order[i] + across + up
                    if open_[cell] and (corners or not (across and up)):
                        open_[cell] = False
                        levels[cell] = level
                        order[end] = cell
                        end += 1
        if corners:
            cornered = begin
    # One by one: a slice would have numba compile the text of an error that cannot be, for seconds.
    state[0], state[1], state[2], state[3] = level, cornered, begin, end
