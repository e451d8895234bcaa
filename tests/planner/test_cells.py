"""Points near lines are found among cells as by looking at all of them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cells import Cells

SEEDS = st.integers(0, 2**32 - 1)


@settings(deadline=None)
@given(seed=SEEDS, count=st.integers(1, 120), side=st.floats(100.0, 2000.0))
def test_squares_hold_each_point_once_and_know_their_neighbours(seed: int, count: int, side: float) -> None:
    points = np.random.default_rng(seed).uniform(-4000.0, 4000.0, (count, 2))
    members = np.arange(3, 3 + count)
    cells = Cells.of(np.concatenate((np.full((3, 2), 1e6), points)), members, side)
    assert sorted(cells.members.tolist()) == members.tolist()
    assert cells.first.tolist() == (np.cumsum(cells.counts) - cells.counts).tolist()
    squares = [
        tuple(each) for each in np.floor(points[cells.members[cells.first] - 3] / side).astype(int).tolist()
    ]
    touching = {
        frozenset((i, j))
        for i, (x, y) in enumerate(squares)
        for j, (u, v) in enumerate(squares[:i])
        if max(abs(x - u), abs(y - v)) == 1
    }
    pairs = [frozenset(pair) for pair in zip(cells.one.tolist(), cells.other.tolist(), strict=True)]
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == touching
