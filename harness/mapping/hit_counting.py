"""What the hits of a scan count for on the grid of edges. Compiled: see `planner.compiled`.

Places are seen from the corner of the grid, east + i north, m. The number of a cell is its column times the rows of the
grid, plus its row.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.compiled import BOOL, COUNT, COUNTS_OUT, FLOAT, FLOATS, INTS, PLACES, PLACES_OUT, compiled
from planner.interface import ComplexArray, FloatArray, IntArray

CONFIRMED_SCORE = 2
"""An edge is believed from this score on. A hit adds one, and a scan that looks through takes one."""
CERTAIN_SCORE = 6  # scores do not rise above this
GAP_PARTS = 8
"""A gap between joined hits is split into this many parts; it spans no more cells, so points are one cell apart."""
CORNER_SINE = 0.3  # a wall has a corner where it turns away from the sensor by an angle of at least this sine

SCORES, SLOTS = "Array(int8, 1, 'C', readonly=True)", "Array(int32, 1, 'C', readonly=True)"
SCORES_OUT, SLOTS_OUT, PLACE = "int8[::1]", "int32[::1]", "complex128"


@compiled(INTS, PLACES, SCORES, SLOTS, FLOAT, COUNT, COUNT, BOOL, FLOAT, COUNT)
def new_edges(
    hits: IntArray,
    places: ComplexArray,
    score: NDArray[np.int8],
    slot: NDArray[np.int32],
    cell_m: float,
    rows: int,
    rays: int,
    closed: bool,
    join_m: float,
    first_score: int,
) -> tuple[IntArray, ComplexArray]:
    """Returns cells and places to be counted: hits that are not certain, and points between hits that are joined.

    (n,) `hits` are the rays that met something, `places` where they did. `score` and `slot` are by cell, the latter
    negative where it has no point. `closed` means that the last hit is the neighbour of the first. Hits nearer to each
    other than `join_m` are joined. A cell that was hit has at least `first_score`, unless it was looked through.
    """
    n, per_m = len(hits), 1.0 / cell_m
    cells, uncertain = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.bool_)
    fresh = 0
    for i in range(n):
        cells[i] = int(places[i].real * per_m) * rows + int(places[i].imag * per_m)
        uncertain[i] = score[cells[i]] < CERTAIN_SCORE
        fresh += uncertain[i]
    wide, gaps = np.empty(n, dtype=np.int64), 0
    for i in range(n if closed else n - 1):
        j = (i + 1) % n
        if uncertain[i] or uncertain[j]:
            missing, gap_m = hits[j] - hits[i], abs(places[j] - places[i])
            # One ray may be missing between neighbours: a lost return does not open a wall.
            if (missing if j else missing + rays) <= 2 and cell_m < gap_m < join_m:
                wide[gaps] = i
                gaps += 1
    most = fresh + (GAP_PARTS - 1) * gaps
    counted, found = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.complex128)
    k = 0
    for i in range(n):
        if uncertain[i]:
            counted[k], found[k] = cells[i], places[i]
            k += 1
    for part in range(1, GAP_PARTS):
        for gap in range(gaps):
            i, share = wide[gap], part / GAP_PARTS
            # In real numbers: numba takes a tenth of a second to compile a product of complex ones.
            way = places[(i + 1) % n] - places[i]
            east, north = places[i].real + share * way.real, places[i].imag + share * way.imag
            cell = int(east * per_m) * rows + int(north * per_m)
            # Where one was looked through, it is not put again: what ends there is seen to end there.
            if slot[cell] < 0 or score[cell] >= first_score:
                counted[k], found[k] = cell, complex(east, north)
                k += 1
    return counted[:k], found[:k]


@compiled(INTS, PLACES, FLOATS, FLOAT, BOOL, FLOAT, BOOL)
def ends(
    hits: IntArray,
    places: ComplexArray,
    ranges: FloatArray,
    cell_m: float,
    closed: bool,
    join_m: float,
    corners: bool,
) -> IntArray:
    """Returns the indices of hits at an end of an outline, as the sensor sees it; one may be there several times.

    Hits and places are those of `new_edges`, `ranges` of all rays. With `corners` a wall that turns away from the
    sensor ends there, too, though both of its sides are in sight.
    """
    n, rays = len(hits), len(ranges)
    pairs = n if closed else n - 1
    step, gap_m = np.empty(pairs, dtype=np.complex128), np.empty(pairs)
    joined = np.empty(pairs, dtype=np.bool_)
    found, k = np.empty(4 * n + 2, dtype=np.int64), 0
    for i in range(pairs):
        j = (i + 1) % n
        step[i] = places[j] - places[i]
        gap_m[i] = abs(step[i])
        joined[i] = gap_m[i] < join_m and hits[j] - hits[i] + rays * (j == 0) <= 2
        if not joined[i]:
            found[k] = i
            k += 1
    for end in range(k):
        found[k + end] = (found[end] + 1) % n
    k *= 2
    if not closed:
        found[k], found[k + 1] = 0, n - 1
        k += 2
    for i in range(n - pairs, pairs if corners else 0):  # only a closed outline has a step before its first
        turn = step[i].imag * step[i - 1].real - step[i].real * step[i - 1].imag
        if joined[i - 1] & joined[i] & (turn > CORNER_SINE * gap_m[i] * gap_m[i - 1]):
            found[k] = i
            k += 1
    for i in range(pairs):
        # A hit that stands before something that it is joined to is an end too.
        if joined[i] and gap_m[i] > cell_m:
            j = (i + 1) % n
            found[k] = j if ranges[hits[i]] > ranges[hits[j]] else i
            k += 1
    return found[:k]


@compiled(INTS, PLACES, SCORES_OUT, SLOTS_OUT, PLACES_OUT, COUNTS_OUT, COUNTS_OUT, COUNT, COUNT, COUNT, PLACE)
def count_hits(
    cells: IntArray,
    places: ComplexArray,
    score: NDArray[np.int8],
    slot: NDArray[np.int32],
    points: ComplexArray,
    cell_of: IntArray,
    since: IntArray,
    known: int,
    revision: int,
    first_score: int,
    corner: complex,
) -> tuple[int, int, bool]:
    """Counts hits: a cell gets a point with the first, and is an edge as soon as it is believed.

    Each of (k,) cells counts once, and the first of the places in it. By cell: `score`, and `slot`, negative where it
    has no point. By slot, with room for k more: `points`, east + i north, the cell that it is of, and `since`, the
    revision at which it became an edge. `known` slots are in use; the first hit raises a score to `first_score` at
    least.

    Returns:
        How many slots are in use now; the revision now; whether a cell was hit that has yet to be believed.
    """
    before = np.empty(len(cells), dtype=np.int64)
    for i in range(len(cells)):
        before[i] = score[cells[i]]
    unconfirmed, raised = False, 0
    for i in range(len(cells)):
        if before[i] >= CERTAIN_SCORE:
            continue
        cell, risen = cells[i], max(before[i] + 1, first_score)
        score[cell] = risen
        if slot[cell] < 0:
            slot[cell], cell_of[known], points[known], since[known] = known, cell, places[i] + corner, 0
            known += 1
        if risen < CONFIRMED_SCORE:
            unconfirmed = True
        elif before[i] < CONFIRMED_SCORE:
            raised = 1
            since[slot[cell]] = revision + 1
    return known, revision + raised, unconfirmed
