"""Each step of the paper's method against numbers worked out by hand, in the paper's order."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from planner.contract import MISSION
from planner.geometry.course import Route
from planner.geometry.curves import Pose, sample
from planner.interface import FloatArray, Mission, Path
from planner.paper.config import ImprovedBugConfig
from planner.paper.model import crosses, guide_vector, most_units, step, within
from planner.paper.multi_step_search import Window, along_guide, multi_step_search
from planner.paper.route_optimisation import cancel_nodes, flyable, shortest, turn_fits
from planner.paper.sectors import (
    FULL_CIRCLE,
    Sector,
    clip,
    distance_left_m,
    fan_shaped_sectors,
    off_guide,
    refine,
    select,
    whole_units,
)

NOTHING = np.zeros((0, 2))
UNIT = math.radians(1.0)


def deg(right: float, left: float) -> Sector:
    return Sector(math.radians(right), math.radians(left))


def near(found: list[Sector], *wanted: tuple[float, float]) -> None:
    np.testing.assert_allclose(np.degrees(np.array(sorted(found))), np.array(wanted).reshape(-1, 2), atol=1e-9)


def window(
    points: FloatArray, r1: float = 1000.0, goal: tuple[float, float] = (5000.0, 0.0), **changes: object
) -> Window:
    """A window about (0, 0): R = 50 m, S0 = 100 m, clearance 50 m, margin 10 m, N = n = 8."""
    keys = {"goal_m": goal, "goal_radius_m": 50.0, "bounds_m": (-6000.0, -6000.0, 6000.0, 6000.0)}
    keys |= {"clearance_m": 50.0, "turn_radius_m": 50.0, "speed_mps": 25.0, "tracking_error_m": 1.0}
    keys |= {"roll_in_s": 0.0, "sensor_range_m": 1000.0}
    mission = Mission(**keys | changes)  # type: ignore[arg-type]
    config = ImprovedBugConfig(planning_window_m=r1, step_m=100.0, margin_m=10.0).resolved(mission)
    return Window((0.0, 0.0), r1, points, 60.0, mission, config)


def test_equations_1_to_3() -> None:
    # 30 deg + 30 units of 1 deg = 60 deg; 100 m along it: (50, 86.60).
    x, y, course = step(3.0, 4.0, math.radians(30.0), 30, UNIT, 100.0)
    assert (x, y) == pytest.approx((53.0, 90.60254))
    assert math.degrees(course) == pytest.approx(60.0)
    assert step(0.0, 0.0, 0.0, -45, 2 * UNIT, 10.0)[:2] == pytest.approx((0.0, -10.0))


@pytest.mark.parametrize(
    ("step_m", "radius_m", "unit_deg", "units"),
    [(200.0, 100.0, 1.0, 90), (100.0, 100.0, 1.0, 53), (200.0, 100.0, 7.0, 12), (1.0, 100.0, 1.0, 0)],
)
def test_the_largest_change_of_course(step_m: float, radius_m: float, unit_deg: float, units: int) -> None:
    # 2 atan(1) = 90 deg, 2 atan(0.5) = 53.13 deg, 90 / 7 = 12.9, 2 atan(0.005) = 0.57 deg.
    assert most_units(step_m, radius_m, math.radians(unit_deg) * (1.0 - 1e-12)) == units


def test_definition_1_and_2() -> None:
    points = np.array([[30.0, 40.0], [30.0, 40.1], [-50.0, 0.0]])
    assert within(points, (0.0, 0.0), 50.0).tolist() == [[30.0, 40.0], [-50.0, 0.0]]
    length, angle = guide_vector((1.0, 1.0), (4.0, 5.0))
    assert length == pytest.approx(5.0)
    assert math.degrees(angle) == pytest.approx(53.1301, abs=1e-4)


def test_a_line_crosses_an_obstacle_that_it_leads_into() -> None:
    point = np.array([[100.0, 59.0]])
    assert crosses((0.0, 0.0), (200.0, 0.0), point, 60.0)
    assert not crosses((0.0, 0.0), (200.0, 0.0), point, 58.0)
    assert not crosses((0.0, 0.0), (50.0, 0.0), point, 60.0)
    assert not crosses((110.0, 0.0), (200.0, 0.0), point, 60.0), "it only leads away"


@pytest.mark.parametrize(
    ("theta_deg", "square"), [(0.0, 4.0), (60.0, 19.0), (90.0, 34.0), (120.0, 49.0), (180.0, 64.0)]
)
def test_equation_4(theta_deg: float, square: float) -> None:
    # a = 5, l = 3: 25 + 9 - 30 cos(theta).
    assert distance_left_m(5.0, 3.0, math.radians(theta_deg)) == pytest.approx(math.sqrt(square))


def test_fan_shaped_sectors() -> None:
    # A disc of 100 m that is 200 m away fills asin(1 / 2) = 30 deg on each side of its bearing.
    def at(*bearings: float) -> FloatArray:
        return 200.0 * np.column_stack((np.cos(np.radians(bearings)), np.sin(np.radians(bearings))))

    assert fan_shaped_sectors(NOTHING, 100.0, (0.0, 0.0)) == [FULL_CIRCLE]
    near(fan_shaped_sectors(at(0.0), 100.0, (0.0, 0.0)), (30.0, 330.0))
    near(fan_shaped_sectors(at(0.0, 180.0), 100.0, (0.0, 0.0)), (30.0, 150.0), (210.0, 330.0))
    near(fan_shaped_sectors(at(0.0, 50.0), 100.0, (0.0, 0.0)), (80.0, 330.0))
    assert fan_shaped_sectors(at(0.0, 59.0, 118.0, 177.0, 236.0, 295.0, 340.0), 100.0, (0.0, 0.0)) == []
    near(fan_shaped_sectors(np.array([[30.0, 0.0]]), 100.0, (0.0, 0.0)), (90.0, 270.0))


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 12))
def test_a_direction_is_in_a_free_sector_where_a_ray_meets_nothing(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points, origin = rng.uniform(-2000.0, 2000.0, (count, 2)), rng.uniform(-500.0, 500.0, 2)
    assume(np.hypot(*(points - origin).T).min() > 301.0)
    sectors = fan_shaped_sectors(points, 300.0, (float(origin[0]), float(origin[1])))
    angles = rng.uniform(-math.pi, math.pi, 180)
    rays = origin + 9e3 * np.column_stack((np.cos(angles), np.sin(angles)))
    lines = shapely.linestrings(np.stack((np.broadcast_to(origin, (180, 2)), rays), axis=1))
    room = shapely.distance(lines[:, None], shapely.points(points)) - 300.0
    free = np.array([any((a - s.right) % math.tau <= s.left - s.right for s in sectors) for a in angles])
    surely = (np.abs(room) > 1e-3).all(axis=1)
    np.testing.assert_array_equal(free[surely], (room > 0.0).all(axis=1)[surely])


def test_a_sector_is_cut_to_what_a_step_can_turn_to() -> None:
    near(clip(deg(30.0, 330.0), 0.0, math.radians(45.0)), (-45.0, -30.0), (30.0, 45.0))
    near(clip(deg(30.0, 330.0), math.radians(400.0), math.radians(20.0)), (390.0, 420.0))
    assert clip(deg(30.0, 60.0), math.pi, math.radians(45.0)) == []


def test_the_sectors_next_to_the_guide_vector_are_selected() -> None:
    parts = [deg(-45.0, -30.0), deg(30.0, 45.0), deg(80.0, 90.0)]
    assert select(parts, math.radians(10.0), 2) == [deg(30.0, 45.0), deg(-45.0, -30.0)]
    assert off_guide(deg(-20.0, 20.0), math.radians(10.0)) == 0.0
    assert math.degrees(off_guide(deg(170.0, 175.0), math.radians(-170.0))) == pytest.approx(15.0)


@pytest.mark.parametrize(
    ("sector", "angle_deg", "direction_deg"),
    [
        (deg(30.0, 90.0), 0.2, 30.0),
        (deg(-20.0, 70.0), 0.2, 0.0),
        (deg(-50.0, -40.0), 0.2, -40.0),
        (deg(30.0, 90.0), 360.0, 60.0),
    ],
)
def test_refinement(sector: Sector, angle_deg: float, direction_deg: float) -> None:
    # (4) grows with the angle off the guide vector, here 0: the edge next to it is best, or it itself.
    found = refine(sector, 500.0, 0.0, 100.0, math.radians(angle_deg))
    assert math.degrees(found) == pytest.approx(direction_deg, abs=0.5 * min(angle_deg, 1.0) + 1e-9)


def test_a_course_changes_by_whole_units_inside_the_sector() -> None:
    def units(right: float, left: float, direction: float) -> int | None:
        return whole_units(deg(right, left), math.radians(direction), 0.0, UNIT)

    assert units(30.2, 45.0, 30.3) == 31
    assert units(30.0, 45.0, 30.1) == 30
    assert units(-45.0, -30.2, -30.3) == -31
    assert units(30.2, 30.8, 30.3) is None


def test_with_nothing_in_the_way_the_steps_go_along_the_guide_vector() -> None:
    (track,) = multi_step_search(window(NOTHING), (0.0, 0.0), 0.0)
    np.testing.assert_allclose(track.nodes, [(100.0 * i, 0.0) for i in range(9)], atol=1e-9)
    assert track.flown_m == pytest.approx(800.0)
    assert track.left_m == pytest.approx(4200.0)
    (short,) = multi_step_search(window(NOTHING, goal=(250.0, 0.0)), (0.0, 0.0), 0.0)
    np.testing.assert_allclose(short.nodes, [(0.0, 0.0), (100.0, 0.0), (200.0, 0.0), (250.0, 0.0)], atol=1e-9)
    (inside,) = multi_step_search(window(NOTHING, r1=450.0), (0.0, 0.0), 0.0)
    assert inside.nodes[-1] == pytest.approx((400.0, 0.0)), "no step leads out of the window"


def test_the_guide_vector_is_looked_along_to_the_rim_of_the_window_or_to_a_nearer_goal() -> None:
    about = replace(window(NOTHING, r1=500.0), center_m=(50.0, 20.0))  # 300, 400, 500: a right triangle
    assert along_guide(about, (350.0, 20.0), 5000.0, 0.5 * math.pi) == pytest.approx((350.0, 420.0))
    assert along_guide(about, (50.0, -280.0), 5000.0, 0.0) == pytest.approx((450.0, -280.0))
    assert along_guide(about, (350.0, 20.0), 100.0, -0.5 * math.pi) == pytest.approx((350.0, -80.0))


def test_one_obstacle_is_passed_beside_its_tangents() -> None:
    # Half of the fan of a disc of 60 m that is 400 m away is asin(0.15) = 8.63 deg: the course changes by 9.
    tracks = multi_step_search(window(np.array([[400.0, 0.0]])), (0.0, 0.0), 0.0)
    assert 2 <= len(tracks) <= 8
    assert {round(math.degrees(math.atan2(t.nodes[1][1], t.nodes[1][0])), 6) for t in tracks} == {9.0, -9.0}
    assert [t.cost_m for t in tracks] == sorted(t.cost_m for t in tracks)
    for track in tracks:
        assert len(track.nodes) == 9
        assert shapely.LineString(track.nodes).distance(shapely.Point(400.0, 0.0)) >= 60.0 - 1e-9


@pytest.mark.parametrize(("open_from_deg", "open_to_deg"), [(132.0, 132.0), (132.0, 170.0), (100.0, 170.0)])
def test_where_all_directions_are_closed_or_lead_back_only_what_a_step_can_meet_counts(
    open_from_deg: float, open_to_deg: float
) -> None:
    """On a course of 90 deg in a ring of 700 m, closed or open up to 170 deg: the goal is east, 135 deg leads back.

    Steps of 100 m turn to the goal, lead to the far side, and no further. The ring's points are 70 m apart: in between
    a disc of 60 m reaches sqrt(60^2 - 35^2) inwards. Beside an opening it takes asin(60 / 700), 4.9 deg.
    """
    angle = np.arange(0.0, math.tau, 0.1)
    ring = 700.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    ring = ring[(angle <= math.radians(open_from_deg)) | (angle >= math.radians(open_to_deg))]
    free = fan_shaped_sectors(ring, 60.0, (0.0, 0.0))
    assert [left < math.radians(170.0) for _, left in free] == [True] * (open_to_deg > open_from_deg)
    best, room_m = multi_step_search(window(ring), (0.0, 0.0), 0.5 * math.pi)[0], 700.0 * math.cos(0.05)
    if open_from_deg == 100.0:  # from 1.7 rad and 4.9 deg, as far as a step can turn
        assert 102.3 < math.degrees(math.atan2(best.nodes[1][1], best.nodes[1][0])) < 139.0
        return
    np.testing.assert_allclose(best.nodes[:6], [(100.0 * k, 0.0) for k in range(6)], atol=1e-9)
    assert max(math.hypot(*node) for node in best.nodes) <= room_m - math.sqrt(60.0**2 - 35.0**2)


def test_the_depth_is_halved_where_no_candidate_gets_on() -> None:
    # A step turns by 11 deg at most, so that four lead 347 m ahead; the goal is behind, the border 340 m ahead: the
    # fourth step leaves the area whatever it does, so that 8 steps, and then 4, become 2.
    closed = window(NOTHING, goal=(-300.0, 5.0), turn_radius_m=500.0, bounds_m=(-500.0, -500.0, 340.0, 500.0))
    assert {len(track.nodes) for track in multi_step_search(closed, (0.0, 0.0), 0.0)} == {3}


def test_nodes_between_which_the_way_is_free_are_cancelled() -> None:
    zigzag = ((0.0, 0.0), (100.0, 20.0), (200.0, -20.0), (300.0, 20.0), (400.0, 0.0))
    assert cancel_nodes(zigzag, (-100.0, 0.0), window(NOTHING)) == (zigzag[0], zigzag[-1])
    # A disc of 60 m about (200, 50) is crossed by the lines from w_1 to w_4 and w_5, not by those to w_3.
    blocked = window(np.array([[200.0, 50.0]]))
    assert cancel_nodes(zigzag, (-100.0, 0.0), blocked)[:2] == (zigzag[0], zigzag[2])
    # The first turn, by a right angle, may take all of the 100 m before it, not half of them.
    left = ((0.0, 0.0), (0.0, 100.0), (0.0, 300.0))
    assert cancel_nodes(left, (-100.0, 0.0), window(NOTHING, turn_radius_m=99.0)) == (left[0], left[2])


def test_the_turn_onto_a_shortcut_keeps_the_turn_radius() -> None:
    # A right angle at R takes R of each leg: all of the 100 m before the first corner, half of any other leg.
    def corner(radius: float, out: float, first: bool) -> bool:
        return turn_fits((-60.0, -80.0), (0.0, 0.0), (-0.8 * out, 0.6 * out), radius, first=first)

    assert corner(99.0, 200.0, True)
    assert not corner(101.0, 300.0, True)
    assert not corner(99.0, 190.0, True)
    assert corner(49.0, 200.0, False)
    assert not corner(51.0, 200.0, False)


def test_the_curve_rounds_its_corners_and_keeps_the_clearance() -> None:
    nodes, start = ((100.0, 0.0), (100.0, 300.0)), Pose(0.0, 0.0, 1.0, 0.0)
    route = flyable(nodes, start, window(NOTHING))
    assert route is not None
    assert route.path.max_curvature_1pm <= 1.0 / 50.0 + 1e-12
    # A quarter of a circle of 50 m in place of 50 m of each leg.
    assert route.path.length_m == pytest.approx(100.0 + 300.0 - 2.0 * 50.0 + 0.5 * math.pi * 50.0)
    assert flyable(nodes, start, window(np.array([[150.1, 150.0]]))) is not None
    assert flyable(nodes, start, window(np.array([[149.9, 150.0]]))) is None
    assert flyable(nodes, start, window(NOTHING, turn_radius_m=101.0)) is None


def test_the_shortest_of_the_optimised_candidates_is_the_plan() -> None:
    path = Path.through([(0.0, 0.0), (1.0, 0.0)])
    short, long = Route(((0.0, 0.0), (300.0, 400.0)), path), Route(((0.0, 0.0), (500.0, 0.0)), path)
    # Both 500 m long; left are 781.02 m to (800, 1000) from the one, 1044.03 m from the other.
    assert shortest([long, short], (800.0, 1000.0)) == [short, long]


def test_every_node_of_a_plan_lies_in_the_window_and_so_does_the_curve() -> None:
    points = np.array([[x, y] for x in range(200, 3000, 230) for y in range(-900, 1000, 310)], dtype=float)
    for r1 in (400.0, 700.0, 1000.0):
        found = window(within(points, (0.0, 0.0), r1 + 60.0), r1=r1)
        tracks = multi_step_search(found, (50.0, 0.0), 0.0)
        assert max(math.hypot(*node) for track in tracks for node in track.nodes) <= r1
        routes = [flyable(track.nodes, Pose(0.0, 0.0, 1.0, 0.0), found) for track in tracks]
        curves = [sample(route.path, 5.0) for route in routes if route is not None]
        assert max(np.hypot(*curve.T).max() for curve in curves) <= r1


def test_keys_that_contradict_each_other_are_refused() -> None:
    with pytest.raises(ValueError, match=r"planning_window_m is 7000, more than sensor.range_m 6000"):
        ImprovedBugConfig(planning_window_m=7000.0).resolved(MISSION)
    with pytest.raises(ValueError, match=r"step_m is 1, too short .* must be at least 3$"):
        ImprovedBugConfig(step_m=1.0).resolved(MISSION)
    with pytest.raises(ValueError, match=r"planning_window_m is 100, less than one and a half steps"):
        ImprovedBugConfig(planning_window_m=100.0).resolved(MISSION)
    derived = ImprovedBugConfig().resolved(replace(MISSION, sensor_range_m=400.0))
    assert derived.step_m == 75.0, "half of the turn radius, more than r1 / N = 50"
    assert ImprovedBugConfig(steps=1).resolved(MISSION).step_m == 3600.0, "0.6 r1: with half a step it fits"
