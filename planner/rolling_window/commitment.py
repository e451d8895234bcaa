"""Commits to the part of a course that ends in a turn seen to be free, or in the goal circle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from planner.geometry.course import Course
from planner.geometry.curves import Point
from planner.interface import MapView, Mission, Path, Plan, PlanPicture, PlanRequest, PlanStatus
from planner.rolling_window.local_planning import LocalPlanning
from planner.rolling_window.multi_step_search import Candidate
from planner.rolling_window.window import guide_vector
from planner.shield.certificate import PROGRESS_SHARE, Certified, Certifier, hold_centre
from planner.shield.committed_plan import CommittedPlan, Start

CONCENTRIC_SHARE = 0.05
"""An arc whose centre lies within this share of the hold radius from that of a hold is part of the hold."""

_certifier = lru_cache(maxsize=8)(Certifier)


class Commitment:
    """Certifies courses."""

    def __init__(self, mission: Mission, local: LocalPlanning, least_m: float, shielded: bool = True) -> None:
        # A turn entered sooner than `least_m` ahead is taken only where neither the goal nor a turn about a place
        # ahead is certified: in a pocket of narrow gaps those lead on.
        self._mission, self._local, self._least_m, self._shielded = mission, local, least_m, shielded

    def commit(
        self,
        request: PlanRequest,
        start: Start,
        course: Course,
        candidates: list[Candidate],
        cut_m: float,
        wants_more_time: bool = False,
    ) -> CommittedPlan | None:
        """The part of a course that ends in a turn seen to be free, or in the goal circle where no turn leads on."""
        certified: Certified | None = Certified(course.path, course.path.length_m)
        if self._shielded:
            certified = self._certify(request.seen, course, cut_m)
        if certified is None:
            return None
        goal, nodes, met_m = self._mission.goal_m, course.nodes, self._local.memory.met_m

        def picture() -> PlanPicture:
            ways = ((start.position, *nodes), *(candidate.nodes for candidate in candidates))
            guide_m = np.array([start.position, goal])
            return PlanPicture(guide_m, candidates=tuple(np.array(way) for way in ways), met_m=met_m)

        plan = Plan(
            PlanStatus.FOUND,
            explanation(request.position_m, goal, nodes),
            waypoints_m=np.array([start.position, *nodes]),
            path=certified.path,
            picture=picture,
            wants_more_time=wants_more_time,
        )
        return CommittedPlan(plan, certified.path, course, certified.loiter_entry_m)

    def _certify(self, seen: MapView, course: Course, cut_m: float) -> Certified | None:
        """The certified part of a course with a turn late enough; else all of it to the goal, or any turn; or None."""
        certifier = self._certifier(1.5 * seen.spacing_m)
        terrain = self._local.room.terrain(self._mission.clearance_m + self._mission.tracking_error_m)
        certified = certifier.certify(course.path, seen, terrain, cut_m)
        enough_m = min(self._least_m, course.path.length_m - self._mission.goal_radius_m)
        if certified is not None and certified.loiter_entry_m >= enough_m:
            return certified
        to_goal = self._to_goal(certifier, course, seen, cut_m)
        return to_goal or certifier.certify_ahead(course.path, seen, terrain, cut_m) or certified

    def leads_on(
        self, found: CommittedPlan, start: Start, effective: CommittedPlan | None, elsewhere: bool = True
    ) -> bool:
        """Whether a certified plan gets anywhere: to the goal, or along its course to a hold.

        Flying on round the hold that the plan in effect ends in is no progress along the course. The hold has to be
        `elsewhere` than that one, or may be the same while that is ahead.
        """
        if not found.path.loiter:
            return True
        hold_m = PROGRESS_SHARE * self._mission.hold_radius_m
        before_m = sum(segment[5] for segment in start.prefix)
        if effective is not None and effective.path.loiter:
            circle = hold_centre(effective.path.segments[-1])
            circled_m = self._circled_m(found.path, circle)
            if (elsewhere or circled_m) and math.dist(hold_centre(found.path.segments[-1]), circle) < hold_m:
                return False
            before_m = max(before_m, circled_m)
        return found.loiter_entry_m - before_m >= hold_m

    def _circled_m(self, path: Path, circle: Point) -> float:
        """Length (m) of what lies on a hold's circle of a path that ends in a full turn, without that turn."""
        off_m = CONCENTRIC_SHARE * self._mission.hold_radius_m
        arcs = (segment for segment in path.segments[:-1].tolist() if segment[4])
        return math.fsum(arc[5] for arc in arcs if math.dist(hold_centre(arc), circle) <= off_m)

    def in_view_m(self, course: Course, seen: MapView) -> float:
        """Arc length (m) up to which a course has been seen to be free."""
        return self._certifier(seen.spacing_m).seen_free_to_m(course.path, seen)

    def _to_goal(self, certifier: Certifier, course: Course, seen: MapView, cut_m: float) -> Certified | None:
        """All of a course to the goal, if it is certified up to where the goal is surely reached; else None."""
        mission = self._mission
        if not course.to_goal or course.nodes[-1] != mission.goal_m:
            return None
        off_m, (xmin, ymin, xmax, ymax) = mission.tracking_error_m, mission.bounds_m
        end_m = course.path.length_m - (mission.goal_radius_m - off_m)
        if not end_m <= min(cut_m, course.path.length_m):
            return None
        bounds_m = (xmin + off_m, ymin + off_m, xmax - off_m, ymax - off_m)
        return certifier.certify_up_to(end_m, course.path, seen, bounds_m)

    def _certifier(self, spacing_m: float) -> Certifier:
        """The certifier of holds that asks for free space every `spacing_m`."""
        mission = self._mission
        return _certifier(self._local.room.holds, mission.clearance_m, mission.sensor_range_m, spacing_m)


def explanation(position: Point, goal: Point, nodes: Sequence[Point]) -> str:
    """Says what is ahead of the aircraft, and on which side it is passed."""
    ux, uy, left = guide_vector(position, goal)
    if len(nodes) < 2:
        return f"way to the goal in view, {left / 1000:.1f} km to go"
    x, y = nodes[0][0] - position[0], nodes[0][1] - position[1]
    side = "left" if ux * y - uy * x > 0.0 else "right"
    return f"obstacle ahead at {math.hypot(x, y) / 1000:.1f} km, passing {side}"
