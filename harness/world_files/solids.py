"""Polygons of what is solid at one altitude: parts and cells of files, placed in the plane; and simpler outlines.

Solid is what reaches into the band from altitude less to altitude plus vertical clearance. Outlines only grow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from typing import Any, Final, NamedTuple

import numpy as np
import shapely

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.world_files.height_field import HeightField, bilinear
from harness.world_files.parts import BoolArray, Box, Datum, FileSpec, FloatArray, Part, Raster
from harness.world_files.plane import Mapping

MAX_RUNS: Final = 400_000  # a mask of cells with more runs of solid cells along its rows than this is refused
STRIP_ROWS: Final = 256  # rasters are read in strips of this many rows, to save memory
LONGEST_EDGE_CELLS: Final = 64  # longer edges get points between, to bend with the plane to 0.01 cell
MOST_GROWTH: Final = 0.005  # filling a polygon's notches may add at most this share of its area
NOTCH_PASSES: Final = 3  # a polygon's notches are filled in this many passes
STRAIGHT_M: Final = 1e-9  # a corner no further than this from the line through its neighbours is dropped


class Solid(NamedTuple):
    """A polygon in the plane, and the heights between which it is solid somewhere."""

    shape: Any
    low_m: float
    high_m: float


class Layer(NamedTuple):
    """The altitudes (m, above mean sea level) that the aircraft may have, and what is known of the ground below.

    `field` is the files' terrain, `flat_m` the height without; where it is, zones above ground are cut to `known_in`.
    """

    low_m: float
    high_m: float
    field: HeightField | None
    flat_m: float | None
    known_in: Box


def sliced_parts(parts: Sequence[Part], mapping: Mapping, layer: Layer, box: Box) -> list[Solid]:
    """Returns the solids of one file's parts in a layer, in the plane and near a box."""
    shapes = mapping.geometries(np.array([part.footprint for part in parts], dtype=object))
    window = shapely.box(*box)
    near = np.array([part.keep_in for part in parts], dtype=np.bool_) | shapely.intersects(shapes, window)
    near &= np.isfinite(shapely.bounds(shapes)).all(axis=1)
    solid: list[Solid] = []
    unknown: list[str] = []
    for index in np.flatnonzero(near).tolist():
        part = parts[index]
        found = _solid(part, shapely.difference(window, shapes[index]) if part.keep_in else shapes[index], layer)
        solid += found or ()
        unknown += [part.name or "one without a name"] if found is None else []
    if unknown:
        count, named = counted(len(unknown), "part"), ", ".join(dict.fromkeys(unknown))[:60]
        text = f"has {count} with limits above ground ({named}), and the ground there is not known"
        raise InputError(f"{text}; give a terrain file too, or ground_m (--ground-m)")
    return solid


def clipped(solids: Sequence[Solid], box: Box) -> list[Solid]:
    """Cuts solids to a box; returns valid polygons, each with the heights of the solid that it is a piece of."""
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


def _solid(part: Part, shape: Any, layer: Layer) -> list[Solid] | None:
    """Returns a part's solids in a layer, as large as its limits make it there; None where the ground is not known."""
    bottom, top, on_ground = part.bottom, part.top, Datum.GROUND in (part.bottom.datum, part.top.datum)
    above = bottom.datum is Datum.SEA and bottom.height_m > layer.high_m
    if above or (top.datum is Datum.SEA and top.height_m < layer.low_m):  # whatever the ground is
        return []
    if on_ground and layer.field is not None and not part.rigid:
        shape = shapely.intersection(shape, shapely.box(*layer.known_in))
        if shape.is_empty:
            return []
    ground, first = _ground_below(part, shape, layer) if on_ground else (np.zeros((2, 1, 1)), (0.0, 0.0))
    if not ground.size or np.isnan(ground).any():
        return None
    lows, tops = (
        each.height_m + heights * (each.datum is Datum.GROUND)
        for each, heights in zip((bottom, top), ground, strict=True)
    )
    solid = Solid(shape, float(lows.min()), float(tops.max()))
    mask = (lows <= layer.high_m) & (tops >= layer.low_m)
    if part.rigid:  # it stands level, as low and as high as its limits are anywhere
        mask = np.array([[solid.low_m <= layer.high_m]]) & (solid.high_m >= layer.low_m)
    if layer.field is None or len(np.unique(mask)) == 1:
        return [solid] if mask.all() else []
    drawn = shapely.segmentize(np.array(outlines(mask), dtype=object), LONGEST_EDGE_CELLS)
    placed = shapely.transform(drawn, lambda p: np.column_stack(layer.field.places(*(0.5 * p + first).T)))
    return [solid._replace(shape=shapely.intersection(shape, shapely.union_all(placed)))]


def _ground_below(part: Part, shape: Any, ground: Layer) -> tuple[FloatArray, FloatArray]:
    """Returns the lowest and highest ground below a part, (2, ...), NaN where not known, and its first column and row.

    Of what is rigid it is that at its corners, as far as they lie on it; else in the quarters of cells that cover it.
    """
    heights, first = np.full((2, 1, 1), math.nan), np.zeros(2)
    if ground.field is not None and part.rigid:
        known = ground.field.at(*shapely.get_coordinates(shape).T)
        heights = np.tile(known[np.isfinite(known)], (2, 1))
    elif ground.field is not None:
        places = np.array(ground.field.cells(*shapely.get_coordinates(shape).T))
        low, high = np.floor(places.min(axis=1) + 0.5), np.floor(places.max(axis=1) + 0.5)
        cells = np.meshgrid(*(np.arange(low[k] - 1.0, high[k] + 2.0) for k in (0, 1)))
        heights = np.array(quarters(bilinear(ground.field.heights_m, *cells)))[:, 2:-2, 2:-2]
        first = low - 0.5
    if ground.flat_m is not None:
        heights = np.where(np.isfinite(heights), heights, ground.flat_m)
    return heights, first


def quarters(heights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(2 rows, 2 columns) lowest and highest ground, bilinear between middles, in quarters of cells; NaN: not known."""
    fine = _with_edges(_with_edges(heights).T).T
    corners = fine[:-1, :-1], fine[1:, :-1], fine[:-1, 1:], fine[1:, 1:]
    return reduce(np.fmin, corners), reduce(np.fmax, corners)


def _with_edges(middles: FloatArray) -> FloatArray:
    """Puts between the values in the middles of cells those on the edges, (2 rows + 1, columns), the outer as near."""
    fine = np.repeat(np.pad(middles, ((1, 1), (0, 0)), mode="edge"), 2, axis=0)[1:-2]
    fine[::2] = 0.5 * (fine[::2] + np.vstack((fine[1::2], fine[-1:])))
    return fine


def outlines(mask: BoolArray) -> list[Any]:
    """Returns polygons, with holes, round the cells that are set; column i and row j cover i to i + 1, j to j + 1."""
    change = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, begins = np.nonzero(change == 1)
    ends = np.nonzero(change == -1)[1]
    if len(rows) > MAX_RUNS:
        raise InputError(f"has {len(rows):,} runs of solid cells in the area; give it with larger cells")
    if not len(rows):
        return []
    # Runs of the same columns in rows that follow each other are one box.
    order = np.lexsort((rows, ends, begins))
    rows, begins, ends = rows[order], begins[order], ends[order]
    goes_on = (np.diff(rows) == 1) & (np.diff(begins) == 0) & (np.diff(ends) == 0)
    first = np.flatnonzero(np.append(True, ~goes_on))
    last = np.append(first[1:], len(rows)) - 1
    boxes = shapely.box(begins[first], rows[first], ends[first], rows[last] + 1)
    return list(shapely.get_parts(shapely.simplify(shapely.union_all(boxes), 0.0)))


def occupied(raster: Raster, spec: FileSpec, low_m: float) -> BoolArray:
    """Returns which cells of a raster are occupied, or which quarters of cells are somewhere as high as `low_m`."""
    values = raster.values
    if raster.occupancy:
        return (values >= 0.5) | (np.isnan(values) & (spec.unknown != "free"))
    solid = np.zeros((2 * values.shape[0], 2 * values.shape[1]), dtype=np.bool_)
    for first in range(0, len(values) if values.size else 0, STRIP_ROWS):
        before = min(first, 1)
        highest = quarters(values[first - before : first + STRIP_ROWS + 1])[1][2 * before :][: 2 * STRIP_ROWS]
        missing = np.isnan(highest) & (spec.nodata != "free")
        solid[2 * first : 2 * (first + STRIP_ROWS)] = (highest >= low_m) | missing
    return solid


def placed_cells(raster: Raster, solid: BoolArray, mapping: Mapping) -> list[Any]:
    """Returns the outlines in the plane of the solid cells of a raster, or of the solid parts of its cells."""
    shapes = np.array(outlines(solid), dtype=object)
    dense = shapely.segmentize(shapes, LONGEST_EDGE_CELLS) if mapping.crs else shapes
    parts = solid.shape[0] // max(len(raster.values), 1)
    placed = shapely.transform(dense, lambda p: np.column_stack(raster.places(*(p / parts).T)))
    return list(mapping.geometries(placed))


def simplified(polygons: Sequence[Any], tolerance_m: float) -> list[Any]:
    """Returns polygons with fewer corners that cover the given ones, which are valid.

    In each of `NOTCH_PASSES` passes corners that make a notch no deeper than the tolerance are left out, small notches
    first, until `MOST_GROWTH` of the polygon's area has been added; corners on a straight line as well.
    """
    given = shapely.orient_polygons(np.array(polygons, dtype=object))
    convex = shapely.area(shapely.convex_hull(given)) <= shapely.area(given) * (1.0 + 1e-12)
    grown = [_fill_notches(polygon, tolerance_m) for polygon in given[~convex]]
    pieces = shapely.get_parts(np.concatenate((given[convex], np.array(grown, dtype=object))))
    return [each for each in pieces if each.geom_type == "Polygon" and each.area > 0]


def _fill_notches(polygon: Any, tolerance_m: float) -> Any:
    """Returns a polygon with its notches filled, which covers the one given."""
    budget = MOST_GROWTH * polygon.area / NOTCH_PASSES
    before = rings = [shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors)]
    for _ in range(NOTCH_PASSES):
        rings = [_fill_once(ring, tolerance_m, budget) for ring in rings]
    if sum(map(len, rings)) == sum(map(len, before)):
        return polygon
    if not (grown := shapely.Polygon(rings[0], [ring for ring in rings[1:] if len(ring) >= 4])).is_valid:
        grown = shapely.make_valid(grown, method="structure", keep_collapsed=False)
    # It may not cover the polygon, by rounding or because something stands in a notch.
    return grown if shapely.covers(grown, polygon) else shapely.union(grown, polygon)


def _fill_once(ring: FloatArray, tolerance_m: float, budget_m2: float) -> FloatArray:
    """Fills notches of a closed ring (solid on its left) in one pass, never at two neighbouring corners."""
    points = ring[:-1]
    turn, base, on, forward = _bends(points)
    straight = forward & (np.abs(turn) <= STRAIGHT_M * on)
    if 3 <= len(points) - straight.sum() < len(points):
        points = points[~straight]
        turn, base, on, forward = _bends(points)
    if len(points) <= 4:
        return np.vstack((points, points[:1]))
    notch = (turn < 0) & (np.abs(turn) / np.maximum(base, 1e-12) <= tolerance_m)
    corners = points[~_cheapest_apart(np.where(notch, 0.5 * np.abs(turn), np.inf), budget_m2)]
    return np.vstack((corners, corners[:1])) if len(corners) >= 3 else ring


def _bends(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Returns per corner of a ring: twice its area (< 0 in a notch), base, edge after it, whether it goes forward."""
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    into, on, base = points - before, after - points, after - before
    turn = into[:, 0] * on[:, 1] - into[:, 1] * on[:, 0]
    return turn, np.hypot(base[:, 0], base[:, 1]), np.hypot(on[:, 0], on[:, 1]), (into * on).sum(axis=1) > 0


def _cheapest_apart(cost: FloatArray, budget: float) -> BoolArray:
    """Tells which corners to leave out: the cheapest first, never two neighbours, until the budget is used up."""
    drop = np.zeros(len(cost), dtype=np.bool_)
    total = 0.0
    for index in np.argsort(cost, kind="stable").tolist():
        price = float(cost[index])
        if not np.isfinite(price) or total + price > budget:
            break
        if not (drop[index - 1] or drop[(index + 1) % len(cost)]):
            drop[index] = True
            total += price
    return drop
