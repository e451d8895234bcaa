"""GeoTIFFs as GDAL writes them, of every byte order and compression."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from harness.world_files.kinds import read
from harness.world_files.parts import Contents, Raster, Reading

rasterio = pytest.importorskip("rasterio")
pytestmark = pytest.mark.filterwarnings("ignore")  # of rasterio's own

HEIGHTS = (500.0 + np.add.outer(np.arange(40.0), 3.0 * np.arange(50.0))).astype(np.float32)
CELL_M, WEST_M, NORTH_M = 50.0, 450_000.0, 5_200_000.0


def made(path: Path, heights: NDArray[Any] = HEIGHTS, crs: str | None = "EPSG:32632", **how: Any) -> Path:
    """A GeoTIFF by GDAL."""
    units, mask = how.pop("units", None), how.pop("mask", None)
    if "gcps" not in how:
        how.setdefault("transform", rasterio.transform.from_origin(WEST_M, NORTH_M, CELL_M, CELL_M))
    rows, columns = heights.shape
    size = {"height": rows, "width": columns, "count": 1, "dtype": heights.dtype.name}
    with (
        rasterio.Env(GDAL_TIFF_INTERNAL_MASK=how.pop("inside", True)),
        rasterio.open(path, "w", driver="GTiff", crs=crs, **size, **how) as file,
    ):
        file.write(heights, 1)
        if units:
            file.units = [units]
        if mask is not None:
            file.write_mask(mask)
    return path


def contents(path: Path, **reading: Any) -> Contents:
    return read(path, None, Reading(**reading))


def terrain(path: Path, **reading: Any) -> Raster:
    found = contents(path, **reading).terrain
    assert found is not None
    return found


@pytest.mark.parametrize("inside", [True, False])
def test_cells_that_a_mask_takes_out_have_no_height(inside: bool, tmp_path: Path) -> None:
    mask = np.full(HEIGHTS.shape, 255, dtype=np.uint8)
    mask[:7] = 0
    found = terrain(made(tmp_path / "a.tif", mask=mask, inside=inside)).values
    assert np.isnan(found[:7]).all()
    assert found[7:].tolist() == HEIGHTS[7:].tolist()


@pytest.mark.parametrize("void", [-9999.0, -32767.0, -32768.0])
@pytest.mark.parametrize("units", [None, "ft"])
def test_voids_that_are_not_declared(void: float, units: str | None, tmp_path: Path) -> None:
    heights = HEIGHTS.copy()
    heights[0] = void
    found = terrain(made(tmp_path / "a.tif", heights, units=units)).values
    assert np.isnan(found[0]).all()
    assert np.isfinite(found[1:]).all()
