"""The point that flies every route exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aircraft.interface import FlightModel, Route
from aircraft.kinematic_point import KinematicPoint
from aircraft.route import route_length, route_point
from aircraft.start import Atmosphere, StartConditions

NORTH = StartConditions(east_m=0.0, north_m=0.0, altitude_m=300.0, course_rad=0.0, airspeed_mps=20.0)
SECOND = 60
LEFT_TURN_M = 50.0 * math.pi
CORNER = Route(np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 100.0], [0.0, 100.0, 1.0, 0.0, 0.0, 100.0]]))
BENT = Route(np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 100.0], [0.0, 100.0, 0.0, 1.0, 0.02, LEFT_TURN_M]]))
LOITER = Route(
    np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 100.0], [0.0, 100.0, 0.0, 1.0, 0.02, 100.0 * math.pi]]), loiter=True
)


def place(point: KinematicPoint) -> tuple[float, float]:
    state = point.state()
    return state.east_m, state.north_m


def test_is_a_flight_model() -> None:
    model: FlightModel = KinematicPoint(NORTH)
    assert model.step_rate_hz == SECOND
    assert model.fault() is None
    state = model.state()
    assert (state.up_m, state.airspeed_mps, state.roll_rad, state.load_factor) == (300.0, 20.0, 0.0, 1.0)


def test_flies_straight_on_before_its_first_route_and_after_its_last() -> None:
    point = KinematicPoint(NORTH)
    point.advance(2 * SECOND)
    assert place(point) == pytest.approx((0.0, 40.0))
    point.follow(CORNER, arc_length_m=40.0)
    point.advance(20 * SECOND)
    assert place(point) == pytest.approx((340.0, 100.0))
    assert point.update(point.state()).past_end


def test_turns_on_the_spot_at_a_corner() -> None:
    point = KinematicPoint(NORTH)
    point.follow(CORNER)
    point.advance(5 * SECOND - 1)
    assert point.state().course_rad == pytest.approx(0.0)
    point.advance(2)
    assert point.state().course_rad == pytest.approx(math.pi / 2)
    assert place(point) == pytest.approx((20.0 / SECOND, 100.0))
    assert point.state().groundspeed_mps == pytest.approx(20.0)


@given(seconds=st.floats(0.0, 12.0), route=st.sampled_from([CORNER, BENT]))
def test_is_exactly_where_the_route_is(seconds: float, route: Route) -> None:
    point = KinematicPoint(NORTH)
    point.follow(route)
    steps = round(seconds * SECOND)
    point.advance(steps)
    station = 20.0 * steps / SECOND
    state, guided = point.state(), point.update(point.state())
    assert (state.east_m, state.north_m) == pytest.approx(route_point(route, station)[:2], abs=1e-9)
    assert (guided.cross_track_m, guided.roll_command_rad) == (0.0, 0.0)
    assert guided.arc_length_m == pytest.approx(station)
    assert guided.past_end == (station > route_length(route))


def test_one_long_step_ends_where_many_short_ones_do() -> None:
    long, short = KinematicPoint(NORTH), KinematicPoint(NORTH)
    for point in (long, short):
        point.follow(BENT)
    long.advance(5 * SECOND)
    for _ in range(50):
        short.advance(6)
    assert place(short) == pytest.approx(place(long), abs=1e-9)
    assert short.state().time_s == long.state().time_s == 5.0


def test_goes_round_a_loiter_for_ever_and_counts_on() -> None:
    point = KinematicPoint(NORTH)
    point.follow(LOITER)
    one_turn_m = 100.0 * math.pi
    point.advance(5 * SECOND)
    entered = place(point)
    point.command(roll_rad=0.0, altitude_m=300.0, airspeed_mps=one_turn_m)
    point.advance(3 * SECOND)
    assert place(point) == pytest.approx(entered, abs=1e-6)
    guided = point.update(point.state())
    assert guided.arc_length_m == pytest.approx(100.0 + 3 * one_turn_m)
    assert not guided.past_end


@pytest.mark.parametrize("arc_length_m", [200.0, 200.0 + 300.0 * math.pi])
def test_a_loiter_taken_up_under_way_is_still_flown_round(arc_length_m: float) -> None:
    point = KinematicPoint(NORTH)
    point.follow(LOITER)
    point.advance(10 * SECOND)
    point.follow(LOITER, arc_length_m=arc_length_m)
    assert point.update(point.state()).arc_length_m == pytest.approx(arc_length_m)
    for _ in range(20):
        point.advance(SECOND)
        assert math.dist(place(point), (-50.0, 100.0)) == pytest.approx(50.0)


def test_a_new_route_under_way_is_joined_at_the_nearest_point_without_a_jump() -> None:
    point = KinematicPoint(NORTH)
    point.advance(2 * SECOND)
    point.follow(BENT, arc_length_m=38.0)
    assert point.update(point.state()).arc_length_m == pytest.approx(40.0)
    assert point.update(point.state()).cross_track_m == 0.0
    assert place(point) == pytest.approx((0.0, 40.0))


def test_a_route_that_begins_elsewhere_is_joined_in_a_straight_line() -> None:
    aside = Route(np.array([[30.0, 40.0, 0.0, 1.0, 0.0, 100.0]]))
    point = KinematicPoint(NORTH)
    point.follow(aside)
    assert place(point) == (0.0, 0.0)
    assert point.update(point.state()).cross_track_m == pytest.approx(50.0)
    point.advance(SECOND)
    assert place(point) == pytest.approx((12.0, 16.0))
    assert point.update(point.state()).cross_track_m == pytest.approx(30.0)
    assert point.update(point.state()).arc_length_m == 0.0
    point.advance(2 * SECOND)
    assert place(point) == pytest.approx((30.0, 50.0))
    assert point.update(point.state()).cross_track_m == 0.0
    assert point.update(point.state()).arc_length_m == pytest.approx(10.0)


def test_the_air_does_not_touch_it() -> None:
    calm, windy = KinematicPoint(NORTH), KinematicPoint(NORTH, Atmosphere(wind_east_mps=15.0))
    for point in (calm, windy):
        point.follow(BENT)
        point.advance(700)
    assert windy.state() == calm.state()
