import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.analysis.flight_limits import AsGiven, FlightLimits
from harness.analysis.trackability import legs
from harness.flight.record import FloatArray, Track
from harness.run_files.given_path import CutCorner
from tests.harness.conftest import plan as make_plan
from tests.harness.conftest import track as make_track

STRAIGHT = make_plan([(0.0, 0.0, 0.0, 1.0, 0.0, 5000.0)])
LIMITS = FlightLimits(300.0, 50.0, math.radians(45), turn_radius_m=110.0, max_cross_track_m=5.0)
OFF = np.where(np.abs(np.arange(201) - 100) < 20, 6.0, 0.0)


def test_the_navigation_margin_comes_on_top_of_the_cross_track_limit_and_of_no_other() -> None:
    assert LIMITS.cross_track_threshold_m == 5.0
    kept = replace(LIMITS, navigation_margin_m=12.5, max_altitude_error_m=10.0)
    assert (kept.cross_track_threshold_m, kept.max_altitude_error_m) == (17.5, 10.0)


@pytest.mark.parametrize(("error_m", "trackable"), [(5.0, True), (-5.0, True), (5.1, False), (-5.1, False)])
def test_leg_is_trackable_up_to_the_threshold(error_m: float, trackable: bool) -> None:
    error = np.minimum(np.arange(201) / 100.0, 1.0) * error_m
    (leg,) = legs(make_track(201, cross_track_m=error), [STRAIGHT], LIMITS)
    assert (leg.start_s, leg.end_s, leg.max_cross_track_m) == (0.0, 20.0, abs(error_m))
    assert leg.trackable is trackable
    assert leg.cause == (None if trackable else "tracking error")


def test_each_plan_is_a_leg_and_short_ones_join_a_neighbour() -> None:
    """Plans flown for 10 s, 2 s, 3 s, 10 s and 1 s, after 1 s without any."""
    index = np.repeat([-1, 0, 1, 2, 3, 4], [10, 100, 20, 30, 100, 10])
    plans = [make_plan([(0, 0, 0, 1, 0.0, 5000.0)], index=i) for i in range(5)]
    judged = legs(make_track(len(index), plan_index=index), plans, LIMITS)
    assert [(leg.start_s, leg.end_s) for leg in judged] == [(1.0, 10.9), (11.0, 26.9)]


@pytest.mark.parametrize("rows", [10, 1])
def test_one_short_plan_is_still_judged(rows: int) -> None:
    (leg,) = legs(make_track(rows, cross_track_m=9.0), [STRAIGHT], LIMITS)
    assert leg.trackable is False


def test_without_a_plan_there_is_no_leg() -> None:
    assert legs(make_track(100, plan_index=-1), [], LIMITS) == ()


@pytest.mark.parametrize(("course_deg", "cause"), [(0.0, "turn radius too tight"), (90.0, "bank limit")])
def test_a_first_plan_that_leads_off_sideways_is_a_corner(course_deg: float, cause: str) -> None:
    """The plan leads east. Who flies north when it takes effect is asked for a right angle on the spot."""
    track = make_track(
        151,
        arc_length_m=np.maximum(2.5 * np.arange(151) - 40.0, 0.0),
        cross_track_m=np.minimum(np.arange(151) / 2.0, 40.0),
        course_deg=np.full(151, course_deg),
        roll_command_deg=np.full(151, 45.0),
    )
    assert legs(track, [make_plan([(0, 0, 1, 0, 0.0, 900.0)])], LIMITS)[0].cause == cause


def test_cause_is_a_corner_that_is_overshot() -> None:
    """The aircraft flies on past a right angle at 250 m; the nearest point of the plan stays there."""
    corner = make_plan([(0, 0, 0, 1, 0.0, 250.0), (0, 250, 1, 0, 0.0, 900.0)])
    along = np.minimum(25.0 * np.arange(151) / 10.0, 250.0)
    off = np.maximum(np.arange(151) - 100.0, 0.0)
    bank = np.where(off > 0, 45.0, 0.0)
    track = make_track(151, arc_length_m=along, cross_track_m=off, roll_command_deg=bank)
    assert legs(track, [corner], LIMITS)[0].cause == "turn radius too tight"
    assert legs(track, [make_plan([(0, 0, 0, 1, 0.0, 9000.0)])], LIMITS)[0].cause == "bank limit"


WIDE = replace(LIMITS, airspeed_mps=25.0, max_altitude_error_m=10.0, max_airspeed_error_mps=2.5, max_load_factor=2.0)


@pytest.mark.parametrize(
    ("columns", "cause"),
    [
        ({"up_m": 311.0, "throttle": 1.0}, "speed or throttle saturation"),
        ({"up_m": 311.0, "throttle": 0.5}, "tracking error"),
        ({"up_m": 309.0, "throttle": 1.0}, None),
        ({"airspeed_mps": 22.0}, "speed or throttle saturation"),
        ({"airspeed_mps": 23.0}, None),
        ({"airspeed_mps": np.where(np.arange(601) % 100 < 50, 21.0, 28.0)}, None),
        ({"load_factor": 2.1}, "load factor"),
        ({"load_factor": np.where(np.arange(601) % 20 == 0, 5.0, 1.0)}, None),
    ],
)  # fmt: skip
def test_altitude_airspeed_and_load_factor_have_limits(columns: dict[str, Any], cause: str | None) -> None:
    """Speed is judged over 20 s and load factor over 1 s: not gust by gust."""
    (leg,) = legs(make_track(601, **columns), [STRAIGHT], WIDE)
    assert leg.cause == cause
    assert leg.trackable is (cause is None)


def passed(arc_length_m: float, cut_m: float, waypoint: int) -> CutCorner:
    return CutCorner(waypoint, 0.0, arc_length_m, 90.0, 100.0, cut_m, arc_length_m, 30.0, 50.0)


def as_given(track: Track, corners: list[CutCorner], off_m: FloatArray, allowed_m: float) -> AsGiven:
    """A level path for an aircraft that climbs at 5 m/s and sinks at 8."""
    rows = len(track)
    return AsGiven(
        corners, off_m, np.full(rows, allowed_m), altitude_m=track.up_m, climb_mps=np.zeros(rows),
        fastest_mps=np.tile((5.0, 8.0), (rows, 1)), airspeed_mps=np.full(rows, 25.0),
    )  # fmt: skip


def test_corners_end_legs_and_belong_to_the_leg_that_they_end() -> None:
    corners = [passed(500.0, 49.0, 1), passed(1000.0, 51.0, 2)]
    track = make_track(601)
    off = np.where(np.abs(track.arc_length_m - 1000.0) < 30.0, 51.0, 50.0)
    judged = legs(track, [STRAIGHT], LIMITS, given=as_given(track, corners, off, 50.0))
    assert [(leg.end_s, leg.waypoint, leg.corner_cut_m, leg.max_deviation_m, leg.cause) for leg in judged] == [
        (20.0, 1, 49.0, 50.0, None),
        (40.0, 2, 51.0, 51.0, "tracking error"),
        (60.0, None, 0.0, 50.0, None),
    ]
    # What lies beyond a corner counts as well, however near the track is to the arcs that were made of the path.
    for last in (corners, [*corners, passed(1400.0, 3.0, 3)]):  # the last leg of 4 s is not one
        beyond = as_given(track, last, np.where(track.arc_length_m > 1450.0, 51.0, 3.0), 50.0)
        assert [leg.trackable for leg in legs(track, [STRAIGHT], LIMITS, given=beyond)] == [True, True, False]


@pytest.mark.parametrize(
    ("heading_deg", "side", "cause"),
    [
        (-15.0, 1.0, "wind drift"),
        (15.0, -1.0, "wind drift"),
        (-15.0, -1.0, "tracking error"),
        (-3.0, 1.0, "tracking error"),
    ],
)  # fmt: skip
def test_cause_is_the_wind_where_the_drift_is_downwind(heading_deg: float, side: float, cause: str) -> None:
    """Course north with the nose to the left: the wind blows from the left and drifts to the right."""
    track = make_track(201, cross_track_m=side * OFF, heading_deg=heading_deg % 360.0)
    assert legs(track, [STRAIGHT], LIMITS)[0].cause == cause


def test_lost_control_is_on_the_last_leg() -> None:
    plans = [make_plan([(0, 0, 0, 1, 0.0, 5000.0)], index=i) for i in range(2)]
    track = make_track(200, plan_index=np.repeat([0, 1], 100))
    judged = legs(track, plans, LIMITS, "rolled over: roll 80 deg")
    assert [leg.cause for leg in judged] == [None, "lost control"]
    assert [leg.trackable for leg in judged] == [True, False]


@pytest.mark.parametrize(
    ("believed_m", "cause"),
    [
        # It flies to where its first fix says that it should be.
        (np.linspace(-14.0, 0.0, 201), "navigation error"),
        (np.full(201, 14.0), "tracking error"),
        (np.linspace(0.0, 14.0, 201), "tracking error"),
        (np.full(201, np.nan), "tracking error"),
    ],
)  # fmt: skip
def test_a_navigation_error_is_told_where_the_true_one_is_largest(believed_m: FloatArray, cause: str) -> None:
    """A true error that grows to 14 m in altitude, or beside the plan, while the aircraft believes to be there."""
    off_m = np.linspace(0.0, 14.0, 201)
    for columns in (
        {"up_m": 300.0 + off_m, "believed_up_m": 300.0 + believed_m, "believed_cross_track_m": 0.0},
        {"cross_track_m": off_m, "believed_up_m": 300.0, "believed_cross_track_m": believed_m},
    ):
        (leg,) = legs(make_track(201, **columns), [STRAIGHT], replace(LIMITS, max_altitude_error_m=10.0))
        assert leg.cause == cause


def test_a_plan_is_too_late_only_for_an_aircraft_that_believed_to_be_off_it() -> None:
    """It is 20 m off by its navigation, which is not most of the 60 m that it comes to be off."""
    off_m = np.linspace(20.0, 60.0, 201)
    for seen_m, cause in ((off_m, "planner too late"), (off_m - 20.0, "tracking error")):
        (leg,) = legs(make_track(201, cross_track_m=off_m, believed_cross_track_m=seen_m), [STRAIGHT], LIMITS)
        assert leg.cause == cause
