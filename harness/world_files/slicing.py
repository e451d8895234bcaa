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
from harness.world_files.parts import Box, Datum, FloatArray, Part, WorldFileError
from harness.world_files.plane import Mapping

PROBES: Final = 5
"""Places a side at which the ground below a building is looked up, besides its corners."""


class Solid(NamedTuple):
    """A polygon in the plane, and the heights between which it is solid somewhere."""

    shape: Any
    low_m: float
    high_m: float


class HeightBand(NamedTuple):
    """The heights above mean sea level in which the aircraft may be."""

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

    field: HeightField | None
    flat_m: float | None
    known_in: Box


def sliced_parts(
    parts: Sequence[Part], mapping: Mapping, band: HeightBand, ground: KnownGround, box: Box
) -> list[Solid]:
    """What of the parts of one file is solid in a band, in the plane and near a box.

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
        found = _solid(part, shape, band, ground)
        if found is None:
            unknown.append(part.name)
        else:
            solid += found
    if unknown:
        names = ", ".join(dict.fromkeys(name for name in unknown if name)) or "one without a name"
        raise WorldFileError(
            f"has {counted(len(unknown), 'part')} with limits above ground ({names[:60]}), and the ground there is not "
            "known; give a terrain file too, or ground_m (--ground-m)"
        )
    return solid


def clipped(solids: Sequence[Solid], box: Box) -> list[Solid]:
    """Valid polygons of what lies in a box, each with the heights of what it is a piece of."""
    import shapely

    window = shapely.box(*box)
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


def _solid(part: Part, shape: Any, band: HeightBand, ground: KnownGround) -> list[Solid] | None:
    """A part as far as it reaches into the band, where its limits make it largest; None: the ground is not known."""
    import shapely

    sea_low = part.bottom.height_m if part.bottom.datum is Datum.SEA else -math.inf
    sea_high = part.top.height_m if part.top.datum is Datum.SEA else math.inf
    if sea_low > band.high_m or sea_high < band.low_m:  # whatever the ground
        return []
    field, heights, corner = ground.field, np.zeros((1, 1)), (0.0, 0.0)
    on_ground = Datum.GROUND in (part.bottom.datum, part.top.datum)
    if on_ground and field is None:
        heights = np.array([[math.nan]])
    elif on_ground and field is not None and part.rigid:
        heights = _probed(field, shape)
    elif on_ground and field is not None:
        shape = shapely.intersection(shape, shapely.box(*ground.known_in))
        if shape.is_empty:
            return []
        heights, corner = _nodes_under(field, shapely.bounds(shape).tolist())
    if ground.flat_m is not None:
        heights = np.where(np.isfinite(heights), heights, ground.flat_m)
    if not heights.size or not np.isfinite(heights).all():
        return None
    lows, tops = (
        limit.height_m + (heights if limit.datum is Datum.GROUND else 0.0 * heights)
        for limit in (part.bottom, part.top)
    )
    solid = Solid(shape, float(lows.min()), float(tops.max()))
    mask = (lows <= band.high_m) & (tops >= band.low_m)
    if part.rigid or mask.all() or field is None:
        return [solid] if solid.low_m <= band.high_m and solid.high_m >= band.low_m else []
    cells, _ = outlines(mask)
    placed = shapely.transform(cells, lambda p: p * field.spacing_m + corner)
    return [solid._replace(shape=shapely.intersection(shape, shapely.union_all(placed)))]


def _nodes_under(field: HeightField, bounds: list[float]) -> tuple[FloatArray, tuple[float, float]]:
    """Nodes whose cells (the node in the middle) cover a box, NaN beyond the field; and the first corner."""
    (east, north), (right, up) = field.corner_m, field.spacing_m
    columns, rows = (
        np.arange(math.floor((low - first) / step + 0.5), math.floor((high - first) / step + 0.5) + 1)
        for low, high, first, step in ((*bounds[::2], east, right), (*bounds[1::2], north, up))
    )
    heights = field.at(*np.meshgrid(east + right * columns, north + up * rows))
    return heights, (east + (columns[0] - 0.5) * right, north + (rows[0] - 0.5) * up)


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
