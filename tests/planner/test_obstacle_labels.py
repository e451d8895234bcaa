"""Labels are the same whenever they are asked for."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.obstacle_labels import ObstacleLabels

CELL_M = 70.0


@given(
    seed=st.integers(0, 2**32 - 1),
    sizes=st.lists(st.integers(1, 40), min_size=1, max_size=8),
    span_m=st.sampled_from([200.0, 600.0, 1500.0]),
)
def test_batches_gathered_at_once_have_the_labels_of_batches_gathered_as_they_come(
    seed: int, sizes: list[int], span_m: float
) -> None:
    points = np.random.default_rng(seed).uniform(-span_m, span_m, (sum(sizes), 2))
    asked, late = ObstacleLabels(CELL_M), ObstacleLabels(CELL_M)
    labels = np.zeros(0, dtype=np.intp)
    for total in np.cumsum(sizes).tolist():
        for each in (asked, late):
            each.add(total)
        labels = asked.of(points[:total])
        assert len(labels) == total
    assert (late.of(points) == labels).all()
    assert (late.of(points) == labels).all()
