"""The point mass against the closed form of its own motion."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aircraft.interface import GRAVITY_MPS2
from aircraft.start import Atmosphere, StartConditions
from tests.point_mass import PointMass

START = StartConditions(1000.0, 2000.0, 300.0, 0.5, 25.0)


def test_straight_flight_makes_the_course_good_in_wind() -> None:
    model = PointMass(START, Atmosphere(wind_east_mps=-6.0, wind_north_mps=4.0))
    before = model.state()
    model.advance(1200)
    after = model.state()
    assert math.atan2(after.east_m - before.east_m, after.north_m - before.north_m) == pytest.approx(0.5)
    moved_m = math.hypot(after.east_m - before.east_m, after.north_m - before.north_m)
    assert moved_m == pytest.approx(10.0 * before.groundspeed_mps)
    assert after.time_s == 10.0


def test_a_steady_bank_flies_the_circle_of_its_radius() -> None:
    model = PointMass(START, roll_lag_s=1e-3)
    roll = math.radians(30.0)
    model.command(roll, 300.0, 25.0)
    model.advance(12)
    radius = 25.0**2 / (GRAVITY_MPS2 * math.tan(roll))
    state = model.state()
    east = state.east_m + radius * math.cos(state.course_rad)
    north = state.north_m - radius * math.sin(state.course_rad)
    for _ in range(50):
        model.advance(60)
        state = model.state()
        assert math.hypot(state.east_m - east, state.north_m - north) == pytest.approx(radius, rel=1e-9)
    assert state.load_factor == pytest.approx(1.0 / math.cos(roll))


def test_roll_is_first_order() -> None:
    model = PointMass(START, roll_lag_s=0.25)
    model.command(0.5, 300.0, 25.0)
    model.advance(30)
    assert model.state().roll_rad == pytest.approx(0.5 * (1.0 - math.exp(-1.0)))


@given(st.integers(1, 120), st.floats(-0.7, 0.7))
def test_big_strides_agree_with_single_steps(steps: int, roll: float) -> None:
    whole, single = PointMass(START), PointMass(START)
    for model in (whole, single):
        model.command(roll, 310.0, 27.0)
    whole.advance(steps)
    for _ in range(steps):
        single.advance(1)
    a, b = whole.state(), single.state()
    assert a.time_s == b.time_s
    assert a.east_m == pytest.approx(b.east_m, abs=0.01)
    assert a.north_m == pytest.approx(b.north_m, abs=0.01)
    assert a.roll_rad == pytest.approx(b.roll_rad, abs=1e-9)
    assert (a.up_m, a.airspeed_mps) == (310.0, 27.0)
