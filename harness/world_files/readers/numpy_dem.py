"""Terrain as NumPy archive: what matplotlib's wheel brings along as `jacksboro_fault_dem.npz`."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.files.zip_archive import DAMAGES
from harness.world_files.bounded import read_bytes
from harness.world_files.parts import WGS84, Contents, Raster, Reading, WorldFileError

MAX_BYTES: Final = 500_000_000
"""An archive unpacks to at most this."""


def read(path: Path, reading: Reading) -> Contents:
    """Reads `elevation` in rows from the north, and `xmin`, `xmax`, `ymin`, `ymax` of its edges in degrees.

    Of ymin and ymax the larger one is the northern edge, whichever it is.

    Raises:
        WorldFileError: something is missing, damaged or of another shape.
    """
    read_bytes(path, first=1)
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(each.file_size for each in archive.infolist()) > MAX_BYTES:
                raise WorldFileError(f"unpacks to more than {MAX_BYTES // 10**6} MB")
        with np.load(path, allow_pickle=False) as arrays:
            values = arrays["elevation"].astype(np.float64)
            west, east, south, north = (float(arrays[name]) for name in ("xmin", "xmax", "ymin", "ymax"))
    except WorldFileError:
        raise
    except (KeyError, TypeError, *DAMAGES) as error:
        raise WorldFileError("must have numbers `elevation`, `xmin`, `xmax`, `ymin`, `ymax`") from error
    south, north = min(south, north), max(south, north)
    if values.ndim != 2 or not values.size or not (-180 <= west < east <= 180 and -90 <= south < north <= 90):
        raise WorldFileError("must have rows and columns of elevation, and edges in degrees around an area")
    rows, columns = values.shape
    affine: Any = ((east - west) / columns, 0.0, west, 0.0, -(north - south) / rows, north)
    return Contents("numpy_dem", reading.crs or WGS84, terrain=Raster(values, affine))
