"""Evading: the room that ways keep from what stands and what moves, and which way is flown for it."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from planner.geometry.curves import Limits, onward, pose_at, poses_at, sample
from planner.interface import BoolArray, FloatArray, MovingEdges, Path, Plan, PlanStatus
from planner.rolling_window.planner import RollingWindow
from planner.shield.encounters import EARLIEST, LATEST
from planner.shield.escape import LOITER_SHARES
from planner.shield.evasion import AHEAD_S, DISCOUNT, UNKNOWN_MPS, UNKNOWN_S, Threats, clearest, rolled_out
from tests.examples import examples
from tests.planner.rolling_window.test_rolling_window import (
    MISSION,
    Seen,
    first_request,
    nothing,
    planner,
    request_on,
)
from tests.planner.walls_and_paths import assert_flyable, ring, wall

LIMITS = Limits(230.0, 30.0)
SPEED, STEP = 25.0, 15.0
PREFIX = [(0.0, 0.0, 1.0, 0.0, 0.0, 50.0)]
WIDE = (-1e5, -1e5, 1e5, 1e5)
NONE, NOTHING = np.zeros((0, 5)), np.zeros((0, 2))


def threats(still: FloatArray | None = None, moving: FloatArray = NONE) -> Threats:
    return Threats(NOTHING if still is None else still, moving, SPEED, STEP)


def moving(points: FloatArray, velocity: tuple[float, float]) -> FloatArray:
    return np.column_stack((points, np.broadcast_to((*velocity, 0.0), (len(points), 3))))


def room_by_hand(path: Path, of: Threats) -> float:
    """At every place, and for what moves at every moment of a fine grid of those at which it may be met."""
    arc_lengths_m = np.arange(0.0, AHEAD_S * SPEED, STEP)
    room = math.inf
    for arc_length_m, place in zip(arc_lengths_m, poses_at(path, arc_lengths_m)[:, :2], strict=True):
        away = [np.hypot(*(of.still_m - place).T)]
        for share in np.linspace(EARLIEST, LATEST, 40):
            now = of.moving[:, :2] + of.moving[:, 2:4] * share * arc_length_m / SPEED
            away.append(np.hypot(*(now - place).T))
        room = min(room, np.concatenate(away).min(initial=math.inf) + DISCOUNT * arc_length_m)
    return room


POINT_WORK = st.tuples(st.floats(-800, 1200), st.floats(-900, 900))
VELOCITY = st.tuples(st.floats(-12, 12), st.floats(-12, 12))


@given(
    st.lists(POINT_WORK, max_size=8),
    st.lists(st.tuples(POINT_WORK, VELOCITY), max_size=5),
    st.sampled_from([-1 / 230.0, -1 / 1000.0, 0.0, 1 / 400.0]),
)
# Far from one thing, what is nearer to the way must not be stepped over: not even where it comes to meet one.
@example([(0.0, 60.0), (600.0, 5.0)], [], 0.0)
@example([(0.0, 60.0)], [((1150.0, 5.0), (-12.0, 0.0))], 0.0)
@settings(max_examples=examples(30))
def test_room_is_the_least_distance_from_what_stands_and_from_what_is_met(
    still: list[tuple[float, float]],
    met: list[tuple[tuple[float, float], tuple[float, float]]],
    curvature: float,
) -> None:
    of = threats(
        np.array(still, dtype=float).reshape(-1, 2),
        np.array([(*place, *velocity, 0.0) for place, velocity in met], dtype=float).reshape(-1, 5),
    )
    path = Path(np.array([(0.0, 0.0, 1.0, 0.0, curvature, 800.0)]))
    room, by_hand = of.room_m(path), room_by_hand(path, of)
    # Between two moments of the grid what moves comes nearer by less than this.
    assert room <= by_hand + 1e-9
    assert room == pytest.approx(by_hand, abs=4.0) or room == by_hand == math.inf
    if room < math.inf:
        assert of.room_m(path, least_m=room + 1.0) < room + 1.0


@given(POINT_WORK, st.sampled_from([-1 / 230.0, 0.0]))
@settings(max_examples=examples(20))
def test_from_what_has_just_appeared_it_keeps_further(place: tuple[float, float], curvature: float) -> None:
    """It is met wherever it can get to."""
    path = Path(np.array([(0.0, 0.0, 1.0, 0.0, curvature, 800.0)]))
    unknown = threats(moving=np.array([(*place, 0.0, 0.0, UNKNOWN_MPS)]))
    arc_lengths_m = np.arange(0.0, AHEAD_S * SPEED, STEP)
    away = np.hypot(*(poses_at(path, arc_lengths_m)[:, :2] - place).T)
    reach = UNKNOWN_MPS * np.minimum(LATEST * arc_lengths_m / SPEED, UNKNOWN_S)
    assert unknown.room_m(path) == pytest.approx((away - reach + DISCOUNT * arc_lengths_m).min())


def test_round_a_loiter_circle_room_is_that_of_the_place_it_will_be_at() -> None:
    """What comes to a circle is met only where it comes while the aircraft is there."""
    circle = Path(np.array([(0.0, 0.0, 1.0, 0.0, 1 / 100.0, math.tau * 100.0)]), loiter=True)
    half_round_m = 100.0 * math.pi
    assert threats(np.array([(0.0, 200.0)])).room_m(circle) == pytest.approx(DISCOUNT * half_round_m, abs=2.0)
    # 200 m to the north after half a turn, 12.6 s: what is there by then, and what has gone by then.
    assert threats(moving=moving(np.array([(400.0, 200.0)]), (-400.0 / 12.6, 0.0))).room_m(circle) < 30.0
    assert threats(moving=moving(np.array([(0.0, 200.0)]), (0.0, 20.0))).room_m(circle) > 100.0


@pytest.mark.parametrize("curvature", [0.0, 1 / 230.0, -1 / 300.0])
def test_ways_can_be_flown_and_end_in_a_turn(curvature: float) -> None:
    prefix = [(*PREFIX[0][:4], curvature, 50.0)]
    ways = list(rolled_out(prefix, LIMITS))
    for path in ways:
        assert path.loiter
        assert_flyable(path, 230.0)
        np.testing.assert_array_equal(path.segments[0], prefix[0])
    ends = np.array([pose_at(path, 700.0)[:2] for path in ways])
    assert len(np.unique(ends.round(1), axis=0)) > 0.5 * len(ways)
    assert np.ptp(ends[:, 1]) > 900.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("curvature", [0.0, 1 / 230.0, -1 / 300.0])
def test_it_passes_aside_where_a_turn_has_no_room(side: float, curvature: float) -> None:
    """In a corridor as wide as a turn radius something stands ahead, nearer to one wall."""
    walls = [wall((-300.0, y), (3000.0, y), 12.0) for y in (-150.0, 150.0)]
    still = np.concatenate((*walls, ring(420.0, 60.0 * side, 30.0, 12.0)))
    prefix = [(*PREFIX[0][:4], curvature, 50.0)]
    straight = Path(np.array([*prefix, (*pose_at(Path(np.array(prefix)), 50.0), 0.0, 900.0)]))
    path = clearest(rolled_out(prefix, LIMITS), WIDE, threats(still), threats(still).room_m(straight))
    assert path is not None
    assert_flyable(path, 230.0)
    rooms = [threats(still).room_m(way) for way in rolled_out(prefix, LIMITS)]
    assert threats(still).room_m(path) == max(rooms) > 30.0
    # Of a straight line it would pass by the middle of the corridor; it passes on the side that is free.
    assert (pose_at(path, 420.0).north_m * side) < 0.0


def test_it_stays_in_the_area() -> None:
    ways = list(rolled_out(PREFIX, LIMITS))
    path = clearest(ways, (-1000.0, -100.0, 1000.0, 600.0), threats(), 1.0)
    assert path is not None
    assert path.segments[-1, 4] > 0.0  # to the left, for to the right there is no room
    assert clearest(ways, (0.0, 0.0, 1.0, 1.0), threats(), 1.0) is None


MISSION_HERE = replace(MISSION, turn_radius_m=230.0, clearance_m=60.0, sensor_range_m=2000.0)


class Partly(Seen):
    """What lies to one side has not been seen."""

    hidden: Callable[[FloatArray], BoolArray] = staticmethod(lambda north: north > math.inf)

    def seen_free(self, points_m: FloatArray) -> BoolArray:
        return ~self.hidden(points_m[:, 1])


def flown_straight(seen: Seen) -> tuple[RollingWindow, Plan]:
    pilot = planner(MISSION_HERE)
    plan = pilot.plan(first_request(seen))
    assert plan.status is PlanStatus.FOUND
    pilot.plan(request_on(plan, 12.5, seen))
    return pilot, plan


def test_it_gives_way_to_what_will_be_in_the_way() -> None:
    """Something crosses from the left; where it is now nothing will be by then."""
    seen = Seen(nothing())
    pilot, plan = flown_straight(seen)
    outline, velocity, time_s = ring(475.0, 220.0, 60.0, 12.0), (0.0, -11.0), 1.0
    seen.moving = (MovingEdges(time_s, outline, velocity),)
    assert plan.path is not None
    here = 25.0 * time_s

    def nearest_m(path: Path, from_m: float) -> float:
        at_s = np.arange(0.0, 25.0, 0.25)[:, None, None]
        there = poses_at(path, from_m + SPEED * at_s.ravel())[:, None, :2]
        return float(np.hypot(*(outline + np.array(velocity) * at_s - there).transpose(2, 0, 1)).min())

    assert nearest_m(plan.path, here) < 60.0
    answer = pilot.plan(request_on(plan, here, seen))
    assert answer.path is not None
    assert nearest_m(answer.path, 0.0) > 60.0


@settings(max_examples=examples(12))
@given(st.lists(st.tuples(st.floats(150, 900), st.floats(-400, 400)), min_size=1, max_size=12))
def test_where_something_has_appeared_what_is_flown_keeps_away_to_the_end_of_its_turn(
    places: list[tuple[float, float]],
) -> None:
    seen = Seen(nothing())
    pilot, plan = flown_straight(seen)
    seen.show(np.array(places))
    seen.last_contradiction_s = 1.0
    answer = pilot.plan(request_on(plan, 25.0, seen))
    assert plan.path is not None

    def room_m(path: Path) -> float:
        line = shapely.LineString(sample(path, 20.0, 0.01))
        return float(shapely.distance(line, shapely.points(places)).min())

    flown = Path(np.array(onward(plan.path, 25.0, plan.path.length_m - 25.0)))
    least_m = LOITER_SHARES[-1] * pilot._local.room.path_keeps_m
    ways = rolled_out(onward(plan.path, 25.0, pilot._lead_m), pilot._local.limits)
    if max(room_m(flown), *(room_m(way) for way in ways)) > least_m + 0.05:
        assert room_m(answer.path or flown) > least_m - 0.05


@pytest.mark.parametrize("place", [(400.0, 110.0), (600.0, -130.0)])
def test_a_plan_is_left_where_what_has_just_appeared_beside_it_may_come_to_it(
    place: tuple[float, float],
) -> None:
    """Further off than the clearance, if it stood still: of that nothing is known yet."""
    seen = Seen(nothing())
    pilot, plan = flown_straight(seen)
    seen.moving = (MovingEdges(1.0, ring(*place, 30.0, 12.0), (0.0, 0.0)),)
    request = request_on(plan, 25.0, seen)
    answer, near = pilot.plan(request), pilot._escapes.threats(request)
    assert near is not None
    assert answer.path is not None
    assert near.room_m(answer.path) >= MISSION_HERE.clearance_m


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_evades_into_space_that_was_seen_to_be_free(side: float) -> None:
    """Ahead stands a wall, and there is room to either side of it."""
    seen = Partly(nothing())
    pilot, plan = flown_straight(seen)
    seen.show(wall((400.0, -150.0), (400.0, 150.0), 12.0))
    seen.last_contradiction_s, seen.hidden = 1.0, lambda north: north * side > 20.0
    answer = pilot.plan(request_on(plan, 25.0, seen))
    assert answer.path is not None
    assert not seen.hidden(poses_at(answer.path, np.arange(0.0, answer.path.length_m, 10.0))[:, 1]).any()


def test_a_plan_is_left_in_time_for_what_comes_to_it() -> None:
    """Flown and met as told: the plan of an aircraft that goes straight, and something that comes from ahead."""
    seen, pilot = Seen(nothing()), planner(MISSION_HERE)
    outline, velocity = ring(2500.0, 0.0, 80.0, 20.0), np.array((-9.0, 0.0))
    plan, arc_length_m, nearest = pilot.plan(first_request(seen)), 0.0, math.inf
    for step in range(160):
        time_s = 0.5 * step
        now = outline + velocity * time_s
        request = request_on(plan, arc_length_m, seen)._replace(time_s=time_s)
        away = np.hypot(*(now - request.position_m).T).min()
        nearest = min(nearest, float(away))
        if away < 1000.0:
            seen.moving = (MovingEdges(time_s, now, (-9.0, 0.0)),)
        if (answer := pilot.plan(request)).status is PlanStatus.FOUND:
            plan, arc_length_m = answer, 0.0
        arc_length_m += 0.5 * 25.0
    assert nearest > 0.9 * MISSION_HERE.clearance_m
