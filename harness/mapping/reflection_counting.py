"""What the rays of a noisy scan did to cells of the plane. Compiled: see `planner.compiled`.

Counts are single-precision numbers: rays that a cell stopped, that it let through, and that ended before it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.compiled import BOOL, COUNT, FLOAT, FLOATS, compiled
from planner.interface import BoolArray, FloatArray

CELLS, CELLS_OUT = "Array(int32, 1, 'C', readonly=True)", "int32[::1]"
COUNTED_OUT, FLAGS, FLAGS_OUT = "float32[:, ::1]", "Array(boolean, 1, 'C', readonly=True)", "boolean[::1]"


@compiled(
    CELLS_OUT, CELLS, FLOATS, FLOATS, FLOATS, FLAGS, COUNTED_OUT, FLOAT, FLOAT, FLOAT, FLOAT, FLOAT, BOOL
)
def count_rays(
    counted: NDArray[np.int32],
    slots: NDArray[np.int32],
    distances: FloatArray,
    positions: FloatArray,
    ranges: FloatArray,
    ignored: BoolArray,
    counts: NDArray[np.float32],
    half: float,
    spacing_rad: float,
    within: float,
    noise: float,
    forget_at: float,
    closed: bool,
) -> int:
    """Counts what the rays towards cells did. Near by, where several rays meet a cell, two more of them are asked.

    Args:
        counted: the slots of the cells that a ray was aimed at; written.
        slots: of the cells that are asked.
        distances: of each,
        positions: and its bearing, in rays from the first on.
        ranges: of all rays.
        ignored: of all rays, those not to be counted; none of them where it is empty.
        counts: (n, 3) of all cells, by slot; written.
        half: half the width of a cell.
        spacing_rad: of the rays.
        within: cells further away are not asked.
        noise: standard deviation of ranges.
        forget_at: counts are halved from so many on.
        closed: the last ray is the neighbour of the first.

    Returns:
        How many are counted.
    """
    rays, many = len(ranges), 0
    for i in range(len(slots)):
        distance, ray = distances[i], int(np.rint(positions[i]))
        if not (abs(positions[i] - ray) * spacing_rad * distance < half and distance < within):
            continue
        if not closed and ray >= rays:
            continue
        ray %= rays
        if len(ignored) and ignored[ray]:
            continue
        slot = slots[i]
        counted[many] = slot
        many += 1
        aside = int(0.7 * half / spacing_rad / max(distance, half))
        for side in range(-1, 2 if aside >= 1 else 0):
            # The ray itself comes first.
            other = ray + (0 if side == -1 else (2 * side - 1) * aside)
            other = other % rays if closed else min(max(other, 0), rays - 1)
            beyond = ranges[other] - distance
            if abs(beyond) <= half:
                counts[slot, 0] += np.float32(1.0)
            elif beyond > half:
                counts[slot, 1] += np.float32(1.0)
            elif beyond > -half - 2.0 * noise:
                counts[slot, 2] += np.float32(1.0)
        if counts[slot, 0] + counts[slot, 1] + counts[slot, 2] > forget_at:
            for column in range(3):
                counts[slot, column] *= np.float32(0.5)
    return many


@compiled(FLAGS_OUT, CELLS, "Array(float32, 2, 'C', readonly=True)", FLAGS, FLOAT, FLOAT, FLOAT, FLOAT)
def decide(
    edges: BoolArray,
    slots: NDArray[np.int32],
    counts: NDArray[np.float32],
    was: BoolArray,
    least_stopped: float,
    least_share: float,
    short: float,
    doubt: float,
) -> None:
    """Tells which cells are edges now.

    Args:
        edges: (k,) whether each cell is; written.
        slots: (k,) of the cells.
        counts: (n, 3) of all cells, by slot.
        was: (n,) whether each was an edge.
        least_stopped: an edge stopped so many rays at least,
        least_share: and this share of those that reached it.
        short: a ray that ended before it counts for so much of one that it stopped.
        doubt: what is an edge remains one down to this part of both.
    """
    for i in range(len(slots)):
        slot = slots[i]
        stopped = np.float32(counts[slot, 0] + np.float32(short) * counts[slot, 2])
        reached = np.float32(stopped + counts[slot, 1])
        share = doubt if was[slot] else 1.0
        edges[i] = stopped >= share * least_stopped and stopped >= share * least_share * reached


@compiled(FLAGS_OUT, "Array(int64, 2, 'C', readonly=True)", CELLS, FLAGS, FLOATS, COUNT, COUNT, FLOAT)
def find_long(
    found: BoolArray,
    cells: NDArray[np.int64],
    slots: NDArray[np.int32],
    edges: BoolArray,
    since_s: FloatArray,
    columns: int,
    reach: int,
    until_s: float,
) -> None:
    """Tells which cells lie near one that has been an edge for long.

    Args:
        found: (k,) whether each is; written.
        cells: (k, 2) their columns and rows; what lies off the grid counts as lying at its border.
        slots: of all cells, column after column; negative where there is none.
        edges: by slot, whether each is an edge,
        since_s: and since when.
        columns: of the grid.
        reach: so many columns and rows further is near.
        until_s: an edge for long has been one since then.
    """
    rows = len(slots) // columns
    for i in range(len(cells)):
        for x in range(cells[i, 0] - reach, cells[i, 0] + reach + 1):
            column = min(max(x, 0), columns - 1)
            for y in range(cells[i, 1] - reach, cells[i, 1] + reach + 1):
                slot = slots[column * rows + min(max(y, 0), rows - 1)]
                if slot >= 0 and edges[slot] and since_s[slot] <= until_s:
                    found[i] = True
                    break
            if found[i]:
                break
