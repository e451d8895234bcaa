"""Places that could not be entered: what of them is given up, and when there is said to be no way."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.geometry.curves import Pose, end_of
from planner.interface import FloatArray, Mission, MovingEdges, Plan, PlanStatus
from planner.rolling_window.dead_ends import MOST_EFFORT, MOST_RETRIES, RETRY_S
from planner.rolling_window.planner import RollingWindow
from planner.rolling_window.situation import NoRoomToTurn, Situation
from planner.world_stability import SETTLED_S
from tests.planner.rolling_window.test_rolling_window import (
    MISSION,
    SPACING,
    first_request,
    nothing,
    planner,
    request_on,
)
from tests.planner.rolling_window.test_states import HalfOpen, proved, searched_in_vain

FAR = np.array([(0.0, 9000.0), (400.0, 9000.0)])


def given_up(pilot: RollingWindow) -> FloatArray:
    """Places nearer than the edges that were seen far off."""
    known = pilot._memory.points_m[: pilot._memory.known]
    return known[known[:, 1] < 8000.0]


def circling(mission: Mission, to_m: float) -> tuple[RollingWindow, HalfOpen, Plan, float]:
    """A flight that turns before what is not known, until some place is given up; how far it flew."""
    seen, pilot = HalfOpen(nothing()), planner(mission)
    seen.to_m = to_m
    seen.show(FAR)
    plan = pilot.plan(first_request(seen))
    for step in range(400):
        pilot.plan(request_on(plan, 25.0 * step, seen))
        if len(given_up(pilot)):
            return pilot, seen, plan, 25.0 * step
    raise AssertionError("nothing was given up")


def test_what_cannot_be_entered_is_given_up_with_room_for_a_turn_though_noise_takes_edges_back() -> None:
    mission = replace(MISSION, turn_radius_m=500.0)
    pilot, seen, plan, flown_m = circling(mission, 3000.0)
    refused = given_up(pilot)
    assert len(refused) == 5
    assert np.ptp(refused[:, 0]) < 400.0
    np.testing.assert_allclose(np.hypot(*np.diff(refused, axis=0).T), mission.clearance_m)
    assert abs(refused[2, 0] - 3000.0) < 2.0 * SPACING
    seen.show(FAR + 50.0)
    seen.last_removal_revision = seen.revision
    pilot.plan(request_on(plan, flown_m + 25.0, seen))
    assert {*map(tuple, refused.tolist())} <= {*map(tuple, given_up(pilot).tolist())}


NEAR_GOAL = replace(MISSION, turn_radius_m=500.0, goal_m=(4000.0, 0.0), goal_radius_m=100.0)


def test_a_goal_in_view_without_room_for_a_turn_is_flown_to() -> None:
    seen, pilot = HalfOpen(nothing()), planner(NEAR_GOAL)
    seen.to_m = 4050.0
    plan = pilot.plan(first_request(seen))
    for step in range(160):
        if (answer := pilot.plan(request_on(plan, 25.0 * step, seen))).status is PlanStatus.FOUND:
            break
    assert plan.path is not None
    assert plan.path.loiter
    assert answer.path is not None
    assert not answer.path.loiter
    assert math.dist(end_of(answer.path)[:2], NEAR_GOAL.goal_m) < 1e-6
    assert len(given_up(pilot)) == 0


def test_a_goal_in_view_that_cannot_be_hit_is_approached_another_way() -> None:
    mission = replace(NEAR_GOAL, goal_radius_m=0.9 * NEAR_GOAL.tracking_error_m)
    pilot, _, _, _ = circling(mission, 4050.0)
    refused = given_up(pilot)
    assert len(refused) == 1
    assert abs(math.dist(refused[0], mission.goal_m) - 500.0) < 2.0 * SPACING


@pytest.mark.parametrize(("gone", "searches"), [(0, 1), (3, MOST_EFFORT)])
def test_where_edges_go_while_it_searches_no_way_is_told_later(gone: int, searches: int) -> None:
    """All is given up, and the edges leave no way that has room to turn: all is tried again before."""
    pilot, seen, plan, flown_m = circling(replace(MISSION, turn_radius_m=500.0), 3000.0)
    pilot._memory.cleared += gone
    now = Situation(request_on(plan, flown_m, seen), pilot._monitor.plan, flown_m)
    assert now.plan is not None
    proved(pilot, no_room=True)
    searched_in_vain(pilot)
    for _ in range(searches + MOST_RETRIES * (MOST_EFFORT + 1) - pilot._giving_up.effort):
        assert pilot._no_way_found(now).status is PlanStatus.NO_PATH
    with pytest.raises(NoRoomToTurn):
        pilot._no_way_found(now)


def far_on(pilot: RollingWindow, seen: HalfOpen, plan: Plan, flown_m: float, time_s: float) -> None:
    pilot.plan(request_on(plan, flown_m, seen)._replace(time_s=time_s))


@pytest.mark.parametrize("change", ["moves", "appears"])
def test_what_was_given_up_is_tried_again_a_minute_after_something_was_in_the_way(change: str) -> None:
    pilot, seen, plan, flown_m = circling(MISSION, 3000.0)
    begin_s = flown_m / 25.0 + 1.0
    refused = given_up(pilot)
    if change == "moves":
        seen.moving = (MovingEdges(3.0, np.array([(9000.0, 9000.0)]), (1.0, 0.0)),)
    else:
        seen.last_contradiction_s = begin_s
    far_on(pilot, seen, plan, flown_m, begin_s)
    seen.moving = ()
    far_on(pilot, seen, plan, flown_m, begin_s + RETRY_S - 1.0)
    np.testing.assert_array_equal(given_up(pilot), refused)
    far_on(pilot, seen, plan, flown_m, begin_s + RETRY_S + 1.0)
    assert len(given_up(pilot)) == 0


@pytest.mark.parametrize("for_turns_alone", [False, True])
def test_while_something_may_be_gone_again_no_goal_is_called_unreachable(for_turns_alone: bool) -> None:
    """All is given up, and the edges leave no way."""
    pilot, seen, plan, flown_m = circling(replace(MISSION, turn_radius_m=500.0), 3000.0)
    changed_s = flown_m / 25.0
    seen.last_contradiction_s = changed_s
    far_on(pilot, seen, plan, flown_m, changed_s)
    flown = pilot._monitor.plan
    assert flown is not None
    proved(pilot, no_way=not for_turns_alone, no_room=True)
    searched_in_vain(pilot)

    def told(time_s: float) -> list[PlanStatus | None]:
        now = Situation(request_on(plan, flown_m, seen)._replace(time_s=time_s), flown, flown_m)
        statuses: list[PlanStatus | None] = []
        for _ in range((MOST_RETRIES + 1) * (MOST_EFFORT + 2)):
            try:
                statuses.append(pilot._no_way_found(now).status)
            except NoRoomToTurn:
                return [None]
        return statuses

    assert set(told(changed_s + SETTLED_S - 1.0)) == {PlanStatus.NO_PATH}
    pilot._giving_up.refuse(Pose(3000.0, 0.0, 1.0, 0.0))
    assert told(changed_s + SETTLED_S + 1.0)[-1] is (None if for_turns_alone else PlanStatus.UNREACHABLE)
    # Where it is for want of room to turn, what was given up was tried again before.
    assert (len(given_up(pilot)) == 0) is for_turns_alone
