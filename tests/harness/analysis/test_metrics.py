import json
import math
from dataclasses import replace

import numpy as np
import pytest

from harness.analysis.deviation import error_figures
from harness.analysis.flight_limits import FlightLimits
from harness.analysis.metrics import metrics, percentiles
from harness.analysis.rows import row_of
from harness.flight.record import AcceptedPlan, Flight, Outcome, Track, digest
from tests.harness.conftest import CIRCLE_PLAN, circle_track
from tests.harness.conftest import STRAIGHT_PLAN as STRAIGHT
from tests.harness.conftest import plan as make_plan
from tests.harness.conftest import track as make_track
from wayproof import Path

LIMITS = FlightLimits(300.0, 200.0, math.radians(45), turn_radius_m=110.0, max_cross_track_m=20.0)
KEYS = {
    "shield", "outcome", "reason", "flown_length_m", "planned_length_m", "flight_time_s", "min_clearance_m",
    "min_altitude_above_ground_m", "clearance_violation_s", "cross_track_m", "total_system_error_m",
    "ground_known_fraction", "flight_technical_error_m", "altitude_error_m", "smoothness", "bank_saturation_fraction",
    "max_load_factor", "trackable", "trackability", "findings", "bank_reversals_per_min",
    "plan_contradictions", "replans", "plan_delay_s", "compute_ms", "timing", "digest",
    "error",
}  # fmt: skip


def flight(track: Track, *plans: AcceptedPlan, outcome: Outcome = Outcome.REACHED) -> Flight:
    return Flight(track, plans, outcome, "because", (1.0, 2.0, 3.0), 10.0, 0.5)


def test_figures_of_a_straight_flight() -> None:
    track = make_track(
        101,
        up_m=np.repeat([299.0, 301.0], [1, 100]),
        cross_track_m=np.repeat([0.0, -2.0], [91, 10]),
        clearance_m=np.repeat([500.0, 150.0], [71, 30]),
        load_factor=np.repeat([1.0, 1.4], [100, 1]),
        roll_command_deg=np.repeat([0.0, -45.0], [100, 1]),
    )
    figures = metrics(flight(track, STRAIGHT), LIMITS)
    assert set(figures) == KEYS
    assert (figures["outcome"], figures["reason"]) == ("reached", "because")
    assert figures["flown_length_m"] == pytest.approx(250.0)
    assert figures["planned_length_m"] == pytest.approx(250.0)
    assert figures["flight_time_s"] == 10.0
    assert figures["min_clearance_m"] == 150.0
    assert figures["min_altitude_above_ground_m"] is None
    assert figures["clearance_violation_s"] == pytest.approx(3.0)
    assert figures["cross_track_m"] == {"rms": pytest.approx(math.sqrt(40 / 101)), "p95": 2.0, "max": 2.0}
    assert figures["altitude_error_m"] == {"rms": 1.0, "p95": 1.0, "max": 1.0}
    assert figures["bank_saturation_fraction"] == pytest.approx(1 / 101)
    assert figures["max_load_factor"] == 1.4
    assert figures["trackable"] is True
    assert figures["replans"] == 0
    assert figures["compute_ms"] == {"p50": 2.0, "p99": pytest.approx(2.98), "max": 3.0}
    assert figures["timing"]["planner_wall_ms"] == {"p50": None, "p99": None, "max": None}
    assert (figures["timing"]["sim_s"], figures["timing"]["realtime_factor"]) == (10.0, 20.0)
    assert figures["digest"] == digest(track)


def test_the_least_height_above_ground_is_over_what_is_known() -> None:
    track = make_track(10, altitude_above_ground_m=np.repeat([120.0, np.nan, 80.0], [4, 3, 3]))
    figures = metrics(flight(track, STRAIGHT), LIMITS)
    assert (figures["min_altitude_above_ground_m"], figures["ground_known_fraction"]) == (80.0, 0.7)


def test_smoothness_of_planned_and_flown_agree_on_a_circle() -> None:
    figures = metrics(flight(circle_track(500.0, 60.0), CIRCLE_PLAN), LIMITS)["smoothness"]
    assert set(figures) == {"planned", "flown"}
    for name in ("heading_change_deg", "bending_energy_1pm", "max_curvature_1pm"):
        assert figures["flown"][name] == pytest.approx(figures["planned"][name], rel=1e-3)
    assert figures["planned"]["bending_energy_1pm"] == pytest.approx(1500.0 / 500.0**2, rel=1e-3)


@pytest.mark.parametrize(("outcome", "ratio"), [(Outcome.REACHED, 1.25), (Outcome.TIMEOUT, None)])
def test_a_row_has_turns_in_turn_radii_and_the_length_in_optima_where_the_goal_was_reached(
    outcome: Outcome, ratio: float | None
) -> None:
    """1500 m on a circle of 500 m, planned as one of 800 m."""
    wider = make_plan([(800.0, 0.0, 0.0, 1.0, 1 / 800.0, 5000.0)])
    content = metrics(flight(circle_track(500.0, 60.0), wider, outcome=outcome), LIMITS)
    figures = row_of("a", "b", content, optimum_m=1200.0, turn_radius_m=200.0).figures
    assert figures["ratio"] == (ratio and pytest.approx(ratio, rel=1e-3))
    assert figures["tightest_turn"] == pytest.approx(200.0 / 800.0)
    assert figures["tightest_flown_turn"] == pytest.approx(200.0 / 500.0, rel=1e-3)


def test_what_does_not_exist_is_null() -> None:
    track = make_track(30, plan_index=-1, cross_track_m=np.nan, arc_length_m=np.nan, clearance_m=np.inf)
    empty = replace(flight(track, outcome=Outcome.PLANNER_FAILED), compute_ms=(), wall_s=0.0)
    figures = metrics(empty, LIMITS)
    assert figures["min_clearance_m"] is None
    assert figures["cross_track_m"] == {"rms": None, "p95": None, "max": None}
    assert figures["compute_ms"] == {"p50": None, "p99": None, "max": None}
    assert figures["timing"]["realtime_factor"] is None
    assert figures["planned_length_m"] == 0.0
    assert figures["trackable"] is False
    assert figures["trackability"] == []
    assert json.loads(json.dumps(figures, allow_nan=False)) == figures


def test_flight_without_a_track_has_no_metrics() -> None:
    with pytest.raises(ValueError, match="without a track"):
        metrics(flight(make_track(0)), LIMITS)


def test_planned_length_survives_frequent_replanning() -> None:
    """A new plan every second, each from where the aircraft is: nothing is lost between them."""
    rows = np.arange(1001)
    track = make_track(1001, plan_index=rows // 10, arc_length_m=2.5 * (rows % 10))
    plans = [make_plan([(0, 25.0 * i, 0, 1, 0.0, 5000.0)], index=i) for i in range(101)]
    figures = metrics(flight(track, *plans), LIMITS)
    assert (figures["planned_length_m"], figures["replans"]) == (pytest.approx(2500.0), 100)


def test_planned_length_counts_every_round_of_a_loiter_and_nothing_beyond_an_end() -> None:
    once = CIRCLE_PLAN.plan.path
    assert once is not None
    for_ever = replace(CIRCLE_PLAN, plan=replace(CIRCLE_PLAN.plan, path=Path(once.segments, loiter=True)))
    track, beyond = (
        make_track(2001),
        make_track(101, arc_length_m=once.length_m + 10.0 + 2.5 * np.arange(101)),
    )
    for flown, plan, length_m in (
        (track, for_ever, 5000.0),
        (track, CIRCLE_PLAN, once.length_m),
        (beyond, CIRCLE_PLAN, 0.0),
    ):
        assert metrics(flight(flown, plan), LIMITS)["planned_length_m"] == pytest.approx(length_m)


def test_error_figures_leave_out_nan() -> None:
    assert error_figures(np.array([np.nan, -3.0, 3.0])) == {"rms": 3.0, "p95": 3.0, "max": 3.0}
    assert percentiles((5.0,)) == {"p50": 5.0, "p99": 5.0, "max": 5.0}


def test_a_plan_is_as_late_as_the_scan_it_knew_is_old() -> None:
    plans = [replace(STRAIGHT, time_s=2.0 * late, scan_s=late) for late in (0.5, 2.5)]
    delays = metrics(flight(make_track(30), *plans, replace(STRAIGHT, time_s=9.0)), LIMITS)["plan_delay_s"]
    assert delays == {"p50": 1.5, "p99": pytest.approx(2.48), "max": 2.5}


def test_a_jump_of_the_believed_position_is_from_row_to_row() -> None:
    """A steady drift is none, however far it leads; what is not known is left out."""
    rows = np.arange(101)
    off_m = 0.2 * rows - np.where(rows >= 60, 30.0, 0.0)
    north_m = make_track(101).north_m + np.where(rows == 80, np.nan, 0.0)
    believed = {"believed_up_m": 300.0, "believed_course_deg": 0.0, "believed_cross_track_m": 0.0}
    track = make_track(101, believed_east_m=off_m, believed_north_m=north_m, **believed)
    assert metrics(flight(track, STRAIGHT), LIMITS)["navigation_jump_m"] == pytest.approx(29.8)


@pytest.mark.parametrize(("clearance_m", "violation_s"), [(200.0, 0.0), (199.9, 4.9)])
def test_exactly_the_wanted_clearance_is_no_violation(clearance_m: float, violation_s: float) -> None:
    figures = metrics(flight(make_track(50, clearance_m=clearance_m), STRAIGHT), LIMITS)
    assert figures["clearance_violation_s"] == pytest.approx(violation_s)


def test_a_contact_between_two_rows_is_below_the_wanted_clearance() -> None:
    """What is thinner than the way from row to row: both rows may be clear of it."""
    figures = metrics(replace(flight(make_track(50, clearance_m=250.0), STRAIGHT), contact_m=-0.5), LIMITS)
    assert figures["min_clearance_m"] == -0.5
    assert figures["clearance_violation_s"] == pytest.approx(0.1)
