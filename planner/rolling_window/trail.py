"""Where the aircraft has been. Of two ways nearly as long, the one that does not lead back is taken."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from planner.geometry.curves import Point

AROUND = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1))


class Trail:
    """Squares of the plane that were flown through, and those around them."""

    def __init__(self, side_m: float) -> None:
        self._side = side_m
        self._last: tuple[int, int] | None = None
        self._flown: set[tuple[int, int]] = set()

    def add(self, place: Point) -> None:
        """Takes in where the aircraft is."""
        x, y = math.floor(place[0] / self._side), math.floor(place[1] / self._side)
        if (x, y) != self._last:
            self._last = x, y
            self._flown.update((x + i, y + j) for i, j in AROUND)

    def retraced_m(self, nodes: Sequence[Point]) -> float:
        """How much of a polyline lies where the aircraft has been, to about a square."""
        back_m = 0.0
        for (ax, ay), (bx, by) in pairwise(nodes):
            length = math.hypot(bx - ax, by - ay)
            count = max(math.ceil(length / self._side), 1)
            share = (np.arange(count) + 0.5) / count
            x = np.floor((ax + share * (bx - ax)) / self._side).astype(np.int64).tolist()
            y = np.floor((ay + share * (by - ay)) / self._side).astype(np.int64).tolist()
            back_m += length / count * sum(place in self._flown for place in zip(x, y, strict=True))
        return back_m
