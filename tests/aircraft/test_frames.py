"""The local plane against PROJ and the geodesics of GeographicLib."""

import math

import numpy as np
import pyproj
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aircraft.frames import LocalPlane
from aircraft.kernels import place_in_patch
from tests.examples import examples

GEOD = pyproj.Geod(ellps="WGS84")
FURTHEST_M = 142_000.0

latitudes = st.floats(-70.0, 70.0)
longitudes = st.floats(-180.0, 180.0)
bearings = st.floats(0.0, math.tau)
distances = st.floats(1.0, FURTHEST_M)


@given(latitudes, longitudes, bearings, distances)
@settings(max_examples=examples(150))
def test_position_agrees_with_the_geodesic(lat: float, lon: float, bearing: float, distance: float) -> None:
    point_lon, point_lat, _ = GEOD.fwd(lon, lat, math.degrees(bearing), distance)
    east, north = LocalPlane(lat, lon).plane(point_lat, point_lon)
    assert math.hypot(east - distance * math.sin(bearing), north - distance * math.cos(bearing)) < 0.1


@given(latitudes, longitudes, bearings, distances, st.floats(0.0, 360.0))
@settings(max_examples=examples(150))
def test_course_agrees_with_a_step_along_the_geodesic(
    lat: float, lon: float, bearing: float, distance: float, true_course_deg: float
) -> None:
    def exact(point_lon: float, point_lat: float) -> tuple[float, float]:
        azimuth_deg, _, length = GEOD.inv(lon, lat, point_lon, point_lat)
        return length * math.sin(math.radians(azimuth_deg)), length * math.cos(math.radians(azimuth_deg))

    point_lon, point_lat, _ = GEOD.fwd(lon, lat, math.degrees(bearing), distance)
    behind = exact(*GEOD.fwd(point_lon, point_lat, true_course_deg + 180.0, 200.0)[:2])
    ahead = exact(*GEOD.fwd(point_lon, point_lat, true_course_deg, 200.0)[:2])
    plane_course = math.atan2(ahead[0] - behind[0], ahead[1] - behind[1])
    convergence = LocalPlane(lat, lon).project(math.radians(point_lat), math.radians(point_lon))[2]
    off_rad = math.remainder(math.radians(true_course_deg) - convergence - plane_course, math.tau)
    assert abs(math.degrees(off_rad)) < 0.01


@given(latitudes, longitudes, bearings, distances)
@settings(max_examples=examples(100))
def test_geodetic_is_the_inverse(lat: float, lon: float, bearing: float, distance: float) -> None:
    plane = LocalPlane(lat, lon)
    east, north = distance * math.sin(bearing), distance * math.cos(bearing)
    assert plane.plane(*plane.geodetic(east, north)) == pytest.approx((east, north), abs=1e-3)


REACHES = st.floats(-1.0, 1.0)


@given(latitudes, longitudes, bearings, distances, REACHES, REACHES)
@settings(max_examples=examples(150))
def test_a_patch_agrees_with_the_plane_to_a_tenth_of_a_millimetre(
    lat: float, lon: float, bearing: float, distance: float, up: float, right: float
) -> None:
    plane = LocalPlane(lat, lon)
    middle = plane.geodetic(distance * math.sin(bearing), distance * math.cos(bearing))
    patch = plane.patch(*map(math.radians, middle))
    latitude, longitude, reach_up, reach_right = patch[:4]
    point = (latitude + up * reach_up, longitude + right * reach_right)
    if math.isnan((near := place_in_patch(np.array(patch), *point))[0]):  # on the rim, by rounding
        assert max(abs(up), abs(right)) > 1.0 - 1e-6
        return
    east, north, convergence = plane.project(*point)
    assert math.dist(near[:2], (east, north)) < 1e-4
    assert abs(math.degrees(near[2] - convergence)) < 1e-5


def test_the_date_line_is_no_edge() -> None:
    east, north = LocalPlane(10.0, 179.9).plane(10.0, -179.9)
    assert 0.0 < east < 23e3
    assert abs(north) < 10.0


@pytest.mark.parametrize(("lat", "lon"), [(86.0, 0.0), (math.nan, 0.0), (0.0, 361.0), (0.0, math.inf)])
def test_an_origin_out_of_range_is_refused(lat: float, lon: float) -> None:
    with pytest.raises(ValueError, match="must be in"):
        LocalPlane(lat, lon)
