"""A plan flown as a mission: its waypoints, when the next leg is flown, and what the law is given."""

import math

import numpy as np
import pytest

from aircraft.airframes import airframe
from aircraft.guidance.interface import GuidanceOutput
from aircraft.guidance.waypoints import MissionLeg, WaypointLaw, acceptance, mission_waypoints, straight
from aircraft.interface import AircraftState, Route
from aircraft.start import StartConditions
from harness.scenario.kinds import guidance_kinds
from tests.point_mass import PointMass
from tests.routes import route_of

RIGHT_ANGLE = route_of((0.0, 400.0), (-0.01, 50.0 * math.pi), (0.0, 400.0))
"""North, round a corner at (0, 500), east."""


class Watched:
    """Flies wings level and keeps the routes that it is given."""

    def __init__(self) -> None:
        self.routes: list[Route] = []

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        self.routes.append(route)

    def update(self, state: AircraftState) -> GuidanceOutput:
        return GuidanceOutput(0.1, 9.0, 9.0, False, True)


def at(east: float, north: float) -> AircraftState:
    return PointMass(StartConditions(east, north, 300.0, 0.0, 25.0)).state()


def test_waypoints_are_the_corners_that_arcs_round() -> None:
    assert mission_waypoints(RIGHT_ANGLE) == pytest.approx(np.array([[0, 0], [0, 500], [500, 500]]), abs=1e-9)


def test_half_a_turn_has_two_corners() -> None:
    points = mission_waypoints(route_of((0.0, 400.0), (-0.01, 100.0 * math.pi), (0.0, 400.0)))
    assert points == pytest.approx(np.array([[0, 0], [0, 500], [200, 500], [200, 0]]), abs=1e-9)


def test_before_a_loiter_the_last_waypoint_is_where_it_begins() -> None:
    circle = (0.01, 200.0 * math.pi)
    waypoints = mission_waypoints(route_of((0.0, 400.0), circle, loiter=True))
    assert waypoints == pytest.approx(np.array([[0, 0], [0, 400]]))
    assert mission_waypoints(route_of(circle, loiter=True)) == pytest.approx(np.array([[0, -1], [0, 0]]))


@pytest.mark.parametrize("length", [0.3, 1e-6])
def test_a_route_of_next_to_no_length_is_a_leg_all_the_same(length: float) -> None:
    start, end = mission_waypoints(route_of((0.0, length)))
    assert math.dist(start, end) == pytest.approx(1.0)
    assert end == pytest.approx([0.0, length])


def test_goes_on_to_the_next_leg_within_the_acceptance_radius_and_where_it_has_passed() -> None:
    law = Watched()
    legs = WaypointLaw(law, "preview", lambda speed, turn: 60.0)
    legs.follow(RIGHT_ANGLE)
    assert law.routes[-1].segments.tolist() == [[0.0, 0.0, 0.0, 1.0, 0.0, 500.0]]
    legs.update(at(0.0, 435.0))
    assert len(law.routes) == 1
    output = legs.update(at(0.0, 445.0))
    assert len(law.routes) == 2
    assert law.routes[-1].segments[0] == pytest.approx([0.0, 500.0, 1.0, 0.0, 0.0, 500.0])
    assert output.roll_command_rad == 0.1
    assert (output.arc_length_m, output.past_end) != (9.0, True)
    assert output.cross_track_m == pytest.approx(-(math.hypot(100.0, 45.0) - 100.0), abs=1e-6)
    passed = WaypointLaw(Watched(), "preview", lambda speed, turn: 1.0)
    passed.follow(RIGHT_ANGLE)
    passed.update(at(-80.0, 501.0))
    assert passed.leg == 1


def test_asking_how_far_along_a_mission_a_place_is_moves_nothing() -> None:
    legs = straight((0j, 500j), (0.0, 500.0), None), straight((500j, 500 + 500j), (500.0, 1000.0), None)
    law = WaypointLaw(Watched(), "preview", lambda speed, turn: 60.0, legs=legs)
    law.follow(RIGHT_ANGLE)
    assert [law.along(at(0.0, y)).arc_length_m for y in (510.0, 420.0)] == pytest.approx([500.0, 420.0])


def test_a_turn_of_more_than_half_a_circle_onto_a_loiter_ends_where_it_ends() -> None:
    turn = MissionLeg(route_of((-0.01, 400.0)), (0.0, 400.0))  # by 229 deg about (100, 0)
    law = WaypointLaw(Watched(), "preview", lambda speed, turn: 60.0, legs=(turn, turn))
    law.follow(RIGHT_ANGLE)
    for gone in (0.5, 2.0, 3.5, 3.9):
        place = at(100.0 - 100.0 * math.cos(gone), 100.0 * math.sin(gone))
        assert law.update(place).arc_length_m == pytest.approx(100.0 * gone)
    law.update(at(161.6, -79.0))
    assert law.leg == 1


def test_a_loiter_is_flown_as_a_circle() -> None:
    law = Watched()
    legs = WaypointLaw(law, "preview", lambda speed, turn: 60.0)
    legs.follow(route_of((0.0, 400.0), (0.01, 200.0 * math.pi), loiter=True))
    legs.update(at(0.0, 399.0))
    assert [route.loiter for route in law.routes] == [False]
    legs.update(at(0.0, 401.0))
    assert [route.loiter for route in law.routes] == [False, True]


def test_acceptance_is_that_of_the_autopilot() -> None:
    limits = airframe("aerosonde").guidance_limits()
    kinds = guidance_kinds()

    def of(kind: str, speed: float, turn_deg: float, radius_m: float | None = None) -> float:
        config = kinds[kind].config().resolved(limits)
        return acceptance(kind, config, limits, radius_m)(speed, math.radians(turn_deg))

    l1 = kinds["l1"].config().resolved(limits)
    assert (distance := l1.damping * l1.period_s * 15.0 / math.pi) < 90.0
    assert of("l1", 15.0, 90.0) == of("l1", 15.0, 120.0) == pytest.approx(distance)
    assert of("l1", 15.0, 45.0) == pytest.approx(0.5 * distance)
    assert of("l1", 100.0, 90.0) == 90.0
    npfg = kinds["npfg"].config().resolved(limits)
    switch_m = 25.0 * npfg.switch_distance_multiplier * npfg.period_s * npfg.damping
    assert of("npfg", 25.0, 10.0) == pytest.approx(switch_m)
    assert of("npfg", 1000.0, 10.0) == 500.0
    assert of("preview", 25.0, 90.0) == pytest.approx(25.0**2 / (9.80665 * math.tan(math.radians(30.0))))
    assert of("l1", 25.0, 10.0, 33.0) == 33.0
