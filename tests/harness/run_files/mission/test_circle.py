"""Ways onto circles and off them, held against what a circle and a tangent are."""

from __future__ import annotations

import cmath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.run_files.mission.circle import Circle, Pose, Row, end_of, onto, towards

PLACES = st.builds(complex, st.floats(-600, 600), st.floats(-600, 600))
DIRECTIONS = st.floats(0, 6.28).map(lambda angle: cmath.exp(1j * angle))
RADII = st.floats(40, 300)
SIDES = st.sampled_from((1, -1))


def end(pose: Pose, rows: list[Row]) -> Pose:
    """Where a way ends that goes on from a pose without a kink."""
    for row in rows:
        assert complex(*row[:2]) == pytest.approx(pose[0], abs=1e-5)
        assert complex(*row[2:4]) == pytest.approx(pose[1], abs=1e-5)
        pose = end_of(row)
    return pose


@given(PLACES, DIRECTIONS, PLACES, RADII, RADII, SIDES)
def test_a_circle_is_joined_along_its_tangent(
    place: complex, ahead: complex, center: complex, radius: float, turn: float, side: int
) -> None:
    circle = Circle(center, radius, side)
    rows = onto((place, ahead), circle, turn)
    there, direction = end((place, ahead), rows)
    assert abs(there - center) == pytest.approx(radius, abs=1e-4)
    assert direction == pytest.approx(circle.direction(there), abs=1e-4)
    assert all(abs(row[4]) in (0.0, pytest.approx(1.0 / turn)) for row in rows)


@given(PLACES, DIRECTIONS, PLACES, RADII)
def test_a_turn_leads_towards_a_place(place: complex, ahead: complex, aim: complex, turn: float) -> None:
    if abs(aim - place) < 1.0:
        return
    there, direction = end((place, ahead), towards((place, ahead), aim, turn))
    if abs(aim - there) > 1e-3:
        assert (aim - there) / abs(aim - there) == pytest.approx(direction, abs=1e-4)


@given(PLACES, PLACES, RADII, SIDES)
def test_tangents_touch_in_the_direction_of_flight(
    place: complex, center: complex, radius: float, side: int
) -> None:
    circle = Circle(center, radius, side)
    joins, leaves = circle.joined_from(place), circle.left_to(place)
    if abs(place - center) <= radius:
        assert (joins, leaves) == (None, None)
        return
    if abs(place - center) < radius + 0.1:
        return
    assert joins is not None
    assert leaves is not None
    towards_it, from_it = (joins - place) / abs(joins - place), (place - leaves) / abs(place - leaves)
    assert towards_it == pytest.approx(circle.direction(joins), abs=1e-4)
    assert from_it == pytest.approx(circle.direction(leaves), abs=1e-4)
