"""Gives up places that could not be seen to be safe to enter, and remembers them like edge points.

They are tried again where nothing else is left, and where something that moved may have been in the way.
"""

from __future__ import annotations

import math

from planner.geometry.curves import Point, Pose
from planner.interface import MapView, Mission
from planner.memory import ObstacleMemory
from planner.world_stability import WorldStability

TURNS_TO_GIVE_UP = 2
"""A place is given up when the aircraft has turned away within two clearances of it this many times."""

RETRY_S = 60.0  # given-up places are tried again this long after something last moved or appeared

MOST_EFFORT = 4
"""A search in vain is repeated with twice the effort, this many times; from then on once a turn."""

MOST_RETRIES = 8
"""All given-up places are tried again this many times before a flight ends for want of room to turn."""

MOST_LOOKS = 16
"""A flight ends for want of a way only after this many places before gaps that look too narrow are given up."""


class GivingUp:
    """Gives up places that the aircraft turned away from, and decides what follows a search in vain."""

    def __init__(self, mission: Mission, memory: ObstacleMemory, stability: WorldStability) -> None:
        self._mission, self._memory = mission, memory
        self.whole_turn_m = math.tau * mission.turn_radius_m
        self._turned_before: list[Point] = []
        self._retry_s = math.inf
        self.retries = 0  # number of times that all given-up places have been tried again
        self.given_up_at_m = 0.0  # arc length of the plan in effect at which a place was given up last
        self.refusals = 0  # number of times that a place has been given up
        self._stability = stability
        self.effort = 0  # the work of a wide search is doubled this often; grows with every search in vain
        self.tried_again = False  # what was given up has been tried again for want of another way

    def turned_twice(self, place: Point) -> bool:
        """Counts one more turn in front of a place; returns whether these are enough to give it up."""
        self._turned_before.append(place)
        reach_m = 2.0 * self._mission.clearance_m  # places nearer to each other are one
        near = [each for each in self._turned_before if math.dist(each, place) < reach_m]
        if len(near) < TURNS_TO_GIVE_UP:
            return False
        self._turned_before = [each for each in self._turned_before if each not in near]
        return True

    def note_change(self, time_s: float, seen: MapView) -> None:
        """Forgets the given-up places some time after something moved or appeared, which may have left the way."""
        if self._stability.note(time_s, seen):
            self._retry_s = self._stability.changed_s + RETRY_S
        if time_s > self._retry_s:
            self._retry_s, self._turned_before = math.inf, []
            self._memory.forget_refused()

    @property
    def waits(self) -> bool:
        """Whether a time is set at which given-up places are tried again."""
        return self._retry_s < math.inf

    def refuse(self, place: Pose) -> None:
        """Gives up a place on a course, and places to its sides as far as a turn takes room."""
        self.refusals += 1
        east, north, along_east, along_north = place
        clearance_m, radius_m = self._mission.clearance_m, self._mission.turn_radius_m
        beside = int(radius_m / clearance_m)
        if math.dist((east, north), self._mission.goal_m) < radius_m:
            # The goal is in view, and cannot be flown into from here: it is to be approached another way.
            east, north, beside = east - radius_m * along_east, north - radius_m * along_north, 0
        for i in range(-beside, beside + 1):
            aside_m = i * clearance_m
            self._memory.refuse((east - aside_m * along_north, north + aside_m * along_east))

    @property
    def out_of_effort(self) -> bool:
        """Whether the search has been repeated with all the effort that there is."""
        return self.effort == MOST_EFFORT

    def narrow(self, no_room: bool, time_s: float) -> bool:
        """Tells whether it is certain that only ways without room to turn are left; `no_room` is proved."""
        # What moved may have closed the way. Where edge points were taken back the sensor errs, and a place that was
        # given up may be seen to be free at another look.
        doubtful = self._stability.ever_changed or self._memory.ever_cleared
        return no_room and self._stability.settled(time_s) and not (doubtful and len(self._memory.refused_m))

    def try_again(self, narrow: bool, at_end: bool, arc_length_m: float) -> None:
        """After a search in vain: doubles the effort (`narrow`: none again); either flag forgives what was given up."""
        self.retries += narrow
        if narrow or at_end:
            self.given_up_at_m = arc_length_m
            self._memory.forget_refused()
            self.tried_again = True
        self.effort = 0 if narrow else min(self.effort + 1, MOST_EFFORT)
