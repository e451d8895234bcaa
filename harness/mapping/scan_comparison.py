"""What differs between two scans: what has come to places that one looked through, and what has gone.

Places are complex: east + i north, m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from harness.mapping.cleared_space import through_places
from harness.mapping.scan import RangeScan, all_round, clockwise_from
from harness.mapping.scan_matching import FEWEST
from planner.compiled import FLOAT, PLACES, compiled
from planner.interface import BoolArray, ComplexArray, FloatArray, IntArray

MISSING = 3  # a run of returns goes on over at most this many lost ones in a row
ABREAST = 2
"""A place was looked through if this many rays on each side went further too, since one or two may be lost returns."""


def arrived(before: RangeScan, places: ComplexArray, sure_m: float) -> BoolArray:
    """(k,) which places a scan before looked through, so that what is there now has come."""
    any_ = any_arrived(before, places, sure_m)
    return looked_through(before, places, sure_m) if any_ else np.zeros(len(places), dtype=np.bool_)


def any_arrived(before: RangeScan, places: ComplexArray, sure_m: float) -> bool:
    """Tells quickly whether `arrived` may hold for any of (k,) places; in a still world mostly it does not."""
    return bool(looked_through(before, places, sure_m, every=FEWEST).any())


def receded(were: ComplexArray, scan: RangeScan, sure_m: float, most_m: float) -> BoolArray:
    """(n,) which rays look through (k,) places where something was, so that what they meet may have drawn back.

    What lies further behind than `sure_m` is surely another place; nothing has drawn back by more than `most_m`.
    """
    back = np.zeros(len(scan.ranges_m), dtype=np.bool_)
    if len(left := were[arrived(scan, were, sure_m)]):
        ray = rays_towards(scan, left)
        ray = ray[scan.ranges_m[ray] - np.abs(left - complex(scan.east_m, scan.north_m)) < most_m]
        # From nearer by, places that were met by neighbouring rays lie further apart.
        back[(ray[:, None] + np.arange(-1, 2)) % len(back)] = True
    return back


def rays_towards(scan: RangeScan, places: ComplexArray) -> IntArray:
    """(k,) the rays of a scan nearest to the bearings of places; a narrow fan also numbers rays beyond its ends."""
    offsets = places - complex(scan.east_m, scan.north_m)
    bearing = clockwise_from(scan.start_rad, offsets.real.copy(), offsets.imag.copy())
    ray = np.rint(bearing / scan.spacing_rad).astype(np.int64)
    return ray % len(scan.ranges_m) if all_round(scan) else ray


def looked_through(
    scan: RangeScan,
    places: ComplexArray,
    sure_m: float,
    abreast: int = ABREAST,
    aimed_m: float = math.inf,
    within_m: float = math.inf,
    every: int = 1,
) -> BoolArray:
    """(k,) which places a scan surely looked through: the ray towards each and `abreast` to either side went further.

    The arguments are those of `through_places`.
    """
    within_m = min(within_m, scan.max_range_m - sure_m)
    return through_places(places, scan.ranges_m, scan.beams, within_m, sure_m, abreast, aimed_m, every)


def runs_of(hits: IntArray, places: ComplexArray, apart_m: FloatArray, scan: RangeScan) -> list[IntArray]:
    """Splits returns of a scan into runs of neighbouring rays whose places lie at most `apart_m` apart."""
    breaks = ((np.abs(np.diff(places)) > apart_m[1:]) | (np.diff(hits) > MISSING + 1)).nonzero()[0] + 1
    runs = np.split(np.arange(len(hits)), breaks)
    closed = all_round(scan) and hits[0] + len(scan.ranges_m) - hits[-1] <= MISSING + 1
    if closed and len(runs) > 1 and abs(places[-1] - places[0]) <= apart_m[0]:
        runs = [np.concatenate((runs[-1], runs[0])), *runs[1:-1]]
    return runs


def extend(mine: IntArray, hits: IntArray, places: ComplexArray, step_m: float, scan: RangeScan) -> IntArray:
    """Adds to some returns, in clockwise order, those that go on from their ends by less than a step each.

    (k,) `mine` are their indices among (n,) `hits`, the rays of the scan that returned something, and `places`.
    """
    next_hits, next_places = np.roll(hits, -1), np.roll(places, -1)
    near = ((next_hits - hits) % len(scan.ranges_m) <= MISSING + 1) & (np.abs(next_places - places) < step_m)
    near[-1] &= all_round(scan)
    count = len(hits)
    first, last = int(mine[0]), int(mine[-1])
    more = count - 1 - (last - first) % count
    while more and near[first - 1]:
        first, more = (first - 1) % count, more - 1
    while more and near[last]:
        last, more = (last + 1) % count, more - 1
    return (first + np.arange((last - first) % count + 1)) % count


def joined(places: ComplexArray, apart_m: FloatArray) -> BoolArray:
    """(k,) which places of a run are near to the one before or after, as false returns are not."""
    away = np.abs(np.diff(places, prepend=math.inf, append=math.inf))
    return np.minimum(away[:-1], away[1:]) < apart_m


def near_any(places: ComplexArray, others: ComplexArray, within_m: float) -> BoolArray:
    """(k,) which of (k,) places lie within `within_m` of one of (m,) others."""
    return near_line(places, others, within_m, 0.0)


@compiled(PLACES, PLACES, FLOAT, FLOAT, rare=True)
def near_line(places: ComplexArray, line: ComplexArray, within_m: float, apart_m: float) -> BoolArray:
    """(k,) which of (k,) places lie within `within_m` of a line through (m,) points, broken at gaps over `apart_m`."""
    near = np.zeros(len(places), dtype=np.bool_)
    if not len(line):
        return near
    west, east, south, north = math.inf, -math.inf, math.inf, -math.inf
    for point in line:
        west, east = min(west, point.real), max(east, point.real)
        south, north = min(south, point.imag), max(north, point.imag)
    west, east, south, north = west - within_m, east + within_m, south - within_m, north + within_m
    for i in range(len(places)):
        x, y = places[i].real, places[i].imag
        if not (west <= x <= east and south <= y <= north):
            continue
        for j in range(len(line)):
            ahead = line[min(j + 1, len(line) - 1)] - line[j]
            dx, dy = x - line[j].real, y - line[j].imag
            squared = ahead.real * ahead.real + ahead.imag * ahead.imag
            if 0.0 < squared <= apart_m * apart_m:
                share = min(max((dx * ahead.real + dy * ahead.imag) / squared, 0.0), 1.0)
                dx, dy = dx - share * ahead.real, dy - share * ahead.imag
            if dx * dx + dy * dy <= within_m * within_m:
                near[i] = True
                break
    return near


def in_a_row(flags: Sequence[bool] | BoolArray) -> int:
    """Returns the length of the longest row of true flags."""
    longest = row = 0
    for flag in flags:
        row = row + 1 if flag else 0
        longest = max(longest, row)
    return longest


def in_all(flags: Iterable[BoolArray]) -> BoolArray:
    """Tells which flags are true in all arrays; stops to read arrays once none is."""
    common: BoolArray | None = None
    for each in flags:
        common = each if common is None else common & each
        if not common.any():
            break
    assert common is not None
    return common
