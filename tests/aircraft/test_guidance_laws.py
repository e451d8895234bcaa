import math

import pytest

from aircraft.guidance.circle import Circle, end_of, shortest_way
from aircraft.guidance.interface import GuidanceLimits
from aircraft.guidance.l1 import L1Circle, L1Config, L1Memory, L1Motion, follow_circle
from aircraft.guidance.npfg import NpfgConfig, NpfgInput, npfg
from aircraft.guidance.pure_pursuit import PurePursuitConfig, look_ahead_distance, pure_pursuit
from aircraft.guidance.vector_field import VectorFieldConfig, VectorFieldLaw, line_course, orbit_course
from aircraft.interface import GRAVITY_MPS2, AircraftState
from tests.contracts.test_guidance_contract import LINE, Point
from tests.routes import route_of

LIMITS = GuidanceLimits(25.0, 30.0, math.radians(45.0), 1.0, 0.25, 0.03, 1.44)
FIELD = VectorFieldConfig().resolved(LIMITS)


def test_the_field_of_a_line_is_that_of_the_book() -> None:
    # chi = chi_q - chi_inf 2/pi atan(k_path e)
    gain, approach = FIELD.path_gain_1pm or 0.0, math.radians(FIELD.approach_angle_deg)
    assert gain == pytest.approx(0.01, rel=0.01)
    assert line_course(1.0 / gain, 0.0, 1.0, approach, gain) == pytest.approx(-math.radians(25.0))
    assert line_course(1e9, 1.0, 0.0, approach, gain) == pytest.approx(math.radians(40.0), abs=1e-6)


def wanted(law: VectorFieldLaw, at: AircraftState) -> float:
    """Bank (rad), not limited, that the law asks for at a place on its route."""
    return law.demand(at, law.progress.nearest(at.east_m, at.north_m))[0]


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_on_an_orbit_the_bank_is_that_of_the_turn(direction: float) -> None:
    law = VectorFieldLaw(FIELD, LIMITS)
    law.follow(route_of((-direction / 200.0, 400.0 * math.pi), loiter=True))
    bank_rad = direction * math.atan(625.0 / (GRAVITY_MPS2 * 200.0))
    assert wanted(law, Point().state()) == pytest.approx(bank_rad)


def test_far_from_an_orbit_the_field_leads_to_its_centre() -> None:
    assert math.cos(orbit_course(0.0, 1e7, 200.0, 1.0, 1.0)) == pytest.approx(-1.0, abs=1e-4)


def test_the_integrator_waits_while_the_roll_is_cut() -> None:
    law = VectorFieldLaw(FIELD, LIMITS)
    law.follow(LINE)
    assert wanted(law, Point(5000.0, 10.0).state()) < -math.radians(45.0)
    assert abs(wanted(law, Point(0.0, 20.0).state())) < 1e-9


@pytest.mark.parametrize("speed_mps", [25.0, 0.05])
def test_l1_flies_straight_on_at_the_centre_of_a_circle_without_a_radius(speed_mps: float) -> None:
    at = L1Motion(7 - 3j, complex(speed_mps), 0.0, 0)
    for place in (7 - 3j, 8 - 3j):
        acceleration, memory = follow_circle(
            at._replace(place=place), L1Circle(7 - 3j, 0.0, 1.0), L1Memory(), L1Config()
        )
        assert all(map(math.isfinite, (acceleration, *memory)))


def test_pure_pursuit_turns_on_the_arc_through_the_goal() -> None:
    # The goal on a circle of 300 m that the aircraft is on: the arc is that circle.
    angle = 0.4
    east, north = 300.0 * (1.0 - math.cos(angle)), 300.0 * math.sin(angle)
    curvature_1pm, roll_rad = pure_pursuit(east, north, 0.0, 20.0, 0.0, math.hypot(east, north))
    assert curvature_1pm == pytest.approx(1.0 / 300.0)
    assert roll_rad == pytest.approx(math.atan(400.0 / (300.0 * GRAVITY_MPS2)))


@pytest.mark.parametrize("right_m", [30.0, -30.0])
def test_pure_pursuit_turns_to_a_goal_behind_as_hard_as_to_one_at_a_right_angle(right_m: float) -> None:
    for ahead_m in (0.0, -40.0):
        curvature_1pm, _ = pure_pursuit(right_m, ahead_m, 0.0, 20.0, 0.0, 50.0)
        assert curvature_1pm == pytest.approx(math.copysign(2.0 / 50.0, right_m))


@pytest.mark.parametrize("side", [1, -1])
def test_the_shortest_way_from_the_middle_of_a_loiter_is_one_turn_that_touches_it_from_within(side: int) -> None:
    """The hub of the turn, 50 m aside, is then 150 m from the middle: after sqrt(150^2 - 50^2) straight on."""
    circle = Circle(7 - 3j, 200.0, side)
    rows = shortest_way((7 - 3j, 1 + 0j), circle, 50.0)
    turn_m = 50.0 * (math.pi / 2 + math.asin(50.0 / 150.0))
    assert sum(row[5] for row in rows) == pytest.approx(math.sqrt(150.0**2 - 50.0**2) + turn_m, abs=0.5)
    place, ahead = end_of(rows[-1])
    assert circle.contains((place, ahead))
    assert not circle.contains((place, -ahead))


def test_pure_pursuit_looks_ahead_by_time() -> None:
    has = PurePursuitConfig().resolved(LIMITS)
    assert look_ahead_distance(12.0, 16.0, has) == pytest.approx(20.0 * 2.0 * math.sqrt(2.0) / 1.44)


def test_npfg_on_its_path_in_calm_air_asks_for_the_curvature() -> None:
    at = NpfgInput(0j, 25j, 0j, 0j, 1j, 1.0 / 150.0)
    assert npfg(at, NpfgConfig(roll_time_constant_s=0.5), 25.0, 30.0) == pytest.approx((625.0 / 150.0, 25.0))


def test_npfg_flies_nowhere_slower_than_the_wind_allows() -> None:
    # A wind of twice the airspeed, against the path: the nose stays in the wind.
    at = NpfgInput(0j, -25j, -50j, 0j, 1j, 0.0)
    assert npfg(at, NpfgConfig(roll_time_constant_s=0.5), 25.0, 25.0) == pytest.approx((0.0, 25.0), abs=1e-9)
