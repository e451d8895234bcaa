"""Anytime search for a way to the goal: in portions of work, while the plan in effect is flown.

A search that is not done within its portion, which is counted and never timed, goes on when the planner is asked next.
What is found is fitted to where the aircraft has got to by then.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator
from typing import NamedTuple

import numpy as np

from planner.geometry.course import Course, Route
from planner.interface import FloatArray, Path
from planner.rolling_window.local_planning import DOUBTFUL_SHARE, Attempt, LocalPlanning
from planner.rolling_window.multi_step_search import Candidate
from planner.shield.committed_plan import Start

LONG_SHARE, MOST_WORK = 0.0015, 6000.0
"""A portion of a search is at least the first share of the work that it has done so far, up to `MOST_WORK` units: else
a search among the edges of a large maze would go on for minutes, flown in a turn."""


class _FoundRoute(NamedTuple):
    """A route found, with its start, the attempt that found it and the edge points it was found among."""

    route: Route
    start: Start
    attempt: Attempt
    points_m: FloatArray
    known: int
    shortest: bool


class AnytimeSearch:
    """One search for ways to the goal, those that are wanted most first."""

    def __init__(
        self,
        local: LocalPlanning,
        effort: int,
        closed: Callable[[], bool],
        widest_first: bool = False,
        open_to_m: Callable[[Course], float] | None = None,
    ) -> None:
        self._local, self._effort, self._closed, self._widest_first = local, effort, closed, widest_first
        self._open_to_m = open_to_m  # m along a course; None: no room is asked for
        self._start: Start | None = None
        self._flown: Course | None = None
        self._steps = self._search()
        self._begun = local.work_count.total  # work counted when the search began
        self.known = local.memory.known  # number of edge points, of what stands still, that it began with
        self.exhausted = False  # all ways have been looked for
        self.stuck: Course | None = None  # the first way that was found and could not be taken
        self.candidates: list[Candidate] = []  # candidates looked at so far

    def courses(self, start: Start, flown: Course | None, work: float) -> Iterator[Course]:
        """Yields the courses found with one more portion of work; the search is `exhausted` after the last."""
        spent = self._local.work_count.total
        enough = spent + max(work, min(LONG_SHARE * (spent - self._begun), MOST_WORK))
        self._start, self._flown = start, flown
        for step in self._steps:
            if step is not None:
                yield step
            elif self._local.work_count.total >= enough:
                return
        self.exhausted = True

    def _now(self) -> tuple[Start, Course | None]:
        """Returns the start of a plan made now, and the course that is flown."""
        assert self._start is not None
        return self._start, self._flown

    def _search(self) -> Generator[Course | None, None, None]:
        """Yields courses as they are found, and None after each step of work."""
        found = False
        waiting: list[_FoundRoute] = []
        closed_m = math.inf
        attempts, memory = self._local.attempts(), self._local.memory
        if self._effort or self._widest_first:
            # The search was in vain so far: a world closed to the narrowest way is closed to all.
            attempts.sort(key=lambda each: each.distance_m + each.margin_m, reverse=self._widest_first)
        for i, attempt in enumerate((*attempts, *self._local.last_attempts)):
            if attempt.distance_m + attempt.margin_m >= closed_m or (attempt.doubtful and found):
                continue  # it is closed to a narrower way, or doubtful and one is found
            before, points = len(self.candidates), memory.points_m
            known = 0 if attempt.doubtful else memory.known  # any edge may cut a doubtful one
            route = yield from self._local.route(attempt, self._effort, self._now, self.candidates, self._closed)
            if len(self.candidates) == before:
                closed_m = attempt.distance_m + attempt.margin_m
            if route is not None:
                found = True
                waiting.append(_FoundRoute(route, self._now()[0], attempt, points, known, shortest=i == 0))
            narrower_may_lead_on = i == 0 and route is not None and self._switches(route)
            if narrower_may_lead_on or self._missed_shorter(waiting):
                continue
            yield from self._offer(waiting)
            waiting = []
        yield from self._courses(waiting)
        if not found:
            yield from self._last_resort()

    def _last_resort(self) -> Generator[Course | None, None, None]:
        """Yields the course along a way found by search over poses, else along part of the first candidate."""
        route = yield from self._local.tight_route(self._now)
        if route is None and self.candidates:
            route = yield from self._local.longest_part(self._now, self.candidates[0])
        if route is not None:
            known = 0 if self._local.last_attempts else self._local.memory.known
            yield self._course(route, known, shortest=False)

    def _offer(self, found: list[_FoundRoute]) -> Generator[Course | None, None, None]:
        """Yields courses along routes; before the first of a search, the one with room for holds if that goes first."""
        if found and self._open_to_m is not None:
            open_to_m, self._open_to_m = self._open_to_m, None
            yield from self._courses((yield from self._roomier(found, open_to_m)))
        yield from self._courses(found)

    def _roomier(
        self, found: list[_FoundRoute], open_to_m: Callable[[Course], float]
    ) -> Generator[None, None, list[_FoundRoute]]:
        """The way with room for holds, if it is to be flown before the shortest of those found; else an empty list."""
        narrow = min(found, key=lambda each: each.route.path.length_m)
        course = self._course(narrow.route, narrow.known, shortest=False)
        if (leads_on_m := open_to_m(course)) >= course.path.length_m:
            return []
        known, points, wide = self._local.memory.known, self._local.memory.points_m, self._local.wide_attempt
        route = yield from self._local.route(wide, self._effort, self._now, [], self._closed)
        if route is None or not self._local.is_worth_room(route, course, leads_on_m):
            return []
        return [_FoundRoute(route, self._now()[0], wide, points, known, shortest=False)]

    def _courses(self, found: list[_FoundRoute]) -> Iterator[Course]:
        """Yields courses along routes, the shorter first, from where a plan would begin now."""
        for each in sorted(found, key=lambda each: each.route.path.length_m):
            start, flown = self._now()
            route: Route | None = each.route
            if start is not each.start:
                nodes = (start.pose[:2], *each.route.nodes)
                route = self._local.fitted(start, each.attempt, nodes, each.points_m, turning=flown is None)
            if route is not None:
                yield self._course(route, each.known, each.shortest)

    def _missed_shorter(self, found: list[_FoundRoute]) -> bool:
        """Tells whether a much shorter way could not be flown: further from obstacles its turns may have room."""
        least_m = min((each.route.path.length_m for each in found), default=0.0)
        searched_m = min((candidate.cost_m for candidate in self.candidates), default=math.inf)
        return least_m > (1.0 + DOUBTFUL_SHARE) * searched_m

    def _switches(self, route: Route) -> bool:
        """Tells whether a route passes obstacles on another side than the course that is flown."""
        start, flown = self._now()
        nodes = (start.pose[:2], *route.nodes)
        return flown is not None and not flown.same_side(nodes, self._local.memory.points_m)

    def _course(self, route: Route, known: int, shortest: bool) -> Course:
        """The course along a route, after the stretch of the plan in effect up to its start."""
        path = Path(np.array([*self._now()[0].prefix, *route.path.segments.tolist()]))
        return Course(path, route.nodes, known, shortest)
