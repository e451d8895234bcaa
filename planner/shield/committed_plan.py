"""The committed plan, and the monitor that compares it with what is seen."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner.geometry.clearance import first_breach
from planner.geometry.course import Course
from planner.geometry.curves import Point, Pose, Segment, along, between, moved, onward, place_on
from planner.interface import FloatArray, Mission, Path, Plan, PlanRequest

COMPARED_EVERY = 16
"""Edge points that are not near the aircraft are compared with the course once in this many requests."""

BROKEN_SHARE = 0.99
"""Share of the clearance: an edge point seen nearer than that to a certified turn breaks the certificate."""

PROLONG_SHARE = 0.6
"""A plan that serves is prolonged when its certified part ends within this share of the sensing range ahead."""

REPLAN_SHARE, CUT_SHARE, GRAZED_SHARE = 0.0625, 0.02, 0.005
"""The next search begins after the first share of the distance to what is wrong with the plan, but after the second
where the course is cut, for that may be a dead end, unless the last search lengthened it by less than the third."""


@dataclass(frozen=True, eq=False)
class CommittedPlan:
    """A plan in effect, and the course that it is the beginning of."""

    plan: Plan  # as it was given to the loop
    path: Path  # of the plan: along the course, then into the turn; or the course, where that is flown to the goal
    course: Course  # the whole way
    loiter_entry_m: float  # arc length at which the path leaves the course, or the flight is over

    @cached_property
    def turn(self) -> Path:
        """The turn that the path ends with; empty where the path ends at the goal."""
        return Path(self.path.segments[-1:] if self.path.loiter else self.path.segments[:0])

    def holds(self, arc_length_m: float) -> bool:
        """Tells whether an aircraft at this arc length is in the turn, or at the goal."""
        return arc_length_m >= self.loiter_entry_m

    def is_over(self, arc_length_m: float) -> bool:
        """Tells whether no path is left at this arc length, the goal missed; a plan that loiters is never over."""
        return not (self.path.loiter or between(self.path, arc_length_m, self.path.length_m))

    def left(self, arc_length_m: float) -> Path:
        """The rest of the path: the way to its turn, with the straight to roll on before that, and the turn."""
        turn_at_m = self.path.length_m - self.turn.length_m
        rows = (*between(self.path, arc_length_m, turn_at_m), *self.turn.segments.tolist())
        return Path(np.array(rows), self.path.loiter)


@dataclass(frozen=True, eq=False)
class Start:
    """Where a new plan leaves the old one: pose and curvature (1/m) there, and the stretch (`prefix`) up to there."""

    position: Point
    pose: Pose
    curvature: float = 0.0
    prefix: list[Segment] = field(default_factory=list)

    def later(self, count: int) -> Iterator[tuple[Pose, list[Segment]]]:
        """Yields the pose, and on a turn `count` - 1 further round it, evenly spaced; each with the way there."""
        yield self.pose, []
        for i in range(1, count if self.curvature else 1):
            arc: Segment = (*self.pose, self.curvature, math.tau * i / count / abs(self.curvature))
            yield along(arc, arc[5]), [arc]


def start_of(
    plan: CommittedPlan | None,
    request: PlanRequest,
    here_m: float,
    lead_m: float,
    mission: Mission,
    to_m: float = math.inf,
) -> Start:
    """Where a new plan begins: `plan` is flown on for `lead_m`, until then or `to_m`; without one, straight on."""
    here, prefix = Pose(*request.position_m, *request.direction), []
    if plan is not None:
        late_m = mission.ground_speed_mps * mission.compute_latency_s
        uncut_m = math.inf if plan.holds(here_m) else max(late_m, to_m - here_m)
        prefix = onward(plan.path, here_m, min(lead_m, uncut_m))
        off_m = math.dist(place_on(plan.path, here_m)[0][:2], here[:2])
        if off_m > mission.off_path_m and prefix:  # it bends as the plan does until a new one
            prefix = moved(prefix, here)
    prefix = prefix or [(*here, 0.0, lead_m)]
    last = prefix[-1]
    return Start(here[:2], along(last, last[5]), last[4], prefix)


class PlanMonitor:
    """Compares edge points as they come in with the plan in effect, and tells when to search for another."""

    def __init__(self, mission: Mission, *, keep_m: float, urgent_m: float, lead_m: float, step_m: float) -> None:
        """A course that comes nearer than `keep_m` to an edge point is cut there.

        Edge points within `urgent_m` of the aircraft are compared at once, and what is wrong within it is urgent. At
        least `lead_m` is flown between two searches, `step_m` (the rolling step) where nothing is urgent.
        """
        self._mission, self._keep_m, self._urgent_m = mission, keep_m, urgent_m
        self._lead_m, self._step_m = lead_m, step_m
        self._turn_keeps_m = BROKEN_SHARE * mission.clearance_m
        self._waiting: list[FloatArray] = []
        self._nearest_m = math.inf
        self._since = COMPARED_EVERY  # number of requests since edge points were compared
        self.plan: CommittedPlan | None = None  # the plan in effect
        self.proposed: CommittedPlan | None = None  # the plan given to the loop last, until it is in effect
        self.cut_m = math.inf  # arc length at which the course comes too near to an edge point seen since
        self.broken = False  # the certified part of the plan, or its turn, comes too near to something
        self.lengthened_m = math.inf  # how much longer the last search made the course
        self.searched_at_m = 0.0  # arc length at which the last search was made

    def take_effect(self, flown: Plan | None, points_m: FloatArray, removed: int = 0) -> bool:
        """Begins to watch the plan proposed last, if it is the one that is flown now; returns whether it is."""
        if self.proposed is None or flown is not self.proposed.plan:
            return False
        self.plan, self.proposed, self.searched_at_m = self.proposed, None, 0.0
        # It may be cut by what came in while it was looked for.
        self.cut_m = self.cut_at(self.plan.course, points_m, removed)
        self.broken = self.cut_m < self.plan.loiter_entry_m
        return True

    def cut_at(self, course: Course, points_m: FloatArray, removed: int = 0) -> float:
        """Arc length at which a course comes too near to an edge that it was not found with.

        `points_m`, (m, 2), are all still ones in the order in which they came in; at most `removed` were let go of.
        """
        return first_breach(course.path, points_m[max(course.known - removed, 0) :], self._keep_m)

    def look(self, plan: CommittedPlan, here_m: float, position: Point, fresh_m: FloatArray) -> bool:
        """Takes in (k, 2) new edges: compares them at once where one is near, else those of a few requests together.

        Returns whether the course is cut anew, or nearer than before; `here_m` is the arc length of the aircraft.
        """
        self._since += 1
        if len(fresh_m):
            self._waiting.append(fresh_m)
            away_m = min(math.dist(position, edge) for edge in fresh_m.tolist())
            self._nearest_m = min(self._nearest_m, away_m)
        elif not self._waiting:
            return False
        if self._since < COMPARED_EVERY and self._nearest_m > self._urgent_m:
            return False
        self._since = 0
        edges = np.concatenate(self._waiting)
        self._waiting, self._nearest_m = [], math.inf
        before = self.cut_m
        if not plan.holds(here_m):
            self.cut_m = min(before, first_breach(plan.course.path, edges, self._keep_m, here_m))
        self.broken |= self.cut_m < plan.loiter_entry_m or first_breach(plan.turn, edges, self._turn_keeps_m) < math.inf
        return self.cut_m < before

    @property
    def waits(self) -> bool:
        """Whether edges that came in have not been compared yet."""
        return len(self._waiting) > 0

    def urgent(self, plan: CommittedPlan, here_m: float) -> bool:
        """Whether the plan in effect is broken, and what is wrong with it is near."""
        return self.broken and min(self.cut_m, plan.loiter_entry_m) - here_m < self._urgent_m

    def due(self, plan: CommittedPlan, here_m: float, since_m: float, newly_cut: bool) -> bool:
        """Whether to roll the window: the nearer ahead something is wrong with the plan in effect, the sooner.

        `since_m` were flown since the last search; `newly_cut` is what `look` returned.
        """
        wrong_m = min(self.cut_m, plan.loiter_entry_m) - here_m
        near = wrong_m < self._urgent_m
        if near and (self.broken or newly_cut):
            return True
        serves = plan.course.shortest and self.cut_m == math.inf and not self.broken
        whole = plan.loiter_entry_m >= plan.course.path.length_m - self._mission.goal_radius_m
        if serves and (whole or plan.loiter_entry_m - here_m > PROLONG_SHARE * self._mission.sensor_range_m):
            return False
        if self.cut_m < math.inf:
            grazed = self.lengthened_m < GRAZED_SHARE * wrong_m
            return since_m >= max(self._lead_m, (REPLAN_SHARE if grazed else CUT_SHARE) * wrong_m)
        return since_m >= max(self._lead_m if near else self._step_m, REPLAN_SHARE * wrong_m)
