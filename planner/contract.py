"""The requirements on every planner, as tests that its author can run.

    from planner.contract import PlannerContract

    class TestMine(PlannerContract):
        kind = MY_KIND

is a whole test module: pytest collects what the class inherits. The planner is flown without error among a few circles,
of which a sensor sees everything within its range. Asked is what the closed loop counts on, not that it is any good.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Sequence
from dataclasses import FrozenInstanceError, fields, is_dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from planner.geometry.curves import Point, along, on_loiter, pose_at, sample
from planner.interface import Mission, NoWayToBegin, PlanRequest, PlanStatus
from planner.nearest_edge import distance_to_edges
from planner.plan_checks import checked_plan
from planner.registry import PlannerKind

if TYPE_CHECKING:
    from planner.interface import BoolArray, FloatArray, MovingEdges, Plan, Planner

Disc = tuple[float, float, float]  # east and north of the centre, radius (m)

MISSION = Mission(  # mission on which every planner is tested
    goal_m=(18_000.0, 12_000.0),
    goal_radius_m=300.0,
    bounds_m=(0.0, 0.0, 20_000.0, 15_000.0),
    clearance_m=200.0,
    turn_radius_m=150.0,
    speed_mps=25.0,
    roll_in_s=1.0,
    tracking_error_m=3.0,
    sensor_range_m=6000.0,
)
START: Point = (1000.0, 1000.0)  # place where a test flight begins
AHEAD: Point = (math.sqrt(0.5), math.sqrt(0.5))  # unit vector of the course there
CIRCLES: tuple[Disc, ...] = ((7000.0, 5000.0, 1500.0), (12_000.0, 8200.0, 900.0), (15_500.0, 9000.0, 800.0))

ASKED_EVERY_S = 0.5  # simulated time between two calls of `plan`
AMONG_CIRCLES_S, IN_THE_OPEN_S = 300.0, 1500.0
"""Longest flights of the tests, among `CIRCLES` and in an empty world."""
SPACING_M = 50.0  # distance between neighbouring edge points


class GivenMap:
    """A seen world of (m, 2) edge points given beforehand; everything else is free."""

    spacing_m = SPACING_M
    revision = 1
    last_removal_revision = 0
    moving: tuple[MovingEdges, ...] = ()
    last_contradiction_s = -math.inf
    distance_m = distance_to_edges

    def __init__(self, points: FloatArray) -> None:
        self._points = points

    def edges_since(self, revision: int) -> FloatArray:
        """All points at first, then none."""
        return self._points[: len(self._points) if revision < self.revision else 0]

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        """(k,) true."""
        return np.ones(len(points_m), dtype=np.bool_)


class InRange(GivenMap):
    """The map of a flight among circles: edges that came within range of a place that was flown through."""

    def __init__(self, circles: Sequence[Disc], range_m: float) -> None:
        super().__init__(np.zeros((0, 2)))
        self.revision = 0
        self._circles, self._range = circles, range_m
        self._hidden = np.concatenate([self._points, *(circle_outline(*each) for each in circles)])
        self._shown: list[FloatArray] = []
        self._places = self._points

    def look(self, place: Point) -> None:
        """Takes a scan, unless one was taken nearby."""
        if len(self._places) and math.dist(self._places[-1], place) < 0.01 * self._range:
            return
        self._places = np.concatenate((self._places, [place]))
        if (near := np.hypot(*(self._hidden - place).T) < self._range).any():
            self.revision += 1
            self._shown.append(self._hidden[near])
            self._hidden = self._hidden[~near]

    def edges_since(self, revision: int) -> FloatArray:
        """(k, 2) edge points that came in after a revision."""
        return np.concatenate([self._points, *self._shown[max(revision, 0) :]])

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        """(k,) whether points were within range once and lie in no obstacle."""
        free = np.zeros(len(points_m), dtype=np.bool_)
        for place in self._places:
            free |= np.hypot(*(points_m - place).T) < self._range
        for x, y, radius in self._circles:
            free &= np.hypot(*(points_m - (x, y)).T) > radius
        return free


class ContractFlight:
    """A planner in a closed loop, its paths flown without error."""

    def __init__(self, kind: PlannerKind, mission: Mission, circles: Sequence[Disc], seconds: float) -> None:
        planner, seen = make(kind, mission), InRange(circles, mission.sensor_range_m)
        self.answers: list[tuple[PlanRequest, Plan]] = []  # every request and what was answered
        self.closest_m = math.inf  # smallest distance to the goal
        plan: Plan | None = None
        arc_length_m, position, direction = 0.0, START, AHEAD
        for number in range(int(seconds / ASKED_EVERY_S)):
            if plan is not None and plan.path is not None:
                pose = pose_at(plan.path, on_loiter(plan.path, arc_length_m))
                position, direction = pose[:2], pose[2:]
            self.closest_m = min(self.closest_m, math.dist(position, mission.goal_m))
            if self.closest_m <= mission.goal_radius_m:
                break
            seen.look(position)
            request = PlanRequest(ASKED_EVERY_S * number, position, direction, seen, plan, arc_length_m)
            answer = planner.plan(request)
            self.answers.append((request, answer))
            if answer.status is PlanStatus.FOUND:
                plan, arc_length_m = answer, 0.0
            arc_length_m += mission.speed_mps * ASKED_EVERY_S


flown_once = cache(ContractFlight)  # a flight that several tests look at


def circle_outline(east_m: float, north_m: float, radius_m: float) -> FloatArray:
    """(k, 2) edge points of a circle."""
    angle = np.arange(0.0, math.tau, SPACING_M / radius_m)
    return np.column_stack((east_m + radius_m * np.cos(angle), north_m + radius_m * np.sin(angle)))


def make(kind: PlannerKind, mission: Mission) -> Planner:
    """A planner for one flight, with the defaults of its keys."""
    return kind.make(kind.config().resolved(mission), mission)


def arrays_in(value: Any) -> list[FloatArray]:
    """All arrays in a plan, through tuples and dataclasses."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, tuple):
        return [array for each in value for array in arrays_in(each)]
    if is_dataclass(value):
        return [array for field in fields(value) for array in arrays_in(getattr(value, field.name))]
    return []


def bits(plan: Plan) -> tuple[object, ...]:
    """Status, reason and the bytes of all arrays of a plan, to be compared bit for bit."""
    return (plan.status, plan.reason, *((a.shape, a.tobytes()) for a in arrays_in(plan)))


class PlannerContract:
    """Tests of one planner kind, which a subclass sets; `mission` is what it is asked to fly."""

    kind: ClassVar[PlannerKind]
    mission: ClassVar[Mission] = MISSION

    def test_it_is_a_planner_with_a_summary_and_described_keys(self) -> None:
        """A plan is asked for with one request; keys are documented and frozen, and none is left to be derived."""
        planner, config = make(self.kind, self.mission), self.kind.config()
        assert list(inspect.signature(planner.plan).parameters) == ["request"]
        assert len(self.kind.summary) > 20, "say in the summary what it is"
        for field in fields(config):
            assert field.metadata["doc"], field.name
            np.testing.assert_raises(FrozenInstanceError, setattr, config, field.name, None)
        resolved = config.resolved(self.mission)
        assert all(getattr(resolved, field.name) is not None for field in fields(resolved))
        assert resolved.resolved(self.mission) == resolved

    def test_an_empty_world_is_flown_to_the_goal(self) -> None:
        """With nothing in the way the goal is reached, and no plan says that there is no way."""
        flown = ContractFlight(self.kind, self.mission, (), IN_THE_OPEN_S)
        assert flown.closest_m <= self.mission.goal_radius_m
        statuses = {answer.status for _, answer in flown.answers}
        assert not statuses & {PlanStatus.NO_PATH, PlanStatus.UNREACHABLE}

    def test_never_raises_wherever_the_first_plan_begins(self) -> None:
        """Whatever is seen, and on whatever course: in the open, in a ring, on an edge point, at the border.

        Only that there is no way to begin may be raised (`NoWayToBegin`).
        """
        ring = circle_outline(3000.0, 3000.0, 900.0)
        for course in np.arange(6) * math.tau / 6:
            direction = (math.sin(course), math.cos(course))
            for points in (np.zeros((0, 2)), ring, np.array([self.mission.goal_m]), np.array([START])):
                for position in (START, (3000.0, 3000.0), (0.0, 0.0), self.mission.goal_m):
                    request = PlanRequest(0.0, position, direction, GivenMap(points))
                    try:
                        answer = make(self.kind, self.mission).plan(request)
                    except NoWayToBegin:  # the one thing that a planner may raise, before its first plan
                        continue
                    assert isinstance(answer.status, PlanStatus)

    def test_two_instances_give_the_same_plans_bit_for_bit(self) -> None:
        """No clock, no randomness of its own, nothing shared between planners."""
        first = flown_once(self.kind, self.mission, CIRCLES, AMONG_CIRCLES_S)
        again = ContractFlight(self.kind, self.mission, CIRCLES, AMONG_CIRCLES_S)
        assert [bits(answer) for _, answer in again.answers] == [bits(answer) for _, answer in first.answers]
        assert len({answer.status for _, answer in first.answers}) > 1, "it never changes its answer"

    def test_its_answers_can_be_flown(self) -> None:
        """FOUND has waypoints and a path from the aircraft on, no tighter than it can turn, inside; no other has one.

        What the closed loop asks of an answer (`planner.plan_checks`) holds: else the flight would end there.
        """
        found, bounds_m = 0, np.array(self.mission.bounds_m)
        for request, answer in flown_once(self.kind, self.mission, CIRCLES, AMONG_CIRCLES_S).answers:
            plan = checked_plan(answer, request.position_m, self.mission)
            assert plan.reason
            assert (plan.path is not None) == (len(plan.waypoints_m) > 0) == (plan.status is PlanStatus.FOUND)
            if plan.path is None:
                continue
            found += 1
            rows = plan.path.segments
            np.testing.assert_allclose(rows[0, :2], request.position_m, atol=1e-3)
            if not self.kind.point:
                np.testing.assert_allclose(rows[0, 2:4], request.direction, atol=1e-5)
                assert plan.path.max_curvature_1pm <= 1.0 / self.mission.turn_radius_m + 1e-9
            meet = 2 if self.kind.point else 4  # that of a point may jump in direction
            for row, following in pairwise(rows):
                np.testing.assert_allclose(along(row, float(row[5]))[:meet], following[:meet], atol=1e-4)
            points = sample(plan.path, 100.0, 0.1)
            assert ((points >= bounds_m[:2] - 1e-6) & (points <= bounds_m[2:] + 1e-6)).all()
        assert found, "no plan was found among a few circles"

    def test_plans_and_what_they_are_made_from_stay_as_they_are(self) -> None:
        """It changes neither what it is given nor a plan handed out, and remembers what it was shown, not the array."""
        points = circle_outline(5000.0, 4000.0, 900.0)
        spoilt, answers = points.copy(), []
        for given in (spoilt, points):
            planner, seen = make(self.kind, self.mission), GivenMap(given)
            plan = planner.plan(PlanRequest(0.0, START, AHEAD, seen))
            assert plan.path is not None
            np.testing.assert_array_equal(given, points)
            before = bits(plan)
            np.testing.assert_raises(FrozenInstanceError, setattr, plan, "status", PlanStatus.KEPT)
            for array in arrays_in(plan):
                assert not array.flags.writeable
                assert not np.shares_memory(array, given)
            spoilt[:] = 0.0
            at_m = 0.4 * plan.path.length_m
            pose = pose_at(plan.path, at_m)
            answers.append(bits(planner.plan(PlanRequest(400.0, pose[:2], pose[2:], seen, plan, at_m))))
            assert bits(plan) == before
        np.testing.assert_array_equal(points, circle_outline(5000.0, 4000.0, 900.0))
        assert answers[0] == answers[1]
