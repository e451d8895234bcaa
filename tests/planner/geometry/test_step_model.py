"""Equations (1) to (4) of the paper against formulas of their own."""

from __future__ import annotations

import cmath
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.geometry.step_model import distance_left_m, largest_course_change_rad, step

PLACES = st.floats(-1e5, 1e5)
COURSES = st.floats(-math.pi, math.pi)
LENGTHS = st.floats(1.0, 1e4)


@given(x=PLACES, y=PLACES, course=COURSES, change=COURSES, length=LENGTHS)
def test_a_step_goes_its_length_along_the_new_course(
    x: float, y: float, course: float, change: float, length: float
) -> None:
    moved = complex(x, y) + length * cmath.exp(1j * course) * cmath.exp(1j * change)
    new_x, new_y, new_course = step(x, y, course, change, length)
    assert math.hypot(new_x - moved.real, new_y - moved.imag) < 1e-9 * 1e5
    assert new_course == pytest.approx(course + change)


def test_steps_of_equal_changes_close_a_regular_polygon() -> None:
    x, y, course = 3.0, -4.0, 0.7
    for _ in range(7):
        x, y, course = step(x, y, course, math.tau / 7, 50.0)
    assert (x, y) == pytest.approx((3.0, -4.0), abs=1e-9)


@given(radius=st.floats(50.0, 5000.0), share=st.floats(0.01, 1.9))
def test_steps_with_the_largest_change_lie_on_a_circle_of_the_turn_radius(
    radius: float, share: float
) -> None:
    length = share * radius
    change = largest_course_change_rad(length, radius)
    first = (0.0, 0.0)
    east, north, course = step(*first, 0.3, 0.0, length)
    second, third = (east, north), step(east, north, course, change, length)[:2]
    # Radius of the circle through three points: the product of the sides over four times the area.
    area = 0.5 * abs(second[0] * third[1] - second[1] * third[0])
    sides = math.dist(first, second) * math.dist(second, third) * math.dist(third, first)
    assert sides / (4.0 * area) == pytest.approx(radius, rel=1e-6)


def test_a_step_as_long_as_the_circle_is_wide_may_turn_back() -> None:
    assert largest_course_change_rad(200.0, 100.0) == pytest.approx(math.pi)
    assert largest_course_change_rad(500.0, 100.0) == pytest.approx(math.pi)


@given(guide=LENGTHS, length=LENGTHS, off=COURSES)
def test_distance_left_is_that_from_the_new_track_point(guide: float, length: float, off: float) -> None:
    x, y, _ = step(0.0, 0.0, 0.0, off, length)
    assert distance_left_m(guide, length, off) == pytest.approx(math.dist((x, y), (guide, 0.0)), abs=1e-2)


@given(guide=LENGTHS, length=LENGTHS, small=st.floats(0.0, 3.0), more=st.floats(0.01, 0.14))
def test_distance_left_grows_with_the_angle_off_the_guide_vector(
    guide: float, length: float, small: float, more: float
) -> None:
    assert distance_left_m(guide, length, small) < distance_left_m(guide, length, small + more)


@given(length=LENGTHS)
def test_a_step_onto_the_goal_leaves_nothing(length: float) -> None:
    assert distance_left_m(length, length, 0.0) == 0.0
