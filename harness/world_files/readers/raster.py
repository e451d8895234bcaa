"""Terrain from rasters that rasterio reads (`wayproof[maps]`): GeoTIFF, ESRI ASCII grid, SRTM .hgt; and from NumPy."""

from __future__ import annotations

import re
import warnings
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.files.input_file import InputError
from harness.files.zip_archive import DAMAGES
from harness.world_files.bounded import read_bytes
from harness.world_files.parts import WGS84, Contents, FileSpec, Raster
from harness.world_files.plane import check_metres, crs_of, in_degrees

MAX_CELLS: Final = 60_000_000  # a raster with more cells, half a gigabyte of heights, is refused
CACHE_MB: Final = 64  # size of GDAL's cache, which is a twentieth of the machine's memory otherwise
MAX_NUMPY_BYTES: Final = 500_000_000  # a ZIP archive whose arrays unpack to more bytes is refused
VOIDS: Final = (-9999.0, -32767.0, -32768.0)  # values for no height in files that name none
HEIGHTS_M: Final = (-12_000.0, 9_000.0)  # heights at or beyond these count as missing: no ground lies there


@contextmanager
def opened(path: Path, driver: str) -> Iterator[Any]:
    """Opens a raster with rasterio, by no other driver of GDAL than `driver`."""
    try:
        import rasterio
        from rasterio.errors import RasterioError
    except ImportError as error:
        raise InputError("is a raster, which rasterio reads: pip install 'wayproof[maps]'") from error
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            rasterio.Env(GDAL_CACHEMAX=CACHE_MB, GDAL_DISABLE_READDIR_ON_OPEN="FALSE"),
            rasterio.open(path, driver=driver) as source,
        ):
            if source.height * source.width > MAX_CELLS:
                size = f"{source.height} x {source.width}"
                raise InputError(f"has {size} cells; must have at most {MAX_CELLS:,}: cut the area out of it")
            yield source
    except InputError:
        raise
    except (RasterioError, ValueError, OSError, MemoryError) as error:
        text = " ".join(str(error).replace(str(path), "it").split())[:120]
        raise InputError(f"cannot be read as a raster ({text}); it may be torn: get it again") from error


def read(spec: FileSpec) -> Contents:
    """Reads a raster of one band of heights in metres; an SRTM tile may be packed as .hgt.zip."""
    notes: tuple[str, ...] = ()
    with opened(spec.path, _driver(spec.path)) as source:
        if source.count > 1 or source.colorinterp[0].name == "palette":
            raise InputError("has more than one band, or a palette; must have one, of heights")
        if source.driver == "AAIGrid":
            _check_grid(spec.path, source)
        band = source.read(1, masked=True)
        values = band.data.astype(np.float64) * source.scales[0] + source.offsets[0]
        values[np.ma.getmaskarray(band) | np.isin(band.data, VOIDS)] = np.nan
        affine: Any = tuple(source.transform)[:6]
        if source.transform.is_identity:
            raise InputError("says not where it lies (no transformation); warp it with gdalwarp")
        if (crs := _crs(source, affine, spec.crs)) is not None:
            notes = check_metres(crs, source.units[0] or "")
            if not (spec.crs or source.crs):
                notes += ("names no crs: its numbers are taken as degrees, WGS 84 (crs)",)
        elif source.driver != "AAIGrid":
            raise InputError("names no coordinate reference system; give crs, as EPSG:32632")
        else:
            affine = tuple((spec.metres_per_cell or affine[0]) / affine[0] * each for each in affine)
            notes = ("names no place on earth: its metres are taken as they are (crs, metres_per_cell)",)
    values[(values <= HEIGHTS_M[0]) | (values >= HEIGHTS_M[1])] = np.nan
    if np.isnan(values).all():
        raise InputError("has no cell with a height between -12000 and 9000 m; must be terrain")
    return Contents(crs, raster=Raster(values, affine), notes=notes)


def _driver(path: Path) -> str:
    """Returns GDAL's driver for a raster; that of SRTM opens a tile in an archive too, by the name of both."""
    if (begin := read_bytes(path, first=2)) in (b"II", b"MM"):
        return "GTiff"
    if path.suffix.lower() != ".hgt" and begin != b"PK":
        return "AAIGrid"
    if not re.fullmatch(r"[NS]\d{2}[EW]\d{3}(\.SRTMGL\d)?\.hgt(\.zip)?", path.name, re.IGNORECASE):
        raise InputError("is an SRTM tile; its name must say where it lies, as N46E009.hgt, N46E009.hgt.zip")
    return "SRTMHGT"


def _check_grid(path: Path, source: Any) -> None:
    """Raises InputError for an ESRI ASCII grid to which GDAL adds zeros, or which it puts at 0, 0."""
    found, head = 0, read_bytes(path, first=1000).lower()
    void = b"nan" if str(source.nodata) == "nan" else b""
    if not any(b"xll" + at in head and b"yll" + at in head for at in (b"corner", b"center")):
        raise InputError("must have xllcorner and yllcorner, or xllcenter and yllcenter")
    with path.open("rb") as file:
        for number, line in enumerate(file, 1):
            if found or not (begin := line.strip()[:3].lower())[:1].isalpha() or begin == b"nan":
                found += len(line.split())
                if line.lower().replace(void, b"").translate(None, b"0123456789+-.e \t\r\n\x1a"):
                    raise InputError(f"line {number}: has something that is no number among its heights")
    if not source.transform.a > 0.0 > source.transform.e:
        raise InputError("has a cellsize that is not above 0; must be terrain")
    if found != (cells := source.height * source.width):
        raise InputError(f"has {found:,} heights; nrows times ncols are {cells:,}: it may be torn")


def _crs(source: Any, affine: tuple[float, ...], given: str | None) -> str | None:
    """Returns the crs that a raster names, else the given, or WGS84 for a grid that can only be in degrees; or None."""
    degrees = affine[0] < 0.1 and 0.0 < abs(affine[2]) <= 180.0 and abs(affine[5]) <= 90.0
    found = crs_of(str(source.crs.to_wkt()) if source.crs else None, given)
    return found or (WGS84 if degrees and source.driver == "AAIGrid" else None)


def read_numpy(spec: FileSpec) -> Contents:
    """Reads `elevation` in rows from the north and its edges in degrees, as in matplotlib's `jacksboro_fault_dem`."""
    try:
        with zipfile.ZipFile(spec.path) as archive:
            too_large = sum(each.file_size for each in archive.infolist()) > MAX_NUMPY_BYTES
        with np.load(spec.path, allow_pickle=False) as arrays:
            values: Any = np.zeros(0) if too_large else arrays["elevation"].astype(np.float64)
            west, east, south, north = (float(arrays[name]) for name in ("xmin", "xmax", "ymin", "ymax"))
    except (KeyError, TypeError, *DAMAGES) as error:
        raise InputError("must have numbers `elevation`, `xmin`, `xmax`, `ymin`, `ymax`") from error
    south, north = min(south, north), max(south, north)
    is_placed = in_degrees(spec.crs or WGS84) and -180 <= west < east <= 180 and -90 <= south < north <= 90
    if values.ndim != 2 or not values.size or not is_placed:
        wanted = "up to 500 MB of elevation in rows and columns, and edges in degrees around it (crs)"
        raise InputError(f"must have {wanted}")
    rows, columns = values.shape
    affine: Any = ((east - west) / columns, 0.0, west, 0.0, -(north - south) / rows, north)
    return Contents(spec.crs or WGS84, raster=Raster(values, affine))
