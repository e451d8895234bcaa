"""Terrain as plain grids: ESRI ASCII, SRTM .hgt, and the NumPy archive that matplotlib's wheel brings along."""

from __future__ import annotations

import codecs
import gzip
import math
import re
import zlib
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.world_files.bounded import UTF_16, read_bytes, text_of, unzipped
from harness.world_files.parts import WGS84, Contents, FloatArray, Raster, Reading, WorldFileError
from harness.world_files.plane import flat_crs
from harness.world_files.readers.geotiff import check_cells, plausible

SIDES: Final = {2 * n * n: n for n in (1201, 3601)}
"""Bytes of an SRTM tile: samples a side; rows and columns on its edges are shared with its neighbours."""
VOID: Final = -32768
_TILE: Final = re.compile(r"([NS])(\d{2})_?([EW])(\d{3})", re.IGNORECASE)
_HEADER: Final = re.compile(r"\s*([A-Za-z_]+)\s+(\S+)[ \t]*\r?\n")
_SPACE: Final = re.compile(rb"\s")
MAX_MEMBER_BYTES: Final = 500_000_000
MAX_HEADER_BYTES: Final = 100_000
PIECE_BYTES: Final = 16_000_000
"""Of the text of a grid, made into numbers at a time."""


def read_ascii(path: Path, reading: Reading) -> Contents:
    """Reads an ESRI ASCII grid. It says not where on earth it lies: without `crs` it has a plane of its own.

    Raises:
        WorldFileError: it is not whole.
    """
    data = read_bytes(path).removeprefix(codecs.BOM_UTF8)
    text = text_of(data if data.startswith(UTF_16) else data[:MAX_HEADER_BYTES])
    keys: dict[str, float] = {}
    place = 0
    while match := _HEADER.match(text, place):
        try:
            keys[match[1].lower()] = float(match[2])
        except ValueError as error:
            raise WorldFileError(f"has {match[1]} {match[2][:20]!r}; must be a number") from error
        place = match.end()
    missing = [name for name in ("ncols", "nrows") if name not in keys]
    dx, dy = keys.get("cellsize", keys.get("dx", 0.0)), keys.get("cellsize", keys.get("dy", 0.0))
    if missing or not (dx > 0 and dy > 0 and keys["ncols"] >= 1 and keys["nrows"] >= 1):
        raise WorldFileError(
            f"has no {' and '.join(missing) or 'positive cellsize'}; must be an ESRI ASCII grid"
        )
    for name in ("ncols", "nrows"):
        if not keys[name].is_integer():
            raise WorldFileError(f"has {name} {keys[name]:g}; must be a whole number")
    columns, rows = int(keys["ncols"]), int(keys["nrows"])
    check_cells(rows, columns)
    if data.startswith(UTF_16):
        data, place = text[place:].encode(), 0
    values = _heights(data, len(text[:place].encode()), rows * columns)
    values[values == keys.get("nodata_value", -9999.0)] = np.nan
    west = keys.get("xllcorner", keys.get("xllcenter", 0.0) - (dx / 2 if "xllcenter" in keys else 0.0))
    south = keys.get("yllcorner", keys.get("yllcenter", 0.0) - (dy / 2 if "yllcenter" in keys else 0.0))
    crs = reading.crs or _beside(path)
    if crs is None and dx < 0.1 and abs(west) <= 180 and abs(south) <= 90 and west != 0.0:
        crs = WGS84
    if crs is None and reading.metres_per_cell:
        scale = reading.metres_per_cell / dx
        dx, dy, west, south = scale * dx, scale * dy, scale * west, scale * south
    raster = Raster(plausible(values.reshape(rows, columns)), (dx, 0.0, west, 0.0, -dy, south + rows * dy))
    notes = (
        () if crs else ("names no place on earth: its metres are taken as they are (crs, metres_per_cell)",)
    )
    return Contents("ascii_grid", crs, terrain=raster, notes=notes)


def _heights(data: bytes, begin: int, count: int) -> FloatArray:
    """(count,) numbers in a text from one of its bytes on, read in pieces.

    Raises:
        WorldFileError: there are more or fewer, or something else.
    """
    values, found = np.empty(count), 0
    while begin < len(data):
        space = _SPACE.search(data, begin + PIECE_BYTES)
        end = space.start() if space else len(data)
        piece = data[begin:end].strip()
        begin = end
        try:
            numbers = np.fromstring(piece, dtype=np.float64, sep=" ") if piece else np.zeros(0)
        except ValueError as error:
            raise WorldFileError("has something that is no number among its heights") from error
        if found + len(numbers) <= count:
            values[found : found + len(numbers)] = numbers
        found += len(numbers)
    if found != count:
        raise WorldFileError(f"has {found:,} heights; nrows times ncols are {count:,}: it may be torn")
    return values


def _beside(path: Path) -> str | None:
    """The coordinate reference system of a file `.prj` of the same name, as GIS programs write it."""
    beside = next(
        (each for each in (path.with_suffix(".prj"), path.with_suffix(".PRJ")) if each.is_file()), None
    )
    if beside is None:
        return None
    text = text_of(read_bytes(beside, 100_000)).strip()
    try:
        flat_crs(text)
    except WorldFileError as error:
        raise WorldFileError(
            f"has {beside.name} beside it, which names no system that is known; give crs"
        ) from error
    return text


def read_srtm(path: Path, reading: Reading) -> Contents:
    """Reads an SRTM tile, also packed as .zip or .gz. Its name says which degree it covers.

    Raises:
        WorldFileError: it has another size or name, or is damaged.
    """
    data, name = read_bytes(path), path.name
    if data[:2] == b"PK":
        name, data, _ = unzipped(data, ".hgt", max(SIDES))
        name = name if _TILE.search(name) else path.name
    elif data[:2] == b"\x1f\x8b":
        try:
            with gzip.GzipFile(fileobj=BytesIO(data)) as packed:
                data = packed.read(max(SIDES) + 1)
        except (OSError, EOFError, zlib.error) as error:
            raise WorldFileError("is a damaged .gz file; get it again") from error
    tile = _TILE.search(name)
    if tile is None:
        raise WorldFileError("is an SRTM tile by its ending; its name must say where it lies, as N46E009.hgt")
    if len(data) not in SIDES:
        raise WorldFileError(
            f"has {len(data):,} bytes; an SRTM tile has {' or '.join(f'{size:,}' for size in SIDES)}: it may be torn"
        )
    side = SIDES[len(data)]
    values = np.frombuffer(data, dtype=">i2").reshape(side, side).astype(np.float64)
    values[values == VOID] = np.nan
    south = float(tile[2]) * (1 if tile[1].upper() == "N" else -1)
    west = float(tile[4]) * (1 if tile[3].upper() == "E" else -1)
    step = 1.0 / (side - 1)  # samples lie on the degrees themselves
    affine = (step, 0.0, west - step / 2, 0.0, -step, south + 1.0 + step / 2)
    return Contents("srtm", WGS84, terrain=Raster(plausible(values), affine))


def read_numpy(path: Path, reading: Reading) -> Contents:
    """Reads a NumPy archive: `elevation` in rows from the north; xmin, xmax, ymin, ymax of its edges in degrees.

    matplotlib's `jacksboro_fault_dem.npz` is one; there ymin is the northern edge.

    Raises:
        WorldFileError: something is missing or of another shape.
    """
    from numpy.lib import format as numpy_format

    data = read_bytes(path)
    arrays: dict[str, Any] = {}
    for key in ("elevation", "xmin", "xmax", "ymin", "ymax"):
        name, member, _ = unzipped(data, f"{key}.npy", MAX_MEMBER_BYTES)
        try:
            stream = BytesIO(member)
            version = numpy_format.read_magic(stream)
            read = (
                numpy_format.read_array_header_1_0
                if version == (1, 0)
                else numpy_format.read_array_header_2_0
            )
            shape, _, kind = read(stream)
            if kind.hasobject or math.prod(shape) * kind.itemsize > MAX_MEMBER_BYTES:
                raise WorldFileError(f"has {name} of {kind} {shape}; must be numbers")
            arrays[key] = np.load(BytesIO(member), allow_pickle=False).astype(np.float64)
        except (ValueError, TypeError, EOFError) as error:
            if isinstance(error, WorldFileError):
                raise
            raise WorldFileError(f"has a damaged {name}") from error
    values = arrays["elevation"]
    if (
        values.ndim != 2
        or not values.size
        or any(arrays[key].size != 1 for key in arrays if key != "elevation")
    ):
        raise WorldFileError(
            "must have elevation in rows and columns, and single numbers xmin, xmax, ymin, ymax"
        )
    check_cells(*values.shape)
    xs: FloatArray = np.sort([float(arrays["xmin"]), float(arrays["xmax"])])
    ys: FloatArray = np.sort([float(arrays["ymin"]), float(arrays["ymax"])])
    if not (xs[0] < xs[1] and ys[0] < ys[1] and abs(xs).max() <= 180 and abs(ys).max() <= 90):
        raise WorldFileError("must have xmin, xmax, ymin and ymax in degrees, and span an area")
    rows, columns = values.shape
    affine = ((xs[1] - xs[0]) / columns, 0.0, xs[0], 0.0, -(ys[1] - ys[0]) / rows, ys[1])
    return Contents("numpy_dem", reading.crs or WGS84, terrain=Raster(plausible(values), affine))
