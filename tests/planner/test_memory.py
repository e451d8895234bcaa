"""What is gathered into one obstacle, against brute force."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner.interface import FloatArray
from planner.memory import ObstacleMemory
from planner.rolling_window.window import Window
from tests.examples import examples
from tests.planner.rolling_window.test_rolling_window import Seen

CLEARANCE = 100.0
SEEDS = st.integers(0, 2**32 - 1)


class Batches(Seen):
    """A seen world whose edge points come in batches and may be taken back."""

    def __init__(self) -> None:
        super().__init__(np.zeros((0, 2)))

    def take_back(self, keep: FloatArray) -> None:
        self.revision += 1
        self.last_removal_revision = self.revision
        self._shown = [(1, keep)]

    def thin_out(self, rng: np.random.Generator) -> None:
        self.revision += 1
        self.last_removal_revision = self.revision
        self._shown = [(at, points[rng.random(len(points)) < 0.95]) for at, points in self._shown]


def components(points: FloatArray, link_m: float) -> NDArray[np.intp]:
    """A number for each point: the lowest one that it is chained to by gaps of at most `link_m`."""
    near = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)) <= link_m
    number = np.arange(len(points))
    while True:
        if ((lowest := np.where(near, number, len(points)).min(axis=1)) == number).all():
            return number
        number = lowest


def is_finer(fine: NDArray[np.intp], coarse: NDArray[np.intp]) -> bool:
    """Whether points together in the first partition are together in the second."""
    return len(set(zip(fine.tolist(), coarse.tolist(), strict=True))) == len(set(fine.tolist()))


def memory_of(*batches: FloatArray) -> ObstacleMemory:
    seen, memory = Batches(), ObstacleMemory(CLEARANCE)
    for batch in batches:
        seen.show(batch)
        memory.take_in(seen)
    return memory


def scattered(seed: int, count: int, span: float) -> FloatArray:
    return np.random.default_rng(seed).uniform(-span, span, (count, 2))


@given(seed=SEEDS, count=st.integers(1, 80), span=st.sampled_from([200.0, 600.0, 1500.0]))
def test_labels_lie_between_those_of_gaps_that_are_surely_closed_and_not_surely_open(
    seed: int, count: int, span: float
) -> None:
    points = scattered(seed, count, span)
    labels = memory_of(points).labels
    assert is_finer(components(points, 0.7 * CLEARANCE), labels)
    assert is_finer(labels, components(points, 2.0 * CLEARANCE))


@given(seed=SEEDS, count=st.integers(2, 80), parts=st.integers(1, 8))
def test_point_by_point_gives_the_same_obstacles_as_at_once(seed: int, count: int, parts: int) -> None:
    points = scattered(seed, count, 800.0)
    at_once, by_and_by = memory_of(points), memory_of(*np.array_split(points, parts))
    np.testing.assert_array_equal(by_and_by.points_m, points)
    assert is_finer(at_once.labels, by_and_by.labels)
    assert is_finer(by_and_by.labels, at_once.labels)


@pytest.mark.parametrize("known_before", [True, False])
def test_what_is_taken_back_is_forgotten(known_before: bool) -> None:
    seen, memory = Batches(), ObstacleMemory(CLEARANCE)
    seen.show(np.array([(0.0, 0.0), (60.0, 0.0), (120.0, 0.0), (180.0, 0.0), (240.0, 0.0)]))
    if known_before:
        memory.take_in(seen)
        assert len(set(memory.labels.tolist())) == 1
    ends = np.array([(0.0, 0.0), (240.0, 0.0)])
    seen.take_back(ends)
    assert len(memory.take_in(seen)) == (0 if known_before else 2), "only what is new is told"
    np.testing.assert_array_equal(memory.points_m, ends)
    assert len(set(memory.labels.tolist())) == 2
    assert len(memory.take_in(seen)) == 0


def ring(east_m: float, north_m: float, count: int = 12) -> FloatArray:
    angle = math.tau * np.arange(count) / count
    return np.column_stack((east_m + 60.0 * np.cos(angle), north_m + 60.0 * np.sin(angle)))


def test_what_moves_comes_last_and_is_an_obstacle_of_its_own_each() -> None:
    seen, memory = Batches(), ObstacleMemory(CLEARANCE)
    still, first, second = scattered(1, 30, 500.0), ring(10.0, 20.0), ring(30.0, 20.0, 5)
    seen.show(still)
    fresh = memory.take_in(seen, [first, second])
    np.testing.assert_array_equal(fresh, np.concatenate((still, first, second)))
    np.testing.assert_array_equal(memory.points_m, fresh)
    np.testing.assert_array_equal(memory.genuine_m, still)
    assert memory.known == 30
    assert memory.labels.shape == (47,)
    assert len(set(memory.labels[30:42].tolist())) == len(set(memory.labels[42:].tolist())) == 1
    assert not set(memory.labels[:30].tolist()) & set(memory.labels[30:].tolist())
    assert memory.labels[30] != memory.labels[42]


@pytest.mark.parametrize("moves", [False, True])
def test_edges_of_an_obstacle_are_those_of_its_points_where_others_had_their_indices(moves: bool) -> None:
    """In a ring that is open to the north, then in one open to the east: M and N lie beside the way out."""
    seen, memory, angle = Batches(), ObstacleMemory(CLEARANCE), np.arange(0.5, math.tau - 0.5, 0.05)
    for way, turned in ((0.5 * math.pi, angle), (0.0, np.random.default_rng(1).permutation(angle))):
        points = 900.0 * np.column_stack((np.cos(way + turned), np.sin(way + turned)))
        seen.take_back(np.zeros((0, 2)) if moves else points)
        memory.take_in(seen, [points] if moves else None)
        window = Window((0.0, 0.0), points, memory.labels, memory.cell_m, np.full(len(points), CLEARANCE))
        edges = window.sector_edges((0.0, 0.0), memory.labels[:1].tolist())
        bearings = sorted(math.atan2(edge.uy, edge.ux) - way for edge in edges)
        half = 0.5 - math.asin(CLEARANCE / 900.0)
        np.testing.assert_allclose(bearings, (-half, half), atol=0.05)


@settings(max_examples=examples(25))
@given(seed=SEEDS)
def test_taken_back_bit_by_bit_what_is_new_lies_behind_what_was_known_but_for_what_went(seed: int) -> None:
    """So are the edges told that a course was not found with, though noise takes some back in every scan."""
    rng = np.random.default_rng(seed)
    seen, memory = Batches(), ObstacleMemory(CLEARANCE)
    place = (5000.0, 5000.0)
    known_at: list[tuple[int, int, int]] = []
    for _ in range(8):
        if rng.random() < 0.7:
            seen.thin_out(rng)
        if rng.random() < 0.7:
            seen.show(rng.uniform(-900.0, 900.0, (int(rng.integers(1, 40)), 2)))
        told = memory.take_in(seen)
        np.testing.assert_array_equal(memory.genuine_m, seen.edges_since(-1))
        if known_at:
            np.testing.assert_array_equal(told, seen.edges_since(known_at[-1][0]))
            assert (memory.points_m == place).all(axis=1).sum() == 1, "what was refused is not forgotten"
        else:
            memory.refuse(place)
        for revision, known, gone in known_at:
            behind = memory.points_m[max(known - (memory.cleared - gone), 0) :]
            assert {*map(tuple, seen.edges_since(revision).tolist())} <= {*map(tuple, behind.tolist())}
        known_at.append((seen.revision, memory.known, memory.cleared))


def test_what_was_refused_outlasts_what_is_taken_back_until_it_is_forgiven() -> None:
    seen, memory = Batches(), ObstacleMemory(CLEARANCE)
    seen.show(scattered(1, 30, 500.0))
    memory.take_in(seen)
    memory.refuse((900.0, 900.0))
    left = scattered(1, 7, 500.0)
    seen.take_back(left)
    memory.take_in(seen)
    assert memory.cleared == 23
    np.testing.assert_array_equal(memory.refused_m, [(900.0, 900.0)])
    np.testing.assert_array_equal(memory.genuine_m, left)
    memory.forget_refused()
    memory.take_in(seen)
    assert memory.cleared == 24
    np.testing.assert_array_equal(memory.points_m, left)
