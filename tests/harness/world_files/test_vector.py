"""Vector files that GDAL reads: where they lie, what has no heights, and archives of them."""

from __future__ import annotations

import itertools
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.world_files.kinds import read
from harness.world_files.parts import Reading, WorldFileError

pyogrio = pytest.importorskip("pyogrio")
pytestmark = pytest.mark.filterwarnings("ignore")

EAST, NORTH = 500_000.0, 5_200_000.0


def write(path: Path, crs: str | None = "EPSG:32632", **fields: Any) -> Path:
    import shapely

    square = shapely.to_wkb(np.array([shapely.box(EAST, NORTH, EAST + 50.0, NORTH + 50.0)], dtype=object))
    names, values = list(fields), [np.array([value]) for value in fields.values()]
    pyogrio.raw.write(path, square, values, names, crs=crs, geometry_type="Polygon")
    return path


def test_polygons_without_heights_are_told(tmp_path: Path) -> None:
    found = read(write(tmp_path / "a.gpkg", kind="wood"), None, Reading())
    assert "1 polygon without height limits taken as solid at every altitude" in found.notes
    assert read(write(tmp_path / "b.gpkg", height=12.0), None, Reading()).notes == ()


def test_what_says_not_where_it_lies_is_refused_until_it_is_told(tmp_path: Path) -> None:
    path = write(tmp_path / "a.shp", crs=None, height=12.0)
    with pytest.raises(WorldFileError, match="names no coordinate reference system; give crs"):
        read(path, None, Reading())
    assert read(path, None, Reading(crs="EPSG:32632")).crs == "EPSG:32632"


def test_a_shapefile_may_be_packed_and_other_archives_are_named(tmp_path: Path) -> None:
    plain = write(tmp_path / "a.shp", height=12.0)
    packed = tmp_path / "a.zip"
    with zipfile.ZipFile(packed, "w") as archive:
        for each in sorted(tmp_path.glob("a.[sdp]*")):
            archive.write(each, f"town/{each.name}")
    (part,), (wanted,) = (read(path, None, Reading()).parts for path in (packed, plain))
    assert part == wanted
    with zipfile.ZipFile(packed, "w") as archive:
        for each in sorted(tmp_path.glob("a.[sdp]*")):
            archive.writestr(f"__MACOSX/town/._{each.name}", "a fork of macOS")
            archive.write(each, f"town/{each.name}")
    assert read(packed, None, Reading()).parts == (wanted,)
    with zipfile.ZipFile(packed, "w") as archive:
        for name, each in itertools.product(("town", "lake"), sorted(tmp_path.glob("a.[sdp]*"))):
            archive.write(each, f"{name}{each.suffix}")
    with pytest.raises(
        WorldFileError, match=r"2 \.shp or \.gpkg files \(town\.shp, lake\.shp\); must have one: unpack"
    ):
        read(packed, None, Reading())
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("dem/", "")
        archive.writestr("dem/heights.csv", "1,2\n")
    with pytest.raises(WorldFileError, match=r"is a ZIP archive with 'heights\.csv'; unpack it"):
        read(packed, None, Reading())
