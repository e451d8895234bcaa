"""Thinking in portions finds what thinking at once finds, and no portion is larger than asked for."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

import planner.local_planning
from planner.course import Course
from planner.curves import Pose
from planner.deliberation import Deliberation
from planner.interface import FloatArray, Mission, SeenWorld
from planner.local_planning import LocalPlanning, Start
from planner.memory import ObstacleMemory
from planner.multi_step_search import search

MakePoints = Callable[..., FloatArray]
Known = Callable[[FloatArray], SeenWorld]

MISSION = Mission(
    goal_m=(12_000.0, 0.0),
    goal_radius_m=100.0,
    bounds_m=(-4000.0, -8000.0, 16_000.0, 8000.0),
    clearance_m=200.0,
    turn_radius_m=150.0,
    speed_mps=25.0,
    roll_in_s=1.0,
    tracking_error_m=3.0,
    sensor_range_m=8000.0,
)
START = Start((0.0, 0.0), Pose(0.0, 0.0, 1.0, 0.0))


@pytest.fixture
def trap(wall: MakePoints, known: Known) -> SeenWorld:
    """A U that is open towards the start, and a wall behind it."""
    corners = [(2000.0, 2000.0), (6000.0, 2000.0), (6000.0, -2000.0), (2000.0, -2000.0)]
    sides = [wall(a, b, 50.0) for a, b in pairwise(corners)]
    return known(np.concatenate([*sides, wall((8000.0, -5000.0), (8000.0, 1500.0), 50.0)]))


def deliberation(seen: SeenWorld, closed: Callable[[], bool] = lambda: False) -> Deliberation:
    memory = ObstacleMemory(MISSION.clearance_m)
    memory.take_in(seen)
    local = LocalPlanning(MISSION, memory, window_m=8000.0, margin_m=20.0, steps=16, candidates=12)
    return Deliberation(local, len(memory.points_m), 0, closed)


def all_courses(thinking: Deliberation, work: int, start: Callable[[], Start]) -> tuple[list[Course], int]:
    courses, portions = [], 0
    while not thinking.done:
        courses += list(thinking.courses(start(), None, work))
        portions += 1
        assert portions < 10_000
    return courses, portions


def test_in_portions_and_at_once_the_same_is_found(trap: SeenWorld) -> None:
    at_once, one = all_courses(deliberation(trap), 10**9, lambda: START)
    slowly, many = all_courses(deliberation(trap), 5, lambda: START)
    assert one == 1
    assert many > 10
    assert [course.nodes for course in slowly] == [course.nodes for course in at_once]
    assert at_once[0].shortest
    assert at_once[0].nodes[-1] == MISSION.goal_m


def test_a_portion_is_no_larger_than_asked_for(trap: SeenWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = 0

    def counted(*args: object, **keys: object) -> object:
        nonlocal steps
        for found in search(*args, **keys):  # type: ignore[arg-type]
            steps += found is None
            yield found

    monkeypatch.setattr(planner.local_planning, "search", counted)
    thinking = deliberation(trap)
    for portion in range(1, 20):
        before = steps
        list(thinking.courses(START, None, 7))
        assert steps - before <= 7, portion
        if thinking.done:
            break
    assert steps > 7


def test_what_is_found_late_begins_where_the_aircraft_has_got_to(trap: SeenWorld) -> None:
    flown = 0.0

    def start() -> Start:
        nonlocal flown
        flown += 12.5
        return Start((flown, 0.0), Pose(flown, 0.0, 1.0, 0.0))

    thinking = deliberation(trap)
    while not thinking.done:
        begin = start()
        for course in thinking.courses(begin, None, 5):
            assert course.path.segments[0, :2].tolist() == list(begin.pose[:2])
    assert flown > 50.0


def test_walled_in_the_proof_ends_it(ring: MakePoints, known: Known) -> None:
    asked = 0

    def closed() -> bool:
        nonlocal asked
        asked += 1
        return True

    courses, _ = all_courses(deliberation(known(ring(0.0, 0.0, 3000.0, 50.0)), closed), 40, lambda: START)
    assert courses == []
    assert asked
