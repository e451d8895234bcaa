"""A track against the path as given: both ways, and only where both are about as far along."""

import math

import numpy as np
import pytest
import shapely
from shapely.ops import substring

from harness.analysis.deviation import Stations, deviation, distances_m
from harness.flight.record import FloatArray
from harness.run_files.given_path import CutCorner
from tests.harness.conftest import track as make_track


def line(*points: tuple[float, float]) -> FloatArray:
    places = np.array(points, dtype=np.float64)
    return np.column_stack((places, np.append(0.0, np.cumsum(np.hypot(*np.diff(places, axis=0).T)))))


def test_without_a_window_it_is_the_distance_that_geos_finds() -> None:
    rng = np.random.default_rng(3)
    way = line(*rng.uniform(-1e3, 1e3, (40, 2)).tolist())
    points = np.column_stack((rng.uniform(-1.5e3, 1.5e3, (700, 2)), rng.uniform(0.0, way[-1, 2], 700)))
    wanted = shapely.distance(shapely.points(points[:, :2]), shapely.LineString(way[:, :2]))
    assert distances_m(points, way, math.inf) == pytest.approx(wanted, abs=1e-6)


def test_within_a_window_it_is_the_distance_from_the_part_that_geos_cuts_out() -> None:
    rng = np.random.default_rng(4)
    way = line(*rng.uniform(-1e3, 1e3, (12, 2)).tolist())
    points = np.column_stack((rng.uniform(-1.5e3, 1.5e3, (700, 2)), rng.uniform(0.0, way[-1, 2], 700)))
    whole = shapely.LineString(way[:, :2])
    parts = [substring(whole, max(along - 90.0, 0.0), along + 90.0) for along in points[:, 2]]
    wanted = shapely.distance(shapely.points(points[:, :2]), parts)
    assert distances_m(points, way, 90.0) == pytest.approx(wanted, abs=1e-6)
    assert distances_m(points, way[:1], 90.0) == pytest.approx(np.hypot(*(points - way[0])[:, :2].T))


def test_another_leg_of_the_path_does_not_count() -> None:
    """There and back 40 m beside; a point on the way back that flies over the way there is 40 m off."""
    way = line((0.0, 0.0), (0.0, 2000.0), (40.0, 2000.0), (40.0, 0.0))
    back = np.array([(0.0, 1000.0, 3040.0), (40.0, 1000.0, 3040.0)])
    assert distances_m(back, way, 300.0).tolist() == [40.0, 0.0]
    assert distances_m(back, way, 3000.0).tolist() == [0.0, 0.0]


def test_a_track_is_measured_both_ways() -> None:
    """The path has a spike of 500 m that the track leaves out: all rows are on the path, the spike is 500 m away."""
    given = np.array([(0.0, 0.0, 0.0), (0.0, 1000.0, 1000.0), (500.0, 1000.0, 1000.0), (0.0, 1000.0, 1000.0)])
    given = np.concatenate((given, [(0.0, 2000.0, 2000.0)]))
    found = deviation(make_track(801), given, 10.0, 400.0)
    assert found.rows_m.max() < 1e-9
    assert found.points_m.max() == pytest.approx(500.0, abs=3.0)
    assert found.figures()["max"] == pytest.approx(500.0, abs=3.0)
    assert found.by_row_m[400] == pytest.approx(500.0, abs=3.0)
    assert found.by_row_m[100] < 1e-9


def test_what_was_not_flown_yet_is_not_compared() -> None:
    found = deviation(make_track(401), line((0.0, 0.0), (0.0, 1000.0), (5000.0, 1000.0)), 10.0, 400.0)
    assert found.figures() == pytest.approx({"p95": 0.0, "max": 0.0}, abs=1e-9)
    before = make_track(3, arc_length_m=math.nan, plan_index=-1)
    assert deviation(before, line((0.0, 0.0), (0.0, 1.0)), 1.0, 1.0).figures() == {"p95": None, "max": None}


def test_a_corner_may_be_cut_by_its_own_figure() -> None:
    track = make_track(401)
    corners = [
        CutCorner(1, 0.0, along_m, 90.0, 80.0, 33.0, along_m, half_m, allowed_cut)
        for along_m, half_m, allowed_cut in ((250.0, 80.0, 60.0), (600.0, 60.0, 20.0), (750.0, 0.5, 0.5))
    ]
    allowed = Stations(track).allowed_m(10.0, corners)
    assert sorted(set(allowed.tolist())) == [0.5, 10.0, 20.0, 60.0]
    # Three times the limit to each side, or as far as the arc is off the legs.
    assert track.north_m[allowed == 60.0] == pytest.approx(np.arange(70.0, 432.0, 2.5))
    assert track.north_m[allowed == 20.0] == pytest.approx(np.arange(520.0, 682.0, 2.5))
    assert track.north_m[allowed == 0.5] == pytest.approx([750.0])


def test_rows_about_a_corner_are_those_that_a_look_at_every_row_finds() -> None:
    """The track goes back along its path again and again, and the first rows fly no plan."""
    rng = np.random.default_rng(5)
    along_m = np.append([math.nan] * 9, np.cumsum(rng.uniform(-40.0, 45.0, 700)))
    stations = Stations(make_track(len(along_m), arc_length_m=along_m))
    for at_m in rng.uniform(np.nanmin(along_m), np.nanmax(along_m), 50).tolist():
        corner = CutCorner(1, 0.0, at_m, 90.0, 80.0, 33.0, at_m, 0.0, 8.0)
        about = np.flatnonzero(np.abs(along_m - at_m) <= 24.0)
        passes = int(np.flatnonzero(along_m >= at_m)[0])
        assert stations.at_corner(corner).tolist() == sorted({*about.tolist(), passes})


def test_a_track_has_reached_what_is_furthest_along_of_its_rows() -> None:
    assert Stations(make_track(4, arc_length_m=np.array([math.nan, 0.0, 40.0, 30.0]))).reached_m == 40.0
    assert Stations(make_track(4, arc_length_m=math.nan)).reached_m == -math.inf
