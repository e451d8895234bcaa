"""Worlds and paths across the antimeridian are those of any other longitude: the ellipsoid is the same all round."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.run_files.path_files import read_path
from harness.world_files.parts import FileSpec, FloatArray
from harness.world_files.siting import Craft, Site, site
from tests.harness.world_files.making import feature, geojson

CRAFT = Craft("aerosonde", 110.0, 120.0)
FIJI, ELSEWHERE = -16.8, 20.0  # latitude, and a longitude where nothing is to be thought of


def square(middle: float, half: float = 0.02) -> list[list[float]]:
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
    return [[round((middle + half * x + 180.0) % 360.0 - 180.0, 9), FIJI + half * y] for x, y in corners]


@pytest.mark.parametrize("longitude", [180.0, 179.99, -179.995, -150.0])
def test_a_world_is_the_same_at_every_longitude(longitude: float, tmp_path: Path) -> None:
    import shapely

    def made(name: str, middle: float) -> tuple[Site, Any]:
        path = geojson(tmp_path / name, feature({}, square(middle)), feature({}, square(middle + 0.2)))
        found = site([FileSpec(path)], 300.0, CRAFT)
        return found, shapely.union_all([each for of in found.expanded.sources for each in of.polygons])

    (there, solid), (here, wanted) = made("there.geojson", longitude), made("here.geojson", ELSEWHERE)
    assert there.place is not None
    assert here.place is not None
    apart = there.place.longitude_deg - here.place.longitude_deg - (longitude - ELSEWHERE)
    apart = math.remainder(apart, 360.0)
    assert abs(apart) < 2e-5
    assert np.allclose(there.bounds_m, here.bounds_m, atol=5.0)
    moved = shapely.transform(solid, lambda p: np.add(p, (apart * 106_600.0, 0.0)))
    assert wanted.area > 0.0
    assert shapely.symmetric_difference(moved, wanted).area < 0.01 * wanted.area


def test_a_path_across_the_antimeridian_is_as_long_as_elsewhere(tmp_path: Path) -> None:
    path = tmp_path / "path.geojson"

    def read(*longitudes: float) -> FloatArray:
        path.write_text(json.dumps({"type": "LineString", "coordinates": [[x, FIJI] for x in longitudes]}))
        found = read_path(path)
        assert found.origin_deg is not None
        assert abs(found.origin_deg[1]) <= 180.0
        return found.points_m

    for line in (
        (179.99, 180.0, -179.99),
        (179.99, 180.0, 180.01),
        (-180.01, -180.0, -179.99),
        (189.99, 190.0, 190.01),
    ):
        assert read(*line) == pytest.approx(read(20.0, 20.01, 20.02), abs=1e-6)
