"""Points along paths: as near to their arcs as they are said to be."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from harness.flight.polylines import polylines


@given(
    radius=st.floats(20.0, 20000.0),
    turn=st.floats(0.01, 2 * math.pi),
    bearing=st.floats(-math.pi, math.pi),
    side=st.sampled_from([-1.0, 1.0]),
)
def test_polyline_stays_by_its_arc(radius: float, turn: float, bearing: float, side: float) -> None:
    tangent = np.array([math.cos(bearing), math.sin(bearing)])
    centre = np.array([100.0, -50.0]) + side * radius * np.array([-tangent[1], tangent[0]])
    points = polylines([np.array([[100.0, -50.0, *tangent, side / radius, radius * turn]])], 0.5)[0]
    away = np.hypot(*(points - centre).T)
    np.testing.assert_allclose(away, radius, rtol=1e-9)
    middles = np.hypot(*(0.5 * (points[1:] + points[:-1]) - centre).T)
    assert (radius - middles).max() <= 0.5 + 1e-6
    spoke = points[0] - centre
    cosine, sine = math.cos(side * turn), math.sin(side * turn)
    end = centre + np.array([cosine * spoke[0] - sine * spoke[1], sine * spoke[0] + cosine * spoke[1]])
    np.testing.assert_allclose(points[-1], end, atol=1e-6 * radius)


def test_polyline_of_lines_is_their_ends() -> None:
    segments = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 10.0], [10.0, 0.0, 0.0, 1.0, 0.0, 5.0]])
    np.testing.assert_allclose(polylines([segments])[0], [[0, 0], [10, 0], [10, 5]], atol=1e-12)


@given(seed=st.integers(0, 2**32 - 1), paths=st.integers(0, 6))
def test_each_of_several_polylines_is_that_of_its_path_alone(seed: int, paths: int) -> None:
    rng = np.random.default_rng(seed)
    several = [rng.uniform(-1.0, 1.0, (rng.integers(1, 5), 6)) for _ in range(paths)]
    for rows in several:
        rows[:, 4:] *= (0.01, 900.0)
        rows[:, 5] = np.abs(rows[:, 5])
    found = polylines(several, 0.5)
    assert len(found) == paths
    for rows, points in zip(several, found, strict=True):
        np.testing.assert_allclose(points, polylines([rows], 0.5)[0], atol=1e-9)
