from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from harness.analysis.moments import moments
from harness.flight.record import Track


def at(row: int, value: float, usual: float = 0.0) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """101 values of which one is another; rows are a tenth of a second apart."""
    values = np.full(101, usual)
    values[row] = value
    return values


def test_each_figure_has_the_time_at_which_it_came_about(make_track: Callable[..., Track]) -> None:
    clearance_m, bank_deg = at(40, 20.0, 500.0), at(60, -45.0)
    clearance_m[38:40], bank_deg[61:70] = 90.0, 45.0
    track = make_track(
        101,
        cross_track_m=at(30, -2.0),
        clearance_m=clearance_m,
        roll_command_deg=bank_deg,
        course_deg=np.repeat([0.0, 10.0], [50, 51]),
    )
    found = moments(track, 100.0, bank_at_limit=True)
    assert found["tse max"] == pytest.approx(3.0)
    assert found["clear m"] == pytest.approx(4.0)
    assert found["below s"] == pytest.approx(3.8)
    assert found["bank %"] == pytest.approx(6.0)
    assert found["κ·R fl."] == pytest.approx(5.0, abs=1.0)
    assert "nav max" not in found


def test_what_did_not_come_about_has_no_time(make_track: Callable[..., Track]) -> None:
    track = make_track(101, cross_track_m=np.full(101, np.nan), clearance_m=np.full(101, np.inf))
    assert not moments(track, 100.0, bank_at_limit=False)


def test_a_jump_of_the_believed_position_is_at_the_row_behind_it(make_track: Callable[..., Track]) -> None:
    track = make_track(101)
    drift_m = np.append(np.linspace(0.0, 30.0, 96), np.zeros(5))
    track = make_track(
        101,
        believed_east_m=track.east_m + drift_m,
        believed_north_m=track.north_m,
        believed_up_m=track.up_m,
        believed_course_deg=track.course_deg,
        believed_cross_track_m=track.cross_track_m,
    )
    found = moments(track, 100.0, bank_at_limit=False)
    assert (found["nav max"], found["nav jump"]) == pytest.approx((9.5, 9.6))
