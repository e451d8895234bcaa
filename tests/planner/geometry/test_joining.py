"""A holding turn is left for late, keeps its distance and can be flown."""

import math

import numpy as np
import pytest
import shapely

from planner.geometry.curves import Limits, end_of, pose_at, sample
from planner.geometry.joining import divert_to_loiter
from planner.geometry.terrain import Terrain
from planner.interface import FloatArray, Path
from tests.planner.walls_and_paths import assert_flyable, wall

LIMITS = Limits(100.0, 30.0)
EAST = Path(np.array([(0.0, 0.0, 1.0, 0.0, 0.0, 2000.0)]))
WIDE = (-1e5, -1e5, 1e5, 1e5)


def terrain(points: FloatArray, bounds: tuple[float, float, float, float] = WIDE) -> Terrain:
    return Terrain(points, np.full(len(points), 50.0), bounds)


def test_in_the_open_the_path_is_flown_as_far_as_it_can_be() -> None:
    turn = divert_to_loiter(EAST, 300.0, 1000.0, LIMITS, terrain(np.zeros((0, 2))), None, 0.0)
    assert turn is not None
    assert turn.loiter
    assert_flyable(turn, 100.0)
    np.testing.assert_allclose(turn.segments[0, :4], pose_at(EAST, 300.0))
    assert turn.segments[-1, 5] == pytest.approx(math.tau * 100.0)
    assert 1000.0 - 25.0 <= end_of(turn).east_m <= 1000.0
    late = divert_to_loiter(EAST, 300.0, 350.0, LIMITS, terrain(np.zeros((0, 2))), None, 180.0)
    assert late is not None
    assert end_of(late).east_m == pytest.approx(480.0)  # it takes effect there


def test_before_a_wall_the_turn_is_begun_where_there_is_room() -> None:
    points = wall((1000.0, -800.0), (1000.0, 800.0), 12.0)
    turn = divert_to_loiter(EAST, 300.0, 950.0, LIMITS, terrain(points), None, 0.0)
    assert turn is not None
    assert_flyable(turn, 100.0)
    line = shapely.LineString(sample(turn, 20.0, 0.01))
    assert 50.0 - 0.02 <= float(shapely.distance(line, shapely.points(points)).min()) < 50.0 + 25.0 + 1.0


@pytest.mark.parametrize("curvature", [1 / 400.0, -1 / 400.0])
def test_a_turn_against_the_one_being_flown_begins_after_the_room_to_roll(curvature: float) -> None:
    bent = Path(np.array([(0.0, 0.0, 1.0, 0.0, curvature, 600.0)]))
    free = divert_to_loiter(bent, 0.0, 500.0, LIMITS, terrain(np.zeros((0, 2))), None, 0.0)
    assert free is not None
    assert free.segments[-1, 4] * curvature > 0.0
    # On the inner side there is no room for the circle anywhere.
    inner = np.array([pose_at(bent, s)[:2] for s in range(-200, 801, 20)])
    courses = [pose_at(bent, s)[2:] for s in range(-200, 801, 20)]
    inner += 120.0 * math.copysign(1.0, curvature) * np.array([(-ty, tx) for tx, ty in courses])
    turn = divert_to_loiter(bent, 0.0, 500.0, LIMITS, terrain(inner), None, 0.0)
    assert turn is not None
    assert_flyable(turn, 100.0)
    assert turn.segments[-1, 4] * curvature < 0.0
    np.testing.assert_allclose(turn.segments[-2, 4:], (0.0, 30.0))


def test_without_room_there_is_none() -> None:
    points = np.concatenate([wall((-900.0, y), (3000.0, y), 12.0) for y in (-120.0, 120.0)])
    assert divert_to_loiter(EAST, 300.0, 1000.0, LIMITS, terrain(points), None, 0.0) is None
    narrow = terrain(np.zeros((0, 2)), (-10.0, -190.0, 2e3, 190.0))
    assert divert_to_loiter(EAST, 300.0, 1000.0, LIMITS, narrow, None, 0.0) is None
