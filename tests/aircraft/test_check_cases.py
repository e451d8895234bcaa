"""NASA's check cases, against NASA's figures and against equations integrated apart from JSBSim."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from harness.flight.record import FloatArray
from tests.aircraft.check_cases import ALTITUDE, ANGLES, CASES, FOOT_M, LONGITUDE, SECONDS, flown

A_M, MU, J2, EARTH_RADPS = 6378137.0, 3.986004418e14, 1.082626684e-3, 7.292115e-5
"""WGS 84."""


@pytest.mark.parametrize("number", CASES)
def test_check_cases_end_where_nasa_s_simulations_do(number: int) -> None:
    """Beyond their spread by a fifth of it, or 0.02 degrees of attitude, at most."""
    ended = flown(CASES[number])
    for path, (low, high) in CASES[number].ends.items():
        room = max(0.2 * (high - low), 0.02 if path in ANGLES else 0.0)
        assert low - room <= ended[path] <= high + room, path


def test_a_sphere_without_drag_falls_by_gravity_alone() -> None:
    """Equations in inertial space with the second harmonic, by scipy; all happens in the plane of the equator."""

    def moving(_: float, state: FloatArray) -> list[float]:
        x, y, u, v = state
        r = math.hypot(x, y)
        pulled = -MU / r**3 * (1.0 + 1.5 * J2 * (A_M / r) ** 2)
        return [u, v, pulled * x, pulled * y]

    start_m = A_M + 30000.0 * FOOT_M
    falling = solve_ivp(moving, (0.0, SECONDS), [start_m, 0.0, 0.0, EARTH_RADPS * start_m], rtol=1e-12, atol=1e-6)
    x, y = falling.y[:2, -1]
    ended = flown(CASES[1])
    assert ended[ALTITUDE] * FOOT_M == pytest.approx(math.hypot(x, y) - A_M, abs=0.002)
    assert ended[LONGITUDE] == pytest.approx(math.degrees(math.atan2(y, x) - EARTH_RADPS * SECONDS), rel=1e-3)


def test_a_tumbling_brick_turns_as_euler_says() -> None:
    """I w' = -w x I w by scipy; at the default 60 steps a second rates are right to 0.01 degrees a second."""
    inertia = np.array(CASES[2].body[3:6])

    def turning(_: float, rate: FloatArray) -> FloatArray:
        return np.asarray(-np.cross(rate, inertia * rate) / inertia)

    start = np.radians(CASES[2].turning_degps)
    euler = solve_ivp(turning, (0.0, SECONDS), start, rtol=1e-11, atol=1e-12).y[:, -1]
    ended = flown(CASES[2], rate_hz=60)
    assert [ended[axis] for axis in "pqr"] == pytest.approx(np.degrees(euler).tolist(), abs=0.01)
