"""Bug1, Bug2 and TangentBug against what geometry says: their lengths, what they reach, what they prove."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from planner import contract
from planner.baselines.bug import Bug1, Bug2
from planner.baselines.tangent_bug import TangentBug
from planner.baselines.walk import Enclosed, Walker, WalkLeg, connected
from planner.contract import GivenMap
from planner.geometry.curves import Point, pose_at
from planner.interface import BoolArray, FloatArray, Mission, Path, Plan, Planner, PlanRequest, PlanStatus
from planner.keys import MarginConfig
from planner.plan_checks import checked_plan
from planner.world_stability import SETTLED_S
from tests.longer import longer
from tests.planner.walls_and_paths import ring, wall

MISSION = replace(
    contract.MISSION, goal_m=(17_000.0, 5000.0), goal_radius_m=100.0, bounds_m=(0.0, 0.0, 20_000.0, 10_000.0),
    sensor_range_m=3000.0,
)  # fmt: skip
KEEP = MISSION.clearance_m + MarginConfig().margin(MISSION)
START = (3000.0, 5000.0)
SPACING = 50.0

MAKE: dict[str, Callable[[Mission], Planner]] = {
    "bug1": lambda mission: Bug1(MarginConfig(), mission),
    "bug2": lambda mission: Bug2(MarginConfig(), mission),
    "tangent_bug": lambda mission: TangentBug(MarginConfig(), mission),
}
KINDS = tuple(MAKE)
OF_CONTACT = ("bug1", "bug2")


class Range(GivenMap):
    """A seen world: the edge points that have been within range, no matter what hides them."""

    def __init__(self, points: FloatArray, range_m: float) -> None:
        super().__init__(points)
        self.revision, self._range = 0, range_m
        self._order: list[FloatArray] = []
        self._unseen = np.ones(len(points), dtype=np.bool_)

    def look(self, place: Point) -> None:
        if (fresh := self._unseen & (np.hypot(*(self._points - place).T) < self._range)).any():
            self._order.append(self._points[fresh])
            self._unseen &= ~fresh
            self.revision += 1

    def edges_since(self, revision: int) -> FloatArray:
        return np.concatenate((self._points[:0], *self._order[max(revision, 0) :]))


class Unsettled(Range):
    """The same, but something appeared in space seen to be free."""

    last_contradiction_s = 2000.0


class Opening(Range):
    """The same, until a part of the wall in the west of the goal is taken back."""

    before = looks = 0

    def edges_since(self, revision: int) -> FloatArray:
        return super().edges_since(revision - self.before)

    def look(self, place: Point) -> None:
        super().look(place)
        self.looks -= 1
        if not self.looks:
            self._order = [each[~self._opens(each)] for each in self._order]
            self._unseen &= ~self._opens(self._points)
            self.before = 1
            self.revision += 1
            self.last_removal_revision = self.revision

    def _opens(self, points: FloatArray) -> BoolArray:
        east, north = MISSION.goal_m
        return (points[:, 0] < east) & (np.abs(points[:, 1] - north) < 4.0 * KEEP)


class Walk(NamedTuple):
    status: PlanStatus
    reason: str
    length_m: float
    track_m: FloatArray
    plans: tuple[Plan, ...]


def walk(
    kind: str,
    points: FloatArray,
    start: Point = START,
    mission: Mission = MISSION,
    step_m: float = 50.0,
    most_m: float = 400_000.0,
    world: type[Range] = Range,
    hold_m: float = math.inf,
) -> Walk:
    """Flies a path without error to the goal, or "never"; after each `hold_m` a shield's full turn to the left."""
    planner, seen = MAKE[kind](mission), world(points, mission.sensor_range_m)
    place, direction, arc_length_m, length = start, (1.0, 0.0), 0.0, 0.0
    flown: Plan | None = None
    track, plans, hold, next_hold_m = [start], list[Plan](), None, hold_m
    turn_m = math.tau * mission.hold_radius_m
    while length < most_m:
        seen.look(place)
        request = PlanRequest(length / mission.speed_mps, place, direction, seen, flown, arc_length_m, committed=hold)
        if length >= next_hold_m:
            hold = Path(np.array([(*place, *direction, math.tau / turn_m, turn_m)]), loiter=True)
            for at_m in np.arange(0.0, turn_m, step_m).tolist():
                request = request._replace(position_m=pose_at(hold, at_m)[:2], flown=None, committed=hold)
                planner.plan(request)
            length, next_hold_m = length + turn_m, length + turn_m + hold_m
        if (plan := planner.plan(request)).status is PlanStatus.FOUND:
            flown, arc_length_m = plan, 0.0
            plans.append(plan)
        if plan.status is PlanStatus.UNREACHABLE or flown is None or flown.path is None:
            return Walk(plan.status, plan.reason, length, np.array(track), tuple(plans))
        arc_length_m += step_m
        length += step_m
        x, y, ux, uy = pose_at(flown.path, arc_length_m)
        place, direction = (x, y), (ux, uy)
        track.append(place)
        if math.dist(place, mission.goal_m) <= mission.goal_radius_m:
            return Walk(PlanStatus.FOUND, "reached", length, np.array(track), tuple(plans))
    return Walk(PlanStatus.NO_PATH, "still under way", length, np.array(track), tuple(plans))


def nearest_m(track: FloatArray, points: FloatArray) -> float:
    return float(shapely.distance(shapely.LineString(track), shapely.MultiPoint(points)))


def around_a_circle(kind: str, radius: float, to_center: float, straight: float) -> float:
    """Length of each algorithm's way round a circle whose centre lies on the straight line."""
    if kind in (hugged := {"bug1": 3.0 * math.pi * radius, "bug2": math.pi * radius}):
        return straight - 2.0 * radius + hugged[kind]
    ways = 0.0
    for leg in (to_center, straight - to_center):
        ways += math.sqrt(leg**2 - radius**2) + radius * (0.5 * math.pi - math.acos(radius / leg))
    return ways


@pytest.mark.parametrize("kind", KINDS)
def test_the_way_round_a_circle_has_the_length_that_geometry_gives(kind: str) -> None:
    points = ring(10_000.0, 5000.0, 1500.0, SPACING)
    # Seen from the start, so that TangentBug takes the tangent at once.
    flight = walk(kind, points, mission=replace(MISSION, sensor_range_m=10_000.0))
    assert flight.reason == "reached"
    expected = around_a_circle(kind, 1500.0 + KEEP, 7000.0, 14_000.0) - MISSION.goal_radius_m
    assert flight.length_m == pytest.approx(expected, abs=0.004 * expected + 50.0)
    assert nearest_m(flight.track_m, points) > MISSION.clearance_m + 0.5 * MarginConfig().margin(MISSION)
    if kind in OF_CONTACT:  # it knows the circle on contact only
        east, north = flight.track_m[flight.track_m[:, 0] < 10_000.0 - 1500.0 - KEEP - 50.0].T
        assert len(east) > 100
        np.testing.assert_allclose(north, 5000.0, atol=1e-6)


@pytest.mark.parametrize("range_m", [4000.0, 6000.0, 7000.0])
def test_tangent_bug_takes_no_way_round_for_a_way_across_a_dent(range_m: float) -> None:
    """Nearly a whole round ahead along the boundary is in sight: right behind."""
    points = np.concatenate([ring(*circle, SPACING) for circle in contract.CIRCLES])
    mission = replace(contract.MISSION, sensor_range_m=range_m)
    flight = walk("tangent_bug", points, contract.START, mission)
    assert flight.reason == "reached"
    assert flight.length_m < 1.1 * math.dist(contract.START, mission.goal_m)


@pytest.mark.parametrize("goal_north_m", [2000.3, 8123.9])
@pytest.mark.parametrize("kind", OF_CONTACT)
def test_a_line_that_leads_aslant_is_found_again(kind: str, goal_north_m: float) -> None:
    mission = replace(MISSION, goal_m=(17_000.0, goal_north_m))
    flight = walk(kind, ring(10_000.0, 0.5 * (5000.0 + goal_north_m), 700.0, SPACING), mission=mission)
    assert flight.reason == "reached"
    most_m = (4.0 if kind == "bug1" else 1.0) * math.pi * (700.0 + KEEP)
    assert flight.length_m < math.dist(START, mission.goal_m) + most_m


@pytest.mark.parametrize("aside", [-800.0, 800.0])
def test_bug1_returns_to_the_nearest_point_by_the_shorter_way(aside: float) -> None:
    radius = 1500.0 + KEEP
    flight = walk("bug1", ring(10_000.0, 5000.0 + aside, 1500.0, SPACING))
    back = math.sqrt(radius**2 - aside**2)
    turn = abs(math.atan2(-aside, -back) - math.atan2(-aside, MISSION.goal_m[0] - 10_000.0)) % math.tau
    last = math.hypot(MISSION.goal_m[0] - 10_000.0, aside) - radius - MISSION.goal_radius_m
    expected = 7000.0 - back + radius * (math.tau + min(turn, math.tau - turn)) + last
    assert flight.reason == "reached"
    assert flight.length_m == pytest.approx(expected, abs=0.004 * expected + 50.0)


@pytest.mark.parametrize("kind", KINDS)
def test_a_trap_open_to_the_start_is_left(kind: str) -> None:
    corners = [(9000.0, 3000.0), (12_000.0, 3000.0), (12_000.0, 7000.0), (9000.0, 7000.0)]
    points = np.concatenate([wall(a, b, SPACING) for a, b in pairwise(corners)])
    flight = walk(kind, points)
    assert flight.reason == "reached"
    assert nearest_m(flight.track_m, points) > MISSION.clearance_m
    # The way out leads back past the open end of an arm.
    assert flight.track_m[:, 0].max() > 12_000.0
    assert flight.length_m > 14_000.0 + 3000.0


@pytest.mark.parametrize("kind", [*OF_CONTACT, *longer(["tangent_bug"])])
@pytest.mark.parametrize("enclosed", ["goal", "start"])
def test_an_enclosure_is_proved_by_going_round_it_but_not_soon_after_something_appeared(
    kind: str, enclosed: str
) -> None:
    """It is gone round again meanwhile: what closes the way may go again. A shield's turns put nothing off."""
    closed = ring(*(MISSION.goal_m if enclosed == "goal" else START), 2000.0, SPACING)
    at_once, later = walk(kind, closed), walk(kind, closed, world=Unsettled)
    held = walk(kind, closed, hold_m=2500.0)
    assert at_once.status is later.status is held.status is PlanStatus.UNREACHABLE
    assert len(held.track_m) < 1.1 * len(at_once.track_m)
    if kind == "bug2":  # the round ends where the line from the start meets the ring
        east = 17_000.0 - 2000.0 - KEEP if enclosed == "goal" else 3000.0 + 2000.0 - KEEP
        assert math.dist(held.track_m[-1], (east, 5000.0)) < 2.0 * (MISSION.hold_radius_m + KEEP)
    assert f"encloses the goal at a distance of {KEEP:.0f} m" in at_once.reason
    if enclosed == "goal" or kind != "tangent_bug":  # from within a hollow boundary TangentBug sees all of it
        assert at_once.length_m > 0.98 * math.tau * (2000.0 + (KEEP if enclosed == "goal" else -KEEP))
    assert at_once.length_m / MISSION.speed_mps < Unsettled.last_contradiction_s + SETTLED_S
    assert later.length_m / MISSION.speed_mps > Unsettled.last_contradiction_s + SETTLED_S


@pytest.mark.parametrize("kind", [*OF_CONTACT, *longer(["tangent_bug"])])
@pytest.mark.parametrize("share", [0.8, 0.95, 1.0])
def test_a_way_that_was_taken_to_be_closed_is_tried_again(kind: str, share: float) -> None:
    """At the end of the round as well as where it has been passed by."""
    closed = ring(*MISSION.goal_m, 2000.0, SPACING)
    flight = walk(kind, closed)
    looks = round(share * len(flight.track_m))
    again = walk(kind, closed, world=type("Opens", (Opening,), {"looks": looks}))
    assert again.reason == "reached"
    assert looks < len(again.track_m) < 3 * len(flight.track_m)


@pytest.mark.flights
@pytest.mark.parametrize("kind", KINDS)
def test_a_wall_across_the_area_is_proved_along_the_bounds(kind: str) -> None:
    flight = walk(kind, wall((10_000.0, 0.0), (10_000.0, 10_000.0), SPACING))
    assert flight.status is PlanStatus.UNREACHABLE
    x, y = flight.track_m.T
    assert (x >= 0.0).all()
    assert ((y >= 0.0) & (y <= 10_000.0)).all()


@pytest.mark.parametrize(
    ("kind", "gap_m", "status"),
    [
        *((kind, 2.2 * KEEP, PlanStatus.FOUND) for kind in KINDS),
        *((kind, 1.8 * KEEP, PlanStatus.UNREACHABLE) for kind in OF_CONTACT),
        *longer([("tangent_bug", 1.8 * KEEP, PlanStatus.UNREACHABLE)]),
    ],
)
def test_a_gap_is_taken_where_it_is_wide_enough(kind: str, gap_m: float, status: PlanStatus) -> None:
    walls = [
        wall((10_000.0, 0.0), (10_000.0, 3000.0), SPACING),
        wall((10_000.0, 3000.0 + gap_m), (10_000.0, 10_000.0), SPACING),
    ]
    assert walk(kind, np.concatenate(walls)).status is status


@pytest.mark.parametrize("depth_m", [0.5, 2.0, 6.0, 12.0, 20.0, 30.0, 100.0])
@pytest.mark.parametrize("kind", KINDS)
def test_an_obstacle_that_the_line_grazes_encloses_nothing(kind: str, depth_m: float) -> None:
    """The line leaves the boundary at so small an angle that the next points of it still lie ahead."""
    (start_x, y), (goal_x, _) = START, MISSION.goal_m
    middle = 0.5 * (start_x + goal_x)
    assert walk(kind, ring(middle, y - 1500.0 - KEEP + depth_m, 1500.0, SPACING)).reason == "reached"


circles = st.lists(
    st.tuples(st.floats(4500.0, 15_500.0), st.floats(0.0, 10_000.0), st.floats(300.0, 2500.0)),
    min_size=1,
    max_size=7,
)


@pytest.mark.parametrize("cases", [*longer([3]), pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_the_goal_is_reached_where_there_is_a_way_and_only_there(kind: str, cases: int) -> None:
    @settings(max_examples=cases, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(world=circles)
    def each(world: list[tuple[float, float, float]]) -> None:
        assert_reached_where_there_is_a_way(kind, world)

    each()


def assert_reached_where_there_is_a_way(kind: str, world: list[tuple[float, float, float]]) -> None:
    points = np.concatenate([ring(x, y, radius, SPACING) for x, y, radius in world])
    ends = shapely.MultiPoint([START, MISSION.goal_m])
    assume(float(shapely.distance(ends, shapely.MultiPoint(points))) > 1.1 * KEEP)

    def connected(keep: float) -> bool:
        grown = shapely.buffer(shapely.MultiPoint(points), keep, quad_segs=32)
        free = shapely.difference(shapely.box(*MISSION.bounds_m), grown)
        parts, both = shapely.get_parts(free), shapely.points([START, MISSION.goal_m])
        return any(shapely.intersects(part, both).all() for part in parts)

    # Discs, not walls: what is a way by a hair's breadth is left out, and so is one along the bounds.
    assume(connected(0.9 * KEEP) == connected(1.1 * KEEP))
    flight = walk(kind, points)
    assert flight.reason == "reached" if connected(KEEP) else flight.status is PlanStatus.UNREACHABLE
    assert nearest_m(flight.track_m, points) > MISSION.clearance_m


def test_legs_are_joined_by_straight_lines_from_where_the_vehicle_is() -> None:
    """Beside a boundary a walk goes on along it from nearby: its path does not jump there."""
    east, north = np.array([(10.0, 0.0), (100.0, 0.0)]), np.array([(103.0, 4.0), (103.0, 54.0)])
    first, second = connected((WalkLeg("one", east), WalkLeg("two", north)), (0.0, 0.0))
    np.testing.assert_array_equal(first.way, [(0.0, 0.0), *east])
    np.testing.assert_array_equal(second.way, [(100.0, 0.0), *north])
    assert (first.state, second.state) == ("one", "two")


@pytest.mark.parametrize(("radius", "gap"), [(2e3, 1.9), (2e3, 2.07), (3e4, 0.0)])
@pytest.mark.parametrize("kind", KINDS)
def test_a_walk_ends_only_where_aircraft_and_goal_are_parted(kind: str, radius: float, gap: float) -> None:
    """A gap is in clearances: one between 2 and 2.2 is left open by the clearance, though not by the margin too."""
    edges = ring(*MISSION.goal_m, radius, 5.0)
    away = np.hypot(*(edges - (MISSION.goal_m[0] - radius, MISSION.goal_m[1])).T)
    planner, seen = MAKE[kind](MISSION), GivenMap(edges[away >= 0.5 * gap * MISSION.clearance_m])
    assert isinstance(planner, Walker)
    planner.legs = (WalkLeg(Enclosed("the goal is enclosed")),)
    plan, parted = planner.plan(PlanRequest(0.0, START, (1.0, 0.0), seen)), radius < 14_000.0 and gap < 2.0
    assert plan.reason == "the goal is enclosed" if parted else plan.status is PlanStatus.FOUND
    assert (plan.status is PlanStatus.UNREACHABLE) == parted


@pytest.mark.parametrize("kind", KINDS)
def test_plans_begin_where_the_loop_allows_it_beside_the_path_too(kind: str) -> None:
    """An aircraft that cuts corners flies 41 m beside its path: no plan begins further from it than is taken."""
    mission = replace(MISSION, speed_mps=15.0)
    planner, seen = MAKE[kind](mission), Range(ring(8000.0, 5000.0, 1200.0, SPACING), mission.sensor_range_m)
    flown, arc_length_m, place, direction, found = None, 0.0, START, (1.0, 0.0), 0
    for n in range(600):
        seen.look(place)
        plan = planner.plan(PlanRequest(2.0 * n, place, direction, seen, flown, arc_length_m))
        checked_plan(plan, place, mission)
        if plan.status is PlanStatus.FOUND:
            flown, arc_length_m, found = plan, 0.0, found + 1
        assert flown is not None
        assert flown.path is not None
        arc_length_m += 30.0
        x, y, ux, uy = pose_at(flown.path, arc_length_m)
        aside = 41.0 if n % 2 else -41.0
        place, direction = (x - aside * uy, y + aside * ux), (ux, uy)
    assert found > 2
