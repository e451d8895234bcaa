"""Places for discs in an area, drawn one by one wherever they keep from those before."""

from __future__ import annotations

import itertools
import math
from bisect import insort
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

TRIES: Final = 100
AT_ONCE: Final = 10
"""Number of places that are tried at a time."""

FULL: Final = 5000
"""After so many discs without a place the area is full, and nothing more is tried."""

MOST_COLUMNS: Final = 1000

FloatArray = NDArray[np.float64]
Place = tuple[float, float]


def placed(
    size_m: tuple[float, float],
    radii_m: FloatArray,
    gap_m: float,
    taken: Sequence[tuple[Place, float]],
    rng: np.random.Generator,
) -> list[Place | None]:
    """A middle for each disc, None for one that found no place in `TRIES`.

    Args:
        size_m: width and height of the area, whose south-west corner is (0, 0).
        radii_m: (N,) of the discs.
        gap_m: they keep this from each other.
        taken: places that are taken already, and what is kept from them.
        rng: draws the places.
    """
    largest = float(radii_m.max(initial=0.0))
    discs = _Discs(max(2 * largest + gap_m, max(size_m) / MOST_COLUMNS), largest)
    for place, kept_m in taken:
        discs.add(place, kept_m)
    found: list[Place | None] = []
    in_vain = 0
    for radius in radii_m.tolist():
        tries = ((rng.random((AT_ONCE, 2)) * size_m).tolist() for _ in range(TRIES // AT_ONCE))
        free = (discs.first_free(places, radius) for places in tries)
        found.append(next(filter(None, free), None) if in_vain < FULL else None)
        if found[-1] is None:
            in_vain += 1
        else:
            discs.add(found[-1], radius + gap_m)
    return found


class _Discs:
    """Discs, each in all square cells where it can matter to another.

    Args:
        cell_m: side of a cell.
        largest_m: radius of the largest disc that is looked for a place.
    """

    def __init__(self, cell_m: float, largest_m: float) -> None:
        self._cell_m, self._largest_m = cell_m, largest_m
        # East, north and what is kept of all that can matter to a cell.
        self._near: defaultdict[tuple[int, int], list[tuple[float, float, float]]] = defaultdict(list)

    def add(self, place: Place, kept_m: float) -> None:
        column, row = (int(along_m // self._cell_m) for along_m in place)
        reach = max(math.ceil((kept_m + self._largest_m) / self._cell_m), 1)
        columns, rows = range(column - reach, column + reach + 1), range(row - reach, row + reach + 1)
        for near in itertools.product(columns, rows):
            # The large ones first: they are the most likely to be in the way.
            insort(self._near[near], (*place, kept_m), key=lambda disc: -disc[2])

    def first_free(self, places: Iterable[Place], radius_m: float) -> Place | None:
        """The first place where a disc keeps from every other one what that asks for; None where there is none."""
        near, cell_m = self._near, self._cell_m
        for east, north in places:
            for x, y, kept_m in near.get((int(east // cell_m), int(north // cell_m)), ()):
                apart_m = kept_m + radius_m
                if (east - x) * (east - x) + (north - y) * (north - y) < apart_m * apart_m:
                    break
            else:
                return east, north
        return None
