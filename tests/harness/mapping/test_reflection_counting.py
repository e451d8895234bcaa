"""What rays did to cells, against the same told for all cells at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.mapping.reflection_counting import count_rays, decide, find_long
from tests.examples import examples

SEEDS = st.integers(0, 2**32 - 1)
RAYS, HALF, NOISE, WITHIN, FORGET_AT = 90, 12.0, 10.0, 700.0, 48.0


@pytest.mark.parametrize("closed", [True, False])
@given(seed=SEEDS, with_ignored=st.booleans())
@settings(max_examples=examples(30))
def test_rays_are_counted_for_the_cells_that_they_were_aimed_at(
    closed: bool, seed: int, with_ignored: bool
) -> None:
    rng = np.random.default_rng(seed)
    spacing = (math.tau if closed else math.pi) / RAYS
    many = 200
    slots = rng.permutation(many).astype(np.int32)[:150]
    distances, positions = rng.uniform(1.0, 800.0, 150), rng.uniform(0.0, math.tau / spacing, 150)
    ranges = np.where(rng.random(RAYS) < 0.2, math.inf, rng.uniform(0.0, 800.0, RAYS))
    near = rng.integers(0, 150, RAYS)
    ranges[::2] = (distances[near] + rng.normal(0.0, NOISE, RAYS))[::2]
    ignored = rng.random(RAYS) < 0.3 if with_ignored else np.zeros(0, dtype=np.bool_)
    counts = rng.uniform(0.0, 17.0, (many, 3)).astype(np.float32)

    expected = counts.copy()
    ray = np.rint(positions).astype(int)
    aimed = (np.abs(positions - ray) * spacing * distances < HALF) & (distances < WITHIN)
    aimed &= closed | (ray < RAYS)
    if with_ignored:
        aimed &= ~ignored[ray % RAYS]
    for i in aimed.nonzero()[0]:
        aside = int(0.7 * HALF / spacing / max(distances[i], HALF))
        for other in (ray[i], ray[i] - aside, ray[i] + aside) if aside else (ray[i],):
            off = ranges[other % RAYS if closed else min(max(other, 0), RAYS - 1)] - distances[i]
            did = (abs(off) <= HALF, off > HALF, -HALF - 2.0 * NOISE < off < -HALF)
            expected[slots[i]] += np.array(did, dtype=np.float32)
        if expected[slots[i]].sum() > FORGET_AT:
            expected[slots[i]] *= 0.5

    counted = np.empty(150, dtype=np.int32)
    told = count_rays(
        counted,
        slots,
        distances,
        positions,
        ranges,
        ignored,
        counts,
        HALF,
        spacing,
        WITHIN,
        NOISE,
        FORGET_AT,
        closed,
    )
    assert counted[:told].tolist() == slots[aimed].tolist()
    assert (counts == expected).all()


def test_an_edge_remains_one_down_to_a_part_of_what_made_it_one() -> None:
    slots = np.arange(4, dtype=np.int32)
    counts = np.array([(5, 10, 0), (4, 0, 4), (2, 0, 0), (5, 30, 0)], dtype=np.float32)
    edges = np.empty(4, dtype=np.bool_)
    decide(edges, slots, counts, np.zeros(4, dtype=np.bool_), 5.0, 0.25, 0.25, 0.3)
    assert edges.tolist() == [True, True, False, False]
    decide(edges, slots, counts, np.ones(4, dtype=np.bool_), 5.0, 0.25, 0.25, 0.3)
    assert edges.tolist() == [True, True, True, True]


@given(seed=SEEDS, reach=st.integers(0, 3))
@settings(max_examples=examples(30))
def test_what_lies_near_a_cell_that_has_long_been_an_edge(seed: int, reach: int) -> None:
    rng = np.random.default_rng(seed)
    columns, rows, known = 12, 9, 30
    slots = np.full(columns * rows, -1, dtype=np.int32)
    slots[rng.permutation(columns * rows)[:known]] = np.arange(known)
    edges, since_s = rng.random(known) < 0.3, rng.uniform(0.0, 100.0, known)
    cells = rng.integers(-4, 16, (40, 2))
    found = np.zeros(40, dtype=np.bool_)
    find_long(found, cells, slots, edges, since_s, columns, reach, 60.0)
    long = np.zeros((columns, rows), dtype=np.bool_)
    for cell, slot in enumerate(slots.tolist()):
        long[divmod(cell, rows)] = slot >= 0 and edges[slot] and since_s[slot] <= 60.0
    around = np.arange(-reach, reach + 1)
    for (column, row), is_long in zip(cells.tolist(), found.tolist(), strict=True):
        x, y = (column + around).clip(0, columns - 1), (row + around).clip(0, rows - 1)
        assert is_long == long[np.ix_(x, y)].any()
