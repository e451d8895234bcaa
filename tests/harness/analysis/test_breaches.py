"""What a track touched or crossed, thin things between two rows among it."""

import numpy as np

from harness.analysis.breaches import compare
from harness.files.mavlink.items import Fence
from harness.flight.record import Track
from harness.run_files.fences import Fences
from harness.world.obstacle import Circle, Obstacle, Polygon
from harness.world.world import World
from tests.harness.conftest import track as make_track

BOUNDS = (-1e4, -1e4, 1e4, 1e4)


def box(name: str, inclusion: bool, west: float, south: float, east: float, north: float) -> Fence:
    return Fence(name, inclusion, (((west, south), (east, south), (east, north), (west, north)),))


def northward(world: World) -> Track:
    """1 km to the north, a row every 2.5 m."""
    track = make_track(401)
    clearance = world.clearance(np.column_stack((track.east_m, track.north_m)), track.time_s)
    return make_track(401, clearance_m=clearance)


def test_a_contact_is_told_with_time_place_and_depth() -> None:
    world = World([Obstacle(Circle((2000.0, 0.0), 9.0)), Obstacle(Circle((60.0, 500.0), 100.0))], BOUNDS)
    found = compare(northward(world), world, Fences(), bounded=False)
    (contact,) = found.breaches
    assert (contact.kind, contact.name) == ("obstacle", "obstacles[1]")
    assert (contact.time_s, contact.east_m, contact.north_m, contact.depth_m) == (20.0, 0.0, 500.0, 40.0)
    assert (contact.start_s, contact.end_s) == (16.9, 23.2)
    assert found.nearest_m.min() == -40.0
    at_the_end = World([Obstacle(Circle((0.0, 1000.0), 100.0))], BOUNDS)
    (contact,) = compare(northward(at_the_end), at_the_end, Fences(), bounded=False).contacts
    assert (contact.start_s, contact.end_s, contact.depth_m) == (36.1, 40.0, 100.0)


def test_a_wire_between_two_rows_is_touched() -> None:
    world = World([Obstacle(Polygon(((-50.0, 501.0), (50.0, 501.0), (50.0, 501.1), (-50.0, 501.1))))], BOUNDS)
    (contact,) = compare(northward(world), world, Fences(), bounded=False).contacts
    assert contact.north_m == 500.0
    assert 0.0 < contact.depth_m <= 0.05


def test_a_moving_obstacle_is_met_where_it_is_then() -> None:
    crossing = Obstacle(Circle((-200.0, 500.0), 30.0), velocity_mps=(10.0, 0.0))
    world = World([crossing, Obstacle(Circle((-400.0, 500.0), 30.0), velocity_mps=(10.0, 0.0))], BOUNDS)
    (contact,) = compare(northward(world), world, Fences(), bounded=False).contacts
    assert contact.name == "obstacles[0]"


def test_fences_are_entered_left_and_clipped_between_rows() -> None:
    world = World([], BOUNDS)
    fences = Fences(
        (
            box("a", False, -5.0, 600.0, 300.0, 700.0),
            box("b", True, -500.0, -500.0, 500.0, 300.0),
            box("c", True, -500.0, 301.0, 500.0, 900.0),
            Fence("d", False, center=(100.0, 0.0), radius_m=50.0),
        )
    )
    found = compare(northward(world), world, fences, bounded=False)
    assert [(each.kind, each.name, each.start_s, round(each.depth_m, 3)) for each in found.crossings] == [
        ("inclusion", "all of b, c", 12.0, 0.5),
        ("exclusion", "a", 24.1, 5.0),
        ("inclusion", "all of b, c", 36.1, 100.0),
    ]
    assert found.nearest_m.min() == -100.0
    assert found.contacts == ()


def test_all_inclusions_count_where_the_autopilot_has_it_so() -> None:
    fences = Fences((box("a", True, -9.0, -9.0, 9.0, 600.0), box("b", True, -9.0, -9.0, 9.0, 2000.0)), inside_all=True)
    world = World([], BOUNDS)
    (left,) = compare(northward(world), world, fences, bounded=False).breaches
    assert (left.name, round(left.start_s, 6), left.depth_m) == ("a", 24.1, 400.0)


def test_the_area_is_left_only_where_its_bounds_count() -> None:
    world = World([], (-100.0, -100.0, 100.0, 900.0))
    (left,) = compare(northward(world), world, Fences(), bounded=True).breaches
    assert (left.kind, left.name, left.depth_m) == ("area", "area.bounds_m", 100.0)
    assert compare(northward(world), world, Fences(), bounded=False).breaches == ()


def test_a_fence_with_a_hole_is_open_there() -> None:
    outer = ((-300.0, 300.0), (300.0, 300.0), (300.0, 1200.0), (-300.0, 1200.0))
    hole = ((-50.0, 301.0), (50.0, 301.0), (50.0, 1100.0), (-50.0, 1100.0))
    world = World([], BOUNDS)
    (thin,) = compare(northward(world), world, Fences((Fence("ring", False, (outer, hole)),)), False).breaches
    assert thin.start_s == 12.0
    assert 0.0 < thin.depth_m <= 0.5
