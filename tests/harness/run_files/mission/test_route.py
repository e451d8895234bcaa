"""Routes of missions: without kinks, at the altitudes and speeds of their items."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from aircraft.guidance.circle import end_of
from aircraft.interface import FloatArray
from harness.run_files.mission.program import Loiter, MissionStep, Program
from harness.run_files.mission.route import LANDING_HEIGHT_M, mission_route
from harness.run_files.mission.vertices import Flying, Ground, MissionRoute
from wayproof import InputError

TURN_M = 100.0


def flying(ground: Ground | None = None) -> Flying:
    return Flying(
        25.0,
        (20.0, 30.0),
        lambda speed: TURN_M * (speed / 25.0) ** 2,
        lambda speed: (5.0, 6.0),
        3.0,
        lambda speed: TURN_M * (speed / 25.0) ** 2,
        ground,
    )


def step(number: int, height: float | None = 100.0, above: str = "home", **more: object) -> MissionStep:
    return MissionStep(number, "an item", (0.0, 0.0), height, above, **more)  # type: ignore[arg-type]


def route(*steps: tuple[MissionStep, complex | None], ground: Ground | None = None) -> MissionRoute:
    """The route of steps at places, home at 400 m; every joint of it is held against a kink."""
    placed = tuple(
        replace(each, position=None if place is None else (place.real, place.imag)) for each, place in steps
    )
    made = mission_route(Program(placed, (), 400.0), flying(ground), "m")
    for before, after in itertools.pairwise(made.way.segments.tolist()):
        place, direction = end_of(tuple(before))
        assert abs(place - complex(*after[:2])) < 1e-4
        assert abs(direction - complex(*after[2:4])) < 1e-4
    assert (np.diff(made.profile.arc_length_m) >= 0.0).all()
    assert (np.diff(made.way.given_m[:, 2]) >= -1e-6).all()
    return made


def altitude(made: MissionRoute, item: int) -> float:
    """Altitude where an item is reached last."""
    return float(made.profile.altitudes(np.array([dict(made.marks)[item]]))[0])


def test_altitudes_go_from_one_waypoint_to_the_next_along_the_leg() -> None:
    made = route((step(1, 100.0), 0j), (step(2, 200.0), 2000j), (step(3, 150.0), 2000 + 2000j))
    assert [altitude(made, number) for number in (1, 2, 3)] == [500.0, 600.0, 550.0]
    assert made.profile.altitudes(np.array([dict(made.marks)[2] / 2.0])) == pytest.approx([550.0])
    (corner,) = made.way.corners
    assert (corner.waypoint, round(corner.radius_m)) == (2, 100)


def test_a_sharp_corner_is_passed_and_flown_back_onto_the_leg() -> None:
    """There and back: the turn begins one radius before, and goes twice that far beside."""
    made = route((step(1), 0j), (step(2), 3000j), (step(3), 0j))
    points = made.way.segments[:, :2]
    assert points[1, 1] == pytest.approx(2900.0)
    assert np.abs(points[2]) == pytest.approx((TURN_M, 2800.0))
    assert made.way.corners[0].cut_m == pytest.approx(0.414 * TURN_M, abs=0.1)
    assert end_of(tuple(made.way.segments[-1].tolist()))[0] == pytest.approx(0j, abs=1e-6)


@pytest.mark.parametrize("clockwise", [True, False])
@pytest.mark.parametrize("center", [1000 + 1000j, 1000j, 50 + 1000j])
@pytest.mark.parametrize("after", [2500 + 800j, 1000 + 1050j, 40 + 990j])
def test_circles_are_flown_at_their_radius_for_their_turns(
    center: complex, after: complex, clockwise: bool
) -> None:
    loiter = Loiter(150.0, clockwise, turns=3.0)
    made = route((step(1), 0j), (step(2), 1000j), (step(3, loiter=loiter), center), (step(4), after))
    bend = made.way.segments[:, 4]
    turned = float((bend * made.way.segments[:, 5])[np.abs(np.abs(bend) - 1.0 / 150.0) < 1e-9].sum())
    assert (turned < 0.0) is clockwise
    assert 3.0 * math.tau - 1e-6 <= abs(turned) <= 4.0 * math.tau + 1e-6
    circle = made.way.segments[np.abs(np.abs(bend) - 1.0 / 150.0) < 1e-9]
    assert np.hypot(*(circle[:, :2] - (center.real, center.imag)).T) == pytest.approx(150.0, abs=1e-3)


def test_a_circle_to_an_altitude_is_as_long_as_the_climb_takes() -> None:
    made = route((step(1), 0j), (step(2, 300.0, loiter=Loiter(120.0, True)), 2000j), (step(3, 300.0), 4000j))
    knots = made.profile
    climbing = (
        knots.arc_length_m[knots.altitude_m > 500.0][0] - knots.arc_length_m[knots.altitude_m == 500.0][-1]
    )
    assert climbing >= 200.0 / (0.8 * 5.0) * 25.0
    assert climbing <= 200.0 / (0.8 * 5.0) * 25.0 + math.tau * 120.0
    assert altitude(made, 2) == 700.0


def test_a_mission_may_begin_on_a_circle() -> None:
    made = route((step(1, loiter=Loiter(100.0, True, turns=1.0)), 50 + 0j), (step(2), 2000j))
    assert math.dist(made.way.segments[0, :2], (50.0, 0.0)) == pytest.approx(100.0)


def test_a_landing_ends_above_its_place_on_the_way_down() -> None:
    made = route((step(1, 100.0), 0j), (step(2, 100.0), 1000j), (step(3, 0.0, landing=True), 3000j))
    assert altitude(made, 3) == 400.0 + LANDING_HEIGHT_M
    end = made.way.segments[-1, :2] + made.way.segments[-1, 5] * made.way.segments[-1, 2:4]
    assert end[1] == pytest.approx(3000.0 - 2000.0 * LANDING_HEIGHT_M / 100.0)


def test_speeds_are_those_the_aircraft_holds_and_others_are_told() -> None:
    made = route((step(1), 0j), (step(2, airspeed_mps=13.0), 1000j), (step(3, airspeed_mps=28.0), 2000j))
    assert made.profile.airspeeds(np.array([500.0, 1500.0])).tolist() == [20.0, 28.0]
    assert sorted(set(made.commanded_mps.tolist())) == [13.0, 25.0, 28.0]
    assert made.notes[0].startswith("13 m/s asked for before item 2: flown at 20 m/s")


def test_above_ground_the_ground_is_followed() -> None:
    def hill(east: FloatArray, north: FloatArray) -> FloatArray:
        return 400.0 + 80.0 * np.exp(-(((north - 1500.0) / 400.0) ** 2)) + 0.0 * east

    made = route((step(1, 50.0), 0j), (step(2, 100.0, "ground"), 3000j), (step(3, 100.0), 5000j), ground=hill)
    along = np.linspace(0.0, 3000.0, 61)
    above = made.profile.altitudes(along) - hill(np.zeros(61), along)
    assert above == pytest.approx(50.0 + 50.0 * along / 3000.0, abs=1.0)
    assert altitude(made, 3) == 500.0


def test_all_items_in_one_place_are_no_path() -> None:
    with pytest.raises(InputError, match="m: all its items are in one place"):
        route((step(1), 5j), (step(2), 5j))


@pytest.mark.parametrize("wide_m", [60.0, 400.0])
def test_a_circle_inside_another_or_about_it_is_joined_by_a_turn(wide_m: float) -> None:
    for side, other in itertools.product((True, False), repeat=2):
        for center in (1000j, 30 + 1000j, 200 + 1100j):
            first, second = Loiter(150.0, side, turns=1.2), Loiter(wide_m, other, turns=1.0)
            made = route((step(1), 0j), (step(2, loiter=first), 1000j), (step(3, loiter=second), center))
            assert abs(complex(*made.way.given_m[-1, :2]) - center) == pytest.approx(wide_m, abs=0.1)
