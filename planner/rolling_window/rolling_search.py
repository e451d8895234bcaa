"""One rolling step of the search: does a portion of work and returns the committed plan it leads to."""

from __future__ import annotations

import math
from enum import Enum
from functools import partial
from typing import TypeGuard

from planner.geometry.course import Course
from planner.geometry.curves import Point
from planner.interface import Mission, PlanRequest
from planner.rolling_window.anytime_search import AnytimeSearch
from planner.rolling_window.barrier import Proof
from planner.rolling_window.commitment import Commitment
from planner.rolling_window.dead_ends import GivingUp
from planner.rolling_window.local_planning import LocalPlanning
from planner.shield.committed_plan import CommittedPlan, PlanMonitor, Start
from planner.shield.escape import room_m
from planner.shield.evasion import Threats

BETTER_SHARE = 0.005
"""A course to the goal that can still be flown is replaced only by one shorter by this share of its rest."""

DETOUR_SHARE = 0.15
"""A way to another hold is flown rather than one to the hold ahead only where it is longer by less than this share of
the way to that hold: seen from there, what is unseen now is mostly open."""

IN_VIEW_RADII = 4.0
"""A course counts as leading on up to this many hold radii before the first place of it that is out of sight."""


class Work(Enum):
    """Counted work (about 1 us a unit) of a search when it begins, and each further time that the planner is asked."""

    WHILE_SERVING = (3000.0, 1000.0)  # the plan in effect can still be flown: there is time
    WHILE_CUT = (5000.0, 2000.0)  # an edge cuts the course ahead: the plan in effect leads into its turn
    WHILE_UNSAFE = (6000.0, 6000.0)  # no safe plan is flown
    WHILE_MOVING = (12_000.0, 12_000.0)  # a late plan may meet what moves; most searches end within it


class RollingSearch:
    """Searches for a new committed plan, a portion of work at a time."""

    def __init__(
        self,
        mission: Mission,
        local: LocalPlanning,
        commitment: Commitment,
        monitor: PlanMonitor,
        giving_up: GivingUp,
        none_to_find: Proof,
    ) -> None:
        self._mission, self._memory = mission, local.memory
        self._local, self._commitment = local, commitment
        self._monitor, self._giving_up, self._none_to_find = monitor, giving_up, none_to_find
        self._request: tuple[PlanRequest, Start] | None = None  # the last request, and a plan's start
        self.running: AnytimeSearch | None = None  # the search that is not done yet
        self.last: AnytimeSearch | None = None  # the search that was at work last
        self.known = 0  # number of edge points that the last search that ended began with
        self.removed = 0  # number of edge points let go of when the last search began
        self.turned_m = math.inf  # least distance from the goal at which the aircraft has turned in a hold
        self.anew = False  # a search is to be made though the course serves: a way may have become free
        self.refused = 0  # number of courses found of which no part that leads on could be certified
        self.nearer: CommittedPlan | None = None  # a certified plan that comes too near to what moves

    @property
    def up_to_date(self) -> bool:
        """Whether no edge point has come in since the last search."""
        return self.known == self._memory.known

    @property
    def freed(self) -> bool:
        """Whether edge points have been let go of since the last search began: a way may have become free."""
        return self._memory.cleared != self.removed

    def stop(self) -> None:
        """Drops a search that is not done: the plan in effect is as good as any."""
        self.running = None

    def cut_m(self, course: Course) -> float:
        """Arc length at which a course comes too near to an edge point that it was not found with."""
        return self._monitor.cut_at(course, self._memory.standing_m, self._memory.cleared - self.removed)

    def go_on(
        self,
        request: PlanRequest,
        start: Start,
        ahead: Course | None,
        serves: bool,
        work: Work,
        threats: Threats | None,
    ) -> CommittedPlan | None:
        """Searches with one portion of work; returns the first certified plan that may be flown, None without one.

        `ahead` is what is left of the course in effect, and `serves` tells whether that can still be flown.
        """
        first, more = work.value
        self._request = request, start
        begins = self.running is None
        search = self.last = self.running = self.running or self._begin(request.position_m)
        same: CommittedPlan | None = None  # leads to the hold of the plan in effect, which is ahead
        for course in search.courses(start, ahead, first if begins else more):
            if serves and self._is_as_good(ahead, course):
                search.exhausted = True
                break
            found = self._commitment.commit(request, start, course, search.candidates, self.cut_m(course))
            if self._may_be_flown(found, start, threats):
                return self._end(search, ahead, choose_hold(same, found))
            to_hold_ahead = self._to_hold_ahead(found, start, threats)
            same = same or to_hold_ahead
            search.stuck = search.stuck or course
            self.refused += to_hold_ahead is None
        if same is not None:
            return self._end(search, ahead, same)
        if search.exhausted:
            self.running, self.known, self.anew = None, search.known, False
        return None

    def _may_be_flown(
        self, found: CommittedPlan | None, start: Start, threats: Threats | None
    ) -> TypeGuard[CommittedPlan]:
        """Whether a plan leads on to a hold elsewhere, clear of what moves; of those too near the furthest is kept."""
        if found is None or not self._commitment.leads_on(found, start, self._monitor.plan):
            return False
        keeps_m = room_m(found.path, threats)
        if keeps_m >= self._mission.clearance_m:
            return True
        if self.nearer is None or keeps_m > room_m(self.nearer.path, threats):
            self.nearer = found  # what moves may come to what is free now
        return False

    def _to_hold_ahead(
        self, found: CommittedPlan | None, start: Start, threats: Threats | None
    ) -> CommittedPlan | None:
        """A plan that leads on to the hold of the plan in effect, while that is ahead; None if it does not."""
        if found is None or room_m(found.path, threats) < self._mission.clearance_m:
            return None
        return found if self._commitment.leads_on(found, start, self._monitor.plan, elsewhere=False) else None

    def _begin(self, position: Point) -> AnytimeSearch:
        """Begins a search, with the effort and the order that searches in vain have led to."""
        self.removed = self._memory.cleared
        effort, widest_first = self._giving_up.effort, self._giving_up.tried_again
        closed = partial(self._none_to_find.closed, position)
        # Among pockets, the shortest ways first leave none out; past them a way with room for holds may go first.
        past = math.dist(position, self._mission.goal_m) < self.turned_m - self._mission.sensor_range_m
        open_to_m = self._open_to_m if past and not widest_first else None
        return AnytimeSearch(self._local, effort, closed, widest_first, open_to_m)

    def _open_to_m(self, course: Course) -> float:
        """Arc length (m) up to which a course is seen to lead on now: to a certified hold, or well in sight."""
        assert self._request is not None
        request, start = self._request
        in_view_m = self._commitment.in_view_m(course, request.seen)
        in_view_m -= IN_VIEW_RADII * self._mission.hold_radius_m
        found = self._commitment.commit(request, start, course, [], self.cut_m(course))
        if found is None or not self._commitment.leads_on(found, start, self._monitor.plan):
            return in_view_m
        return max(found.loiter_entry_m, in_view_m)

    def _end(self, search: AnytimeSearch, ahead: Course | None, found: CommittedPlan) -> CommittedPlan:
        """Ends a search that has found a plan, and returns that."""
        self.running, self.known, self.anew = None, search.known, False
        self._giving_up.effort = 0
        self._monitor.lengthened_m = self._local.growth_m(found.course, ahead)
        return found

    def _is_as_good(self, ahead: Course | None, course: Course) -> bool:
        """Whether what is left of a whole way is as good as a course: hardly longer, or that is only a beginning."""
        goal = self._mission.goal_m
        if ahead is None or not ahead.to_goal or ahead.nodes[-1] != goal:
            return False
        return course.nodes[-1] != goal or course.path.length_m > ahead.path.length_m * (1.0 - BETTER_SHARE)


def choose_hold(same: CommittedPlan | None, other: CommittedPlan) -> CommittedPlan:
    """Chooses which plan is flown: the one to the hold ahead, if there is one, or the one to another hold."""
    if same is None:
        return other
    longer_m = other.course.path.length_m - same.course.path.length_m
    return same if longer_m > DETOUR_SHARE * same.loiter_entry_m else other
