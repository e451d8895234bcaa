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


@compiled(COUNTED_OUT, "int32", FLOAT, FLOAT, FLOAT, rare=True)
def _count(counts: NDArray[np.float32], slot: int, beyond: float, half: float, noise: float) -> None:
    """Counts a ray that went so much further than a cell: it was stopped, passed, or ended before it."""
    if abs(beyond) <= half:
        counts[slot, 0] += np.float32(1.0)
    elif beyond > half:
        counts[slot, 1] += np.float32(1.0)
    elif beyond > -half - 2.0 * noise:
        counts[slot, 2] += np.float32(1.0)


@compiled(CELLS_OUT, CELLS, FLOATS, FLOATS, FLOATS, FLAGS, COUNTED_OUT, *[FLOAT] * 5, BOOL, rare=True)
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

    Of the cells that are asked, `slots`, those that a ray was aimed at are written to `counted`. `distances` (m) and
    `positions`, bearings in rays from the first on, are by cell; `counts` (n, 3), which is written, by slot. `ignored`
    rays are not counted; it may be empty. `half` is half the width of a cell; cells beyond `within` are not asked;
    counts are halved from `forget_at` on.

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
            _count(counts, slot, ranges[other] - distance, half, noise)
        if counts[slot, 0] + counts[slot, 1] + counts[slot, 2] > forget_at:
            for column in range(3):
                counts[slot, column] *= np.float32(0.5)
    return many


@compiled(
    FLAGS_OUT, "Array(int64, 2, 'C', readonly=True)", CELLS, FLAGS, FLOATS, COUNT, COUNT, FLOAT, rare=True
)
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

    (k, 2) `cells` are columns and rows, of which `reach` more to each side are near; what lies off the grid counts as
    lying at its border. `slots` are those of all cells, column after column, negative where there is none; by slot is
    told whether it is an edge, and since when. An edge for long has been one since `until_s`.
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
