"""Places that a course led to and that could not be seen to be safe to enter."""

from __future__ import annotations

import math

from planner.curves import Point

ENOUGH = 2
"""So many turns before a place show what can be seen of it."""


class DeadEnds:
    """Counts how often the aircraft had to turn before a place.

    Args:
        reach_m: places nearer to each other than this are one.
    """

    def __init__(self, reach_m: float) -> None:
        self._reach = reach_m
        self._places: list[Point] = []

    def turned_before(self, place: Point) -> bool:
        """Counts one more turn before a place; returns whether these are enough to give it up."""
        self._places.append(place)
        near = [each for each in self._places if math.dist(each, place) < self._reach]
        if len(near) < ENOUGH:
            return False
        self._places = [each for each in self._places if each not in near]
        return True
