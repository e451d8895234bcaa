"""Thinking in portions finds what thinking at once finds, and no portion is larger than asked for."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from unittest.mock import Mock

import numpy as np
import pytest

from planner import contract
from planner.contract import GivenMap
from planner.geometry.course import Course
from planner.geometry.curves import Point, Pose, places_along
from planner.interface import MapView, Mission, Path
from planner.memory import ObstacleMemory
from planner.rolling_window.anytime_search import AnytimeSearch
from planner.rolling_window.local_planning import LocalPlanning
from planner.shield.committed_plan import Start
from tests.planner.rolling_window.test_pose_search import returned
from tests.planner.rolling_window.test_rolling_window import seen_at_once
from tests.planner.walls_and_paths import ring, wall

MISSION = replace(
    contract.MISSION,
    goal_m=(12_000.0, 0.0),
    goal_radius_m=100.0,
    bounds_m=(-4000.0, -8000.0, 16_000.0, 8000.0),
    sensor_range_m=8000.0,
)
START = Start((0.0, 0.0), Pose(0.0, 0.0, 1.0, 0.0))


@pytest.fixture
def trap() -> MapView:
    """A U that is open towards the start, and a wall behind it."""
    corners = [(2000.0, 2000.0), (6000.0, 2000.0), (6000.0, -2000.0), (2000.0, -2000.0)]
    sides = [wall(a, b, 50.0) for a, b in pairwise(corners)]
    return GivenMap(np.concatenate([*sides, wall((8000.0, -5000.0), (8000.0, 1500.0), 50.0)]))


def planning(
    seen: MapView,
    closed: Callable[[], bool] = lambda: False,
    memory: ObstacleMemory | None = None,
    mission: Mission = MISSION,
    open_to_m: float | None = None,
) -> tuple[LocalPlanning, AnytimeSearch]:
    memory = memory or ObstacleMemory(mission.clearance_m)
    memory.take_in(seen)
    local = LocalPlanning(mission, memory, margin_m=20.0, steps=16, candidates=12)
    asked = None if open_to_m is None else lambda course: open_to_m
    return local, AnytimeSearch(local, 0, closed, open_to_m=asked)


def all_courses(thinking: AnytimeSearch, work: int, start: Callable[[], Start]) -> tuple[list[Course], int]:
    courses, portions = [], 0
    while not thinking.exhausted:
        courses += list(thinking.courses(start(), None, work))
        portions += 1
        assert portions < 10_000
    return courses, portions


def test_in_portions_and_at_once_the_same_is_found(trap: MapView) -> None:
    at_once, one = all_courses(planning(trap)[1], 10**9, lambda: START)
    slowly, many = all_courses(planning(trap)[1], 5, lambda: START)
    assert (one, many > 10) == (1, True)
    assert [course.nodes for course in slowly] == [course.nodes for course in at_once]
    assert (at_once[0].shortest, at_once[0].nodes[-1]) == (True, MISSION.goal_m)


def test_a_portion_is_hardly_larger_than_asked_for(trap: MapView) -> None:
    """It ends with the step that makes it full, or with the route that is optimised."""
    local, thinking = planning(trap)
    portions = 0
    while not thinking.exhausted:
        before = local.work_count.total
        list(thinking.courses(START, None, 800.0))
        assert local.work_count.total - before < 2 * 800.0
        portions += 1
    assert portions > 7


@pytest.mark.parametrize(("most", "portions"), [(1.3e6, 650), (1e7, 667 + 732 + 1000)])
def test_portions_grow_in_a_search_that_goes_on_for_minutes(
    trap: MapView, monkeypatch: pytest.MonkeyPatch, most: float, portions: int
) -> None:
    """By hand: 2,000 a portion up to 1.33 million, 0.15 % more in each up to 4 million, then 6,000."""
    local, thinking = planning(trap)

    def endless(*_: object) -> Iterator[None]:
        while True:
            local.work_count.add(0, 10.0, 1)
            yield

    monkeypatch.setattr(local, "route", endless)
    asked = 0
    while local.work_count.total < most:
        assert not list(thinking.courses(START, None, 2000.0))
        asked += 1
    assert asked == pytest.approx(portions, rel=0.005)


@pytest.mark.parametrize("other_way", [False, True])
def test_what_is_found_late_begins_where_the_aircraft_has_got_to(other_way: bool, trap: MapView) -> None:
    """So does a way that waited for a wider one, for it passes obstacles on the other side than the course flown."""
    nodes: tuple[Point, ...] = ((1800.0, -2300.0), (6200.0, -2300.0), (8000.0, -5300.0), MISSION.goal_m)
    course = Course(Path.through(np.array([(0.0, 0.0), *nodes])), nodes, len(trap.edges_since(-1)), False)
    _, thinking = planning(trap)
    flown_m = found = 0.0
    while not thinking.exhausted:
        flown_m += 12.5
        begin = Start((flown_m, 0.0), Pose(flown_m, 0.0, 1.0, 0.0))
        for each in thinking.courses(begin, course if other_way else None, 5):
            assert each.path.segments[0, :2].tolist() == list(begin.pose[:2])
            found += 1
    assert (flown_m > 50.0, found > 0) == (True, True)


def test_a_curve_is_judged_by_the_points_and_the_start_that_it_is_asked_for_with() -> None:
    post, goal = np.array([(3000.0, 0.0)]), MISSION.goal_m
    local, _ = planning(GivenMap(post))
    wanted, beside = local.attempts()[0], Start((3000.0, 100.0), Pose(3000.0, 100.0, 1.0, 0.0))
    asked = [(START, post[:0]), (START, post), (beside, post)]  # no more is kept than a start lies away
    found = [local.fitted(start, wanted, [start.position, goal], points) for start, points in asked]
    assert [each is not None for each in found] == [True, False, True]


def test_walled_in_the_proof_ends_it() -> None:
    closed = Mock(return_value=True)
    _, thinking = planning(GivenMap(ring(0.0, 0.0, 3000.0, 50.0)), closed)
    assert (all_courses(thinking, 40, lambda: START)[0], closed.called) == ([], True)


def test_what_comes_into_view_meanwhile_does_not_turn_the_search_the_other_way() -> None:
    """The near end of a wall is passed although more of the wall behind that end is seen before the search ends."""
    across = wall((3000.0, -700.0), (3000.0, 6000.0), 50.0)
    seen, memory = seen_at_once(across), ObstacleMemory(MISSION.clearance_m)
    _, thinking = planning(seen, memory=memory)
    assert not list(thinking.courses(START, None, 2))
    seen.show(wall((3000.0, -700.0), (6000.0, -700.0), 50.0))
    memory.take_in(seen)
    course = next(iter(thinking.courses(Start((100.0, 0.0), Pose(100.0, 0.0, 1.0, 0.0)), None, 10**6)))
    assert (course.known, course.shortest) == (len(across), True)
    assert min(north for _, north in course.nodes) < -800.0
    assert course.path.length_m < 12_500.0


@pytest.mark.parametrize(
    ("flown_before", "grown_m", "wind_mps", "north"),
    [(False, 0, 0, False), (True, 0, 0, True), (False, 20, 8, False), (False, 100, 8, True), (False, 100, 0, False)],
)  # fmt: skip
def test_of_two_ways_nearly_alike_the_one_is_taken_that_does_not_lead_back_or_has_not_grown_in_wind(
    flown_before: bool, grown_m: int, wind_mps: int, north: bool
) -> None:
    """The side changes for 3 % of 12.6 km, which is 0.38 km, and the 0.07 km more: between six times 20 and 100 m.

    Among ways without room for holds nothing is held against a way that has grown.
    """
    mission = replace(MISSION, wind_mps=float(wind_mps))
    local, _ = planning(GivenMap(wall((6000.0, -2000.0), (6000.0, 2100.0), 50.0)), mission=mission)
    nodes = ((6000.0, -2250.0), MISSION.goal_m)
    ways = ([*((-float(grown_m), 0.0),) * (grown_m > 0), (0.0, 0.0), *nodes], [(0.0, 0.0), *nodes])
    grown, south = (Course(Path.through(np.array(way)), nodes, local.memory.known, False) for way in ways)
    assert [local.growth_m(grown, south) for _ in range(4)] == pytest.approx([grown_m] * 4)
    assert math.isinf(local.growth_m(south, None))  # from here on it is another course, which has not grown
    assert local.growth_m(grown, south) == pytest.approx(grown_m)
    if flown_before:
        for share in np.linspace(0.3, 1.0, 60).tolist():
            local.trail.add((6000.0 * share, -2200.0 * share))
    for attempt, to_the_north in ((local.wide_attempt, north), (local.attempts()[0], flown_before)):
        way = returned(local.route(attempt, 0, lambda: (START, south if grown_m else None), [], lambda: False))
        assert way is not None
        assert (way.nodes[0][1] > 0.0) is to_the_north


@pytest.mark.parametrize(
    ("gap_m", "off_m", "border_m", "open_to_m", "aside"),
    [
        (500.0, 1200.0, 8000.0, 3050.0, True),
        (500.0, 1200.0, 8000.0, 3200.0, False),  # the gap, 3.1 km ahead, is seen to lead on
        (500.0, 1200.0, 8000.0, None, False),  # room is not asked for
        (500.0, 2000.0, 8000.0, 0.0, False),  # longer by more than half a hold, which is 471 m
        (900.0, 1200.0, 8000.0, 0.0, False),  # a hold has room in the gap
        (500.0, 1200.0, 1300.0, 0.0, False),  # and none between the end of the wall and the border
    ],
)
def test_a_way_with_room_for_holds_may_be_longer_by_half_a_hold(
    gap_m: float, off_m: float, border_m: float, open_to_m: float | None, aside: bool
) -> None:  # fmt: skip
    """A wall across with a gap 900 m north of the way straight on, an end south of it, a post behind; 200 m clear."""
    south, north = 900.0 - 0.5 * gap_m, 900.0 + 0.5 * gap_m
    ends = (3000.0, north, 8000.0), (3000.0, 370.0 - off_m, south), (6000.0, -300.0, -200.0)
    parts = [wall((x, a), (x, b), 50.0) for x, a, b in ends]
    mission = replace(MISSION, bounds_m=(-4000.0, -border_m, 16_000.0, 8000.0))
    _, thinking = planning(GivenMap(np.concatenate(parts)), mission=mission, open_to_m=open_to_m)
    course, *others = thinking.courses(START, None, 10**9)
    assert (len(others), course.nodes[0][1] < -500.0) == (2 + aside, aside)  # offered once
    around_m, through_m = (math.hypot(3000.0, y) + math.hypot(9000.0, y) for y in (off_m, south + 220.0))
    assert course.path.length_m == pytest.approx(around_m if aside else through_m, abs=60.0)
    assert not aside or through_m < around_m < through_m + math.pi * MISSION.hold_radius_m


@pytest.mark.parametrize("gap_m", [0.0, 600.0])
def test_a_wide_search_is_led_to_a_way_that_leads_back_and_told_soon_that_there_is_none(gap_m: float) -> None:
    """A room with columns, its door behind the aircraft."""
    west, east, north = -3000.0, 6000.0, 4500.0
    corners = [(west, 0.5 * gap_m), (west, north), (east, north), (east, -north), (west, -north)]
    walls = [wall(a, b, 50.0) for a, b in pairwise([*corners, (west, -0.5 * gap_m)])]
    columns = [(float(x), float(y)) for x in range(-2000, 5500, 1200) for y in range(-3500, 4000, 1200)]
    rings = [ring(x, y, 200.0, 50.0) for x, y in columns if math.hypot(x, y) > 700.0]
    local, thinking = planning(GivenMap(np.concatenate([*walls, *rings])))
    courses, _ = all_courses(thinking, 10**9, lambda: START)
    assert local.work_count.total < (400_000.0 if gap_m else 100_000.0)
    assert (len(thinking.candidates) > 0) == (len(courses) > 0) == (gap_m > 0.0)
    along_it = math.dist((west, 0.0), (west - 200.0, north)) + math.dist((6200.0, 4700.0), (12e3, 0))
    for course in courses:
        assert course.nodes[-1] == MISSION.goal_m
        assert course.path.length_m < 1.06 * (3000.0 + 9400.0 + along_it)


def test_a_turn_is_flown_on_to_where_a_curve_fits_the_way_out() -> None:
    """A ring about the turn, open where the tangent north leaves it: no wider arc fits in it."""
    turn_m, wide_m = 0.8 * MISSION.turn_radius_m, MISSION.turn_radius_m
    outer_m = turn_m + MISSION.clearance_m + 10.0
    bearing = np.linspace(0.0, math.tau, 400)
    ring = np.column_stack((outer_m * np.cos(bearing), turn_m + outer_m * np.sin(bearing)))
    open_ = (np.abs(ring[:, 0] - turn_m) < 1.3 * MISSION.clearance_m) & (ring[:, 1] > turn_m)
    local, _ = planning(GivenMap(ring[~open_]))
    attempt = local.attempts()[1]
    start = Start((0.0, 0.0), Pose(0.0, 0.0, 1.0, 0.0), 1.0 / turn_m)
    nodes, points = [(0.0, 0.0), (turn_m, turn_m + 8.0 * wide_m)], local.memory.points_m
    assert local.fitted(start, attempt, nodes, points) is None
    route = local.fitted(start, attempt, nodes, points, turning=True)
    assert route is not None
    assert route.path.segments[0].tolist()[:5] == [0.0, 0.0, 1.0, 0.0, 1.0 / turn_m]
    away = places_along(route.path, route.path.length_m, 2000)[:, None] - ring[~open_]
    assert np.hypot(away[..., 0], away[..., 1]).min() > MISSION.clearance_m
