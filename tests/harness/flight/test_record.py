import math
from dataclasses import replace

import numpy as np
import pytest

from harness.flight.record import FloatArray, Track
from harness.flight.track_log import TrackLog
from tests.harness.conftest import track as make_track
from wayproof import AircraftState, GuidanceOutput


def state(time_s: float) -> AircraftState:
    return AircraftState(time_s, 3.0, 4.0, 300.0, -15.0, 20.0, 0.5, -0.1, 0.2, 0.03, 24.0, 1.1)


def steered(roll_command_rad: float, cross_track_m: float, arc_length_m: float) -> GuidanceOutput:
    return GuidanceOutput(roll_command_rad, cross_track_m, arc_length_m, bank_saturated=False, past_end=False)


def none_near(points_m: FloatArray, times_s: FloatArray) -> FloatArray:
    assert points_m.shape == (len(times_s), 2)
    return np.full(len(times_s), np.inf)


def test_row_holds_the_state_in_the_units_of_the_file() -> None:
    log = TrackLog(lambda points, times: points.sum(axis=1) + times)
    log.add(state(0.5), steered(0.25, -1.5, 77.0), 3)
    row = {name: values[0] for name, values in vars(log.close()).items()}
    assert row["course_deg"] == pytest.approx(360.0 - math.degrees(math.atan(0.75)))
    assert row["heading_deg"] == pytest.approx(360.0 - math.degrees(0.1))
    assert row["groundspeed_mps"] == 25.0
    assert row["roll_deg"] == pytest.approx(math.degrees(0.2))
    assert row["pitch_deg"] == pytest.approx(math.degrees(0.03))
    assert row["roll_command_deg"] == pytest.approx(math.degrees(0.25))
    assert row["clearance_m"] == 7.5
    assert (row["time_s"], row["east_m"], row["north_m"], row["up_m"]) == (0.5, 3.0, 4.0, 300.0)
    assert (row["airspeed_mps"], row["load_factor"]) == (24.0, 1.1)
    assert (row["cross_track_m"], row["arc_length_m"], row["plan_index"]) == (-1.5, 77.0, 3)


def test_due_north_is_0_not_360_degrees() -> None:
    log = TrackLog(none_near)
    north = state(0.0)._replace(velocity_east_mps=-1e-15, heading_rad=-1e-17)
    log.add(north, steered(0.0, math.nan, math.nan), -1, north)
    track = log.close()
    assert (track.course_deg[0], track.heading_deg[0]) == (0.0, 0.0)


def test_a_navigation_error_is_the_distance_and_the_true_arc_length_less_what_is_ahead() -> None:
    """On the course of which east is 3/5 and north 4/5 the belief is 10 m ahead and 5 m to the right: at (10, 5)."""
    flown = make_track(9, east_m=2.0, believed_east_m=12.0, believed_north_m=make_track(9).north_m + 5.0)
    flown = replace(flown, course_deg=np.full(9, math.degrees(math.atan2(3.0, 4.0))))
    assert flown.navigation_error_m == pytest.approx(np.full(9, math.sqrt(125.0)))
    assert flown.along_truly.arc_length_m == pytest.approx(flown.arc_length_m - 10.0)


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_a_state_that_is_not_finite_is_no_row_nor_a_block(rows: int) -> None:
    blocks: list[Track] = []
    log = TrackLog(none_near, [blocks.append], block_rows=rows)
    for tick in range(4):
        log.add(state(tick / 10), steered(0.0, math.nan, math.nan), -1)
    log.add(state(0.4)._replace(velocity_up_mps=math.inf), steered(0.0, math.nan, math.nan), -1)
    np.testing.assert_array_equal(log.close().time_s, np.arange(4) / 10)
    assert all(len(block) for block in blocks)
