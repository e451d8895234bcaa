"""Terrain of files as one height field in the local plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from harness.world_files.cells import window_of
from harness.world_files.height_field import HeightField, bilinear
from harness.world_files.parts import Box, Raster
from harness.world_files.plane import Mapping

MOST_NODES: Final = 1_000_000
"""More than these make the field coarser than the file, which is told."""


def height_field(sources: Sequence[tuple[Raster, Mapping]], box: Box) -> tuple[HeightField | None, list[str]]:
    """The ground in a box of the plane, at about the file's own spacing; and what there is to say of it.

    A height is bilinear between the middles of the file's cells, and that of the next middle within half a cell of the
    edge. Of several files the first that knows a place counts.

    Args:
        sources: rasters of heights, each with the mapping of its coordinates to the plane.
        box: of the plane.

    Returns:
        None where no file reaches into the box.
    """
    known = [each for each in (_spacing(raster, mapping, box) for raster, mapping in sources) if each]
    if not known:
        return None, []
    xmin, ymin, xmax, ymax = box
    right, up = (_rounded(min(each[k] for each in known)) for k in (0, 1))
    notes = []
    nodes = ((xmax - xmin) / right + 1) * ((ymax - ymin) / up + 1)
    if nodes > MOST_NODES:
        factor = math.ceil(math.sqrt(nodes / MOST_NODES))
        right, up = factor * right, factor * up
        notes.append(f"the ground is kept every {right:g} m, coarser than the file: its area is large")
    columns, rows = int((xmax - xmin) / right) + 2, int((ymax - ymin) / up) + 2
    east, north = np.meshgrid(xmin + right * np.arange(columns), ymin + up * np.arange(rows))
    heights = np.full(rows * columns, np.nan)
    for raster, mapping in sources:
        missing = np.flatnonzero(np.isnan(heights))
        x, y = mapping.from_plane(east.ravel()[missing], north.ravel()[missing], raster.middle_x)
        places = raster.cells(x, y)
        sizes = raster.values.shape[::-1]
        inside = np.logical_and(*((p >= 0) & (p <= size) for p, size in zip(places, sizes, strict=True)))
        column, row = (np.clip(p - 0.5, 0.0, size - 1.0) for p, size in zip(places, sizes, strict=True))
        heights[missing[inside]] = bilinear(raster.values, column[inside], row[inside])
    if not np.isfinite(heights).any():
        return None, []
    return HeightField((xmin, ymin), (right, up), heights.reshape(rows, columns)), notes


def _spacing(raster: Raster, mapping: Mapping, box: Box) -> tuple[float, float] | None:
    """Sides of a cell in metres, in the middle of what lies in the box; None where nothing does."""
    rows, columns = window_of(raster, mapping, box)
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return None
    return cell_sides(raster, mapping, 0.5 * (columns.start + columns.stop), 0.5 * (rows.start + rows.stop))


def cell_sides(raster: Raster, mapping: Mapping, column: float, row: float) -> tuple[float, float] | None:
    """Lengths in the plane of the two sides of a cell, metres; None where its place has none."""
    x, y = raster.places(column + np.array([0.0, 1.0, 0.0]), row + np.array([0.0, 0.0, 1.0]))
    east, north = mapping.to_plane(x, y)
    sides = np.hypot(east[1:] - east[0], north[1:] - north[0]).tolist()
    return (sides[0], sides[1]) if np.isfinite(sides).all() else None


def _rounded(spacing_m: float) -> float:
    """Down to two digits."""
    digits = 1 - math.floor(math.log10(spacing_m))
    return math.floor(spacing_m * 10.0**digits) / 10.0**digits
