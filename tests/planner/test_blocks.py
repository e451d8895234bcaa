"""Points near lines are found among blocks as by looking at all of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.blocks import Blocks

SEEDS = st.integers(0, 2**32 - 1)


@settings(deadline=None)
@given(seed=SEEDS, count=st.integers(1, 200), side=st.floats(50.0, 3000.0), within=st.floats(1.0, 500.0))
def test_no_point_near_a_line_is_missed(seed: int, count: int, side: float, within: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-3000.0, 3000.0, (count, 2))
    origin = tuple(rng.uniform(-3000.0, 3000.0, 2).tolist())
    angles = rng.uniform(-math.pi, math.pi, 5)
    ux, uy = np.cos(angles), np.sin(angles)
    lines, found = Blocks.of(points, side).near_lines(origin, ux + 1j * uy, within)
    pairs = list(zip(lines.tolist(), found.tolist(), strict=True))
    assert len(set(pairs)) == len(pairs)
    dx, dy = points[:, 0] - origin[0], points[:, 1] - origin[1]
    ahead = ux[:, None] * dx + uy[:, None] * dy
    beside = np.abs(uy[:, None] * dx - ux[:, None] * dy)
    near = set(zip(*(each.tolist() for each in ((ahead > 0.0) & (beside < within)).nonzero()), strict=True))
    assert near <= set(pairs)
    # What else is found lies no further off than a square is wide.
    slack = within + math.sqrt(2.0) * side
    assert all(beside[pair] <= slack and ahead[pair] >= -slack for pair in pairs)


@settings(deadline=None)
@given(seed=SEEDS, count=st.integers(1, 120), side=st.floats(100.0, 2000.0))
def test_squares_hold_each_point_once_and_know_their_neighbours(seed: int, count: int, side: float) -> None:
    points = np.random.default_rng(seed).uniform(-4000.0, 4000.0, (count, 2))
    blocks = Blocks.of(points, side)
    assert sorted(blocks.members.tolist()) == list(range(count))
    assert blocks.first.tolist() == (np.cumsum(blocks.counts) - blocks.counts).tolist()
    squares = [
        tuple(each) for each in np.floor(points[blocks.members[blocks.first]] / side).astype(int).tolist()
    ]
    touching = {
        frozenset((i, j))
        for i, (x, y) in enumerate(squares)
        for j, (u, v) in enumerate(squares[:i])
        if max(abs(x - u), abs(y - v)) == 1
    }
    pairs = [frozenset(pair) for pair in blocks.beside.tolist()]
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == touching


def test_far_from_all_lines_nothing_is_found() -> None:
    blocks = Blocks.of(np.array([(0.0, 5000.0), (-4000.0, 0.0)]), 300.0)
    lines, found = blocks.near_lines((0.0, 0.0), np.array([1.0 + 0.0j]), 200.0)
    assert len(lines) == len(found) == 0
    assert blocks.reach_m.tolist() == pytest.approx([0.0, 0.0])
