"""The watch over a plan in effect."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.course import Course
from planner.effect import Effect, Watch
from planner.interface import Path, Plan, PlanStatus

STRAIGHT = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 9000.0)]))
TURN = (2000.0, 0.0, 1.0, 0.0, 0.01, 2.0 * math.pi * 100.0)
COMMITTED = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 2000.0), TURN]), loiter=True)
EDGES = np.array([(1000.0, 900.0), (5000.0, 100.0), (1500.0, -50.0)])


def effect(known: int) -> Effect:
    course = Course(STRAIGHT, ((9000.0, 0.0),), known, shortest=True)
    return Effect(Plan(PlanStatus.FOUND, "", path=COMMITTED), COMMITTED, course, 2000.0)


@pytest.mark.parametrize(("known", "cut", "broken"), [(3, False, False), (2, True, True), (1, True, True)])
def test_a_plan_is_cut_by_what_came_in_while_it_was_looked_for(known: int, cut: bool, broken: bool) -> None:
    watch = Watch(keep_m=300.0, turn_keeps_m=200.0, urgent_m=1000.0)
    watch.begin(effect(known), EDGES)
    assert math.isfinite(watch.cut_m) is cut
    assert watch.broken is broken
    if cut:
        assert 1200.0 <= watch.cut_m <= 1500.0


def test_what_has_gone_meanwhile_hides_nothing_that_came_in() -> None:
    watch = Watch(keep_m=300.0, turn_keeps_m=200.0, urgent_m=1000.0)
    course = effect(4).course  # one of the four is gone; the last of the edges is new
    assert watch.cut_at(course, EDGES) == math.inf
    assert 1200.0 <= watch.cut_at(course, EDGES, gone=2) <= 1500.0
    watch.begin(effect(4), EDGES, gone=9)
    assert watch.broken


def test_a_cut_beyond_the_turn_does_not_break_the_plan() -> None:
    watch = Watch(keep_m=300.0, turn_keeps_m=200.0, urgent_m=1000.0)
    watch.begin(effect(1), EDGES[:2])
    assert 4700.0 <= watch.cut_m <= 5000.0
    assert not watch.broken
