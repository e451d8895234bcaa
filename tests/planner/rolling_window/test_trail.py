"""What of a way leads back along where the aircraft has been."""

from __future__ import annotations

import numpy as np
import pytest

from planner.rolling_window.trail import Trail

SIDE = 1000.0


def flown_east(length_m: float) -> Trail:
    trail = Trail(SIDE)
    for east in np.arange(0.0, length_m, 50.0).tolist():
        trail.add((east, 500.0))
    return trail


def test_the_way_back_counts_and_a_new_one_does_not() -> None:
    trail = flown_east(20_000.0)
    assert trail.retraced_m([(20_000.0, 500.0), (5000.0, 500.0)]) == pytest.approx(15_000.0)
    assert trail.retraced_m([(20_000.0, 9000.0), (5000.0, 9000.0)]) == 0.0
    off_it = trail.retraced_m([(10_000.0, 500.0), (10_000.0, 20_000.0)])
    assert off_it == pytest.approx(1500.0, abs=SIDE)
