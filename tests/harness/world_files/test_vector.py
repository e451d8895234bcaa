"""Vector files that GDAL reads: where they lie, what has no heights, and archives of them."""

from __future__ import annotations

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


def test_an_archive_names_what_it_holds(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("dem/", "")
        archive.writestr("dem/town.shp", "1,2\n")
    with pytest.raises(WorldFileError, match=r"is a ZIP archive with 'town\.shp'; unpack it"):
        read(tmp_path / "a.zip", None, Reading())
