"""Terrain from GeoTIFF: Pillow reads the usual ones, rasterio (`wayproof[maps]`) any.

Tags are those of OGC GeoTIFF 1.1 (OGC 19-008r4).
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from harness.files.input_file import open_regular
from harness.world_files.bounded import check_size, head
from harness.world_files.parts import FOOT_M, Contents, FloatArray, Raster, Reading, WorldFileError
from harness.world_files.plane import flat_crs, has_heights, unit_that_is_no_metre, vertical_unit_m

MAX_CELLS: Final = 60_000_000
"""Half a gigabyte of heights while they are read."""
STRIP_CELLS: Final = 2_000_000
"""As many at a time."""
CACHE_MB: Final = 64
"""Of GDAL, which keeps a twentieth of the machine's memory else."""
PIXEL_SCALE, TIE_POINTS, TRANSFORMATION, GEO_KEYS, NODATA = 33550, 33922, 34264, 34735, 42113
GEOGRAPHIC_CRS, PROJECTED_CRS, RASTER_TYPE = 2048, 3072, 1025
VERTICAL_CRS, VERTICAL_UNIT, METADATA = 4096, 4099, 42112
USER_DEFINED: Final = 32767
COMPRESSION, SUBFILE = 259, 254
MASK: Final = 4
"""Bit of SUBFILE: the image says which cells of the first one hold a value."""
BIG_ENDIAN: Final = b"MM"
VOIDS: Final = (-9999.0, -32767.0, -32768.0)
"""What cells without a height hold in files that do not say so."""
MOST_IMAGES: Final = 100
LEAST_POINTS: Final = 3
"""Ground control points that say where a grid lies."""
FOOT, US_FOOT = 9002, 9003
"""EPSG numbers of units."""
US_FOOT_M: Final = 1200.0 / 3937.0
EPSG_UNITS_M: Final = {9001: 1.0, FOOT: FOOT_M, US_FOOT: US_FOOT_M}
UNITS_M: Final = {
    **dict.fromkeys(("m", "metre", "meter", "metres", "meters"), 1.0),
    **dict.fromkeys(("ft", "foot", "feet", "international foot"), FOOT_M),
    **dict.fromkeys(("us survey foot", "us-ft", "ftus", "us_survey_foot", "foot_us", "sfoot"), US_FOOT_M),
    **dict.fromkeys(("cm", "centimetre", "centimeter"), 0.01),
    **dict.fromkeys(("dm", "decimetre", "decimeter"), 0.1),
}
"""Units of height by the names that GDAL writes."""
POINT: Final = 2
"""Of RASTER_TYPE: a tie point is the middle of a cell, not its corner."""
MISSING: Final = "rasterio reads it: pip install 'wayproof[maps]'"


def read(path: Path, reading: Reading) -> Contents:
    """Reads a GeoTIFF of one band of heights.

    Raises:
        WorldFileError: it cannot be read, has no place on earth, or is too large.
    """
    try:
        return _with_pillow(path, reading)
    except WorldFileError as error:
        fault = WorldFileError(str(error))  # the first holds on to what was read
    found = _with_rasterio(path, reading)
    if found is None:
        raise fault
    if isinstance(found, WorldFileError):
        raise found from fault
    return found


def _with_pillow(path: Path, reading: Reading) -> Contents:
    from PIL import Image

    first = head(path, len(BIG_ENDIAN))
    check_size(path)
    try:
        # Not from bytes in memory: they would take as much room as the heights.
        with open_regular(path) as file, Image.open(file, formats=["TIFF"]) as image:
            columns, rows = image.size
            check_cells(rows, columns)
            tags: dict[int, Any] = dict(image.tag_v2)  # type: ignore[attr-defined]
            if len(image.getbands()) != 1:
                raise WorldFileError(
                    f"has {len(image.getbands())} bands; must have one, of heights; {MISSING}"
                )
            if image.mode in ("P", "1"):
                raise WorldFileError(f"has a palette; must have numbers, of heights; {MISSING}")
            if first == BIG_ENDIAN and tags.get(COMPRESSION, 1) != 1 and image.mode != "L":
                # Pillow 12 turns the bytes round which its decoder has turned already.
                raise WorldFileError(f"is compressed and has its high bytes first; {MISSING}")
            values = _numbers(image)
            if _has_mask(image, path):
                raise WorldFileError(f"has a mask that says which cells hold a height; {MISSING}")
    except WorldFileError:
        raise
    except Exception as error:  # Pillow raises many kinds for damaged files
        raise WorldFileError(
            f"cannot be read as a TIFF ({str(error)[:80] or type(error).__name__}); {MISSING}"
        ) from error
    nodata = _number(tags.get(NODATA))
    for strip in strips(values) if nodata is not None else ():
        values[strip][values[strip] == nodata] = np.nan
    keys = _geo_keys(tags.get(GEO_KEYS, ()))
    crs = reading.crs or _crs(keys)
    affine = _affine(tags, keys.get(RASTER_TYPE) == POINT)
    scaling = _scaling(tags, keys)
    values, notes = in_metres(values, scaling, crs)
    return Contents("geotiff", crs, terrain=Raster(plausible(values), affine), notes=notes)


def _numbers(image: Any) -> FloatArray:
    """(rows, columns) numbers of an image of one band, by strips: Pillow's own way takes thrice the room."""
    columns, rows = image.size
    values = np.empty((rows, columns))
    for strip in strips(values):
        part = np.asarray(image.crop((0, strip.start, columns, strip.stop)))
        if part.shape != values[strip].shape:
            raise WorldFileError(f"is a TIFF of mode {image.mode}, not of heights; {MISSING}")
        values[strip] = part
    return values


def strips(values: FloatArray) -> Iterator[slice]:
    """Rows of a raster, a few million cells at a time: what is worked out for them takes little room."""
    rows, columns = values.shape
    step = max(STRIP_CELLS // max(columns, 1), 1)
    for start in range(0, rows, step):
        yield slice(start, min(start + step, rows))


def _has_mask(image: Any, path: Path) -> bool:
    """Whether one of the images of a file is a mask, or there is one beside it."""
    if path.with_name(f"{path.name}.msk").is_file():
        return True
    for number in range(1, min(image.n_frames, MOST_IMAGES)):
        image.seek(number)
        if int(image.tag_v2.get(SUBFILE, 0)) & MASK:
            return True
    return False


class Scaling(NamedTuple):
    """What makes heights above mean sea level, in metres, of a file's numbers: times a factor, plus an offset."""

    factor: float = 1.0
    offset_m: float = 0.0
    is_told: bool = True  # that these are the unit


def in_metres(values: FloatArray, scaling: Scaling, crs: str) -> tuple[FloatArray, tuple[str, ...]]:
    """Heights in metres, and what to say of it.

    Args:
        values: as the file has them; changed in place, voids become NaN.
        scaling: what the file says of them.
        crs: of its horizontal coordinates.
    """
    for strip in strips(values):
        values[strip][np.isin(values[strip], VOIDS)] = np.nan
    if scaling[:2] == (1.0, 0.0):
        plane_unit = "" if scaling.is_told else unit_that_is_no_metre(crs)
        if not plane_unit:
            return values, ()
        return values, (f"its heights name no unit: taken as metres, although its plane is in {plane_unit}",)
    told = f"its heights are its numbers times {scaling.factor:.6g}"
    told += f" plus {scaling.offset_m:g} m" if scaling.offset_m else ""
    values *= scaling.factor
    values += scaling.offset_m
    return values, (told + ", as it says",)


def unit_m(name: str) -> float:
    """Length of a unit, as GDAL names it, in metres.

    Raises:
        WorldFileError: it is none that is known.
    """
    word = name.strip().lower()
    if word not in UNITS_M:
        raise WorldFileError(
            f"has heights in {name[:20]!r}, which is no unit that is known; convert it to metres"
        )
    return UNITS_M[word]


def _scaling(tags: dict[int, Any], keys: dict[int, int]) -> Scaling:
    """Unit, scale and offset of heights, as GDAL's own tag, the vertical unit or the vertical system says."""
    items = {
        match[1].lower(): match[2]
        for match in re.finditer(r"<Item[^>]*\brole=\"(\w+)\"[^>]*>([^<]*)<", str(tags.get(METADATA, "")))
    }
    scale, offset = (_number(items.get(name, none)) for name, none in (("scale", "1"), ("offset", "0")))
    is_told = bool(items.get("unittype") or keys.get(VERTICAL_UNIT) or keys.get(VERTICAL_CRS))
    if items.get("unittype"):
        unit = unit_m(items["unittype"])
    else:
        unit = EPSG_UNITS_M.get(keys.get(VERTICAL_UNIT, 0)) or _vertical_unit_m(keys.get(VERTICAL_CRS, 0))
    if (
        scale is None
        or offset is None
        or not (math.isfinite(scale) and math.isfinite(offset))
        or scale == 0.0
    ):
        raise WorldFileError("has a scale or an offset of its heights that is no number")
    return Scaling(scale * unit, offset * unit, is_told)


def _vertical_unit_m(code: int) -> float:
    """Of a vertical system by its EPSG number; a metre where there is none."""
    return vertical_unit_m(f"EPSG:{code}") if 0 < code < USER_DEFINED else 1.0


def check_cells(rows: int, columns: int) -> None:
    """Raises WorldFileError if a raster is too large to be read whole."""
    if rows * columns > MAX_CELLS:
        raise WorldFileError(
            f"has {rows} x {columns} cells; must have at most {MAX_CELLS:,}: cut the area of interest out of it"
        )


def plausible(values: FloatArray) -> FloatArray:
    """Heights with those that are no height on earth made NaN, in place."""
    any_known = False
    for strip in strips(values):
        known = (values[strip] > -12_000.0) & (values[strip] < 9_000.0)
        values[strip][~known] = np.nan
        any_known |= bool(known.any())
    if not any_known:
        raise WorldFileError("has no cell with a height between -12000 and 9000 m; must be terrain")
    return values


def _number(text: Any) -> float | None:
    try:
        return float(str(text).strip("\0 "))
    except ValueError:
        return None


def _geo_keys(directory: Any) -> dict[int, int]:
    """Key -> value of those whose value stands in the directory itself."""
    entries = [int(each) for each in directory]
    quads = [entries[i : i + 4] for i in range(4, len(entries) - 3, 4)]
    return {key: value for key, where, _, value in quads if where == 0}


def _crs(keys: dict[int, int]) -> str:
    for key in (PROJECTED_CRS, GEOGRAPHIC_CRS):
        code = keys.get(key, 0)
        if 0 < code < USER_DEFINED:
            flat_crs(f"EPSG:{code}")  # newer than PROJ's list here, perhaps: then GDAL may know it
            return f"EPSG:{code}"
    raise WorldFileError(
        f"names no coordinate reference system by its EPSG number; give crs, as EPSG:32632, or {MISSING}"
    )


def _affine(tags: dict[int, Any], points: bool) -> tuple[float, float, float, float, float, float]:
    if TRANSFORMATION in tags:
        m = [float(each) for each in tags[TRANSFORMATION]]
        affine = (m[0], m[1], m[3], m[4], m[5], m[7])
    elif PIXEL_SCALE in tags and TIE_POINTS in tags:
        column, row, _, x, y = (float(each) for each in tags[TIE_POINTS][:5])
        right, down = (float(each) for each in tags[PIXEL_SCALE][:2])
        affine = (right, 0.0, x - right * column, 0.0, -down, y + down * row)
    else:
        raise WorldFileError(f"says not where it lies (no tie point); {MISSING}")
    if points:
        a, b, c, d, e, f = affine
        affine = (a, b, c - (a + b) / 2, d, e, f - (d + e) / 2)
    if affine[0] * affine[4] == affine[1] * affine[3] or not np.isfinite(affine).all():
        raise WorldFileError("has cells of no size; must be a GeoTIFF of terrain")
    return affine


def _with_rasterio(path: Path, reading: Reading) -> Contents | WorldFileError | None:
    """The same with rasterio; what is wrong with it; or None where there is no rasterio."""
    try:
        import rasterio
        from rasterio.enums import ColorInterp
        from rasterio.errors import RasterioError
        from rasterio.windows import Window
    except ImportError:
        return None
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            rasterio.Env(GDAL_CACHEMAX=CACHE_MB),
            rasterio.open(path) as source,
        ):
            check_cells(source.height, source.width)
            others = [each for each in source.colorinterp[1:] if each is not ColorInterp.alpha]
            if others or source.colorinterp[0] is ColorInterp.palette:
                return WorldFileError(
                    f"has {source.count} bands or a palette, an image; must have one band, of heights"
                )
            values = np.empty((source.height, source.width))
            for strip in strips(values):
                window = Window(0, strip.start, source.width, strip.stop - strip.start)
                band = source.read(1, window=window, masked=True)
                values[strip] = band.data
                values[strip][np.ma.getmaskarray(band)] = np.nan
            system = source.crs or source.gcps[1]
            crs = reading.crs or (system.to_wkt() if system else None)
            if crs is None:
                return WorldFileError("names no coordinate reference system; give crs, as EPSG:32632")
            affine = _placed(source)
            unit = unit_m(source.units[0]) if source.units[0] else vertical_unit_m(crs)
            is_told = bool(source.units[0]) or has_heights(crs)
            scaling = Scaling(source.scales[0] * unit, source.offsets[0] * unit, is_told)
            values, notes = in_metres(values, scaling, crs)
            terrain = Raster(plausible(values), affine)
            return Contents("geotiff", crs, terrain=terrain, notes=notes)
    except WorldFileError as error:
        return error
    except (RasterioError, ValueError, OSError, MemoryError) as error:
        return WorldFileError(f"cannot be read as a raster ({' '.join(str(error).split())[:120]})")


def _placed(source: Any) -> tuple[float, float, float, float, float, float]:
    """Where a raster of rasterio lies, by its transformation, or by its ground control points.

    Raises:
        WorldFileError: by neither, or the points do not lie on a grid.
    """
    from rasterio.transform import from_gcps

    if not source.transform.is_identity:
        return tuple(source.transform)[:6]
    points = source.gcps[0]
    if len(points) < LEAST_POINTS:
        raise WorldFileError(
            "says not where it lies (no tie point, no transformation); get it with its place"
        )
    a, b, c, d, e, f = tuple(from_gcps(points))[:6]
    off = [
        math.hypot(a * each.col + b * each.row + c - each.x, d * each.col + e * each.row + f - each.y)
        for each in points
    ]
    if not max(off) <= 0.5 * math.sqrt(abs(a * e - b * d)):
        raise WorldFileError(
            "has ground control points that do not lie on a grid; warp it, as with gdalwarp, and give the result"
        )
    return a, b, c, d, e, f
