"""Points near a place against numpy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.kernels.room import near_place


@given(seed=st.integers(0, 2**32 - 1), many=st.integers(0, 60), reach_m=st.sampled_from([0.0, 30.0, 900.0]))
def test_those_near_a_place_are_told_in_their_order(seed: int, many: int, reach_m: float) -> None:
    points = np.random.default_rng(seed).uniform(-60.0, 60.0, (many, 2))
    near = near_place(points, 5.0, -7.0, reach_m)
    assert (near == points[np.hypot(points[:, 0] - 5.0, points[:, 1] + 7.0) < reach_m]).all()
    assert near.shape == (np.count_nonzero(np.hypot(*(points - (5.0, -7.0)).T) < reach_m), 2)
