"""A noisy scan made quieter: medians of neighbouring rays.

A median keeps steps in range where they are, and neither lost nor false returns count in it. Near by, where rays are
dense, many of them are taken together.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from harness.mapping.scan import RangeScan, all_round
from planner.interface import FloatArray, IntArray

HALF_WIDTHS = (2, 4, 8, 16)
"""A median takes in one of these numbers of rays on each side: the largest within the width, or the first."""
MEDIAN_ERROR_SHARE = 0.55  # standard deviation of the median of five over that of each, for normal errors


def smoothed(scan: RangeScan, width_m: float) -> RangeScan:
    """A scan whose ranges are medians.

    Args:
        scan: as the sensor gave it.
        width_m: rays that meet something broadside no further apart than this may be taken together.

    Returns:
        The same with other ranges; none where most of the rays about one returned nothing.
    """
    ring = np.pad(scan.ranges_m, HALF_WIDTHS[-1], mode="wrap" if all_round(scan) else "reflect")
    rough = _medians(ring, np.arange(len(scan.ranges_m)), HALF_WIDTHS[0])
    ranges = rough.copy()
    # As rays that met something nearer than this lie within the width, so many to either side.
    reach_m = [0.5 * width_m / (scan.spacing_rad * half) for half in HALF_WIDTHS] + [0.0]
    for half, (further, nearer) in zip(HALF_WIDTHS[1:], pairwise(reach_m[1:]), strict=True):
        rays = ((rough <= further) & (rough > nearer)).nonzero()[0]
        ranges[rays] = _medians(ring, rays, half)
    return replace(scan.computed(), ranges_m=ranges)


def _medians(ring: FloatArray, rays: IntArray, half: int) -> FloatArray:
    """(k,) medians of the ranges of `half` rays on each side of (k,) rays; infinite where most returned nothing.

    Of an even number of returns it is the lower of the two in the middle.
    """
    width = 2 * half + 1
    ordered = np.sort(np.lib.stride_tricks.sliding_window_view(ring, width)[rays + HALF_WIDTHS[-1] - half])
    returned = np.count_nonzero(ordered < math.inf, axis=1)
    medians = ordered[np.arange(len(rays)), np.maximum(returned - 1, 0) // 2]
    return np.where(2 * returned > width, medians, math.inf)
