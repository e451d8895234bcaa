"""Routes of missions: without kinks, at the altitudes and speeds of their items."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from aircraft.guidance.circle import end_of
from aircraft.interface import FloatArray
from harness.run_files.mission.program import Loiter, MissionStep, Program
from harness.run_files.mission.route import mission_route
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
    placed = tuple(replace(each, position=None if place is None else (place.real, place.imag)) for each, place in steps)
    made = mission_route(Program(placed, (), 400.0), flying(ground), "m")
    for before, after in itertools.pairwise(made.way.segments.tolist()):
        place, direction = end_of(tuple(before))
        assert abs(place - complex(*after[:2])) < 1e-4
        assert abs(direction - complex(*after[2:4])) < 1e-4
    assert (np.diff(made.profile.arc_length_m) >= 0.0).all()
    assert (np.diff(made.way.given_m[:, 2]) >= -1e-6).all()
    return made


def altitude(made: MissionRoute, item: int) -> float:
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
@pytest.mark.parametrize(
    ("after", "last"),
    [(2500 + 800j, 3000 + 3000j), (1000 + 1050j, 3000 + 3000j), (40 + 990j, 40 + 990j)],
)
def test_circles_are_flown_at_their_radius_for_their_turns(
    center: complex, after: complex, last: complex, clockwise: bool
) -> None:
    loiter = Loiter(150.0, clockwise, turns=3.0)
    places = (0j, 1000j, center, after, last)
    made = route(*((step(n, loiter=loiter if n == 3 else None), each) for n, each in enumerate(places, 1)))
    bend = made.way.segments[:, 4]
    turned = float((bend * made.way.segments[:, 5])[np.abs(np.abs(bend) - 1.0 / 150.0) < 1e-9].sum())
    assert (turned < 0.0) is clockwise
    assert 3.0 * math.tau - 1e-6 <= abs(turned) <= 4.0 * math.tau + 1e-6
    circle = made.way.segments[np.abs(np.abs(bend) - 1.0 / 150.0) < 1e-9]
    assert np.hypot(*(circle[:, :2] - (center.real, center.imag)).T) == pytest.approx(150.0, abs=1e-3)
    # A chord of 5 m leaves a circle of 150 m by 5^2 / (8 * 150) = 0.021 m.
    middles = np.abs((made.way.given_m[1:, :2] + made.way.given_m[:-1, :2]) @ (0.5, 0.5j) - center)
    on = np.abs(np.abs(made.way.given_m[:, :2] @ (1.0, 1j) - center) - 150.0) < 1e-3
    assert middles[on[1:] & on[:-1]].min() > 150.0 - 0.022
    if abs(after - center) > 150.0:  # it is left along a tangent, which begins at a waypoint
        points = made.way.waypoints_m @ (1.0, 1j)
        out = points[np.abs(points - after).argmin() - 1] - center
        assert (abs(out), (out / (after - center - out)).real) == pytest.approx((150.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("climb_mps", [None, 4.0, -4.8])
@pytest.mark.parametrize(("seconds", "turns"), [(31.0, 1), (32.0, 2)])
def test_a_loiter_lasts_its_time_or_that_of_a_climb_at_the_airspeed_flown(
    seconds: float, turns: int, climb_mps: float | None
) -> None:
    """At 30 m/s a turn of 150 m takes 31.4 s; a climb is flown at 0.8 * 5 m/s, a descent at 0.8 * 6 m/s."""
    loiter = Loiter(150.0, True, time_s=seconds if climb_mps is None else None)
    height_m = 320.0 if climb_mps is None else 300.0 + seconds * climb_mps
    circling = step(2, height_m, loiter=loiter, airspeed_mps=35.0)
    made = route((step(1, 300.0), 0j), (circling, 150 + 1000j), (step(3, height_m), 3000j))
    around_m = turns * math.tau * 150.0
    assert made.way.segments[:, 5].sum() == pytest.approx(3000.0 + around_m)
    ends = made.profile.altitudes(np.array([1000.0, 1000.0 + around_m]))
    assert ends == pytest.approx([720.0 if climb_mps is None else 700.0, 400.0 + height_m])


@pytest.mark.parametrize("off_m", [-0.01, 0.0, 0.01])  # a file has places to 1e-7 degrees
def test_a_circle_is_gone_on_round_by_a_next_loiter_there(off_m: float) -> None:
    halves = [(step(n, loiter=Loiter(150.0, True, turns=0.5)), 150 + off_m + 1000j) for n in (2, 3)]
    made = route((step(1), 0j), *halves, (step(4), 3000j))
    assert made.way.segments[:, 5].sum() == pytest.approx(3000.0 + math.tau * 150.0, abs=0.1)


def test_a_mission_may_begin_on_a_circle() -> None:
    made = route((step(1, loiter=Loiter(100.0, True, turns=1.0)), 50 + 0j), (step(2), 2000j))
    assert math.dist(made.way.segments[0, :2], (50.0, 0.0)) == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("before_m", "north_m", "up_m"),
    [
        (100.0, 2700.0, 15.0),
        (16.0, 1125.0, 15.0),
        (15.0, 3000.0, 15.0),
        (9.0, 3000.0, 9.0),
        (-9.0, 3000.0, 0.0),
    ],
)
def test_a_landing_ends_15_m_above_its_place_on_the_straight_line_down(
    before_m: float, north_m: float, up_m: float
) -> None:
    made = route((step(1, 100.0), 0j), (step(2, before_m), 1000j), (step(3, 0.0, landing=True), 3000j))
    assert altitude(made, 3) == pytest.approx(400.0 + up_m)
    assert end_of(tuple(made.way.segments[-1].tolist()))[0] == pytest.approx(north_m * 1j)


def test_speeds_are_those_the_aircraft_holds_and_others_are_told() -> None:
    """The turn radius grows with the square of the airspeed: 100 m * (28 / 25)^2 = 125.44 m; 0 goes back to 25 m/s."""
    speeds = {2: 13.0, 3: 35.0, 4: 28.0, 5: 0.0}
    steps = {n: step(n, airspeed_mps=speeds.get(n), loiter=None) for n in range(1, 6)}
    steps[4] = replace(steps[4], loiter=Loiter(0.0, True, turns=1.0))
    made = route(*((each, 1000j * (n - 1)) for n, each in steps.items()))
    places = np.array([500.0, 1500.0, 2500.0, made.way.segments[:, 5].sum() - 100.0])
    assert made.profile.airspeeds(places).tolist() == [20.0, 30.0, 28.0, 25.0]
    assert sorted(set(made.commanded_mps.tolist())) == [13.0, 25.0, 28.0, 35.0]
    assert 1.0 / np.abs(made.way.segments[:, 4]).max() == pytest.approx(125.44)
    asked = (
        "13 m/s asked for before item 2: flown at 20 m/s",
        "35 m/s asked for before item 3: flown at 30 m/s",
    )
    assert [note.partition(";")[0] for note in made.notes] == list(asked)


@pytest.mark.parametrize(
    ("places", "begin_m", "end_m"),
    [
        ((0j, 1000j, 1000j, 5000j), 1000, 1625),
        ((0j, 1000j, 1000j, 1400j), 1000, 1400),
        ((0j, 1000j, 1000j), 375, 1000),
    ],
)
def test_two_altitudes_at_one_place_are_a_ramp(places: tuple[complex, ...], begin_m: float, end_m: float) -> None:
    """A climb of 100 m at 0.8 * 5 m/s and 25 m/s is 625 m long, or as long as the way to the next waypoint."""
    made = route(*((step(n, 200.0 if n > 2 else 100.0), each) for n, each in enumerate(places, start=1)))
    assert made.profile.altitudes(np.linspace(begin_m, end_m, 3)) == pytest.approx([500.0, 550.0, 600.0])


@pytest.mark.parametrize("share", [0.98, 1.02])
@pytest.mark.parametrize(("turn_deg", "limit_m"), [(90.0, 0.0), (150.0, 0.0), (100.0, 45.0)])
def test_a_corner_before_a_circle_is_rounded_where_a_turn_has_room(
    turn_deg: float, limit_m: float, share: float
) -> None:
    """Else it is flown over. At 100 degrees an arc inside the corner is 56 m off, and one past it and back 41 m."""
    ahead = 1j * np.exp(-1j * math.radians(turn_deg))  # its parts are sine and cosine of the turn
    past_radii = ahead.real - ahead.imag + 2.0 * math.sqrt(1.0 - 0.25 * (1.0 + ahead.real + ahead.imag) ** 2)
    away_m = share * TURN_M * (1.0 if turn_deg == 90.0 else past_radii)
    touch, first = 1000j + away_m * ahead, Loiter(200.0, True, turns=0.5)
    made = route(
        (step(1, loiter=first), -2000 - 500j),
        *((step(2), 0j), (step(3, acceptance_m=limit_m), 1000j), (step(4), 0.005 + 1000j)),
        (step(5, loiter=Loiter(150.0, True, turns=1.0)), touch - 150j * ahead),
        (step(6), touch + 3000.0 * ahead),
    )
    assert [corner.waypoint for corner in made.way.corners] == ([2, 3] if share > 1.0 else [2])
    assert np.abs(made.way.segments[:, 4]).max() <= (1.0 + 1e-9) / TURN_M
    along = np.append(0.0, np.cumsum(made.way.segments[:, 5]))
    for corner in made.way.corners:
        row = int(np.searchsorted(along, corner.arc_length_m)) - 1
        begun = (*made.way.segments[row, :5].tolist(), corner.arc_length_m - along[row])
        assert abs(end_of(begun)[0] - complex(corner.east_m, corner.north_m)) == pytest.approx(corner.cut_m)


def test_above_ground_the_ground_is_followed() -> None:
    def hill(east: FloatArray, north: FloatArray) -> FloatArray:
        return 400.0 + 80.0 * np.exp(-(((north - 1500.0) / 400.0) ** 2)) + 0.0 * east

    made = route((step(1, 50.0), 0j), (step(2, 100.0, "ground"), 3000j), (step(3, 100.0), 5000j), ground=hill)
    along = np.linspace(0.0, 3000.0, 61)
    above = made.profile.altitudes(along) - hill(np.zeros(61), along)
    assert above == pytest.approx(50.0 + 50.0 * along / 3000.0, abs=1.0)
    assert altitude(made, 3) == 500.0


@pytest.mark.parametrize("distance_m", [149.0, 150.0, 150.5, 151.5, 160.0])
def test_a_waypoint_close_to_a_circle_is_rounded_onto_it(distance_m: float) -> None:
    """It is about as far from the centre as the circle is wide: no arc on the leg between has room."""
    circling = step(3, loiter=Loiter(150.0, True, turns=1.0))
    made = route((step(1), -1000j), (step(2), 0j), (circling, 1j * distance_m))
    assert np.abs(made.way.segments[:, 4]).max() <= (1.0 + 1e-9) / TURN_M  # nowhere tighter than it turns


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
