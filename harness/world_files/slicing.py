"""What of a file's parts is solid at one altitude: polygons in the local plane.

A part is solid where it reaches into the band from altitude less to altitude plus the vertical clearance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from harness.files.wording import counted
from harness.world_files.cells import outlines
from harness.world_files.height_field import HeightField
from harness.world_files.parts import BoolArray, Datum, FloatArray, Limit, Part, Raster, WorldFileError
from harness.world_files.plane import Mapping

LONGEST_EDGE_CELLS: Final = 64
"""Outlines of cells are bent into the plane with a point at least this often: to a hundredth of a cell."""
MAX_WINDOW_CELLS: Final = 40_000_000
PROBES: Final = 5
"""Places a side at which the ground below a building is looked up, besides its corners."""

Box = tuple[float, float, float, float]
"""xmin, ymin, xmax, ymax."""


class Solid(NamedTuple):
    """A polygon in the plane, and the heights between which it is solid somewhere."""

    shape: Any
    low_m: float
    high_m: float


@dataclass(frozen=True)
class HeightBand:
    """The heights in which the aircraft may be.

    Attributes:
        low_m: altitude less vertical clearance, above mean sea level.
        high_m: altitude plus vertical clearance.
    """

    low_m: float
    high_m: float


@dataclass(frozen=True)
class KnownGround:
    """What is known of the ground.

    Attributes:
        field: terrain of the files, None without.
        flat_m: height where there is no terrain; None: not known.
        known_in: the area: zones with limits above ground are cut to it where there is terrain.
    """

    field: HeightField | None = None
    flat_m: float | None = None
    known_in: Box = (-1e9, -1e9, 1e9, 1e9)


def sliced_parts(
    parts: Sequence[Part], mapping: Mapping, band: HeightBand, ground: KnownGround, box: Box
) -> list[Solid]:
    """Pieces, in the plane and cut to a box, of what is solid in a band.

    Args:
        parts: of one file.
        mapping: of its coordinates to the plane.
        band: heights of the aircraft.
        ground: for limits above ground.
        box: nothing outside matters.

    Raises:
        WorldFileError: a limit above ground decides, and the ground is not known there.
    """
    import shapely

    if not parts:
        return []
    shapes = mapping.geometries(np.array([part.footprint for part in parts], dtype=object))
    window = shapely.box(*box)
    finite = np.isfinite(shapely.bounds(shapes)).all(axis=1)
    keep_in = np.array([part.keep_in for part in parts])
    near = finite & (keep_in | shapely.intersects(shapes, window))
    solid: list[Solid] = []
    unknown: list[str] = []
    for index in np.flatnonzero(near).tolist():
        part, shape = parts[index], shapes[index]
        if part.keep_in:
            shape = shapely.difference(window, shape)
        try:
            solid += _solid(part, shape, band, ground)
        except _GroundUnknown:
            unknown.append(part.name)
    if unknown:
        names = ", ".join(dict.fromkeys(name for name in unknown if name)) or "one without a name"
        raise WorldFileError(
            f"has {counted(len(unknown), 'part')} with limits above ground ({names[:60]}), and the ground there is not "
            "known; give a terrain file too, or ground_m (--ground-m)"
        )
    return _clipped(solid, window)


class _GroundUnknown(Exception):
    """A limit above ground where no ground is known."""


def _clipped(solids: Sequence[Solid], window: Any) -> list[Solid]:
    """Valid polygons of what lies in a window, each with the heights of what it is a piece of."""
    import shapely

    if not solids:
        return []
    valid = np.array([each.shape for each in solids], dtype=object)
    bad = ~shapely.is_valid(valid)
    valid[bad] = shapely.make_valid(valid[bad], method="structure", keep_collapsed=False)
    across = ~shapely.contains_properly(window, valid)
    valid[across] = shapely.intersection(valid[across], window)
    pieces, of = shapely.get_parts(valid, return_index=True)
    return [
        Solid(piece, *solids[index][1:])
        for piece, index in zip(pieces, of.tolist(), strict=True)
        if piece.geom_type == "Polygon" and piece.area > 0
    ]


def _solid(part: Part, shape: Any, band: HeightBand, ground: KnownGround) -> list[Solid]:
    """A part as far as it reaches into the band."""
    low, high = part.bottom, part.top
    above_ground = [limit for limit in (low, high) if limit.datum is Datum.GROUND]
    if not above_ground:
        inside = low.height_m <= band.high_m and high.height_m >= band.low_m
        return [Solid(shape, low.height_m, high.height_m)] if inside else []
    # What the other limit rules out needs no ground.
    if (low.datum is Datum.SEA and low.height_m > band.high_m) or (
        high.datum is Datum.SEA and high.height_m < band.low_m
    ):
        return []
    if ground.field is None:
        if ground.flat_m is None:
            raise _GroundUnknown
        low_m, high_m = _height(low, ground.flat_m), _height(high, ground.flat_m)
        return [Solid(shape, low_m, high_m)] if low_m <= band.high_m and high_m >= band.low_m else []
    return _on_terrain(part, shape, band, ground, ground.field)


def _height(limit: Limit, ground_m: float) -> float:
    return limit.height_m + (ground_m if limit.datum is Datum.GROUND else 0.0)


def _on_terrain(
    part: Part, shape: Any, band: HeightBand, ground: KnownGround, field: HeightField
) -> list[Solid]:
    """A part that stands on, or follows, terrain; limits are taken where they make it largest."""
    import shapely

    corner = (0.0, 0.0)
    if part.rigid:
        heights = _probed(field, shape)
    else:
        shape = shapely.intersection(shape, shapely.box(*ground.known_in))
        if shape.is_empty:
            return []
        heights, corner = _nodes_under(field, shapely.bounds(shape).tolist())
    if ground.flat_m is not None:
        heights = np.where(np.isfinite(heights), heights, ground.flat_m)
    if not heights.size or not np.isfinite(heights).all():
        raise _GroundUnknown
    lows, tops = (
        limit.height_m + (heights if limit.datum is Datum.GROUND else 0.0 * heights)
        for limit in (part.bottom, part.top)
    )
    solid = Solid(shape, float(lows.min()), float(tops.max()))
    mask = (lows <= band.high_m) & (tops >= band.low_m)
    if part.rigid or mask.all():
        return [solid] if solid.low_m <= band.high_m and solid.high_m >= band.low_m else []
    if not mask.any():
        return []
    cells, _ = outlines(mask)
    (west, south), (right, up) = corner, field.spacing_m
    placed = shapely.transform(cells, lambda p: p * (right, up) + (west, south))
    return [solid._replace(shape=shapely.intersection(shape, shapely.union_all(placed)))]


def _nodes_under(field: HeightField, bounds: list[float]) -> tuple[FloatArray, tuple[float, float]]:
    """Nodes whose cells (the node in the middle) cover a box, NaN beyond the field; and the first corner."""
    (east, north), (right, up) = field.corner_m, field.spacing_m
    rows, columns = field.heights_m.shape
    left, low = math.floor((bounds[0] - east) / right + 0.5), math.floor((bounds[1] - north) / up + 0.5)
    last, top = math.floor((bounds[2] - east) / right + 0.5), math.floor((bounds[3] - north) / up + 0.5)
    corner = (east + (left - 0.5) * right, north + (low - 0.5) * up)
    if (top - low + 1) * (last - left + 1) > MAX_WINDOW_CELLS:
        return np.zeros((0, 0)), corner
    heights = np.full((top - low + 1, last - left + 1), np.nan)
    row_from, row_to = max(low, 0), min(top + 1, rows)
    column_from, column_to = max(left, 0), min(last + 1, columns)
    if row_from < row_to and column_from < column_to:
        inside = field.heights_m[row_from:row_to, column_from:column_to]
        heights[row_from - low : row_to - low, column_from - left : column_to - left] = inside
    return heights, corner


def _probed(field: HeightField, shape: Any) -> FloatArray:
    """Heights of the ground below a small shape: at its corners and at places inside."""
    import shapely

    xmin, ymin, xmax, ymax = shapely.bounds(shape)
    grid = np.meshgrid(np.linspace(xmin, xmax, PROBES), np.linspace(ymin, ymax, PROBES))
    east, north = grid[0].ravel(), grid[1].ravel()
    inside = shapely.contains_xy(shape, east, north)
    corners = shapely.get_coordinates(shape)
    heights = field.at(np.append(corners[:, 0], east[inside]), np.append(corners[:, 1], north[inside]))
    return heights[np.isfinite(heights)]  # a building may stand half outside of the terrain


def sliced_cells(raster: Raster, solid: BoolArray, mapping: Mapping, box: Box) -> tuple[list[Any], int]:
    """Outlines, in the plane and cut to a box, of cells that are solid; and how many a side were taken together.

    Args:
        raster: gives the places of the cells.
        solid: (rows, columns) which are solid.
        mapping: of the file's coordinates to the plane.
        box: nothing outside matters.
    """
    import shapely

    rows, columns = window_of(raster, mapping, box)
    polygons, factor = outlines(solid[rows, columns])
    first_column, first_row = columns.start, rows.start

    def place(points: FloatArray) -> FloatArray:
        x, y = raster.places(points[:, 0] + first_column, points[:, 1] + first_row)
        return np.column_stack(mapping.to_plane(x, y))

    dense = (
        shapely.segmentize(np.array(polygons, dtype=object), LONGEST_EDGE_CELLS) if mapping.crs else polygons
    )
    placed = shapely.transform(np.array(dense, dtype=object), place)
    return [each.shape for each in _clipped([Solid(s, 0.0, 0.0) for s in placed], shapely.box(*box))], factor


def window_of(raster: Raster, mapping: Mapping, box: Box) -> tuple[slice, slice]:
    """Rows and columns that cover a box of the plane."""
    xmin, ymin, xmax, ymax = box
    share = np.linspace(0.0, 1.0, 33)
    east = np.concatenate(
        (xmin + share * (xmax - xmin), np.full(33, xmax), xmin + share * (xmax - xmin), np.full(33, xmin))
    )
    north = np.concatenate(
        (np.full(33, ymin), ymin + share * (ymax - ymin), np.full(33, ymax), ymin + share * (ymax - ymin))
    )
    column, row = raster.cells(*mapping.from_plane(east, north, raster.middle_x))
    spans = []
    for places, size in ((row, raster.values.shape[0]), (column, raster.values.shape[1])):
        known = places[np.isfinite(places)]
        low, high = (known.min(), known.max()) if len(known) else (0.0, 0.0)
        begin = int(np.clip(math.floor(np.clip(low, -1e9, 1e9)) - 2, 0, size))
        spans.append(slice(begin, max(int(np.clip(math.ceil(np.clip(high, -1e9, 1e9)) + 2, 0, size)), begin)))
    return spans[0], spans[1]
