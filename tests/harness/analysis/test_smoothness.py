import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.analysis.smoothness import (
    Profile,
    Smoothness,
    flown_profile,
    planned_profile,
    polyline_profile,
    smoothness,
    stations_in_effect,
    tangent_of,
)
from harness.flight.record import AcceptedPlan
from tests.harness.conftest import plan as make_plan
from tests.harness.conftest import track as make_track
from wayproof import Path, Plan, PlanStatus


def profile(*pieces: tuple[float, float]) -> Profile:
    length, curvature = np.array(pieces, dtype=np.float64).T
    return Profile(length, curvature)


@given(radius=st.floats(10.0, 1e5), turn=st.floats(0.1, 20.0), cuts=st.integers(1, 50))
def test_circle_in_closed_form(radius: float, turn: float, cuts: int) -> None:
    """Turn t at radius R: heading t, energy t / R, curvature 1 / R, no rate; however it is cut."""
    figures = smoothness(profile(*[(radius * turn / cuts, -1.0 / radius)] * cuts), 10.0)
    assert figures.heading_change_deg == pytest.approx(math.degrees(turn))
    assert figures.bending_energy_1pm == pytest.approx(turn / radius)
    assert figures.max_curvature_1pm == pytest.approx(1.0 / radius)
    assert figures.max_curvature_rate_1pm2 == 0.0


def test_straight_line_is_zero_in_all() -> None:
    nothing = Smoothness(*[0.0] * 4)
    assert smoothness(profile((1000.0, 0.0)), 25.0) == nothing
    assert smoothness(Profile(np.zeros(0), np.zeros(0)), 25.0) == nothing


def test_clothoid_in_closed_form() -> None:
    """k = c s up to L: heading c L^2 / 2, energy c^2 L^3 / 3, curvature c L, rate c."""
    rate, length, pieces = 2e-5, 400.0, 4000
    step = length / pieces
    figures = smoothness(profile(*[(step, rate * (i + 0.5) * step) for i in range(pieces)]), 20.0)
    assert figures.heading_change_deg == pytest.approx(math.degrees(rate * length**2 / 2))
    assert figures.bending_energy_1pm == pytest.approx(rate**2 * length**3 / 3, rel=1e-6)
    assert figures.max_curvature_1pm == pytest.approx(rate * length, rel=1e-3)
    assert figures.max_curvature_rate_1pm2 == pytest.approx(rate, rel=1e-6)


def test_flown_course_through_north_does_not_jump() -> None:
    course = np.where(np.arange(100) % 2, 359.999, 0.001)
    assert smoothness(flown_profile(make_track(100, course_deg=course)), 25.0).heading_change_deg < 0.5


def test_planned_counts_only_what_was_in_effect() -> None:
    """1000 m of a line whose arc is never reached, then 500 m of an arc of 1000 m radius."""
    plans = [
        make_plan([(0, 0, 0, 1, 0.0, 1500.0), (0, 1500, 0, 1, 0.01, 100.0)]),
        make_plan([(0, 1000, 0, 1, 0.001, 5000.0)], index=1),
    ]
    station = np.arange(601) * 2.5
    index = (station >= 1000.0).astype(int)
    track = make_track(601, plan_index=index, arc_length_m=station - 1000.0 * index)
    assert stations_in_effect(track) == [(0, 0.0, 1000.0), (1, 0.0, 500.0)]
    figures = smoothness(planned_profile(track, plans, 25.0), 25.0)
    assert figures.heading_change_deg == pytest.approx(math.degrees(0.5))
    assert figures.max_curvature_1pm == 0.001
    assert figures.max_curvature_rate_1pm2 == pytest.approx(0.001 / 25.0)


def test_planned_corner_is_turned_over_the_window() -> None:
    """A polyline with a right angle: heading 90 deg, energy (pi / 2)^2 / w, curvature (pi / 2) / w."""
    polyline = make_plan([(0, 0, 0, 1, 0.0, 100.0), (0, 100, -1, 0, 0.0, 400.0)])
    figures = smoothness(planned_profile(make_track(101), [polyline], 25.0), 25.0)
    assert figures.heading_change_deg == pytest.approx(90.0)
    assert figures.bending_energy_1pm == pytest.approx((math.pi / 2) ** 2 / 25.0)
    assert figures.max_curvature_1pm == pytest.approx(math.pi / 2 / 25.0)


@given(radius=st.floats(50.0, 1e4), chords=st.integers(8, 200))
def test_polyline_in_a_circle_has_nearly_its_curvature(radius: float, chords: int) -> None:
    """With a turn of a = 2 pi / n at each vertex and chords of 2 r sin(a / 2), the curvature is a over a chord."""
    angle = np.linspace(0.0, math.tau, chords + 1)
    chord, turn = 2.0 * radius * math.sin(math.pi / chords), math.tau / chords
    bent = polyline_profile(radius * np.column_stack((np.cos(angle), np.sin(angle))), 2.0 * chord)
    figures = smoothness(bent, 2.0 * chord)
    assert bent.length_m.sum() == pytest.approx(chords * chord)
    assert figures.max_curvature_1pm == pytest.approx(turn / chord)
    assert figures.heading_change_deg == pytest.approx(math.degrees(turn * (chords - 1)))
    assert figures.bending_energy_1pm == pytest.approx(turn**2 / chord * (chords - 1))


def test_polyline_with_a_corner_turns_it_over_the_window() -> None:
    bent = polyline_profile(np.array([(0.0, 0.0), (0.0, 100.0), (-400.0, 100.0)]), 25.0)
    assert bent.length_m == pytest.approx([87.5, 25.0, 387.5])
    assert bent.curvature_1pm == pytest.approx([0.0, math.pi / 2 / 25.0, 0.0])
    line = polyline_profile(np.array([(0.0, 0.0), (30.0, 40.0)]), 25.0)
    assert (line.length_m.tolist(), line.curvature_1pm.tolist()) == ([50.0], [0.0])


@pytest.mark.parametrize("end_turn", [0.0, 0.3])
def test_the_turn_onto_a_new_plan_counts(end_turn: float) -> None:
    """North for 1000 m, the last part of it an arc, then a plan that begins at 0.5 rad to the right."""
    out = 0.5
    plans = [
        make_plan([(0, 0, 0, 1, 0.0, 900.0), (0, 900, 0, 1, end_turn / 100.0, 100.0)]),
        make_plan([(0, 1000, math.sin(out), math.cos(out), 0.0, 5000.0)], index=1),
    ]
    station = np.arange(601) * 2.5
    index = (station >= 1000.0).astype(int)
    track = make_track(601, plan_index=index, arc_length_m=station - 1000.0 * index)
    figures = smoothness(planned_profile(track, plans, 25.0), 25.0)
    assert figures.heading_change_deg == pytest.approx(math.degrees(end_turn + end_turn + out))
    assert figures.max_curvature_1pm == pytest.approx((end_turn + out) / 25.0)


@pytest.mark.parametrize(("loiter", "turned_rad"), [(True, 300.0 / 40.0), (False, math.tau)])
def test_planned_goes_on_past_the_end(loiter: bool, turned_rad: float) -> None:
    """300 m along a circle of 251 m circumference, flown for ever or left at its end."""
    path = Path(np.array([[0, 0, 0, 1, 1 / 40.0, math.tau * 40.0]]), loiter)
    plan = AcceptedPlan(0, 0.0, 1.0, Plan(PlanStatus.FOUND, "", path=path))
    figures = smoothness(planned_profile(make_track(121), [plan], 25.0), 25.0)
    assert figures.heading_change_deg == pytest.approx(math.degrees(turned_rad))
    assert tangent_of(plan, 300.0) == pytest.approx((-math.sin(turned_rad), math.cos(turned_rad)))


def test_rows_before_the_first_plan_do_not_count() -> None:
    index = np.repeat([-1, 0], 50)
    station = np.where(index < 0, np.nan, 10.0 + 2.5 * (np.arange(100) - 50))
    assert stations_in_effect(make_track(100, plan_index=index, arc_length_m=station)) == [(0, 10.0, 132.5)]
