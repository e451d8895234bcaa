"""Occupancy maps: ROS map_server, MovingAI benchmark maps."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.files import strict_yaml
from harness.files.input_file import InputError
from harness.world_files.bounded import read_bytes, text_of
from harness.world_files.parts import Contents, FileSpec, FloatArray, Raster
from harness.world_files.readers import raster

FREE_CELLS, BLOCKED_CELLS = b".GS", b"@OTW"
"""Ground and shallow water are free; out of bounds, trees and deep water block (MovingAI format, Sturtevant, 2012)."""
MODES: Final = ("trinary", "scale")  # modes of ROS map_server in which a grey tells what a cell is
WHITE: Final = re.compile(rb"P[256](?:(?:\s|#.*\n)+(\d+)){3}")  # matches a PGM or PPM by the number for white
IMAGES: Final = {b"P": "PNM", b"\x89": "PNG"}  # GDAL's driver of an image by its first byte


def read_moving_ai(spec: FileSpec) -> Contents:
    """Reads a MovingAI map; a cell is as large as `metres_per_cell` says, else one metre."""
    text = text_of(read_bytes(spec.path))
    side = r"\s*(height|width)\s+(\d{1,9})\s*\n"
    head = re.match(rf"type.*\n{side}{side}\s*map\s*\n", text)
    if head is None or head[1] == head[3]:
        raise InputError("has no height, width and `map`; must be a MovingAI map")
    sizes = {head[1]: int(head[2]), head[3]: int(head[4])}
    rows, columns = sizes["height"], sizes["width"]
    body = [line.encode("latin-1", "replace") for line in text[head.end() :].rstrip().splitlines()]
    wrong = next((number for number, line in enumerate(body) if len(line) != columns), len(body))
    if not len(body) == wrong == rows or not rows * columns:
        line = text.count("\n", 0, head.end()) + min(wrong, rows) + 1
        raise InputError(f"has no row of {columns} cells in line {line}, of {rows} rows: it may be torn")
    cells = np.frombuffer(b"".join(body), dtype=np.uint8).reshape(rows, columns)
    if strange := set(np.unique(cells).tolist()) - set(FREE_CELLS + BLOCKED_CELLS):
        raise InputError(f"has the cell {chr(min(strange))!r}; must be one of . G S @ O T W")
    occupied = np.isin(cells, list(BLOCKED_CELLS)).astype(np.float64)
    size = spec.metres_per_cell or 1.0
    notes = () if spec.metres_per_cell else ("says not how large a cell is: 1 m (metres_per_cell)",)
    return Contents(None, raster=Raster(occupied, (size, 0, 0, 0, -size, rows * size), True), notes=notes)


def read_ros(spec: FileSpec) -> Contents:
    """Reads a map of ROS map_server: a YAML file and the image that it names.

    Occupied and free are distinguished as map_server does: p = (255 - grey) / 255, or grey / 255 if `negate`; above
    `occupied_thresh` a cell is occupied, below `free_thresh` free, else unknown. The mode `scale` has whole percents
    between the thresholds: 100 is occupied, too, and 0 free.
    """
    keys = strict_yaml.parse(text_of(read_bytes(spec.path, 100_000)), "line").plain()
    if not isinstance(keys, dict) or not isinstance(keys.get("image"), str):
        raise InputError("names no image; must be a map of ROS map_server")
    mode, size = str(keys.get("mode", "trinary")).lower(), keys.get("resolution", 0.0)
    origin = keys.get("origin", (0.0, 0.0, 0.0))
    occupied, free = keys.get("occupied_thresh", 0.65), keys.get("free_thresh", 0.25)
    negate = keys.get("negate", 0)
    for name, value, known in (("mode", mode, MODES), ("negate", negate, (0, 1))):
        if value not in known:
            text = f"has the {name} {str(value)[:20]!r}; must be one of {', '.join(map(str, known))}"
            raise InputError(text)
    if not _are_numbers((size, occupied, free), least=0.0) or size == 0 or max(occupied, free) > 1:
        text = f"the resolution {size} and the thresholds {occupied}, {free}"
        raise InputError(f"has {text}; must be metres above 0, and shares between 0 and 1")
    if not isinstance(origin, tuple) or len(origin) not in (2, 3) or not _are_numbers(origin):
        raise InputError("has an origin that is not [x, y, yaw]")
    if mode == "scale":
        occupied, free = (free + percent / 100.0 * (occupied - free) for percent in (99.5, 0.5))
    share = np.abs(_greys(spec.path.parent / keys["image"]) - (not negate))
    solid = np.where(share > occupied, 1.0, np.where(share < free, 0.0, np.nan))
    # The lower left corner is given, and the map is turned counter-clockwise about it by `yaw` radians.
    x, y, yaw = (*origin, 0.0)[:3]
    cell = spec.metres_per_cell or size
    west, south, rows = x * cell / size, y * cell / size, len(solid)
    cos, sin = cell * math.cos(yaw), cell * math.sin(yaw)
    return Contents(None, raster=Raster(solid, (cos, sin, west - rows * sin, sin, -cos, south + rows * cos), True))


def _greys(path: Path) -> FloatArray:
    """Returns the (rows, columns) greys of an image, from 0 to 1; a colour counts as the mean of its bands."""
    try:
        data = read_bytes(path)
        with raster.opened(path, IMAGES.get(data[:1], "PNM")) as source:
            if source.colorinterp[0].name == "palette" or source.count in (2, 4):
                raise InputError("has a palette or is not opaque; save it as plain grey PGM or PNG")
            greys: FloatArray = source.read()
            bits = source.tags(1, ns="IMAGE_STRUCTURE").get("NBITS") or greys.dtype.itemsize * 8
            white = WHITE.match(data)
            if not (b"IEND" in data if white is None else len(data) > white.end() + greys.nbytes):
                raise InputError("is torn")
            return np.asarray(greys.mean(axis=0) / (float(white[1]) if white else 2.0 ** int(bits) - 1.0))
    except InputError as error:
        if "pip install" in str(error):
            raise
        text, wanted = str(error).partition(";")[0], "must be grey PNG, or PGM in bytes (P5)"
        raise InputError(f"names the image {path.name}: {text}; {wanted}") from error


def _are_numbers(values: Sequence[Any], least: float = -math.inf) -> bool:
    return all(type(value) in (int, float) and math.isfinite(value) and value >= least for value in values)
