"""Points along paths: as near to their arcs as they are said to be."""

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
    np.testing.assert_allclose(np.hypot(*(points - centre).T), radius, rtol=1e-9)
    assert (radius - np.hypot(*(0.5 * (points[1:] + points[:-1]) - centre).T)).max() <= 0.5 + 1e-6
    spoke = points[0] - centre
    cosine, sine = math.cos(side * turn), math.sin(side * turn)
    end = centre + np.array([cosine * spoke[0] - sine * spoke[1], sine * spoke[0] + cosine * spoke[1]])
    np.testing.assert_allclose(points[-1], end, atol=1e-6 * radius)
