"""Worlds and paths across the antimeridian are those of any other longitude: the ellipsoid is the same all round."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.run_files.path_files import read_path
from harness.world_files.expansion import FileSpec
from harness.world_files.parts import FloatArray
from harness.world_files.siting import Craft, Site, site
from tests.harness.world_files.making import feature, geojson

CRAFT = Craft("aerosonde", 110.0, 120.0)
FIJI, ELSEWHERE = -16.8, 20.0
"""Latitude, and a longitude where nothing is to be thought of."""


def turned(longitude: float, upto_360: bool = False) -> float:
    """A longitude as files write it, within half a turn or up to a whole one."""
    return longitude % 360.0 if upto_360 else (longitude + 180.0) % 360.0 - 180.0


def square(middle: float, half: float = 0.02) -> list[list[float]]:
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
    return [[round(turned(middle + half * x), 9), FIJI + half * y] for x, y in corners]


def as_geojson(path: Path, longitude: float) -> Path:
    return geojson(
        path.with_suffix(".geojson"), feature({}, square(longitude)), feature({}, square(longitude + 0.2))
    )


def as_grid(path: Path, longitude: float) -> Path:
    """A hill in the middle of terrain whose columns go on beyond 180 degrees."""
    east, north = np.meshgrid(np.arange(61) - 30.0, np.arange(61) - 30.0)
    rows = 500.0 * np.exp(-((east / 6.0) ** 2) - (north / 8.0) ** 2)
    path = path.with_suffix(".asc")
    head = f"ncols 61\nnrows 61\nxllcenter {turned(longitude, True) - 0.06}\nyllcenter {FIJI - 0.06}\ncellsize 0.002\n"
    path.write_text(head + "\n".join(" ".join(f"{height:.2f}" for height in row) for row in rows) + "\n")
    path.with_suffix(".prj").write_text(
        'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],'
        'UNIT["degree",0.0174532925199433]]'
    )
    return path


@pytest.mark.parametrize("make", [as_geojson, as_grid])
@pytest.mark.parametrize("longitude", [180.0, 179.99, -179.995, -150.0])
def test_a_world_is_the_same_at_every_longitude(
    make: Callable[[Path, float], Path], longitude: float, tmp_path: Path
) -> None:
    import shapely

    (there, solid), (here, wanted) = (
        _made(make(tmp_path / name, each)) for name, each in (("there", longitude), ("here", ELSEWHERE))
    )
    assert there.place is not None
    assert here.place is not None
    apart = there.place.longitude_deg - here.place.longitude_deg - (longitude - ELSEWHERE)
    apart = math.remainder(apart, 360.0)
    assert abs(apart) < 2e-5
    assert np.allclose(there.bounds_m, here.bounds_m, atol=5.0)
    moved = shapely.transform(solid, lambda p: np.add(p, (apart * 106_600.0, 0.0)))
    assert wanted.area > 0.0
    assert shapely.symmetric_difference(moved, wanted).area < 0.01 * wanted.area
    assert (there.expanded.ground is None) == (here.expanded.ground is None)


def _made(path: Path) -> tuple[Site, Any]:
    import shapely

    found = site([FileSpec(path, crs="EPSG:4326" if path.suffix == ".asc" else None)], 300.0, CRAFT)
    return found, shapely.union_all([each for source in found.expanded.sources for each in source.polygons])


def test_a_path_across_the_antimeridian_is_as_long_as_elsewhere(tmp_path: Path) -> None:
    path = tmp_path / "path.geojson"

    def read(*longitudes: float) -> FloatArray:
        line = {"type": "LineString", "coordinates": [[x, FIJI] for x in longitudes]}
        path.write_text(json.dumps(line))
        found = read_path(path)
        assert found.origin_deg is not None
        assert abs(found.origin_deg[1]) <= 180.0
        return found.points_m

    wanted = read(20.0, 20.01, 20.02)
    assert read(179.99, 180.0, -179.99) == pytest.approx(wanted, abs=1e-6)
    assert read(179.99, 180.0, 180.01) == pytest.approx(wanted, abs=1e-6)
    assert read(-180.01, -180.0, -179.99) == pytest.approx(wanted, abs=1e-6)
    assert read(189.99, 190.0, 190.01) == pytest.approx(wanted, abs=1e-6)
