"""What of a course is flown: to a turn that keeps its distance, or to the goal where the whole of it may be."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from planner import contract
from planner.contract import GivenMap
from planner.geometry.course import Course
from planner.geometry.curves import Point, Pose, along
from planner.interface import MapView, Mission, Path, Plan, PlanRequest, PlanStatus
from planner.memory import ObstacleMemory
from planner.rolling_window.commitment import Commitment, explanation
from planner.rolling_window.local_planning import LocalPlanning
from planner.rolling_window.rolling_search import choose_hold
from planner.shield.certificate import hold_centre
from planner.shield.committed_plan import CommittedPlan, Start
from tests.planner.walls_and_paths import wall

MISSION = replace(
    contract.MISSION,
    goal_m=(1000.0, 0.0),
    goal_radius_m=50.0,
    clearance_m=40.0,
    sensor_range_m=3000.0,
    turn_radius_m=100.0,
    bounds_m=(-500.0, -500.0, 1500.0, 500.0),
)
LEAST_M = 400.0
OVER_M = 1000.0 - (50.0 - 3.0)
"""Station of the course at which an aircraft that is off it by the tracking error is at the goal all the same."""
NARROW = replace(MISSION, bounds_m=(-500.0, -90.0, 1500.0, 90.0))  # no room to turn in it

AT_ORIGIN = Start((0.0, 0.0), Pose(0.0, 0.0, 1.0, 0.0))


def held(*segments: tuple[float, ...], entry_m: float) -> CommittedPlan:
    """A plan whose last segment is a full turn to the left."""
    path = Path(np.array(segments), loiter=True)
    return CommittedPlan(Plan(PlanStatus.FOUND, "", path.segments[:, :2], path), path, to_goal(), entry_m)


def test_a_new_plan_has_to_gain_a_quarter_of_a_hold_and_to_end_in_another() -> None:
    commitment, _ = committed(GivenMap(np.zeros((0, 2))), MISSION, to_goal())
    round_100 = (1.0, 0.0, 1.0 / 100.0, math.tau * 100.0)
    flown = held((0.0, 0.0, *round_100), entry_m=0.0)

    def ahead(length_m: float) -> CommittedPlan:
        return held((0.0, 0.0, 1.0, 0.0, 0.0, length_m), (length_m, 0.0, *round_100), entry_m=length_m)

    def leads_on(length_m: float, effective: CommittedPlan | None, elsewhere: bool = True) -> bool:
        return commitment.leads_on(ahead(length_m), AT_ORIGIN, effective, elsewhere)

    assert [leads_on(length_m, None) for length_m in (24.0, 26.0)] == [False, True]
    assert [leads_on(length_m, flown) for length_m in (24.0, 26.0)] == [False, True]
    whole_turn = (0.0, 0.0, 1.0, 0.0, 1.0 / 100.0, math.tau * 100.0)
    for line_m, gets_on in ((20.0, False), (30.0, True)):  # a turn in the hold before the line is no progress
        found = held(whole_turn, *map(tuple, ahead(line_m).path.segments), entry_m=math.tau * 100.0 + line_m)
        assert commitment.leads_on(found, AT_ORIGIN, flown) is gets_on
    back = held(whole_turn, (0.0, 0.0, 1.0, 0.0, 0.0, 300.0), (0.0, 0.0, *round_100), entry_m=928.0)
    assert not commitment.leads_on(back, AT_ORIGIN, flown, elsewhere=False)
    # Another way to the hold ahead leads on, if it may, as far as that is ahead.
    assert [leads_on(length_m, ahead(length_m), False) for length_m in (24.0, 300.0)] == [False, True]
    assert not leads_on(300.0, ahead(300.0))


def test_another_hold_than_the_one_ahead_is_flown_to_only_on_a_way_that_is_hardly_longer() -> None:
    turn = held((0.0, 0.0, 1.0, 0.0, 1.0 / 100.0, math.tau * 100.0), entry_m=400.0)
    ahead, *others = (replace(turn, course=to_goal(length_m)) for length_m in (1000.0, 1059.0, 1061.0))
    assert [choose_hold(ahead, each) is each for each in others] == [True, False]
    assert choose_hold(None, others[1]) is others[1]


def to_goal(length_m: float = 1000.0) -> Course:
    east, north = MISSION.goal_m
    path = Path(np.array([(east - length_m, north, 1.0, 0.0, 0.0, length_m)]))
    return Course(path, (MISSION.goal_m,), 0, True)


def committed(
    seen: MapView, mission: Mission, course: Course, cut_m: float = math.inf
) -> tuple[Commitment, CommittedPlan | None]:
    memory = ObstacleMemory(mission.clearance_m)
    memory.take_in(seen)
    local = LocalPlanning(mission, memory, margin_m=10.0, steps=3, candidates=3)
    commitment = Commitment(mission, local, LEAST_M)
    east, north = course.path.segments[0, :2].tolist()
    start = Start((east, north), Pose(east, north, 1.0, 0.0))
    request = PlanRequest(0.0, (east, north), (1.0, 0.0), seen)
    return commitment, commitment.commit(request, start, course, [], cut_m)


@pytest.mark.parametrize(("room_m", "fits"), [(41.0, False), (42.5, False), (43.5, True)])
def test_a_turn_keeps_the_clearance_and_the_tracking_error(room_m: float, fits: bool) -> None:
    """A turn beside the course has no room, one whose centre is on it just so."""
    beside = MISSION.turn_radius_m + room_m
    walls = [wall((-300.0, side * beside), (1300.0, side * beside), 5.0) for side in (1.0, -1.0)]
    _, found = committed(GivenMap(np.concatenate(walls)), MISSION, replace(to_goal(), to_goal=False))
    assert (found is not None) is fits
    if found is not None:
        assert found.path.loiter
        centre = hold_centre(found.path.segments[-1])
        assert centre[1] == pytest.approx(0.0, abs=1e-6)
        assert found.loiter_entry_m < centre[0]
        for before, after in pairwise(found.path.segments.tolist()):
            np.testing.assert_allclose(along(before, before[5]), after[:4], atol=1e-6)


def test_the_goal_is_flown_to_where_no_turn_leads_on_and_near_it_one_is_kept_in_reserve() -> None:
    for mission, length_m, entry_m in ((NARROW, 1000.0, OVER_M), (MISSION, 0.5 * LEAST_M, None)):
        commitment, found = committed(GivenMap(np.zeros((0, 2))), mission, to_goal(length_m))
        assert found is not None
        assert commitment.leads_on(found, AT_ORIGIN, None)
        assert found.path.loiter is (entry_m is None)
        assert entry_m is None or found.loiter_entry_m == pytest.approx(entry_m)
        assert found.plan.wants_more_time is False


@pytest.mark.parametrize(("cut_m", "flown"), [(OVER_M - 0.1, False), (OVER_M + 0.1, True)])
def test_no_further_than_something_is_in_the_way(cut_m: float, flown: bool) -> None:
    _, found = committed(GivenMap(np.zeros((0, 2))), NARROW, to_goal(), cut_m)
    assert (found is not None) is flown


def test_a_course_that_ends_elsewhere_is_not_flown_to_its_end() -> None:
    open_space = GivenMap(np.zeros((0, 2)))
    assert committed(open_space, NARROW, replace(to_goal(), nodes=((900.0, 0.0),)))[1] is None
    assert committed(open_space, NARROW, replace(to_goal(), to_goal=False))[1] is None


@pytest.mark.parametrize("side", range(4))
def test_nor_nearer_to_the_border_than_an_aircraft_may_be_off_it(side: int) -> None:
    for off_m, flown in ((2.9, False), (3.1, True)):
        bounds = list(NARROW.bounds_m)
        bounds[side] = (0.0, 0.0, OVER_M, 0.0)[side] + (off_m if side >= 2 else -off_m)
        mission = replace(NARROW, bounds_m=(bounds[0], bounds[1], bounds[2], bounds[3]))
        _, found = committed(GivenMap(np.zeros((0, 2))), mission, to_goal())
        assert (found is not None) is flown


def test_a_plan_says_what_is_ahead_and_on_which_side_it_is_passed() -> None:
    goal, ahead = (10_000.0, 0.0), "obstacle ahead at 3.0 km, passing"
    nodes: list[list[Point]] = [[(3000.0, 400.0), goal], [(3000.0, -400.0), goal], [goal]]
    told = [explanation((0.0, 0.0), goal, each) for each in nodes]
    assert told == [f"{ahead} left", f"{ahead} right", "way to the goal in view, 10.0 km to go"]
