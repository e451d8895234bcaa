"""A planner's memory of the map with refused places, against all that was shown."""

import numpy as np
import pytest

from planner.interface import FloatArray
from planner.memory import ObstacleMemory
from planner.shield.refused_places import with_places
from tests.planner.rolling_window.test_rolling_window import Seen


class Growing(Seen):
    """A map that gets one edge point more at every step, and loses its first one at one of them."""

    def __init__(self) -> None:
        self.edges: list[tuple[int, float]] = []
        self.revision = self.last_removal_revision = 0

    def step(self, remove: bool) -> None:
        self.revision += 1
        self.edges.append((self.revision, 100.0 * self.revision))
        if remove:
            del self.edges[0]
            self.last_removal_revision = self.revision

    def edges_since(self, revision: int) -> FloatArray:
        return np.array([(east, 0.0) for at, east in self.edges if at > revision]).reshape(-1, 2)


def test_every_edge_and_every_refused_place_is_remembered_once() -> None:
    seen, memory = Growing(), ObstacleMemory(10.0)
    refused: list[tuple[int, tuple[float, float]]] = []
    for number in range(12):
        seen.step(remove=number in (3, 7))
        if number in (2, 3, 9):
            refused.append((seen.revision, (50.0 + number, 400.0)))
        memory.take_in(with_places(seen, refused))
        expected = sorted([(east, 0.0) for _, east in seen.edges] + [place for _, place in refused])
        assert sorted(map(tuple, memory.points_m.tolist())) == expected
        away_m = with_places(seen, refused).distance_m(np.array([[50.0, 390.0]]))
        assert away_m[0] == pytest.approx(np.hypot(*(np.array(expected) - (50.0, 390.0)).T).min())
    assert with_places(seen, refused).spacing_m == seen.spacing_m
