"""The plan in effect, and the watch over what is seen in its way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.geometry.clearance import first_breach
from planner.geometry.course import Course
from planner.geometry.curves import Point, Pose, Segment, between, moved, onward, place_on
from planner.interface import FloatArray, Mission, Path, Plan

WATCHED_TOGETHER = 16
"""Edges that are not near are compared with the course once in so many times that the planner is asked."""

PROLONG = 0.6
"""A plan is prolonged when its certified part ends nearer than this share of the sensing range."""

UNHURRIED, CUT, GRAZED = 0.0625, 0.02, 0.005
"""The window rolls on after this share of the distance to what is wrong with the plan, or a rolling step. Where the
course is cut, after a share that is smaller, for what lies ahead may be a dead end: not so where the last search made
the way longer by less than a third share of that distance."""


@dataclass(frozen=True, eq=False)
class CommittedPlan:
    """A plan in effect, and what it is the beginning of.

    Attributes:
        plan: as it was given to the loop.
        path: its path: along the course, then into the turn; or the course, where that is flown to the goal.
        course: the whole way.
        loiter_entry_m: station at which the path leaves the course for the turn, or the flight is over.
    """

    plan: Plan
    path: Path
    course: Course
    loiter_entry_m: float

    @cached_property
    def turn(self) -> Path:
        """The turn that the path ends with; nothing where it ends at the goal."""
        return Path(self.path.segments[-1:] if self.path.loiter else self.path.segments[:0])

    def holds(self, arc_length_m: float) -> bool:
        """Whether an aircraft there is in the turn, or at the goal."""
        return arc_length_m >= self.loiter_entry_m

    def over(self, arc_length_m: float) -> bool:
        """Whether an aircraft there has nothing left to fly: it missed the goal."""
        return not (self.path.loiter or between(self.path, arc_length_m, self.path.length_m))

    def onward_from(self, pose: Pose, arc_length_m: float, length_m: float, near_m: float) -> list[Segment]:
        """What of it is flown next. An aircraft that is not near it bends as that does until it is told otherwise."""
        flown = onward(self.path, arc_length_m, length_m)
        off_m = math.dist(place_on(self.path, arc_length_m)[0][:2], pose[:2])
        return flown if off_m <= near_m or not flown else moved(flown, pose)

    def left(self, arc_length_m: float) -> Path:
        """What is left of it: the way to its turn, with the straight to roll on before that, and the turn."""
        turn_at_m = self.path.length_m - self.turn.length_m
        return Path(np.array([*between(self.path, arc_length_m, turn_at_m), *self.turn.segments.tolist()]))


class PlanMonitor:
    """Compares edges as they come in with the plan in effect, and tells when to look for another.

    Args:
        mission: sensing range and goal.
        keep_m: a course that comes nearer to an edge is cut there.
        turn_keeps_m: a certified turn that comes nearer to one is broken.
        urgent_m: edges nearer to the aircraft are compared at once; what is wrong nearer to it is urgent.
        lead_m: the least way between two searches.
        step_m: the rolling step, where nothing is urgent.
    """

    def __init__(
        self,
        mission: Mission,
        *,
        keep_m: float,
        turn_keeps_m: float,
        urgent_m: float,
        lead_m: float,
        step_m: float,
    ) -> None:
        self._keep, self._turn_keeps, self._urgent = keep_m, turn_keeps_m, urgent_m
        self._lead, self._step = lead_m, step_m
        self._prolong, self._goal_radius = PROLONG * mission.sensor_range_m, mission.goal_radius_m
        self._waiting: list[FloatArray] = []
        self._nearest_m = math.inf
        self._since = WATCHED_TOGETHER  # times asked since edges were compared
        self.cut_m = math.inf
        """Station at which the course comes too near to an edge seen since it was found."""
        self.broken = False
        """Its certified part does so, or its turn."""
        self.lengthened_m = math.inf
        """By so much the last search made the way longer."""

    def begin(self, effect: CommittedPlan, points_m: FloatArray, gone: int = 0) -> None:
        """A new plan is in effect: it may be cut by what came in while it was looked for (see `cut_at`)."""
        self.cut_m = self.cut_at(effect.course, points_m, gone)
        self.broken = self.cut_m < effect.loiter_entry_m

    def cut_at(self, course: Course, points_m: FloatArray, gone: int = 0) -> float:
        """Station at which a course comes too near to one of (m, 2) still edges that it was not found with.

        Args:
            course: the course.
            points_m: (m, 2) all that are remembered, in the order in which they came in.
            gone: so many at most of those that it was found with have been let go of since.
        """
        return first_breach(course.path, points_m[max(course.known - gone, 0) :], self._keep)

    def look(self, effect: CommittedPlan, here_m: float, position: Point, fresh_m: FloatArray) -> bool:
        """Takes in new edges, (k, 2): compares them at once where one is near, else those of a few times together.

        Returns:
            Whether the course is cut anew, or nearer than before.
        """
        self._since += 1
        if len(fresh_m):
            self._waiting.append(fresh_m)
            away_m = min(math.dist(position, edge) for edge in fresh_m.tolist())
            self._nearest_m = min(self._nearest_m, away_m)
        elif not self._waiting:
            return False
        if self._since < WATCHED_TOGETHER and self._nearest_m > self._urgent:
            return False
        self._since = 0
        edges = np.concatenate(self._waiting)
        self._waiting, self._nearest_m = [], math.inf
        before = self.cut_m
        if not effect.holds(here_m):
            self.cut_m = min(before, first_breach(effect.course.path, edges, self._keep, here_m))
        self.broken |= (
            self.cut_m < effect.loiter_entry_m
            or first_breach(effect.turn, edges, self._turn_keeps) < math.inf
        )
        return self.cut_m < before

    def due(self, effect: CommittedPlan, here_m: float, since_m: float, newly_cut: bool) -> bool:
        """Whether to roll the window: the nearer ahead something is wrong with the plan in effect, the sooner.

        Args:
            effect: the plan in effect.
            here_m: station of the aircraft on it.
            since_m: flown since the last search.
            newly_cut: as `look` has it.
        """
        wrong = min(self.cut_m, effect.loiter_entry_m) - here_m
        near = wrong < self._urgent
        if near and (self.broken or newly_cut):
            return True
        serves = effect.course.shortest and self.cut_m == math.inf and not self.broken
        whole = effect.loiter_entry_m >= effect.course.path.length_m - self._goal_radius
        if serves and (whole or effect.loiter_entry_m - here_m > self._prolong):
            return False
        if self.cut_m < math.inf:
            grazed = self.lengthened_m < GRAZED * wrong
            return since_m >= max(self._lead, (UNHURRIED if grazed else CUT) * wrong)
        return since_m >= max(self._lead if near else self._step, UNHURRIED * wrong)
