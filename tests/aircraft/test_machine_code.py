"""What numba makes of the laws is what their plain functions say."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from aircraft import kernels
from aircraft.guidance import machine_code
from aircraft.guidance.interface import GuidanceLimits
from aircraft.guidance.l1 import L1Circle, L1Config, L1Leg, L1Memory, L1Motion, follow_circle, follow_leg
from aircraft.guidance.npfg import NpfgConfig, NpfgInput, npfg
from aircraft.guidance.pure_pursuit import PurePursuitConfig, look_ahead_distance, pure_pursuit
from aircraft.guidance.registry import guidance_kinds
from aircraft.guidance.vector_field import Motion, VectorFieldConfig, follow_line, follow_orbit, parameters
from aircraft.interface import GRAVITY_MPS2, AircraftState, Route

LIMITS = GuidanceLimits(25.0, 32.0, math.radians(45.0), 1e3, 0.25, 0.05, 1.4)
"""Roll may change at once, so that a command is what the law says."""
LINE = Route(np.array([[0.0, 0.0, 0.6, 0.8, 0.0, 5000.0]]))
RIGHT = Route(np.array([[0.0, 0.0, 0.0, 1.0, -0.005, math.tau * 200.0]]), loiter=True)
RNG = np.random.default_rng(5)
PLACES = RNG.uniform(-150.0, 150.0, (40, 2))
HEADINGS = RNG.uniform(-math.pi, math.pi, 40)
WIND = (4.0, -3.0)


def states() -> list[AircraftState]:
    made = []
    for (east, north), heading in zip(PLACES, HEADINGS, strict=True):
        velocity = 25.0 * math.sin(heading) + WIND[0], 25.0 * math.cos(heading) + WIND[1]
        made.append(
            AircraftState(0.0, east, north, 300.0, *velocity, 0.0, heading % math.tau, 0.0, 0.0, 25.0, 1.0)
        )
    return made


def limited(acceleration_mps2: float) -> float:
    return max(
        -LIMITS.bank_limit_rad, min(math.atan(acceleration_mps2 / GRAVITY_MPS2), LIMITS.bank_limit_rad)
    )


def npfg_roll(at: AircraftState, line: bool) -> float:
    if line:
        along = 0.6 * at.east_m + 0.8 * at.north_m
        path = (0.6 * along, 0.8 * along, 0.6, 0.8, 0.0)
    else:
        away = math.hypot(at.east_m - 200.0, at.north_m)
        out = (at.east_m - 200.0) / away, at.north_m / away
        path = (200.0 + 200.0 * out[0], 200.0 * out[1], out[1], -out[0], 0.005)
    has = NpfgConfig().resolved(LIMITS).parameters(25.0, 32.0, LIMITS.bank_limit_rad)
    given = (at.east_m, at.north_m, at.velocity_east_mps, at.velocity_north_mps, *WIND)
    return limited(npfg(NpfgInput(*given, *path), has).lateral_acceleration_mps2)


def l1_roll(at: AircraftState, line: bool) -> float:
    yaw = math.remainder(at.heading_rad, math.tau)
    motion = L1Motion(
        *(at.east_m, at.north_m, at.velocity_east_mps, at.velocity_north_mps),
        *(yaw, int(100.0 * math.degrees(yaw)) % 36000, 1.0),
    )
    has = L1Config().parameters()
    if line:
        leg = L1Leg(0.0, 0.0, 3000.0, 4000.0, 0.0)
        return limited(follow_leg(motion, leg, math.inf, L1Memory(), has)[0].lateral_acceleration_mps2)
    circle = L1Circle(200.0, 0.0, 200.0, 1.0)
    return limited(follow_circle(motion, circle, L1Memory(), has)[0].lateral_acceleration_mps2)


def vector_field_roll(at: AircraftState, line: bool) -> float:
    has = parameters(VectorFieldConfig().resolved(LIMITS), LIMITS)
    motion = Motion(at.east_m, at.north_m, at.velocity_east_mps, at.velocity_north_mps, at.heading_rad)
    if line:
        return follow_line(motion, 0.0, 0.0, 0.6, 0.8, 0.0, has).roll_rad
    return follow_orbit(motion, 200.0, 0.0, 200.0, 1.0, 0.0, has).roll_rad


@pytest.mark.parametrize("line", [True, False])
@pytest.mark.parametrize(
    ("kind", "plain"), [("npfg", npfg_roll), ("l1", l1_roll), ("vector_field", vector_field_roll)]
)
def test_a_law_commands_what_its_functions_say(
    kind: str, plain: Callable[[AircraftState, bool], float], line: bool
) -> None:
    for state in states():
        along = 0.6 * state.east_m + 0.8 * state.north_m
        if line and along < 0.0:
            continue  # before the route begins its beginning is the nearest point
        law = guidance_kinds()[kind].law(LIMITS)
        law.follow(LINE if line else RIGHT)
        assert law.update(state).roll_command_rad == pytest.approx(plain(state, line), abs=1e-9)


def test_the_goal_of_pure_pursuit_is_the_look_ahead_distance_away() -> None:
    has = PurePursuitConfig().resolved(LIMITS).parameters()
    law = guidance_kinds()["pure_pursuit"].law(LIMITS)
    ahead = look_ahead_distance(0.0, 25.0, has)
    law.follow(RIGHT)
    state = AircraftState(0.0, 0.0, 0.0, 300.0, 0.0, 25.0, 0.0, 0.0, 0.0, 0.0, 25.0, 1.0)
    # A point of the circle about (200, 0): the chord to it is the look-ahead distance.
    half = math.asin(0.5 * ahead / 200.0)
    goal = ahead * math.sin(half), ahead * math.cos(half)
    expected = pure_pursuit(*goal, 0.0, 25.0, 0.0, ahead).roll_rad
    assert law.update(state).roll_command_rad == pytest.approx(expected, rel=2e-3)
    assert expected == pytest.approx(math.atan(625.0 / (200.0 * GRAVITY_MPS2)))


def test_the_stamp_is_of_all_files_that_are_compiled() -> None:
    files = {Path(module.__file__).stem for module in (kernels, *machine_code.LAWS) if module.__file__}
    assert files == {"kernels", "npfg", "l1", "vector_field", "pure_pursuit"}
    assert len(machine_code.STAMP) == 64
