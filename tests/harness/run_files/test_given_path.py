"""Corners flown by, curves given back."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st

from aircraft.interface import FloatArray
from harness.flight.polylines import polylines
from harness.run_files.given_path import Tightest, fly_by
from planner.geometry.curves import end_of
from wayproof import Path


def joints(segments: FloatArray) -> FloatArray:
    """(n - 1,) largest of gap (m) and jump of direction (rad) at each joint."""
    ends = [end_of(Path(row)) for row in segments[:-1]]
    gap = [math.dist(end[:2], row[:2]) for end, row in zip(ends, segments[1:], strict=True)]
    jump = [math.dist(end[2:], row[2:4]) for end, row in zip(ends, segments[1:], strict=True)]
    return np.maximum(gap, jump)


@pytest.mark.parametrize("turn_deg", [10.0, 45.0, 90.0, 120.0, -90.0])
def test_a_corner_is_flown_by_with_the_turn_radius(turn_deg: float) -> None:
    out = math.radians(turn_deg)
    points = np.array([(0, 0), (0, 3000), (-3000 * math.sin(out), 3000 + 3000 * math.cos(out))])
    way = fly_by(points, 150.0, 0.1)
    (corner,) = way.corners
    assert (corner.waypoint, corner.east_m, corner.north_m) == (1, 0.0, 3000.0)
    assert corner.turn_deg == pytest.approx(turn_deg)
    assert corner.radius_m == pytest.approx(150.0)
    assert corner.cut_m == pytest.approx(150.0 / math.cos(out / 2) - 150.0)
    assert way.segments[:, 4] == pytest.approx([0.0, math.copysign(1 / 150.0, turn_deg), 0.0])
    assert joints(way.segments).max() < 1e-6
    near = np.hypot(*(polylines([way.segments], 1e-4)[0] - points[1]).T).min()
    assert near == pytest.approx(corner.cut_m, abs=0.01)
    assert corner.arc_length_m == pytest.approx(3000.0 - 150.0 * math.tan(abs(out) / 2) + 75.0 * abs(out))


def test_a_corner_without_room_gets_what_room_there_is() -> None:
    way = fly_by(np.array([(0.0, 0), (0, 3000), (60, 3000), (60, 0)]), 110.0, 1.0)
    assert [corner.radius_m for corner in way.corners] == pytest.approx([30.0, 30.0])
    assert way.segments[:, 5].min() > 1.0
    assert joints(way.segments).max() < 1e-6


def test_neighbours_share_a_leg_by_what_they_need() -> None:
    """A right angle needs 110 m of a leg of 140 m, the slight turn after it a few."""
    out = math.radians(5.0)
    points = np.array([(0, 0), (0, 3000), (140, 3000), (140 + 3000 * math.cos(out), 3000 + 3000 * math.sin(out))])
    assert [each.radius_m for each in fly_by(points, 110.0, 1e-3).corners] == pytest.approx([110.0, 110.0])


@given(radius=st.floats(100.0, 5000.0), turn=st.floats(0.5, 6.0), share=st.floats(0.02, 0.2), side=st.booleans())
def test_points_of_a_circle_give_it_back(radius: float, turn: float, share: float, side: bool) -> None:
    angle = np.linspace(0.0, turn, max(round(turn / share), 2) + 1)
    points = np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))
    points[:, 1] *= 1.0 if side else -1.0
    sagitta = 0.5 * (share * radius) ** 2 / radius
    way = fly_by(points, 100.0, sagitta)
    bend = np.abs(way.segments[:, 4])
    # The first and the last arc have a whole leg for themselves.
    assert (bend[bend > 0] >= 0.45 / radius).all()
    assert (bend <= 1.02 / radius + 1e-12).all()
    assert np.abs(np.hypot(*polylines([way.segments], 1e-4)[0].T) - radius).max() <= sagitta
    assert way.corners == ()


@pytest.mark.parametrize("radius_m", [100.0, 300.0, 1000.0])
@pytest.mark.parametrize(("chord_m", "decimals"), [(0.25, 6), (1.0, 6), (2.0, 6), (0.25, 2)])
def test_a_circle_sampled_closely_bends_as_it_does(radius_m: float, chord_m: float, decimals: int) -> None:
    angle = np.arange(0.0, 3.0, chord_m / radius_m)
    points = (radius_m * np.column_stack((np.cos(angle), np.sin(angle)))).round(decimals)
    assert np.abs(fly_by(points, 60.0, 0.1, Tightest(55.0, 10.0)).segments[:, 4]).max() < 1.3 / radius_m


def test_points_on_a_line_are_left_out() -> None:
    way = fly_by(np.column_stack((np.zeros(101), np.linspace(0.0, 1000.0, 101))), 100.0, 1.0)
    assert way.segments.tolist() == [[0.0, 0.0, 0.0, 1.0, 0.0, 1000.0]]
    assert way.waypoints_m.tolist() == [[0.0, 0.0], [0.0, 1000.0]]


def test_a_path_may_cross_itself_at_one_of_its_points() -> None:
    points = np.array([(0.0, 0), (0, 2000), (1000, 1000), (0, 1000), (-1000, 1000), (0, 0), (500, -900)])
    assert fly_by(points, 50.0, 0.1).waypoints_m.tolist() == np.delete(points, 3, axis=0).tolist()


@example([(0, 0), (15, 0), (5, 0), (25, 0)])  # it goes back along itself
@given(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=2, max_size=12))
def test_any_polyline_becomes_a_path_from_its_start_to_its_end(grid: list[tuple[int, int]]) -> None:
    points = 200.0 * np.array(grid, dtype=np.float64)
    if len(points := points[np.append(True, np.hypot(*np.diff(points, axis=0).T) > 0)]) < 2:
        points = np.array([(0.0, 0.0), (200.0, 0.0)])
    way = fly_by(points, 110.0, 1.0)
    drawn_m, kept_m = (np.hypot(*np.diff(each, axis=0).T).sum() for each in (points, way.waypoints_m))
    assert kept_m == pytest.approx(drawn_m)
    assert np.isfinite(way.segments).all()
    assert (way.segments[:, 5] > 0).all()
    assert np.hypot(way.segments[:, 2], way.segments[:, 3]) == pytest.approx(1.0)
    assert way.segments[0, :2] == pytest.approx(points[0])
    assert end_of(Path(way.segments))[:2] == pytest.approx(points[-1], abs=1e-3)


@pytest.mark.parametrize("seed", range(20))
def test_kinks_that_are_flown_as_one_are_judged_by_the_points_given(seed: int) -> None:
    """Short legs and sharp turns at random, in wind: the way is continuous, and what is judged is the polyline."""
    rng = np.random.default_rng(seed)
    leg = rng.choice([2.0, 5.0, 20.0, 60.0, 200.0], 30) * rng.uniform(0.5, 1.5, 30)
    angle = np.cumsum(rng.normal(0.0, rng.choice([0.2, 0.8, 2.0]), 30))
    points = np.cumsum(np.column_stack((leg * np.cos(angle), leg * np.sin(angle))), axis=0)
    way = fly_by(points, 110.0, 2.5, Tightest(63.7, 10.0, 0.3 * np.exp(1j * seed)))
    assert joints(way.segments).max(initial=0.0) < 1e-5
    assert np.diff(way.stations_m).min() >= 0.0
    assert np.diff(way.given_m[:, 2]).min() >= -1e-9
    given_line, line = shapely.LineString(way.given_m[:, :2]), shapely.LineString(points)
    assert shapely.hausdorff_distance(given_line, line) < 0.02  # a point so near to its line is left out
    assert float(way.segments[:, 5].sum()) == pytest.approx(way.stations_m[-1])


@pytest.mark.parametrize("back", [1, -1])
@pytest.mark.parametrize(
    "twice", [[(512, 0), (511, 0)], [(512, 0), (511, 1)], [(511, 0), (512, 1), (510, 0)], [(-1, 1)]]
)
@pytest.mark.parametrize("north_m", [0.0, 300.0])
def test_points_back_and_forth_about_one_place_are_flown_as_one(
    twice: list[tuple[float, float]], north_m: float, back: int
) -> None:
    """As a second click leaves them, or a receiver that stands still: an aircraft flies past within a few metres."""
    points = np.array([(0.0, 0.0), *twice, (1200.0, north_m)])[::back]
    way = fly_by(points, 110.0, 2.5, Tightest(63.7, 10.0))
    assert np.abs(way.segments[:, 4]).max() <= 1.0 / 63.7
    line = shapely.LineString(polylines([way.segments])[0])
    assert shapely.hausdorff_distance(line, shapely.LineString(points), densify=0.01) < 4.0
