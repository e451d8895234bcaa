"""Which part of files larger than an area is taken, and where its plane touches the earth."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from pyproj import Geod

from harness.world_files.parts import FileSpec
from harness.world_files.siting import Craft, Site, site
from tests.harness.run.given import written
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
    others = [zone(151.2 + 3.0 * k, -33.9 + 2.0 * k) for k in range(-3, 4)]
    found = sited(tmp_path / "a.geojson", *others, *[zone(115.9 + 0.05 * k, -31.9) for k in range(4)])
    assert found.place is not None
    _, _, away_m = Geod(ellps="WGS84").inv(115.975, -31.9, found.place.longitude_deg, found.place.latitude_deg)
    assert away_m < 25_000.0
    assert found.bounds_m[0] == pytest.approx(-found.bounds_m[2], abs=1.0)
    polygons = found.expanded.sources[0].polygons
    assert len(polygons) == 4
    # One zone's true size on the ellipsoid, and not one that the plane of a far origin would stretch.
    area_m2, _ = Geod(ellps="WGS84").geometry_area_perimeter(shapely.box(115.89, -31.91, 115.91, -31.89))
    assert polygons[0].area == pytest.approx(abs(area_m2), rel=1e-3)
    assert math.dist(*found.ends_m) > 5000.0


def test_another_part_is_taken_where_the_most_crowded_has_no_room(tmp_path: Path) -> None:
    blocked = [zone(8.0 + 0.001 * k, 47.0, 0.8) for k in range(5)]
    found = sited(tmp_path / "a.geojson", *blocked, zone(15.0, 49.0), zone(15.1, 49.0))
    assert found.place is not None
    assert found.place.longitude_deg == pytest.approx(15.0, abs=0.5)
    assert len(found.expanded.sources[0].polygons) == 2


def test_a_zone_larger_than_an_area_is_flown_round_at_a_corner(tmp_path: Path) -> None:
    found = sited(tmp_path / "a.geojson", zone(8.0, 47.0, 0.8))
    (polygon,) = found.expanded.sources[0].polygons
    xmin, ymin, xmax, ymax = found.bounds_m
    assert 0.5 < polygon.area / ((xmax - xmin) * (ymax - ymin)) < 1.0
    assert (shapely.distance(shapely.points(found.ends_m), polygon) > CRAFT.clearance_m).all()


def occupancy(path: Path, metres_per_cell: float) -> Site:
    return site([FileSpec(path, metres_per_cell=metres_per_cell)], 100.0, CRAFT)


def test_a_world_in_which_it_can_turn_round_nowhere_on_the_way_says_with_which_cells_it_can(
    tmp_path: Path,
) -> None:
    # Two ends, and a narrow corridor between them.
    rows = ["." * 14 + ("." if 4 <= row < 10 else "@") * 32 + "." * 14 for row in range(14)]
    path = written(tmp_path / "a.map", "type octile\nheight 14\nwidth 60\nmap\n" + "\n".join(rows) + "\n")
    (note,) = [note for note in occupancy(path, 56.0).notes if "proved unreachable" in note]
    assert "narrower than 460 m, where aerosonde cannot turn round" in note
    cell = float(note.partition("--metres-per-cell ")[2].split()[0])
    assert cell > 56.0
    assert not any("proved unreachable" in note for note in occupancy(path, cell).notes)


def test_neighbouring_tiles_of_terrain_make_one_area(tmp_path: Path) -> None:
    """Four tiles of 4 x 4 km about (0, 0), of which the north-eastern alone has ground at 300 m."""
    specs = []
    for x, y in ((0, 0), (-4000, 0), (0, -4000), (-4000, -4000)):
        head = f"ncols 40\nnrows 40\nxllcorner {x}\nyllcorner {y}\ncellsize 100\nNODATA_value -9999\n"
        text = head + (f"{300 if x == y == 0 else 100} " * 40 + "\n") * 40
        specs.append(FileSpec(written(tmp_path / f"{x}{y}.asc", text)))
    found = site(specs, 400.0, CRAFT)
    xmin, ymin, xmax, ymax = found.bounds_m
    assert (xmax - xmin, ymax - ymin) == pytest.approx((8000.0, 8000.0), abs=2.0)
    ground = found.expanded.ground
    assert ground is not None
    middle = np.array((0.5 * (xmin + xmax), 0.5 * (ymin + ymax)))
    corners = middle + 2000.0 * np.array(((1, 1), (-1, 1), (1, -1), (-1, -1)))
    assert ground.at(*corners.T).tolist() == pytest.approx([300.0, 100.0, 100.0, 100.0], abs=0.5)
