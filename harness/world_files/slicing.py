"""What of a file's parts is solid at one altitude: polygons in the local plane.

A part is solid where it reaches into the band from altitude less to altitude plus the vertical clearance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely

from harness.files.wording import counted
from harness.world_files.cells import outlines
from harness.world_files.height_field import HeightField
from harness.world_files.parts import Box, Datum, FloatArray, Part, WorldFileError
from harness.world_files.plane import Mapping


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
    """What is known of the ground: terrain of the files, and the height where there is none.

    Zones with limits above ground are cut to the area `known_in` where there is terrain.
    """

    field: HeightField | None
    flat_m: float | None
    known_in: Box


def sliced_parts(
    parts: Sequence[Part], mapping: Mapping, band: HeightBand, ground: KnownGround, box: Box
) -> list[Solid]:
    """What of the parts of one file is solid in a band, in the plane and near a box."""
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
    if _is_out(part, band):
        return []
    on_ground = Datum.GROUND in (part.bottom.datum, part.top.datum)
    if on_ground and ground.field is not None and not part.rigid:
        shape = shapely.intersection(shape, shapely.box(*ground.known_in))
        if shape.is_empty:
            return []
    heights, corner = _ground_below(part, shape, ground) if on_ground else (np.zeros((1, 1)), (0.0, 0.0))
    if not (heights.size and np.isfinite(heights).all()):
        return None
    lows, tops = (each.height_m + heights * (each.datum is Datum.GROUND) for each in (part.bottom, part.top))
    solid = Solid(shape, float(lows.min()), float(tops.max()))
    mask = (lows <= band.high_m) & (tops >= band.low_m)
    if part.rigid:  # it stands level, as low and as high as its limits are anywhere
        mask = np.array([[solid.low_m <= band.high_m]]) & (solid.high_m >= band.low_m)
    if ground.field is None or len(np.unique(mask)) == 1:
        return [solid] * bool(mask.all())
    spacing = ground.field.spacing_m
    placed = shapely.transform(outlines(mask)[0], lambda p: p * spacing + corner)
    return [solid._replace(shape=shapely.intersection(shape, shapely.union_all(placed)))]


def _is_out(part: Part, band: HeightBand) -> bool:
    """Whether a part lies above or below a band, whatever the ground."""
    above = part.bottom.datum is Datum.SEA and part.bottom.height_m > band.high_m
    return above or (part.top.datum is Datum.SEA and part.top.height_m < band.low_m)


def _ground_below(part: Part, shape: Any, ground: KnownGround) -> tuple[FloatArray, tuple[float, float]]:
    """Heights of the ground below a part, NaN where it is not known; and the first corner of their cells.

    Of what is rigid at its corners, of which some may lie outside of the terrain.
    """
    heights, corner = np.array([[math.nan]]), (0.0, 0.0)
    if ground.field is not None and part.rigid:
        heights = ground.field.at(*shapely.get_coordinates(shape).T)
        heights = heights[np.isfinite(heights)]
    elif ground.field is not None:
        heights, corner = _nodes_under(ground.field, shapely.bounds(shape).tolist())
    if ground.flat_m is not None:
        heights = np.where(np.isfinite(heights), heights, ground.flat_m)
    return heights, corner


def _nodes_under(field: HeightField, bounds: list[float]) -> tuple[FloatArray, tuple[float, float]]:
    """Nodes whose cells (the node in the middle) cover a box, NaN beyond the field; and the first corner."""
    (east, north), (right, up) = field.corner_m, field.spacing_m
    columns, rows = (
        np.arange(math.floor((low - first) / step + 0.5), math.floor((high - first) / step + 0.5) + 1)
        for low, high, first, step in ((*bounds[::2], east, right), (*bounds[1::2], north, up))
    )
    heights = field.at(*np.meshgrid(east + right * columns, north + up * rows))
    return heights, (east + (columns[0] - 0.5) * right, north + (rows[0] - 0.5) * up)
