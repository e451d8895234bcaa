"""Places, directions and turns at many arc lengths of a path at once."""

from __future__ import annotations

import numpy as np

from planner.interface import FloatArray, Path
from planner.kernels import segments


def poses_at(path: Path, arc_lengths_m: FloatArray) -> FloatArray:
    """(k, 4) poses at (k,) arc lengths along a path, clamped to its ends."""
    return segments.poses_at(path.segments, np.ascontiguousarray(arc_lengths_m))


def places_along(path: Path, end_m: float, pieces: int) -> FloatArray:
    """(pieces + 1, 2) places along a path, clamped to its ends, from its start to an arc length and evenly spaced."""
    return segments.places_along(path.segments, end_m, pieces)


def turn_centres(path: Path, arc_lengths_m: FloatArray, radius_m: float, roll_m: float) -> FloatArray:
    """(k, 2, 2) centres of the turns off a path at (k,) arc lengths: to the left, and to the right.

    Where the path turns the other way, the turn begins after a straight of `roll_m`.
    """
    return segments.turn_centres(path.segments, np.ascontiguousarray(arc_lengths_m), radius_m, roll_m)
