"""Occupancy maps: ROS map_server, MovingAI benchmark maps."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.files import strict_yaml
from harness.files.input_file import InputError
from harness.world_files.bounded import read_bytes, text_of
from harness.world_files.parts import (
    BoolArray,
    Contents,
    FloatArray,
    Raster,
    Reading,
    WorldFileError,
)
from harness.world_files.readers.geotiff import check_cells, strips

FREE: Final = frozenset(b".GS")
"""Ground, ground and shallow water of the MovingAI format (Sturtevant, Benchmarks for grid-based pathfinding, 2012)."""
BLOCKED: Final = frozenset(b"@OTW")
"""Out of bounds, trees and deep water."""
MODES: Final = ("trinary", "scale", "raw")
"""Of ROS map_server: how a grey becomes occupied, free or unknown."""


def read_moving_ai(path: Path, reading: Reading) -> Contents:
    """Reads a MovingAI map; a cell is as large as `metres_per_cell` says, else one metre.

    Raises:
        WorldFileError: it is not whole.
    """
    lines = text_of(read_bytes(path)).splitlines()
    head = dict(line.split(None, 1) for line in lines[:3] if len(line.split()) == 2)
    try:
        rows, columns = int(head["height"]), int(head["width"])
        begin = next(i for i, line in enumerate(lines[:10]) if line.strip() == "map") + 1
    except (KeyError, ValueError, StopIteration) as error:
        raise WorldFileError("has no height, width and `map`; must be a MovingAI map") from error
    body = [line.rstrip("\r\n").encode("latin-1", "replace") for line in lines[begin : begin + rows]]
    if len(body) != rows or any(len(line) != columns for line in body) or rows * columns == 0:
        raise WorldFileError(
            f"has {len(body)} rows, not all of {columns} cells; must have {rows}: it may be torn"
        )
    check_cells(rows, columns)
    cells = np.frombuffer(b"".join(body), dtype=np.uint8).reshape(rows, columns)
    strange = set(np.unique(cells).tolist()) - FREE - BLOCKED
    if strange:
        raise WorldFileError(f"has the cell {chr(min(strange))!r}; must be one of . G S @ O T W")
    occupied = np.isin(cells, list(BLOCKED)).astype(np.float64)
    size = reading.metres_per_cell or 1.0
    notes = () if reading.metres_per_cell else ("says not how large a cell is: 1 m (metres_per_cell)",)
    return Contents(
        "moving_ai", None, occupied=Raster(occupied, _from_corner(0.0, 0.0, size, rows)), notes=notes
    )


def read_ros(path: Path, reading: Reading) -> Contents:
    """Reads a map of ROS map_server: a YAML file and the image that it names.

    Occupied and free are told as map_server does: p = (255 - grey) / 255, or grey / 255 if `negate`; above
    `occupied_thresh` a cell is occupied, below `free_thresh` free, else unknown. In mode `raw` p = grey / 100, and
    above 100 nothing is known; in mode `scale` a cell that is not opaque is unknown.

    Raises:
        WorldFileError: it is not such a map, or its image cannot be read.
    """
    keys = _yaml(path)
    mode = str(keys.get("mode", "trinary")).lower()
    if mode not in MODES:
        raise WorldFileError(f"has the mode {mode[:20]!r}; must be one of {', '.join(MODES)}")
    size = _positive(keys, "resolution")
    origin = keys.get("origin", (0.0, 0.0, 0.0))
    if not (isinstance(origin, tuple) and len(origin) >= 2 and all(_is_number(each) for each in origin)):
        raise WorldFileError("has an origin that is not [x, y, yaw]")
    occupied_from, free_to = keys.get("occupied_thresh", 0.65), keys.get("free_thresh", 0.25)
    if not (_is_number(occupied_from) and _is_number(free_to)):
        raise WorldFileError("has thresholds that are no numbers")
    if not (0.0 <= occupied_from <= 1.0 and 0.0 <= free_to <= 1.0):
        raise WorldFileError(
            f"has the thresholds {occupied_from:g} and {free_to:g}; must be shares between 0 and 1"
        )
    negate = bool(keys.get("negate", 0))

    def solid_of(grey: FloatArray, opaque: BoolArray) -> FloatArray:
        known = opaque
        if mode == "raw":
            chance, known = grey / 100.0, known & (grey <= 100.0)
        else:
            chance = grey / 255.0 if negate else (255.0 - grey) / 255.0
        occupied, free = known & (chance > occupied_from), known & (chance < free_to)
        cells: FloatArray = occupied.astype(np.float64)
        cells[~occupied & ~free] = np.nan
        return cells

    solid = _image(path.parent / str(keys.get("image", "")), solid_of)
    scale = (reading.metres_per_cell or size) / size
    rows = solid.shape[0]
    affine = _from_corner(origin[0] * scale, origin[1] * scale, size * scale, rows)
    yaw = float(origin[2]) if len(origin) > 2 else 0.0
    if yaw:
        affine = _turned(affine, origin[0] * scale, origin[1] * scale, yaw)
    return Contents("ros_map", None, occupied=Raster(solid, affine))


def _image(path: Path, solid_of: Callable[[FloatArray, BoolArray], FloatArray]) -> FloatArray:
    """(rows, columns) cells of an image, by strips.

    Args:
        path: of the image.
        solid_of: cells from their grey (0 to 255, of colours the mean as map_server has it) and where they are opaque.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        data = read_bytes(path)
    except WorldFileError as error:
        raise WorldFileError(
            f"names the image {path.name}, which {str(error).partition(';')[0]}; lay it there"
        ) from error
    try:
        with Image.open(_stream(data), formats=["PPM", "PNG", "BMP", "JPEG"]) as image:
            columns, rows = image.size
            check_cells(rows, columns)
            solid = np.empty((rows, columns))
            for strip in strips(solid):
                solid[strip] = solid_of(*_greys(image.crop((0, strip.start, columns, strip.stop))))
            return solid
    except WorldFileError:
        raise
    except UnidentifiedImageError as error:
        raise WorldFileError(f"names the image {path.name}, which is no PGM, PNG, BMP or JPEG") from error
    except Exception as error:  # Pillow raises many kinds for damaged files
        raise WorldFileError(
            f"names the image {path.name}, which cannot be read ({str(error)[:80]})"
        ) from error


def _greys(image: Any) -> tuple[FloatArray, BoolArray]:
    """Grey from 0 to 255 of an image, and where it is opaque."""
    if image.mode in ("I", "I;16", "F"):
        grey = np.asarray(image, dtype=np.float64) / 257.0
    elif image.mode in ("L", "1"):
        grey = np.asarray(image.convert("L"), dtype=np.float64)
    else:
        grey = np.asarray(image.convert("RGB"), dtype=np.float64).mean(axis=2)
    opaque = np.ones(grey.shape, dtype=np.bool_)
    if "A" in image.convert("RGBA" if "transparency" in image.info else image.mode).getbands():
        opaque = np.asarray(image.convert("RGBA").getchannel("A")) == 255
    return grey, opaque


def _stream(data: bytes) -> Any:
    from io import BytesIO

    return BytesIO(data)


def _yaml(path: Path) -> dict[str, Any]:
    try:
        keys = strict_yaml.parse(text_of(read_bytes(path, 100_000)), "map").plain()
    except InputError as error:
        raise WorldFileError(str(error).removeprefix("map:")) from error
    if not isinstance(keys, dict) or not isinstance(keys.get("image"), str):
        raise WorldFileError("names no image; must be a map of ROS map_server")
    return keys


def _positive(keys: dict[str, Any], name: str) -> float:
    value = keys.get(name)
    if not _is_number(value) or not 0 < float(value) < 1e6:  # type: ignore[arg-type]
        raise WorldFileError(f"has no positive {name}; must be a map of ROS map_server")
    return float(value)  # type: ignore[arg-type]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _from_corner(
    west: float, south: float, size: float, rows: int
) -> tuple[float, float, float, float, float, float]:
    """Of a raster whose lower left corner is given."""
    return size, 0.0, west, 0.0, -size, south + rows * size


def _turned(
    affine: tuple[float, float, float, float, float, float], x0: float, y0: float, yaw: float
) -> tuple[float, float, float, float, float, float]:
    """The same, turned counter-clockwise about (x0, y0)."""
    a, b, c, d, e, f = affine
    cos, sin = math.cos(yaw), math.sin(yaw)
    c, f = c - x0, f - y0
    return (
        cos * a - sin * d,
        cos * b - sin * e,
        x0 + cos * c - sin * f,
        sin * a + cos * d,
        sin * b + cos * e,
        y0 + sin * c + cos * f,
    )
