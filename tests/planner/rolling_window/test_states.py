"""The states of the rolling-window planner, and each transition between them."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from planner.geometry.course import Course
from planner.geometry.curves import Pose, on_loiter
from planner.interface import (
    BoolArray,
    FloatArray,
    Mission,
    NoWayToBegin,
    Path,
    Plan,
    PlanRequest,
    PlanStatus,
)
from planner.memory import ObstacleMemory
from planner.rolling_window.dead_ends import MOST_EFFORT, MOST_LOOKS, MOST_RETRIES, GivingUp
from planner.rolling_window.planner import NO_BETTER, RollingWindow
from planner.rolling_window.rolling_search import Work
from planner.rolling_window.situation import NoRoomToTurn, NoWayFound, PlanningState, Situation
from planner.shield.certificate import CertificateBroken
from planner.shield.committed_plan import Start
from planner.shield.escape import Escape
from planner.world_stability import WorldStability
from tests.planner.rolling_window.test_rolling_window import (
    MISSION,
    SPACING,
    Seen,
    first_request,
    nothing,
    planner,
    request_on,
    seen_at_once,
)
from tests.planner.walls_and_paths import ring


class HalfOpen(Seen):
    """Nothing is known of what lies further east than some place."""

    to_m = 3000.0

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        return points_m[:, 0] < self.to_m


def flown(pilot: RollingWindow, seen: Seen) -> Plan:
    plan = pilot.plan(first_request(seen))
    assert plan.status is PlanStatus.FOUND
    return plan


def loitering(mission: Mission = MISSION) -> tuple[RollingWindow, Seen, Plan, float]:
    """A planner whose aircraft is in the turn that its plan ends with, and where that begins."""
    seen, pilot = HalfOpen(nothing()), planner(mission)
    plan = flown(pilot, seen)
    assert plan.path is not None
    entry_m = plan.path.length_m - float(plan.path.segments[-1, 5])
    pilot.plan(request_on(plan, entry_m - 1.0, seen))
    assert pilot.state is PlanningState.FOLLOWING
    return pilot, seen, plan, entry_m


def searched_in_vain(pilot: RollingWindow, *, exhausted: bool = True, stuck: object = None) -> None:
    search = SimpleNamespace(exhausted=exhausted, stuck=stuck, candidates=[])
    pilot._search.last = search  # type: ignore[assignment]


def proved(pilot: RollingWindow, *, no_way: bool = False, no_room: bool = False) -> None:
    """So much is proved of the edges seen."""
    for proof in (pilot._proofs.no_way, pilot._proofs.none_to_find):
        proof.closed = lambda position, most=0: no_way  # type: ignore[method-assign]
    pilot._proofs.no_room_to_turn.closed = lambda position, most=0: no_room  # type: ignore[method-assign]


def in_the_loiter() -> tuple[RollingWindow, Situation]:
    pilot, seen, plan, entry_m = loitering()
    request = request_on(plan, entry_m + 50.0, seen)
    pilot.plan(request)
    assert pilot._monitor.plan is not None
    return pilot, Situation(request, pilot._monitor.plan, entry_m + 50.0)


def test_a_plan_that_serves_is_prolonged_and_followed_on() -> None:
    seen, pilot = Seen(nothing()), planner()
    plan = flown(pilot, seen)
    answers = []
    for step in range(1, 80):
        answers.append(pilot.plan(request_on(plan, 100.0 * step, seen)))
        assert pilot.state is PlanningState.FOLLOWING
        if answers[-1].status is PlanStatus.FOUND:
            break
    assert answers[-1].path is not None
    assert plan.path is not None
    assert answers[-1].path.length_m > plan.path.length_m - 100.0 * len(answers)
    assert {each.reason for each in answers[:-1] if each.status is PlanStatus.NO_BETTER} <= {NO_BETTER}


def test_in_its_turn_the_aircraft_loiters_and_gives_up_a_place_that_was_turned_before_twice() -> None:
    pilot, seen, plan, entry_m = loitering()
    assert math.isinf(pilot._search.turned_m)
    request = request_on(plan, entry_m + 10.0, seen)
    pilot.plan(request)
    turned_m, (goal_east_m, _) = math.dist(request.position_m, MISSION.goal_m), MISSION.goal_m
    for nearer_m, with_room_first in (
        (0.99 * MISSION.sensor_range_m, False),
        (1.01 * MISSION.sensor_range_m, True),
    ):
        search = pilot._search._begin((goal_east_m - turned_m + nearer_m, 0.0))
        assert (search._open_to_m is not None) is with_room_first
    assert pilot.state in (PlanningState.LOITERING, PlanningState.GIVING_UP)
    pilot.plan(request_on(plan, entry_m + 11.0, seen))
    assert pilot.state is PlanningState.LOITERING
    assert len(pilot._memory.refused_m) == 0
    committed = pilot._monitor.plan
    assert committed is not None
    pilot._loitered = None  # as if another plan had come to the same place
    pilot._loiter(Situation(request_on(plan, entry_m + 50.0, seen), committed, entry_m + 50.0), committed)
    assert pilot.state is PlanningState.LOITERING
    assert len(pilot._memory.refused_m) > 0


def test_from_the_loiter_a_way_that_opens_is_followed() -> None:
    pilot, _, plan, entry_m = loitering()
    for step in range(40):
        answer = pilot.plan(request_on(plan, entry_m + 25.0 * step, Seen(nothing())))
        if answer.status is PlanStatus.FOUND:
            break
    assert (answer.status, pilot.state) == (PlanStatus.FOUND, PlanningState.FOLLOWING)


def test_walled_in_at_the_start_a_turn_is_the_escape_where_there_is_room() -> None:
    pilot = planner()
    answer = pilot.plan(first_request(seen_at_once(ring(0.0, 0.0, 900.0, SPACING))))
    assert pilot.state is PlanningState.ESCAPING
    assert answer.path is not None
    assert answer.path.loiter
    pilot = planner()
    with pytest.raises(NoWayToBegin):
        pilot.plan(first_request(seen_at_once(ring(0.0, 0.0, 250.0, SPACING))))
    assert pilot.state is PlanningState.ESCAPING


@pytest.mark.parametrize("closed", [False, True])
def test_without_a_plan_the_proof_is_told_where_there_is_no_escape(closed: bool) -> None:
    pilot, seen = planner(), seen_at_once(np.array([(3000.0, 0.0)]))
    proved(pilot, no_way=closed)
    searched_in_vain(pilot)
    none = Escape(Plan(PlanStatus.NO_PATH, "no room yet"))
    pilot._escapes.at_start = lambda *_: none  # type: ignore[method-assign]
    told = (PlanStatus.NO_PATH, PlanningState.ESCAPING), (PlanStatus.UNREACHABLE, PlanningState.PROVING)
    assert (pilot._no_way_found(Situation(first_request(seen), None)).status, pilot.state) == told[closed]


def test_a_broken_plan_is_escaped_from_while_there_is_a_turn() -> None:
    pilot, now = in_the_loiter()
    pilot._monitor.broken = True
    searched_in_vain(pilot)
    pilot._no_way_found(now)
    assert pilot.state is PlanningState.ESCAPING


def test_a_broken_plan_without_an_escape_is_a_broken_certificate() -> None:
    pilot, seen, plan, entry_m = loitering()
    request = request_on(plan, entry_m + 50.0, seen)
    seen.show(np.array(request.position_m) + ring(0.0, 0.0, 60.0, 20.0))
    with pytest.raises(CertificateBroken):
        pilot.plan(request)
    assert pilot.state is PlanningState.ESCAPING


def test_a_first_turn_into_what_is_not_seen_is_no_certificate() -> None:
    seen, pilot = HalfOpen(nothing()), planner()
    seen.to_m = 100.0
    request = request_on(flown(pilot, seen), 50.0, seen)
    seen.show(np.array(request.position_m) + ring(0.0, 0.0, 60.0, 20.0))
    assert pilot.plan(request).status is not PlanStatus.UNREACHABLE


def test_a_search_that_is_not_done_goes_on_while_the_plan_is_flown() -> None:
    pilot, now = in_the_loiter()
    before = pilot.state
    searched_in_vain(pilot, exhausted=False)
    answer = pilot._no_way_found(now)
    wanted = PlanStatus.NO_PATH, "thinking on; the plan in effect goes on", True
    assert (answer.status, answer.reason, answer.wants_more_time) == wanted
    assert pilot.state is before


def east_to(east_m: float) -> Course:
    return Course(Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, east_m)])), ((east_m, 0.0),), 0, False)


def found_of(pilot: RollingWindow, course: Course, now: PlanRequest, serves: bool = False) -> bool:
    """Whether a search that finds one course leads to a plan."""
    search = SimpleNamespace(courses=lambda *_: [course], exhausted=True, stuck=None, candidates=[], known=0)
    pilot._search._begin = lambda _: search  # type: ignore[assignment, method-assign, return-value]
    start, ahead = Start((0.0, 0.0), Pose(0.0, 0.0, 1.0, 0.0)), east_to(MISSION.goal_m[0])
    return pilot._search.go_on(now, start, ahead, serves, Work.WHILE_CUT, None) is not None


def test_where_no_other_hold_is_found_another_way_to_the_one_ahead_is_flown() -> None:
    seen, pilot = HalfOpen(nothing()), planner()
    now = request_on(flown(pilot, seen), 100.0, seen)
    pilot.plan(now)
    assert pilot._monitor.plan is not None
    assert (found_of(pilot, pilot._monitor.plan.course, now), pilot._search.refused) == (True, 0)
    assert (found_of(pilot, east_to(10.0), now), pilot._search.refused) == (False, 1)


def test_a_course_leads_on_to_a_hold_elsewhere_or_four_radii_short_of_what_is_in_sight() -> None:
    seen, pilot = HalfOpen(nothing()), planner()
    plan = flown(pilot, seen)
    assert plan.path is not None
    assert pilot._monitor.proposed is not None
    course, entry_m = pilot._monitor.proposed.course, plan.path.length_m - float(plan.path.segments[-1, 5])
    in_sight_m = HalfOpen.to_m - 4.0 * MISSION.hold_radius_m
    assert in_sight_m + SPACING < pilot._search._open_to_m(course) == pytest.approx(entry_m)
    pilot.plan(request_on(plan, 100.0, seen))  # it is in effect: the hold is no other
    assert pilot._search._open_to_m(course) == pytest.approx(in_sight_m, abs=SPACING)


def test_of_plans_too_near_to_what_moves_the_one_that_keeps_off_most_is_kept() -> None:
    search, threats = planner()._search, SimpleNamespace(room_m=lambda path, *_: path)
    search._commitment.leads_on = lambda *_: True  # type: ignore[method-assign]
    ways = [SimpleNamespace(path=room_m) for room_m in (20.0, 60.0, 40.0)]
    start = Start((0.0, 0.0), Pose(0.0, 0.0, 1.0, 0.0))
    assert not any(search._may_be_flown(way, start, threats) for way in ways)  # type: ignore[arg-type]
    assert search.nearer is ways[1]  # type: ignore[comparison-overlap]


def test_a_course_that_serves_is_not_left_for_the_beginning_of_another() -> None:
    seen, pilot = Seen(nothing()), planner()
    now = request_on(flown(pilot, seen), 0.0, seen)
    assert [found_of(pilot, east_to(900.0), now, serves) for serves in (True, False)] == [False, True]


@pytest.mark.parametrize(("turns", "given_up"), [(0.9, False), (1.1, True)])
def test_a_course_that_cannot_be_entered_is_given_up_after_a_whole_turn(turns: float, given_up: bool) -> None:
    pilot, now = in_the_loiter()
    assert now.plan is not None
    proved(pilot)
    searched_in_vain(pilot, stuck=now.plan.course)
    arc_length_m = now.plan.loiter_entry_m + turns * math.tau * MISSION.turn_radius_m
    later = now.request._replace(arc_length_m=arc_length_m)
    pilot._no_way_found(Situation(later, now.plan, on_loiter(now.plan.path, arc_length_m)))
    assert pilot.state is PlanningState.GIVING_UP
    assert (len(pilot._memory.refused_m) > 0) is given_up


def test_a_closed_chain_of_edges_is_the_proof_that_there_is_no_way() -> None:
    pilot, now = in_the_loiter()
    proved(pilot, no_way=True)
    searched_in_vain(pilot)
    answer = pilot._no_way_found(now)
    assert (answer.status, pilot.state) == (PlanStatus.UNREACHABLE, PlanningState.PROVING)
    assert "no gap in it is wider than" in answer.reason


@pytest.mark.parametrize("far_off", [False, True])
def test_a_chain_that_edge_points_may_be_too_far_off_to_close_is_told_as_no_proof(far_off: bool) -> None:
    pilot, now = in_the_loiter()
    proved(pilot, no_way=True)
    if far_off:
        pilot._proofs.exact = False
    else:
        pilot._proofs.no_way.closed = lambda position, most=0: False  # type: ignore[method-assign]
    searched_in_vain(pilot)
    assert pilot._no_way_found(now).status is PlanStatus.NO_PATH
    assert pilot._local.last_attempts
    pilot._giving_up.refusals = MOST_LOOKS
    with pytest.raises(NoWayFound, match="does not prove the goal unreachable"):
        pilot._no_way_found(now)


def test_want_of_room_to_turn_is_proved_after_all_was_tried_again() -> None:
    pilot, now = in_the_loiter()
    proved(pilot, no_room=True)
    searched_in_vain(pilot)
    for _ in range(MOST_RETRIES + 1):
        assert pilot._no_way_found(now).status is PlanStatus.NO_PATH
    tries = range((MOST_RETRIES + 1) * (MOST_EFFORT + 2))
    with pytest.raises(NoRoomToTurn, match=r"(?s)none is 700 m wide.*does not prove the goal unreachable"):
        assert all(pilot._no_way_found(now).status is PlanStatus.NO_PATH for _ in tries)
    assert pilot.state is PlanningState.PROVING
    assert pilot._giving_up.tried_again


def test_no_room_to_turn_is_no_verdict_while_a_place_is_given_up_that_the_sensor_may_err_about() -> None:
    memory = ObstacleMemory(MISSION.clearance_m)
    giving_up = GivingUp(MISSION, memory, WorldStability())
    giving_up.try_again(narrow=False, at_end=True, arc_length_m=0.0)
    memory.refuse((500.0, 0.0))
    assert giving_up.narrow(no_room=True, time_s=0.0)
    memory.ever_cleared = True
    assert not giving_up.narrow(no_room=True, time_s=0.0)
    memory.forget_refused()
    assert giving_up.narrow(no_room=True, time_s=0.0)
