"""Which part of files larger than an area is taken, and where its plane touches the earth."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import shapely
from pyproj import Geod

from harness.world_files.expansion import FileSpec
from harness.world_files.parts import WorldFileError
from harness.world_files.siting import Craft, Site, site
from tests.harness.world_files.making import feature, geojson

CRAFT = Craft("aerosonde", 110.0, 120.0)


def zone(longitude: float, latitude: float, half_deg: float = 0.01) -> dict[str, Any]:
    x, y, h = longitude, latitude, half_deg
    return feature(
        {"upper": "3000 m"}, [(x - h, y - h), (x + h, y - h), (x + h, y + h), (x - h, y + h), (x - h, y - h)]
    )


def sited(path: Path, *features: dict[str, Any]) -> Site:
    return site([FileSpec(geojson(path, *features))], 100.0, CRAFT)


def test_a_file_of_a_continent_has_its_origin_where_the_area_is(tmp_path: Path) -> None:
    perth = [zone(115.9 + 0.05 * k, -31.9) for k in range(4)]
    others = [zone(151.2 + 3.0 * k, -33.9 + 2.0 * k) for k in range(-3, 4)]
    found = sited(tmp_path / "a.geojson", *others, *perth)
    assert found.place is not None
    _, _, away_m = Geod(ellps="WGS84").inv(
        115.975, -31.9, found.place.longitude_deg, found.place.latitude_deg
    )
    assert away_m < 25_000.0
    assert found.bounds_m[0] == pytest.approx(-found.bounds_m[2], abs=1.0)
    polygons = found.expanded.sources[0].polygons
    assert len(polygons) == 4
    # One zone's true size on the ellipsoid, and not one that the plane of a far origin would stretch.
    area_m2, _ = Geod(ellps="WGS84").geometry_area_perimeter(shapely.box(115.89, -31.91, 115.91, -31.89))
    assert polygons[0].area == pytest.approx(abs(area_m2), rel=1e-3)
    assert math.dist(found.start_m, found.goal_m) > 5000.0


def test_another_part_is_taken_where_the_most_crowded_has_no_room(tmp_path: Path) -> None:
    blocked = [zone(8.0 + 0.001 * k, 47.0, 0.8) for k in range(5)]
    found = sited(tmp_path / "a.geojson", *blocked, zone(15.0, 49.0), zone(15.1, 49.0))
    assert found.place is not None
    assert found.place.longitude_deg == pytest.approx(15.0, abs=0.5)
    assert len(found.expanded.sources[0].polygons) == 2


def test_where_no_part_has_room_the_first_is_named(tmp_path: Path) -> None:
    with pytest.raises(WorldFileError, match="0% free, are too small for aerosonde"):
        sited(tmp_path / "a.geojson", *(zone(8.0 + 6 * k, 47.0, 0.8) for k in range(2)))
