"""The proof of unreachability against plane geometry."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner import contract
from planner.contract import GivenMap
from planner.geometry.curves import Point
from planner.interface import FloatArray, MapView
from planner.memory import ObstacleMemory
from planner.rolling_window.barrier import POINTS_A_CALL, THINNING_SHARE, Barrier, Proof
from tests.examples import examples
from tests.planner.rolling_window.test_rolling_window import Seen
from tests.planner.walls_and_paths import wall

BOUNDS = (0.0, 0.0, 1000.0, 1000.0)
CLEARANCE = 40.0
START, GOAL = (200.0, 480.0), (800.0, 530.0)
SURE = 1.0 - 2.0 * THINNING_SHARE
"""Two points may each be left out for one this share of the clearance away, and by no more."""


def barrier_of(*batches: FloatArray, start: Point = START, goal: Point = GOAL) -> Barrier:
    barrier = Barrier(start, goal, BOUNDS, CLEARANCE)
    for batch in batches:
        barrier.add(batch)
    return barrier


def parted(points: FloatArray, keep_m: float, start: Point = START, goal: Point = GOAL) -> bool | None:
    """Whether discs about points part start and goal in the area; None where one of the two is covered."""
    discs: Any = shapely.union_all(shapely.buffer(shapely.points(points), keep_m, quad_segs=64))
    free = shapely.box(*BOUNDS).difference(discs)
    ends = [shapely.Point(start), shapely.Point(goal)]
    if not all(free.contains(end) for end in ends):
        return None
    return not any(all(part.contains(end) for end in ends) for part in shapely.get_parts(free))


def circle_of(x: float, y: float, radius: float, spacing: float, gap_m: float = 0.0) -> FloatArray:
    """Points around a circle, with neighbours a gap apart at one place."""
    open_rad = 2.0 * math.asin(0.5 * gap_m / radius) if gap_m else 0.0
    count = math.ceil((math.tau - open_rad) * radius / spacing)
    angle = 0.5 * open_rad + np.linspace(0.0, math.tau - open_rad, count + 1)
    return np.column_stack((x + radius * np.cos(angle), y + radius * np.sin(angle)))


@pytest.mark.flights
@settings(max_examples=examples(75))
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 220))
def test_random_points_close_it_where_their_discs_part_the_area(seed: int, count: int) -> None:
    points = np.random.default_rng(seed).uniform(0.0, 1000.0, (count, 2))
    ends = np.array([START, GOAL])
    away = np.hypot(*(points[:, None] - ends).transpose(2, 0, 1)).min(axis=1, initial=math.inf)
    points = points[away > 1.01 * CLEARANCE]
    closed = barrier_of(points).closed
    # Never a proof of what is not so; and no proof is missed but for the points that are left out.
    if closed:
        assert parted(points, 1.001 * CLEARANCE) is not False
    if parted(points, SURE * CLEARANCE):
        assert closed


@settings(max_examples=examples(30))
@given(
    x=st.floats(100.0, 900.0),
    y=st.floats(100.0, 900.0),
    radius=st.floats(65.0, 420.0),
    gap_m=st.sampled_from([0.0, 40.0, 79.5, 80.5, 120.0]),
    turn=st.floats(0.0, math.tau),
)
def test_any_ring_with_any_gap(x: float, y: float, radius: float, gap_m: float, turn: float) -> None:
    c, s = math.cos(turn), math.sin(turn)
    points = circle_of(0.0, 0.0, radius, 8.0, gap_m) @ np.array([[c, s], [-s, c]]) + (x, y)
    points = points[(points >= 0.0).all(axis=1) & (points <= 1000.0).all(axis=1)]
    low, high = parted(points, 0.99 * CLEARANCE), parted(points, 1.01 * CLEARANCE)
    assume(low is not None and low is high)
    assert barrier_of(points).closed is high


@pytest.mark.parametrize("vertical", [False, True])
@pytest.mark.parametrize(
    ("begin", "end", "closed"),
    [(0.0, 1000.0, True), (39.0, 961.0, True), (41.0, 1000.0, False), (0.0, 959.0, False)],
)
def test_a_wall_closes_the_area_where_it_reaches_from_border_to_border(
    vertical: bool, begin: float, end: float, closed: bool
) -> None:
    along = np.linspace(begin, end, 60)
    across = np.full(60, 500.0)
    points = np.column_stack((across, along) if vertical else (along, across))
    start, goal = ((200.0, 300.0), (800.0, 600.0)) if vertical else ((300.0, 200.0), (600.0, 800.0))
    assert barrier_of(points, start=start, goal=goal).closed is closed


@pytest.mark.parametrize("begin", [0.0, 41.0, 89.0, 91.0])
def test_what_keeps_from_the_border_as_well_needs_a_wider_gap_there(begin: float) -> None:
    wall = np.column_stack((np.full(60, 500.0), np.linspace(begin, 1000.0, 60)))
    for border_m in (0.0, 50.0):
        barrier = Barrier(START, GOAL, BOUNDS, CLEARANCE, border_m)
        barrier.add(wall)
        # The middle of a turn keeps off the border by its radius and off the wall by the clearance more.
        within = shapely.box(*BOUNDS).buffer(-border_m)
        parts = shapely.get_parts(within.difference(shapely.buffer(shapely.LineString(wall), CLEARANCE)))
        joined = any(all(part.contains(shapely.Point(end)) for end in (START, GOAL)) for part in parts)
        assert barrier.closed is not joined


def test_a_border_beside_an_end_counts_for_nothing() -> None:
    for end, closed in (((800.0, 30.0), True), ((520.0, 30.0), False)):
        for ends in (((200.0, 480.0), end), (end, (200.0, 480.0))):
            barrier = Barrier(*ends, BOUNDS, CLEARANCE, 50.0)
            barrier.add(np.column_stack((np.full(60, 500.0), np.linspace(85.0, 1000.0, 60))))  # a wall
            assert barrier.closed is closed


def proof_of(seen: MapView, keeps_m: float) -> tuple[Proof, int]:
    mission = replace(contract.MISSION, goal_m=GOAL, bounds_m=BOUNDS, clearance_m=CLEARANCE)
    memory = ObstacleMemory(CLEARANCE)
    memory.take_in(seen)
    return Proof(mission, memory, keeps_m), math.ceil(len(memory.points_m) / POINTS_A_CALL)


def proved(seen: MapView, keeps_m: float) -> bool:
    proof, portions = proof_of(seen, keeps_m)
    answers = [proof.closed(START) for _ in range(portions)]
    assert not any(answers[:-1]) or answers[-1]
    return answers[-1]


def test_what_was_refused_proves_nothing() -> None:
    points = wall((500.0, 0.0), (500.0, 1000.0), 20.0)
    proof, _ = proof_of(GivenMap(points[:0]), CLEARANCE)
    for place in points.tolist():
        proof._memory.refuse((place[0], place[1]))
    assert not proof.closed(START)
    assert proved(GivenMap(points), CLEARANCE)


def test_a_proof_with_what_was_refused_holds_until_that_is_forgiven() -> None:
    points = wall((500.0, 0.0), (500.0, 1000.0), 50.0)
    seen = GivenMap(points[np.abs(points[:, 1] - 600.0) > 30.0])
    proof, _ = proof_of(seen, CLEARANCE)
    memory = proof._memory
    given_up = Proof(proof._mission, memory, CLEARANCE, with_refused=True)
    assert not given_up.closed(START)
    memory.refuse((500.0, 600.0))
    assert given_up.closed(START)
    assert not proof.closed(START)
    memory.forget_refused()
    memory.take_in(seen)
    assert not given_up.closed(START)


class TakingBack(Seen):
    """A wall of which only some is left at the second look; what is new then closes the gap or does not."""

    def __init__(self, first: FloatArray, left: FloatArray, new: FloatArray) -> None:
        self.revision, self._first, self._left, self._new = 1, first, left, new

    def second_look(self) -> None:
        self.revision = self.last_removal_revision = 2

    def edges_since(self, revision: int) -> FloatArray:
        if self.revision == 1:
            return self._first if revision < 1 else self._first[:0]
        return np.concatenate((self._left, self._new)) if revision < 1 else self._new


@pytest.mark.parametrize("closes", [False, True])
def test_what_was_let_go_of_proves_nothing_any_more(closes: bool) -> None:
    whole = wall((500.0, 0.0), (500.0, 1000.0), 20.0)
    south, north = (whole[:, 1] < 400.0), (whole[:, 1] > 600.0)
    between = whole[~south & ~north]
    # At first the gap is filled but the south is missing; then the filling goes and the south comes.
    seen = TakingBack(whole[~south], whole[north], whole[south] if not closes else whole[~north])
    proof, _ = proof_of(seen, CLEARANCE)
    assert not proof.closed(START)
    seen.second_look()
    proof._memory.take_in(seen)
    assert proof._memory.cleared == len(between)
    assert proof.closed(START) is closes
    assert proof.closed(START) is closes
