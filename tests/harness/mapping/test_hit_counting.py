"""What hits count for, against the same told hit by hit in plain Python."""

from __future__ import annotations

import cmath
import math
from itertools import pairwise
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from harness.mapping.hit_counting import (
    CERTAIN,
    CONFIRMED,
    CORNER,
    PARTS,
    count_hits,
    count_new_edges,
    edges_after,
    ends,
    new_edges,
)
from planner.interface import ComplexArray, FloatArray, IntArray

CELL, SIDE, JOIN = 10.0, 40, 60.0
RAYS = 24
MIDDLE = complex(203.1, 197.3)

SEED = st.integers(0, 2**32 - 1)


def hits_of(rng: np.random.Generator) -> tuple[IntArray, ComplexArray, FloatArray, bool]:
    """Rays all round, some of which met nothing: hits, places, ranges, whether the last is beside the first."""
    ranges = rng.choice([40.0, 60.0, 150.0, math.inf], RAYS, p=[0.4, 0.3, 0.2, 0.1])
    ranges += rng.uniform(0.0, 20.0, RAYS)
    hits = (ranges < math.inf).nonzero()[0]
    places = MIDDLE + ranges[hits] * np.exp(1j * math.tau / RAYS * hits)
    return hits, places, ranges, bool(len(hits) and hits[0] + RAYS - hits[-1] <= 2)


def grids_of(rng: np.random.Generator) -> tuple[np.ndarray[tuple[int], np.dtype[np.int8]], IntArray]:
    """Scores of all cells; and the cells that have points, in order: all that have a score, and some others."""
    score = rng.choice([0, 0, 1, 2, CERTAIN], SIDE * SIDE).astype(np.int8)
    return score, rng.permutation(((score > 0) | (rng.random(SIDE * SIDE) < 0.3)).nonzero()[0])


def slots_of(known: IntArray) -> np.ndarray[tuple[int], np.dtype[np.int32]]:
    slot = np.full(SIDE * SIDE, -1, dtype=np.int32)
    slot[known] = np.arange(len(known))
    return slot


def cell_at(place: complex) -> int:
    return int(place.real / CELL) * SIDE + int(place.imag / CELL)


def pairs_of(hits: IntArray, places: ComplexArray, closed: bool) -> list[tuple[int, int, bool, float]]:
    """Neighbours, whether they are joined, and the gap between them."""
    found = []
    for i in range(len(hits) if closed else len(hits) - 1):
        j = (i + 1) % len(hits)
        gap = abs(complex(places[j] - places[i]))
        found.append((i, j, gap < JOIN and (hits[j] - hits[i]) % RAYS <= 2, gap))
    return found


@given(seed=SEED, first_score=st.sampled_from((1, CONFIRMED)))
def test_news_are_hits_that_are_not_certain_and_what_lies_between(seed: int, first_score: int) -> None:
    rng = np.random.default_rng(seed)
    hits, places, _, closed = hits_of(rng)
    score, known = grids_of(rng)
    slot = slots_of(known)
    cells, found = new_edges(hits, places, score, slot, CELL, SIDE, RAYS, closed, JOIN, first_score)
    uncertain = [score[cell_at(place)] < CERTAIN for place in places.tolist()]
    expected = [place for place, fresh in zip(places.tolist(), uncertain, strict=True) if fresh]
    for part in range(1, PARTS):
        for i, j, joined, gap in pairs_of(hits, places, closed):
            between = complex(places[i] + part / PARTS * (places[j] - places[i]))
            at = cell_at(between)
            if joined and gap > CELL and (uncertain[i] or uncertain[j]):
                expected += [between] if slot[at] < 0 or score[at] >= first_score else []
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert cells.tolist() == [cell_at(place) for place in expected]


@given(seed=SEED, corners=st.booleans())
def test_outlines_end_at_gaps_at_corners_and_before_what_is_behind(seed: int, corners: bool) -> None:
    hits, places, ranges, closed = hits_of(np.random.default_rng(seed))
    pairs = pairs_of(hits, places, closed)
    apart = [(i, j) for i, j, joined, _ in pairs if not joined]
    expected = [i for i, _ in apart] + [j for _, j in apart]
    expected += [] if closed else [0, len(hits) - 1]
    if corners:
        for (i, j, before, _), (_, k, after, _) in pairwise(pairs):
            turn = cmath.phase((places[k] - places[j]) / (places[j] - places[i]))
            expected += [j] if before and after and math.sin(turn) > CORNER else []
    for i, j, joined, gap in pairs:
        if joined and gap > CELL:
            expected.append(i if ranges[hits[i]] <= ranges[hits[j]] else j)
    assert ends(hits, places, ranges, CELL, closed, JOIN, corners).tolist() == expected


@given(seed=SEED, first_score=st.sampled_from((1, CONFIRMED)))
def test_a_cell_counts_once_and_is_an_edge_as_soon_as_it_is_believed(seed: int, first_score: int) -> None:
    rng = np.random.default_rng(seed)
    score, known = grids_of(rng)
    slot, count, revision, corner = slots_of(known), len(known), 7, complex(-300.0, 500.0)
    cells = rng.choice(rng.integers(0, SIDE * SIDE, 30), 60).astype(np.int64)
    places = rng.uniform(0.0, CELL, 60) + 1j * rng.uniform(0.0, CELL, 60)
    points, since = np.zeros(count + 60, dtype=np.complex128), rng.integers(0, revision, count + 60)
    cell_of = np.concatenate((known, np.zeros(60, dtype=np.int64)))
    scores, when = dict(enumerate(score.tolist())), {int(c): int(since[slot[c]]) for c in known}
    first: dict[int, complex] = {}
    for cell, place in zip(cells.tolist(), places.tolist(), strict=True):
        first.setdefault(cell, place)
    raised = unconfirmed = False
    expected = known.tolist()
    for cell in first:
        if score[cell] >= CERTAIN:
            continue
        scores[cell] = max(int(score[cell]) + 1, first_score)
        if cell not in when:
            expected.append(cell)
            when[cell] = 0
        unconfirmed |= scores[cell] < CONFIRMED
        if score[cell] < CONFIRMED <= scores[cell]:
            raised, when[cell] = True, revision + 1
    told = count_hits(
        cells, places, score, slot, points, cell_of, since, count, revision, first_score, corner
    )
    assert told == (len(expected), revision + raised, unconfirmed)
    assert cell_of[: told[0]].tolist() == expected
    assert slot[expected].tolist() == list(range(told[0]))
    assert score.tolist() == list(scores.values())
    assert since[: told[0]].tolist() == [when[cell] for cell in expected]
    assert points[count : told[0]].tolist() == [first[cell] + corner for cell in expected[count:]]


@given(seed=SEED, first_score=st.sampled_from((1, CONFIRMED)))
def test_news_that_are_counted_at_once_count_the_same(seed: int, first_score: int) -> None:
    rng = np.random.default_rng(seed)
    hits, places, _, closed = hits_of(rng)
    score, known = grids_of(rng)

    def counted() -> list[Any]:
        room = len(known) + PARTS * len(hits)
        cell_of, since = np.zeros(room, dtype=np.intp), np.zeros(room, dtype=np.intp)
        cell_of[: len(known)] = known
        return [score.copy(), slots_of(known), np.zeros(room, dtype=np.complex128), cell_of, since]

    one, other = counted(), counted()
    state: list[Any] = [len(known), 7, first_score, complex(5.0, 6.0)]
    cells, found = new_edges(hits, places, one[0], one[1], CELL, SIDE, RAYS, closed, JOIN, first_score)
    told = count_hits(cells, found, *(one + state))
    assert count_new_edges(CELL, SIDE, RAYS, closed, JOIN, hits, places, *(other + state)) == told
    for left, right in zip(one, other, strict=True):
        np.testing.assert_array_equal(left, right)


@given(seed=SEED, revision=st.integers(-1, 6))
def test_edges_are_told_that_became_so_after_a_revision(seed: int, revision: int) -> None:
    rng = np.random.default_rng(seed)
    score, known = grids_of(rng)
    since = rng.integers(0, 6, len(known))
    slots = np.empty(len(known), dtype=np.intp)
    expected = [
        i for i, cell in enumerate(known.tolist()) if since[i] > revision and score[cell] >= CONFIRMED
    ]
    many = edges_after(slots, score, known, since, len(known), revision)
    assert slots[:many].tolist() == expected
    fewer = edges_after(slots, score, known, since, len(known) // 2, revision)
    assert slots[:fewer].tolist() == [slot for slot in expected if slot < len(known) // 2]
