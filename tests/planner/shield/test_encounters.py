"""Where obstacles that move are met, against brute-force simulation in time."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from planner.interface import FloatArray, MovingEdges
from planner.shield.encounters import EARLIEST, FASTEST_SHARE, LATEST, PASSING_S, meeting_s, met_at
from tests.examples import examples

SPEED, SPACING = 25.0, 20.0
SEEDS = st.integers(0, 2**32 - 1)
PACES = st.floats(0.0, FASTEST_SHARE * SPEED)
COURSES = st.floats(0.0, math.tau)


def obstacle(seed: int, pace: float, course: float, time_s: float = 0.0) -> MovingEdges:
    """A round outline some way off (0, 0)."""
    rng = np.random.default_rng(seed)
    angle, away, radius = rng.uniform(0.0, math.tau), rng.uniform(300.0, 2000.0), rng.uniform(20.0, 250.0)
    angles = np.linspace(0.0, math.pi, 24) + rng.uniform(0.0, math.tau)
    centre = away * np.array((math.cos(angle), math.sin(angle)))
    points = centre + radius * np.column_stack((np.cos(angles), np.sin(angles)))
    return MovingEdges(time_s, points, (pace * math.cos(course), pace * math.sin(course)))


def simulated_s(offset: FloatArray, velocity: FloatArray, speed: float) -> float:
    """When an aircraft that heads straight for where it will be is as far off as a point that moves."""
    times = np.linspace(0.0, 2000.0, 400_001)
    away = np.hypot(offset[0] + velocity[0] * times, offset[1] + velocity[1] * times)
    return float(times[np.argmax(speed * times >= away)])


@settings(max_examples=examples(10))
@given(seed=SEEDS, pace=PACES, course=COURSES)
def test_the_time_is_that_of_a_simulation(seed: int, pace: float, course: float) -> None:
    each = obstacle(seed, pace, course)
    velocity = np.array(each.velocity_mps)
    told = meeting_s(each.points_m, velocity, SPEED)
    for i in (0, 11, 23):
        assert told[i] == pytest.approx(simulated_s(each.points_m[i], velocity, SPEED), abs=0.006)


@example(seed=1, pace=15.0, course=0.3, share=EARLIEST, later=0.0)
@example(seed=1, pace=15.0, course=0.3, share=LATEST, later=PASSING_S)
@settings(max_examples=examples(15))
@given(seed=SEEDS, pace=PACES, course=COURSES, share=st.floats(EARLIEST, LATEST), later=st.floats(0.0, PASSING_S))
def test_whoever_flies_to_any_point_of_the_outline_meets_it_where_it_is_drawn(
    seed: int, pace: float, course: float, share: float, later: float
) -> None:
    """Straight, a little slower for the way round or the wind, or a little faster."""
    each = obstacle(seed, pace, course)
    drawn = met_at(each, (0.0, 0.0), 0.0, SPEED, SPACING)
    velocity = np.array(each.velocity_mps)
    for point in each.points_m[::5]:
        straight_s = simulated_s(point, velocity, SPEED)
        met = point + velocity * (share * straight_s + (later if share > 1.0 else 0.0))
        # Steps in time, and one point a cell.
        assert np.hypot(*(drawn - met).T).min() <= 0.5 * SPACING + 0.5 * SPACING * math.sqrt(2.0) + 1.0


@settings(max_examples=examples(15))
@given(seed=SEEDS, pace=PACES, course=COURSES)
def test_nothing_is_drawn_where_it_is_met_neither_too_early_nor_too_late(seed: int, pace: float, course: float) -> None:
    each = obstacle(seed, pace, course)
    velocity = np.array(each.velocity_mps)
    straight_s = meeting_s(each.points_m, velocity, SPEED)
    for place in met_at(each, (0.0, 0.0), 0.0, SPEED, SPACING):
        # The point that it comes from, and when that is there.
        along = (place - each.points_m) @ velocity / max(pace * pace, 1e-12)
        after_s = np.clip(along, EARLIEST * straight_s, LATEST * straight_s + PASSING_S)
        assert np.hypot(*(each.points_m + after_s[:, None] * velocity - place).T).min() < 1e-6


@given(seed=SEEDS, pace=PACES, course=COURSES, age_s=st.floats(0.0, 30.0))
def test_what_was_seen_a_while_ago_has_moved_on(seed: int, pace: float, course: float, age_s: float) -> None:
    old = obstacle(seed, pace, course, time_s=100.0 - age_s)
    new = MovingEdges(100.0, old.points_m + age_s * np.array(old.velocity_mps), old.velocity_mps)
    one, other = (met_at(each, (500.0, -300.0), 100.0, SPEED, SPACING) for each in (old, new))
    apart = np.hypot(*(one[:, None] - other).transpose(2, 0, 1))
    assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < SPACING
    assert len(other) < 24 * 200
