"""Places that a course led to and that could not be seen to be safe to enter, and when they are tried again."""

from __future__ import annotations

import math

from planner.geometry.curves import Point, Pose
from planner.interface import MapView, Mission
from planner.memory import ObstacleMemory
from planner.world_stability import WorldStability

ENOUGH = 2
"""So many turns before a place show what can be seen of it."""

RETRY_S = 60.0
"""So long after something last moved or appeared, what was given up is tried again: it may have been in the way."""


class DeadEnds:
    """Counts how often the aircraft had to turn before a place, and gives places up.

    Args:
        mission: goal and limits.
        memory: what is given up is refused there.
    """

    def __init__(self, mission: Mission, memory: ObstacleMemory) -> None:
        self._mission, self._memory = mission, memory
        self._reach = 2.0 * mission.clearance_m  # places nearer to each other are one
        self._places: list[Point] = []
        self.unrest = WorldStability()
        """When something last moved or appeared."""
        self._retry_s = math.inf

    def turned_before(self, place: Point) -> bool:
        """Counts one more turn before a place; returns whether these are enough to give it up."""
        self._places.append(place)
        near = [each for each in self._places if math.dist(each, place) < self._reach]
        if len(near) < ENOUGH:
            return False
        self._places = [each for each in self._places if each not in near]
        return True

    def note_change(self, time_s: float, seen: MapView) -> None:
        """Has what was given up tried again when what moved or appeared may have left the way."""
        if self.unrest.note(time_s, seen):
            self._retry_s = self.unrest.changed_s + RETRY_S
        if time_s > self._retry_s:
            self._retry_s, self._places = math.inf, []
            self._memory.forgive()

    def give_up(self, place: Pose) -> None:
        """Gives up a place on a course, and what lies to its sides: a turn takes so much room."""
        east, north, along_east, along_north = place
        clearance_m, radius_m = self._mission.clearance_m, self._mission.turn_radius_m
        beside = int(radius_m / clearance_m)
        if math.dist((east, north), self._mission.goal_m) < radius_m:
            # The goal is in view, and cannot be flown into from here: it is to be approached another way.
            east, north, beside = east - radius_m * along_east, north - radius_m * along_north, 0
        for i in range(-beside, beside + 1):
            aside_m = i * clearance_m
            self._memory.refuse((east - aside_m * along_north, north + aside_m * along_east))
